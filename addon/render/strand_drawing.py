"""One draw of strands: programs and bindings for opaque strands, layers and hashed strands."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..shading.settings import ShadingSettings, StrandSettings
from .capabilities import fails_in_idle_branches
from .detail_pass import DetailOrder
from .feature_programs import UniformBlocks, bound
from .pixel_parts import PixelPart
from .shader_feature import ShaderFeature
from .shader_program import ShaderProgram, ShaderRecipe

#: for the coverage of pixels, see ribbon_coverage in lib_coverage.glsl
_RIBBON = ("smooth", "VEC4", "ribbon")
#: for shading a fragment later
_PLACED = (("smooth", "FLOAT", "strand_place"), ("flat", "INT", "strand_index"), _RIBBON)
_STRUCTS = ("struct_view.glsl", "struct_lights.glsl", "struct_fibre.glsl", "struct_opacity.glsl")
_SETTINGS = (StrandSettings, ShadingSettings)
#: default defines of shading, which features override
_PLAIN = (("MARSCHNER", 0), ("SHADOWS", 0), ("SCATTERING", 0))
#: default defines of strand.vert.glsl
_WHOLE = (("ADAPTIVE", 0), ("IN_SLOTS", 0), ("DEBUG", 0), ("UNEVEN", 0))
_VARYINGS = (
    ("smooth", "VEC3", "strand_point"),
    ("smooth", "VEC3", "strand_tangent"),
    ("smooth", "VEC2", "strand_along_and_occlusion"),
    ("smooth", "FLOAT", "strand_radius"),
    ("flat", "INT", "strand_seed"),
)

_OPAQUE_RECIPE = ShaderRecipe(
    name="strand_opaque",
    vertex="strand.vert.glsl",
    fragment="strand.frag.glsl",
    structs=_STRUCTS,
    settings=_SETTINGS,
    integers=("output_encoding", "samples_across"),
    varyings=_VARYINGS,
    outputs=(("VEC4", "color"),),
    defines=(*_PLAIN, *_WHOLE, ("COVERED", 0), ("GATHERED", 0)),
)
#: finds the nearest strand
_PLACE_RECIPE = ShaderRecipe(
    name="strand_place",
    vertex="strand.vert.glsl",
    fragment="strand_place.frag.glsl",
    structs=("struct_view.glsl",),
    settings=(StrandSettings,),
    integers=("samples_across",),
    varyings=(("smooth", "FLOAT", "strand_place"), ("flat", "INT", "strand_index")),
    outputs=(("VEC4", "color"),),
    defines=(*_WHOLE, ("COVERED", 0), ("GATHERED", 1)),
)
#: finds the nearest fragment that is not discarded
_HASHED_RECIPE = ShaderRecipe(
    name="strand_hashed",
    vertex="strand.vert.glsl",
    fragment="strand_hashed.frag.glsl",
    structs=("struct_view.glsl",),
    settings=(StrandSettings,),
    integers=("turn",),
    varyings=_PLACED,
    outputs=(("VEC4", "hair"),),
    defines=(*_WHOLE, ("COVERED", 1), ("GATHERED", 1)),
)
#: shades the fragments that two turns have found
_HASHED_SHADE_RECIPE = ShaderRecipe(
    name="strand_hashed_shade",
    vertex="whole_target.vert.glsl",
    fragment="strand_hashed_shade.frag.glsl",
    structs=_STRUCTS,
    settings=_SETTINGS,
    textures=(("FLOAT_2D", "first_hair"), ("FLOAT_2D", "second_hair")),
    integers=("output_encoding",),
    outputs=(("VEC4", "first_light"), ("VEC4", "second_light")),
    defines=(*_PLAIN, ("UNEVEN", 0)),
)
#: adds each fragment to the list of its pixel
_GATHER_RECIPE = ShaderRecipe(
    name="strand_gather",
    vertex="strand.vert.glsl",
    fragment="strand_layers.frag.glsl",
    structs=("struct_view.glsl",),
    settings=(StrandSettings,),
    images=(
        ("R32UI", "layer_count", "READ_WRITE"),
        ("R32UI", "layer_heads", "READ_WRITE"),
        ("R32UI", "layer_pixels"),
        ("RGBA32UI", "layer_nodes"),
    ),
    integers=("capacity",),
    varyings=_PLACED,
    outputs=(("VEC4", "color"),),
    defines=(*_WHOLE, ("COVERED", 1), ("GATHERED", 1), ("COUNTED", 0), ("PARTS", 0)),
)
#: counts the fragments of each pixel
_COUNT_RECIPE = replace(
    _GATHER_RECIPE,
    name="strand_count",
    images=(("R32UI", "layer_heads", "READ_WRITE"),),
    integers=(),
    defines=(*_WHOLE, ("COVERED", 1), ("GATHERED", 1), ("COUNTED", 1), ("PARTS", 0)),
)
#: shades the visible nodes of all lists
_SHADE_RECIPE = ShaderRecipe(
    name="strand_layers_shade",
    compute="strand_layers_shade.comp.glsl",
    structs=_STRUCTS,
    settings=_SETTINGS,
    images=(
        ("R32UI", "layer_count", "READ"),
        ("R32UI", "layer_seen", "READ"),
        ("RGBA32UI", "layer_nodes", "READ_WRITE"),
    ),
    group_size=(64, 1),
    defines=(*_PLAIN, ("UNEVEN", 0)),
)
#: sums each pixel's list
_SHOWN_RECIPE = ShaderRecipe(
    name="strand_layers_shown",
    vertex="whole_target.vert.glsl",
    fragment="strand_layers_shown.frag.glsl",
    images=(
        ("R32UI", "layer_heads", "READ"),
        ("RGBA32UI", "layer_nodes", "READ"),
        ("RG32F", "layer_fronts", "READ"),
    ),
    integers=("output_encoding", "writes_depth"),
    outputs=(("VEC4", "color"),),
)


@dataclass(frozen=True, eq=False)
class StrandDrawing:
    """All bindings of one draw.

    order: the strands to draw, with their numbers of pieces.
    ribbon: makes the batch of a strand with this many pieces.
    points: features of strands and eye. shading: features of all programs that shade.
    display_features: additional features of programs that write colours.
    expected_depths: see PixelPart; called only if needed.
    """

    order: DetailOrder
    ribbon: Callable[[int], Any]
    blocks: UniformBlocks
    points: Sequence[ShaderFeature]
    shading: Sequence[ShaderFeature]
    display_features: Sequence[ShaderFeature]
    output_encoding: int
    samples_across: int
    expected_depths: Callable[[], range]

    def draw(self) -> None:
        """Draw all strands, opaque, each pixel shaded as it is drawn."""
        integers = {"output_encoding": self.output_encoding, "samples_across": self.samples_across}
        features = [*self.points, self._detail, *self.shading, *self.display_features]
        self._draw(bound(_OPAQUE_RECIPE, features, self.blocks, integers=integers))

    def draw_places(self) -> None:
        """Draw the number of the nearest strand and the place along its points, with the width of
        opaque strands."""
        integers = {"samples_across": self.samples_across}
        features = [*self.points, self._detail]
        self._draw(bound(_PLACE_RECIPE, features, self.blocks, integers=integers))

    def draw_hashed(self, turn: int) -> None:
        """Draw the visible fragments of one of two turns, see hashed_strands.py."""
        features = [*self.points, self._detail]
        self._draw(bound(_HASHED_RECIPE, features, self.blocks, integers={"turn": turn}))

    def shade_hashed(self, hair_textures: Sequence[Any]) -> ShaderProgram:
        """Bind the program that shades the fragments of two turns."""
        driver = ShaderFeature(defines={"SHADES_ALL": int(fails_in_idle_branches())})
        return bound(
            _HASHED_SHADE_RECIPE,
            [*self.points, *self.shading, *self.display_features, driver],
            self.blocks,
            textures=dict(zip(("first_hair", "second_hair"), hair_textures, strict=True)),
            integers={"output_encoding": self.output_encoding},
        )

    def gather(
        self, images: Mapping[str, Any], capacity: int, part: PixelPart | None = None
    ) -> None:
        """Add all fragments, or those in a part, to the lists of pixels, see strand_layers.py."""
        features = [*self.points, self._detail, *(() if part is None else (_part_feature(part),))]
        integers = {"capacity": capacity}
        self._draw(self._bound(_GATHER_RECIPE, features, images, integers))

    def count_fragments(self, images: Mapping[str, Any]) -> None:
        """Count the fragments of each pixel in the head of its list."""
        self._draw(self._bound(_COUNT_RECIPE, [*self.points, self._detail], images, {}))

    def shade(self, images: Mapping[str, Any]) -> ShaderProgram:
        """Bind the program that shades the visible nodes."""
        return self._bound(_SHADE_RECIPE, [*self.points, *self.shading], images, {})

    def show(self, images: Mapping[str, Any], *, writes_depth: bool) -> ShaderProgram:
        """Bind the program that sums the lists."""
        integers = {
            "output_encoding": self.output_encoding,
            "writes_depth": int(writes_depth),
        }
        return self._bound(_SHOWN_RECIPE, self.display_features, images, integers)

    @property
    def _detail(self) -> ShaderFeature:
        """The feature for the numbers of pieces: one number for all segments, or one for each."""
        order = self.order
        if order.factors is None:
            return ShaderFeature(name="fixed", integers={"subdivisions": order.subdivisions})
        if order.slots is not None:
            return ShaderFeature(
                name="slots",
                textures={
                    "slots": ("UINT_2D", order.slots),
                    "factors": ("FLOAT_2D", order.factors),
                },
                integers={"slot_pieces": order.classes[0].capacity},
                defines={"ADAPTIVE": 1, "IN_SLOTS": 1},
            )
        return ShaderFeature(
            name="adaptive",
            textures={"order": ("FLOAT_2D", order.order), "factors": ("FLOAT_2D", order.factors)},
            integers={"first_instance": 0},
            defines={"ADAPTIVE": 1},
        )

    def _draw(self, shader: ShaderProgram) -> None:
        for drawn in self.order.classes:
            if self.order.order is not None:
                shader.shader.uniform_int("first_instance", drawn.first)
            self.ribbon(drawn.capacity).draw_instanced(
                shader.shader, instance_start=0, instance_count=drawn.count
            )

    def _bound(
        self,
        recipe: ShaderRecipe,
        features: Sequence[ShaderFeature],
        images: Mapping[str, Any],
        integers: Mapping[str, int],
    ) -> ShaderProgram:
        own = {name: images[name] for _, name, *_ in recipe.images}
        return bound(recipe, features, self.blocks, images=own, integers=integers)


def _part_feature(part: PixelPart) -> ShaderFeature:
    """The feature of programs that gather only the fragments in a part."""
    ends = {"first": part.first, "end": part.end, "near": part.near, "far": part.far}
    return ShaderFeature(
        name="part",
        integers={f"part_{name}": end for name, end in ends.items()},
        defines={"PARTS": 1},
    )
