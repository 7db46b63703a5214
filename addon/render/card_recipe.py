"""The programs that draw hair cards: their depth alone, or shaded."""

from __future__ import annotations

from dataclasses import dataclass

from ..shading.settings import ShadingSettings
from .card_batches import ATTRIBUTES
from .marschner_textures import MARSCHNER_TEXTURES, SHARES_TEXTURES
from .opacity_maps import OpacityForm
from .shader_program import ShaderRecipe

_INPUTS = tuple(
    ("FLOAT" if length == 1 else f"VEC{length}", name) for name, length in ATTRIBUTES.items()
)

PRIME_RECIPE = ShaderRecipe(
    name="card_prime",
    vertex="card.vert.glsl",
    fragment="card.frag.glsl",
    structs=("struct_view.glsl",),
    blocks=(("View", "view"),),
    textures=(("FLOAT_2D", "alpha_texture"),),
    numbers=(("FLOAT", "opaque_alpha"), ("FLOAT", "sharpness"), ("VEC2", "atlas_tiles")),
    inputs=_INPUTS,
    varyings=(("smooth", "VEC2", "card_uv"),),
    outputs=(("VEC4", "color"),),
    defines=(("PRIME", 1),),
)


@dataclass(frozen=True, kw_only=True)
class CardShading:
    """What a program that shades cards holds.

    model: one of shading.settings.MODELS. is_clipped: it tests alpha, so that pixels that are
    hidden may have to be shaded. With opacity maps hair shades cards; `scatters` adds light from
    strand to strand, in Marschner's model. With a display it looks up how the viewport shows a
    colour, see display.py. light_kinds: see kinds_needed.
    is_even: see CardSnapshot.
    """

    model: str = "kajiya_kay"
    has_tangent_map: bool = False
    has_normal_map: bool = False
    is_clipped: bool = False
    has_display: bool = False
    is_even: bool = False
    opacity: OpacityForm | None = None
    scatters: bool = False
    light_kinds: int = 2

    @property
    def name(self) -> str:
        maps = "_tangent_map" * self.has_tangent_map + "_normal_map" * self.has_normal_map
        lit = f"_{self.opacity.slots}_{self.opacity.is_deep}" if self.opacity else ""
        lit += f"{'_scattering' * self.scatters}_{self.light_kinds}"
        shown = (
            "_even" * self.is_even + "_clipped" * self.is_clipped + "_display" * self.has_display
        )
        return f"card_{self.model}{maps}{lit}{shown}"

    @property
    def textures(self) -> tuple[str, ...]:
        """Of HairTextures, those that it reads."""
        highlights = "tangent" if self.has_tangent_map else "shift"
        return ("base", "alpha", "noise", highlights, *(("normal",) * self.has_normal_map))

    @property
    def recipe(self) -> ShaderRecipe:
        is_marschner = self.model == "marschner"
        return ShaderRecipe(
            name=self.name,
            vertex="card.vert.glsl",
            fragment="card.frag.glsl",
            structs=(
                "struct_view.glsl",
                "struct_lights.glsl",
                "struct_fibre.glsl",
                "struct_opacity.glsl",
            ),
            settings=(ShadingSettings,),
            blocks=(
                ("View", "view"),
                ("Lights", "lights"),
                ("ShadingSettings", "shading"),
                *((("Fibre", "fibre"),) if is_marschner else ()),
                *((("Opacity", "opacity"),) if self.opacity else ()),
            ),
            textures=(
                *(("FLOAT_2D", f"{name}_texture") for name in self.textures),
                *(MARSCHNER_TEXTURES if is_marschner else ()),
                *(SHARES_TEXTURES if self.scatters else ()),
                *(self.opacity.samplers if self.opacity else ()),
                *((("FLOAT_3D", "display_table"),) if self.has_display else ()),
            ),
            integers=("is_opaque", "output_encoding"),
            numbers=(
                ("VEC2", "atlas_tiles"),
                *((("VEC2", "alpha_range"),) if self.is_clipped else ()),
                *((("FLOAT", "card_thickness"),) if self.opacity else ()),
                *((("FLOAT", "scatter_density"), ("VEC3", "skin_color")) if self.scatters else ()),
                *((("VEC4", "display_shaper"),) if self.has_display else ()),
            ),
            inputs=_INPUTS,
            varyings=(
                ("smooth", "VEC2", "card_uv"),
                ("smooth", "VEC3", "card_point"),
                ("smooth", "VEC3", "card_normal"),
                ("smooth", "VEC3", "card_tangent"),
                ("smooth", "FLOAT", "card_occlusion"),
                ("smooth", "FLOAT", "card_along"),
            ),
            outputs=(("VEC4", "color"),),
            defines=(
                ("PRIME", 0),
                ("CLIPPED", int(self.is_clipped)),
                ("EVEN", int(self.is_even)),
                ("TANGENT_MAP", int(self.has_tangent_map)),
                ("NORMAL_MAP", int(self.has_normal_map)),
                ("MARSCHNER", int(is_marschner)),
                ("SHADOWS", int(self.opacity is not None)),
                ("SCATTERING", int(self.scatters)),
                ("LIGHT_KINDS", self.light_kinds),
                *(self.opacity.defines if self.opacity else ()),
                *((("DISPLAY", 1),) if self.has_display else ()),
            ),
        )
