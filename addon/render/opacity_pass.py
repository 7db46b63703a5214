"""Draws strands into opacity maps, see opacity_maps.py: ribbons of one piece a segment."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import gpu

from ..params.glsl import struct_values
from ..shading.lights import Light
from ..shading.settings import StrandSettings
from ..shading.volume.light_frame import Ball
from ..shading.volume.settings import VolumeSettings
from .feature_programs import UniformBlocks, bound
from .opacity_maps import OpacityDrawing, OpacityMaps
from .shader_feature import ShaderFeature
from .shader_program import ShaderRecipe
from .snapshot import Caster

_LAYERS_RECIPE = ShaderRecipe(
    name="opacity",
    vertex="opacity.vert.glsl",
    fragment="opacity.frag.glsl",
    structs=("struct_opacity.glsl",),
    settings=(StrandSettings,),
    varyings=(("smooth", "FLOAT", "strand_depth"), ("flat", "FLOAT", "strand_weight")),
    defines=(("DEEP", 0),),
)
_STARTS_RECIPE = ShaderRecipe(
    name="opacity_starts",
    compute="opacity_starts.comp.glsl",
    structs=("struct_opacity.glsl",),
    images=(("R32UI", "starts", "READ_WRITE"),),
    integers=("drawn_count", "map_index"),
)


@dataclass(frozen=True, eq=False)
class _Strands:
    """Strands on the GPU. drawn: how many of them throw the shadow of all. strip: one of them."""

    state: Hashable
    feature: ShaderFeature
    settings: ShaderFeature
    blocks: UniformBlocks
    cv_count: int
    drawn: int
    strip: Any

    def draw_starts(self, maps: OpacityMaps, number: int, place: ShaderFeature) -> None:
        shader = bound(
            _STARTS_RECIPE,
            [place, self.feature],
            self.blocks,
            images={"starts": maps.starts},
            integers={"map_index": number, "drawn_count": self.drawn},
        )
        gpu.compute.dispatch(shader.shader, -(-self.cv_count // 8), -(-self.drawn // 8), 1)
        gpu.shader.unbind()

    def draw_layers(self, features: Sequence[ShaderFeature]) -> None:
        shader = bound(_LAYERS_RECIPE, [*features, self.feature, self.settings], self.blocks)
        self.strip.draw_instanced(shader.shader, instance_start=0, instance_count=self.drawn)


class OpacityPass:
    """Keeps the maps of one groom's strands from draw to draw; making one touches no GPU."""

    def __init__(self) -> None:
        self.release()

    def release(self) -> None:
        """Release everything on the GPU; the next draw makes it again."""
        self._drawing, self._blocks = OpacityDrawing(), UniformBlocks()
        self._strip: tuple[int, Any] = (0, None)

    @property
    def note(self) -> str:
        """What the artist is to know of the last draw, or nothing."""
        return self._drawing.note

    def maps(
        self,
        points: Any,
        serial: int,
        shape: tuple[int, int],
        ball: Ball,
        lights: Sequence[Light],
        settings: VolumeSettings,
        strands: StrandSettings,
        casters: tuple[Caster, ...] = (),
        spacing: float = 0.0,
    ) -> OpacityMaps:
        """The maps of a frame.

        Args:
            points: texture of CVs, xyz [m, world] and radius, in the layout of strand_rows.
            serial: another number whenever the points are others.
            shape: strand_count, cv_count.
            ball, lights, casters, spacing: as in OpacityDrawing.maps.
        """
        strand_count, cv_count = shape
        drawn = max(round(strand_count * settings.strand_fraction), 1)
        feature = ShaderFeature(
            textures={"cv_points": ("FLOAT_2D", points)},
            integers={"cv_count": cv_count, "strand_count": strand_count},
            numbers={"strand_step": ("FLOAT", strand_count / drawn)},
        )
        look = ShaderFeature(
            blocks={"strands": ("StrandSettings", struct_values(strands.as_drawn))}
        )
        state, strip = (serial, shape, strands), self._ribbon(cv_count)
        hair = _Strands(state, feature, look, self._blocks, cv_count, drawn, strip)
        return self._drawing.maps(hair, ball, lights, settings, casters, spacing)

    def _ribbon(self, cv_count: int) -> Any:
        """A strip of vertices without attributes: two a CV."""
        if self._strip[0] != cv_count:
            layout = gpu.types.GPUVertFormat()
            layout.attr_add(id="unused", comp_type="F32", len=1, fetch_mode="FLOAT")
            vertices = gpu.types.GPUVertBuf(layout, 2 * cv_count)
            self._strip = cv_count, gpu.types.GPUBatch(type="TRI_STRIP", buf=vertices)
        return self._strip[1]
