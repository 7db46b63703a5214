"""Draws the lights' opacity maps: how much hair lies between each light and every place.

First the depths of meshes, then where deep layers start and end, then the sums of the layers by
additive blending, in textures that opacity_maps.py describes. These are kept as long as they fit.
What has not changed since the last draw is not drawn again, so that a moving camera costs nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import gpu
import numpy as np

from ..arrays import Floats
from ..params.glsl import struct_values
from ..shading.lights import LIGHT_CAPACITY, Light
from ..shading.settings import StrandSettings
from ..shading.volume.light_frame import Ball, LightFrame
from ..shading.volume.map_size import MapSize, fitted_size, size_note
from ..shading.volume.opacity import layer_ends
from ..shading.volume.settings import VolumeSettings
from ..shading.volume.shadow_lights import shadow_frames
from .mesh_depths import MeshDepths
from .opacity_maps import OpacityForm, OpacityMaps, new_maps
from .shader_program import ShaderRecipe, program
from .shader_source import LAYER_TEXEL_CAPACITY
from .snapshot import Caster
from .textures import UniformBlock, drawing_into, drawing_state

__all__ = ["OpacityForm", "OpacityMaps", "OpacityPass", "opacity_recipe", "pack_opacity"]

_NOTHING = (0.0, 0.0, 0.0, 0.0)
_BLOCKS = (("Opacity", "opacity"), ("StrandSettings", "strands"))


def opacity_recipe(slots: int, *, is_deep: bool) -> ShaderRecipe:
    """The program that draws into so many slots."""
    return ShaderRecipe(
        name=f"opacity_{slots}_{'deep' if is_deep else 'slices'}",
        vertex="opacity.vert.glsl",
        fragment="opacity.frag.glsl",
        structs=("struct_opacity.glsl",),
        settings=(StrandSettings,),
        blocks=_BLOCKS,
        textures=(
            ("FLOAT_2D", "cv_points"),
            *((("UINT_2D", "opacity_starts"),) if is_deep else ()),
        ),
        integers=(
            "cv_count",
            "strand_count",
            "light_index",
            "first_texel",
            *(("map_index",) if is_deep else ()),
        ),
        numbers=(("FLOAT", "strand_step"),),
        varyings=(("smooth", "FLOAT", "strand_depth"), ("flat", "FLOAT", "strand_weight")),
        outputs=tuple(("VEC4", f"layers_{slot}") for slot in range(slots)),
        defines=(("TARGETS", slots), ("DEEP", int(is_deep))),
    )


_STARTS_RECIPE = ShaderRecipe(
    name="opacity_starts",
    compute="opacity_starts.comp.glsl",
    structs=("struct_opacity.glsl",),
    blocks=(("Opacity", "opacity"),),
    textures=(("FLOAT_2D", "cv_points"),),
    images=(("R32UI", "starts", "READ_WRITE"),),
    integers=("cv_count", "strand_count", "drawn_count", "light_index", "map_index"),
    numbers=(("FLOAT", "strand_step"),),
)


@dataclass(frozen=True)
class _Hair:
    """Strands on the GPU. drawn: how many of them throw the shadow of all."""

    points: Any
    strand_count: int
    cv_count: int
    drawn: int

    @property
    def step(self) -> float:
        return self.strand_count / self.drawn


class OpacityPass:
    """Keeps the maps of one groom from draw to draw; making one touches no GPU.

    note: what the artist is to know of the last draw, or nothing.
    """

    def __init__(self) -> None:
        self.release()

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next draw makes it anew."""
        self._blocks = {name: UniformBlock() for _, name in _BLOCKS}
        self._maps: OpacityMaps | None = None
        self._drawn: tuple[Any, ...] = ()
        self._meshes_drawn: tuple[Any, ...] = ()
        self.note = ""
        self._strip: tuple[int, Any] = (0, None)
        self._casters = MeshDepths()

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
    ) -> OpacityMaps:
        """The maps of a moment.

        Args:
            points: texture of CVs, xyz [m, world] and radius, in the layout of strand_rows.
            serial: another number whenever the points are others.
            shape: strand_count, cv_count.
            ball: around all strands.
            lights: in the order in which the shader knows them.
            casters: meshes, world space; another object whenever one is another.
        """
        frames = shadow_frames(lights, ball, settings)
        count = sum(frame is not None for frame in frames)
        size = fitted_size(settings, count, gpu.capabilities.max_texture_size_get())
        self.note = size_note(settings, count, size)
        values = pack_opacity(frames, settings, size)
        meshes = tuple(map(id, casters))
        wanted = (serial, shape, strands, settings, values.tobytes(), meshes)
        if self._maps is None or self._drawn != wanted:
            shadowing = [index for index, frame in enumerate(frames) if frame is not None]
            self._maps = maps = self._maps_of(values, size)
            maps.forget_starts()
            hair = _Hair(points, *shape, max(round(shape[0] * settings.strand_share), 1))
            self._blocks["opacity"].holding(values)
            self._blocks["strands"].holding(struct_values(strands.as_drawn))
            self._draw_casters(maps, shadowing, casters)
            for number, light in enumerate(shadowing):
                self._draw_map(maps, number, light, hair, settings)
            self._drawn = wanted
        return self._maps

    def _maps_of(self, values: Floats, size: MapSize) -> OpacityMaps:
        """The textures of the draw before where they have this size, with other values."""
        if self._maps is not None and self._maps.size == size:
            return replace(self._maps, values=values)
        self._meshes_drawn = ()
        return new_maps(values, size)

    def _draw_casters(
        self, maps: OpacityMaps, shadowing: list[int], casters: tuple[Caster, ...]
    ) -> None:
        """The depths of meshes, if a light sees others than before, or from elsewhere."""
        seen = (tuple(map(id, casters)), maps.values[: -4 * LAYER_TEXEL_CAPACITY - 4].tobytes())
        self._casters.hold(casters)
        if self._meshes_drawn == seen:
            return
        rows = maps.values[: 4 * 4 * LIGHT_CAPACITY].reshape(4, LIGHT_CAPACITY, 4)
        for number, light in enumerate(shadowing):
            self._casters.draw(maps.meshes, number, rows[:, light])
        self._meshes_drawn = seen

    def _draw_map(
        self, maps: OpacityMaps, number: int, light: int, hair: _Hair, settings: VolumeSettings
    ) -> None:
        """The map of one light: where its layers start, then what they hold."""
        blocks = {name: block.buffer for name, block in self._blocks.items()}
        integers = {
            "cv_count": hair.cv_count,
            "strand_count": hair.strand_count,
            "light_index": light,
        }
        if maps.starts is not None:
            integers["map_index"] = number
            shader = program(_STARTS_RECIPE)
            shader.bind(
                blocks={"opacity": blocks["opacity"]},
                textures={"cv_points": hair.points},
                images={"starts": maps.starts},
                integers={**integers, "drawn_count": hair.drawn},
                numbers={"strand_step": hair.step},
            )
            groups = -(-hair.cv_count // 8), -(-hair.drawn // 8)
            gpu.compute.dispatch(shader.shader, *groups, 1)
            gpu.shader.unbind()
        slot_count = len(maps.slots)
        shader = program(opacity_recipe(slot_count, is_deep=maps.starts is not None))
        for turn in range(maps.passes):
            layer = number * maps.passes + turn
            target = gpu.types.GPUFrameBuffer(
                color_slots=tuple({"texture": slot, "layer": layer} for slot in maps.slots)
            )
            with (
                drawing_into(target),
                drawing_state(depth_test="NONE", depth_write=False, blend="ADDITIVE_PREMULT"),
            ):
                target.clear(color=_NOTHING)
                starts = {} if maps.starts is None else {"opacity_starts": maps.starts}
                shader.bind(
                    blocks=blocks,
                    textures={"cv_points": hair.points, **starts},
                    integers={**integers, "first_texel": turn * slot_count},
                    numbers={"strand_step": hair.step},
                )
                self._ribbon(hair.cv_count).draw_instanced(
                    shader.shader, instance_start=0, instance_count=hair.drawn
                )

    def _ribbon(self, cv_count: int) -> Any:
        """A strip of vertices without attributes: two a CV."""
        if self._strip[0] != cv_count:
            layout = gpu.types.GPUVertFormat()
            layout.attr_add(id="unused", comp_type="F32", len=1, fetch_mode="FLOAT")
            vertices = gpu.types.GPUVertBuf(layout, 2 * cv_count)
            self._strip = cv_count, gpu.types.GPUBatch(type="TRI_STRIP", buf=vertices)
        return self._strip[1]


def pack_opacity(
    frames: Sequence[LightFrame | None], settings: VolumeSettings, size: MapSize
) -> Floats:
    """The block `Opacity` of gpu_shaders/struct_opacity.glsl in std140, (228,) float32."""
    rows = np.zeros((5, LIGHT_CAPACITY, 4))
    rows[4, :, 0] = -1.0
    numbers = iter(range(LIGHT_CAPACITY))
    for index, frame in enumerate(frames[:LIGHT_CAPACITY]):
        if frame is not None:
            rows[:3, index] = frame.to_map[[0, 1, 3]]
            rows[3, index], rows[4, index, 0] = frame.to_depth, next(numbers)
    found = layer_ends(settings)
    ends = 2.0 + np.arange(4.0 * LAYER_TEXEL_CAPACITY)  # lanes without a layer end behind all hair
    ends[: len(found)] = found
    words = np.zeros(4, np.float32)
    words[:2] = settings.extinction, settings.bias
    words.view(np.int32)[2:] = size.texels, size.side
    return np.concatenate([rows.ravel().astype(np.float32), ends.astype(np.float32), words])
