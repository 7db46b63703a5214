"""Draws strands into opacity maps, see opacity_maps.py: ribbons with one piece per segment.

Strands with similar point counts are one draw, see detail_classes.py. So programs read spans only
of the strands that are drawn, in the order of these classes.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import gpu
import numpy as np

from ..arrays import Floats
from ..params.glsl import struct_values
from ..shading.lights import Light
from ..shading.settings import StrandSettings
from ..shading.volume.light_frame import Ball
from ..shading.volume.map_size import START_TEXELS
from ..shading.volume.settings import VolumeSettings
from .capabilities import capabilities
from .detail_classes import DetailClass, detail_classes, spread_capacities
from .feature_programs import UniformBlocks, bound
from .opacity_maps import OpacityDrawing, OpacityMaps
from .opacity_starts import draw_starts
from .ribbons import Ribbons
from .shader_feature import ShaderFeature
from .shader_program import ShaderRecipe
from .snapshot import Caster
from .strand_curves import curves_feature
from .strand_layout import StrandLayout, strand_rows
from .textures import texture_from

_LAYERS_RECIPE = ShaderRecipe(
    name="opacity",
    vertex="opacity.vert.glsl",
    fragment="opacity.frag.glsl",
    structs=("struct_opacity.glsl",),
    settings=(StrandSettings,),
    integers=("first_instance",),
    numbers=(("FLOAT", "strand_step"),),
    varyings=(("smooth", "FLOAT", "strand_depth"), ("flat", "FLOAT", "strand_weight")),
    defines=(("DEEP", 0), ("UNEVEN", 0)),
)
#: the depths of the first and the last strand
_DEPTH_RECIPE = ShaderRecipe(
    name="opacity_start",
    vertex="opacity_start.vert.glsl",
    fragment="opacity_start.frag.glsl",
    structs=("struct_opacity.glsl",),
    integers=("first_instance", "points_across"),
)
#: the same by atomics, without drawing all strands
_STARTS_RECIPE = ShaderRecipe(
    name="opacity_starts",
    compute="opacity_starts.comp.glsl",
    structs=("struct_opacity.glsl",),
    images=(("R32UI", "starts", "READ_WRITE"),),
    integers=("drawn_count", "map_index", "first_instance"),
)
#: fewest sample points of a segment, where depth tests find the first and the last hair
_FEWEST_POINTS = 8


@dataclass(frozen=True, eq=False)
class _ShadowStrands:
    """The strands that cast the shadow of all strands: those of the lowest ranks. If a strand is
    added or removed, the others stay the same; choosing every nth strand would change them.

    layout: of all strands. rank: see Snapshot. count: number of chosen strands.
    spans: their texture strand_spans, in drawing order. classes: the draws.
    """

    layout: StrandLayout
    rank: Floats | None
    count: int
    spans: Any
    classes: tuple[DetailClass, ...]

    @classmethod
    def of(cls, layout: StrandLayout, rank: Floats | None, count: int) -> _ShadowStrands:
        if rank is None:
            evenly = (np.arange(count) + 0.5) * (layout.strand_count / count)
            chosen = np.minimum(evenly.astype(np.int64), layout.strand_count - 1)
        else:
            chosen = np.sort(np.argsort(rank, kind="stable")[:count])
        classes: tuple[DetailClass, ...] = (DetailClass(layout.cv_count - 1, 0, count),)
        if not layout.cv_count:
            pieces = layout.counts[chosen] - 1
            order, classes = detail_classes(pieces, fixed_capacities=spread_capacities(pieces))
            chosen = chosen[order]
        spans = texture_from(strand_rows(layout.spans[chosen][:, None]), "RGBA32F")
        return cls(layout, rank, count, spans, classes)

    def matches(self, layout: StrandLayout, rank: Floats | None, count: int) -> bool:
        return self.layout is layout and self.rank is rank and self.count == count


@dataclass(frozen=True, eq=False)
class _Strands:
    """Strands on the GPU. curves: their points. shadow_strands: the strands that are drawn."""

    state: Hashable
    curves: ShaderFeature
    settings: ShaderFeature
    blocks: UniformBlocks
    shadow_strands: _ShadowStrands
    ribbons: Ribbons

    def draw_starts(self, maps: OpacityMaps, number: int, place: ShaderFeature) -> None:
        if capabilities().image_atomics:
            self._find_starts(maps, number, place)
        else:
            side = maps.size.side // START_TEXELS
            draw_starts(maps, number, side, lambda: self._draw_points(maps, side, place))

    def _draw_points(self, maps: OpacityMaps, side: int, place: ShaderFeature) -> None:
        """Draw sample points for the first and the last depth, enough that a strand as long as the
        map is wide has two in each texel.
        """
        integers = {"first_instance": 0, "points_across": 0}
        shader = bound(
            _DEPTH_RECIPE, [place, maps.mesh_feature, self.curves], self.blocks, integers=integers
        ).shader
        for drawn in self.shadow_strands.classes:
            across = max(-(-2 * side // drawn.capacity), _FEWEST_POINTS)
            shader.uniform_int("first_instance", drawn.first)
            shader.uniform_int("points_across", across)
            self.ribbons.points((drawn.capacity + 1) * across).draw_instanced(
                shader, instance_start=0, instance_count=drawn.count
            )

    def _find_starts(self, maps: OpacityMaps, number: int, place: ShaderFeature) -> None:
        integers = {"map_index": number, "drawn_count": 0, "first_instance": 0}
        shader = bound(
            _STARTS_RECIPE,
            [place, maps.mesh_feature, self.curves],
            self.blocks,
            images={"starts": maps.starts},
            integers=integers,
        )
        for drawn in self.shadow_strands.classes:
            shader.shader.uniform_int("drawn_count", drawn.count)
            shader.shader.uniform_int("first_instance", drawn.first)
            shader.run(drawn.capacity + 1, drawn.count)
        gpu.shader.unbind()

    def draw_layers(self, features: Sequence[ShaderFeature]) -> None:
        shadow_strands = self.shadow_strands
        shader = bound(
            _LAYERS_RECIPE,
            [*features, self.curves, self.settings],
            self.blocks,
            integers={"first_instance": 0},
            numbers={"strand_step": shadow_strands.layout.strand_count / shadow_strands.count},
        )
        for drawn in shadow_strands.classes:
            shader.shader.uniform_int("first_instance", drawn.first)
            self.ribbons.strip(drawn.capacity).draw_instanced(
                shader.shader, instance_start=0, instance_count=drawn.count
            )


class OpacityPass:
    """The opacity maps of one groom's strands. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self.release()

    def release(self) -> None:
        """Release everything on the GPU; the next draw makes it again."""
        self._drawing, self._blocks = OpacityDrawing(), UniformBlocks()
        self._ribbons = Ribbons()
        self._shadow_strands: _ShadowStrands | None = None

    @property
    def has_stale_maps(self) -> bool:
        """Whether some maps are of earlier positions of their lights, see OpacityDrawing.maps."""
        return self._drawing.has_stale_maps

    def maps(
        self,
        points: Any,
        serial: int,
        layout: StrandLayout,
        ball: Ball,
        lights: Sequence[Light],
        settings: VolumeSettings,
        strands: StrandSettings,
        casters: tuple[Caster, ...] = (),
        spacing: float = 0.0,
        attributes: Any = None,
        rank: Floats | None = None,
        *,
        is_turning: bool = False,
    ) -> OpacityMaps:
        """The maps of a frame.

        Args:
            points: texture of CVs, xyz [m, world] and w radius, in this layout.
            serial: changes whenever the points change.
            rank: see Snapshot.
            attributes: texture cv_attributes, if points are unevenly spaced, see strand_pass.py.
            ball, lights, casters, spacing, is_turning: as in OpacityDrawing.maps.
        """
        count = max(round(layout.strand_count * settings.strand_fraction), 1)
        shadow_strands = self._shadow_strands
        if shadow_strands is None or not shadow_strands.matches(layout, rank, count):
            shadow_strands = self._shadow_strands = _ShadowStrands.of(layout, rank, count)
        curves = curves_feature(points, shadow_strands.spans, attributes)
        look = ShaderFeature(
            blocks={"strands": ("StrandSettings", struct_values(strands.as_drawn))}
        )
        state = serial, shadow_strands, strands, capabilities().image_atomics
        hair = _Strands(state, curves, look, self._blocks, shadow_strands, self._ribbons)
        return self._drawing.maps(
            hair, ball, lights, settings, casters, spacing, is_turning=is_turning
        )
