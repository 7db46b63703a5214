"""The programs that draw strands: shaded as they are drawn, or as layers that are shaded later."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..shading.settings import ShadingSettings, StrandSettings
from ..shading.volume.transparency import LAYERS
from .marschner_textures import MARSCHNER_TEXTURES, SHARES_TEXTURES
from .opacity_pass import OpacityForm
from .shader_program import ShaderRecipe
from .shader_source import DEBUG_VIEWS

#: debug views that show a number of each strand
NUMBERED_VIEWS = ("guide", "group")
#: what covers pixels in part, see ribbon_coverage in lib_coverage.glsl
_RIBBON = (("smooth", "VEC4", "ribbon"),)
#: how the viewport shows a colour
_DISPLAY_TEXTURES = (("FLOAT_3D", "display_table"),)
_DISPLAY_NUMBERS = (("VEC4", "display_shaper"),)


@dataclass(frozen=True, kw_only=True)
class StrandShading:
    """What a program that shades strands holds.

    It holds one model of MODELS alone. A debug view has none: it is the same with either.
    With a display it looks up how the viewport shows a colour, see display.py. With opacity maps
    hair shades itself; `scatters` adds light from strand to strand, in Marschner's model.
    light_kinds: see kinds_needed.
    has_others: whether there is more hair in the way than the maps hold, by CV.
    """

    model: str = "kajiya_kay"
    debug_view: str = "none"
    has_display: bool = False
    opacity: OpacityForm | None = None
    scatters: bool = False
    light_kinds: int = 2
    has_others: bool = False

    @property
    def name(self) -> str:
        maps = f"_{self.opacity.slots}_{self.opacity.is_deep}" if self.opacity else ""
        scattering, others = "_scattering" * self.scatters, "_others" * self.has_others
        parts = f"{self.model}{scattering}{maps}{others}_{self.light_kinds}"
        return f"{parts}_{self.debug_view}{'_display' * self.has_display}"

    @property
    def recipe(self) -> ShaderRecipe:
        """All that shading needs, before it has stages."""
        is_marschner = self.model == "marschner"
        return ShaderRecipe(
            name=self.name,
            structs=(
                "struct_view.glsl",
                "struct_lights.glsl",
                "struct_fibre.glsl",
                "struct_opacity.glsl",
            ),
            settings=(StrandSettings, ShadingSettings),
            blocks=(
                ("View", "view"),
                ("Lights", "lights"),
                ("StrandSettings", "strands"),
                ("ShadingSettings", "shading"),
                *((("Fibre", "fibre"),) if is_marschner else ()),
                *((("Opacity", "opacity"),) if self.opacity else ()),
            ),
            textures=(
                ("FLOAT_2D", "cv_points"),
                ("FLOAT_2D", "cv_looks"),
                *((("FLOAT_2D", "cv_between"),) if self.has_others else ()),
                *(MARSCHNER_TEXTURES if is_marschner else ()),
                *(SHARES_TEXTURES if self.scatters else ()),
                *(self.opacity.samplers if self.opacity else ()),
                *(_DISPLAY_TEXTURES if self.has_display else ()),
            ),
            integers=("cv_count", "output_encoding"),
            numbers=(
                ("VEC3", "volume_center"),
                *((("FLOAT", "scatter_density"), ("VEC3", "skin_color")) if self.scatters else ()),
                *(_DISPLAY_NUMBERS if self.has_display else ()),
            ),
            defines=(
                ("MARSCHNER", int(is_marschner)),
                ("SHADOWS", int(self.opacity is not None)),
                ("SCATTERING", int(self.scatters)),
                ("LIGHT_KINDS", self.light_kinds),
                *(self.opacity.defines if self.opacity else ()),
                *((("DISPLAY", 1),) if self.has_display else ()),
                *((("OTHERS", 1),) if self.has_others else ()),
            ),
        )


def strand_recipe(
    shading: StrandShading | None = None, *, is_adaptive: bool, is_hashed: bool = False
) -> ShaderRecipe:
    """The program that draws every segment in equally many pieces, or each in its own, and shades
    each pixel that it draws; hashed ones are left out by chance.
    """
    shading = shading or StrandShading()
    recipe, debug_view = shading.recipe, shading.debug_view
    numbers = (("FLOAT_2D", "debug_numbers"),) if debug_view in NUMBERED_VIEWS else ()
    way = f"{'hashed' if is_hashed else 'opaque'}_{'adaptive' if is_adaptive else 'fixed'}"
    return replace(
        recipe,
        name=f"strand_{way}_{recipe.name}",
        vertex="strand.vert.glsl",
        fragment="strand.frag.glsl",
        textures=(*recipe.textures, *_detail_textures(is_adaptive), *numbers),
        integers=(
            *recipe.integers,
            *(() if is_hashed else ("samples_across",)),
            _detail_integer(is_adaptive),
        ),
        varyings=(
            ("smooth", "VEC3", "strand_point"),
            ("smooth", "VEC3", "strand_tangent"),
            ("smooth", "VEC2", "strand_along_and_occlusion"),
            ("smooth", "FLOAT", "strand_radius"),
            ("flat", "INT", "strand_seed"),
            *((("smooth", "VEC4", "strand_between"),) if shading.has_others else ()),
            *((("flat", "INT", "strand_index"),) if debug_view != "none" else ()),
            *(_RIBBON if is_hashed else ()),
        ),
        outputs=(("VEC4", "color"),),
        defines=(
            *recipe.defines,
            ("ADAPTIVE", int(is_adaptive)),
            ("DEBUG", DEBUG_VIEWS.index(debug_view)),
            ("HASHED", int(is_hashed)),
            ("COVERED", int(is_hashed)),
            ("GATHERED", 0),
        ),
    )


def gather_recipe(*, is_adaptive: bool) -> ShaderRecipe:
    """The program that puts each fragment of a strand into the list of its pixel."""
    return ShaderRecipe(
        name=f"strand_gather_{'adaptive' if is_adaptive else 'fixed'}",
        vertex="strand.vert.glsl",
        fragment="strand_layers.frag.glsl",
        structs=("struct_view.glsl",),
        settings=(StrandSettings,),
        blocks=(("View", "view"), ("StrandSettings", "strands")),
        textures=(("FLOAT_2D", "cv_points"), *_detail_textures(is_adaptive)),
        images=(
            ("R32UI", "layer_count", "READ_WRITE"),
            ("R32UI", "layer_heads", "READ_WRITE"),
            ("R32UI", "layer_pixels"),
            ("RGBA32UI", "layer_nodes"),
        ),
        integers=("cv_count", "capacity", _detail_integer(is_adaptive)),
        varyings=(
            ("smooth", "FLOAT", "strand_along"),
            ("flat", "INT", "strand_index"),
            *_RIBBON,
        ),
        outputs=(("VEC4", "color"),),
        defines=(
            ("ADAPTIVE", int(is_adaptive)),
            ("DEBUG", 0),
            ("COVERED", 1),
            ("GATHERED", 1),
        ),
    )


ORDER_RECIPE = ShaderRecipe(
    name="strand_layers_order",
    compute="strand_layers_order.comp.glsl",
    images=(
        ("R32UI", "layer_count", "READ_WRITE"),
        ("R32UI", "layer_heads", "READ_WRITE"),
        ("R32UI", "layer_pixels", "READ"),
        ("RGBA32UI", "layer_nodes", "READ_WRITE"),
        ("R32UI", "layer_seen"),
        ("RG32F", "layer_fronts"),
    ),
    integers=("pixel_count",),
    group_size=(64, 1),
    defines=(("LAYERS", LAYERS),),
)


def shade_recipe(shading: StrandShading) -> ShaderRecipe:
    """The program that shades those of all lists that are seen."""
    recipe = shading.recipe
    return replace(
        recipe,
        name=f"strand_layers_shade_{recipe.name}",
        compute="strand_layers_shade.comp.glsl",
        textures=tuple(each for each in recipe.textures if each not in _DISPLAY_TEXTURES),
        numbers=tuple(each for each in recipe.numbers if each not in _DISPLAY_NUMBERS),
        images=(("R32UI", "layer_seen", "READ"), ("RGBA32UI", "layer_nodes", "READ_WRITE")),
        integers=("cv_count", "seen_count"),
        group_size=(64, 1),
    )


def shown_recipe(*, has_display: bool) -> ShaderRecipe:
    """The program that adds up each pixel's list."""
    return ShaderRecipe(
        name=f"strand_layers_shown{'_display' * has_display}",
        vertex="strand_layers.vert.glsl",
        fragment="strand_layers_shown.frag.glsl",
        textures=_DISPLAY_TEXTURES if has_display else (),
        images=(
            ("R32UI", "layer_heads", "READ"),
            ("RGBA32UI", "layer_nodes", "READ"),
            ("RG32F", "layer_fronts", "READ"),
        ),
        integers=("output_encoding", "writes_depth"),
        numbers=_DISPLAY_NUMBERS if has_display else (),
        outputs=(("VEC4", "color"),),
        defines=(("DISPLAY", 1),) if has_display else (),
    )


DONE_RECIPE = ShaderRecipe(
    name="strand_layers_done", compute="strand_layers_done.comp.glsl", group_size=(1, 1)
)


def _detail_textures(is_adaptive: bool) -> tuple[tuple[str, str], ...]:
    return (("FLOAT_2D", "order"), ("FLOAT_2D", "factors")) if is_adaptive else ()


def _detail_integer(is_adaptive: bool) -> str:
    return "first_instance" if is_adaptive else "subdivisions"
