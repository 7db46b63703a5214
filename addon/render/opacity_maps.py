"""The lights' opacity maps: how much hair lies between each light and every place.

    starts  R32UI: depths of the first and the last hair, where layers are deep
    meshes  depth array: of the first mesh
    slots   RGBA32F arrays, as many as a framebuffer is given at once, at most six: four layers a
            texel

Each light that throws shadows has a map: in `starts` one square above the other, the last hair's
to the right of the first one's; in the slots as many layers of an array as it takes passes to draw
all its texels, texel t in slot t % slots.

Drawn are first the depths of meshes, then where deep layers start and end, then the sums of the
layers by additive blending. What has not changed since the last draw is not drawn again, so that a
moving camera costs nothing.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import gpu
import numpy as np

from ..arrays import Floats
from ..shading.lights import LIGHT_CAPACITY, Light
from ..shading.volume.light_frame import Ball, LightFrame
from ..shading.volume.map_size import START_TEXELS, MapSize, even_size, fitted_size, size_note
from ..shading.volume.opacity import layer_ends
from ..shading.volume.settings import VolumeSettings
from ..shading.volume.shadow_lights import shadow_frames
from . import gpu_objects
from .mesh_depths import MeshDepths
from .shader_feature import ShaderFeature
from .shader_source import LAYER_TEXEL_CAPACITY
from .snapshot import Caster
from .textures import drawing_into, drawing_state

_NOTHING = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class OpacityMaps:
    """What shading reads: the block `Opacity`, and the textures."""

    values: Floats
    size: MapSize
    slots: tuple[Any, ...]
    meshes: Any
    starts: Any = None

    @property
    def passes(self) -> int:
        """How many layers of each slot a map has: one a pass that draws it."""
        return self.size.passes

    @property
    def feature(self) -> ShaderFeature:
        """What a program that reads them has."""
        arrays = {f"opacity_{slot}": array for slot, array in enumerate(self.slots)}
        named = {name: ("FLOAT_2D_ARRAY", array) for name, array in arrays.items()}
        named["opacity_meshes"] = ("DEPTH_2D_ARRAY", self.meshes)
        is_deep = self.starts is not None
        if is_deep:
            named["opacity_starts"] = ("UINT_2D", self.starts)
        return ShaderFeature(
            name=f"{len(self.slots)}_{'deep' if is_deep else 'slices'}",
            blocks={"opacity": ("Opacity", self.values)},
            textures=named,
            defines={
                "SHADOWS": 1,
                "SLOTS": len(self.slots),
                "DEEP": int(is_deep),
                "PASSES": self.passes,
            },
        )

    def forget_starts(self) -> None:
        """As if no light had met any hair."""
        if self.starts is not None:
            self.starts.clear(format="UINT", value=(-1,))  # beyond all depths


def new_maps(values: Floats, size: MapSize) -> OpacityMaps:
    """Textures of this size; what they hold is to be drawn."""
    square, mesh_square = (size.side, size.side), (size.mesh_side, size.mesh_side)
    # one texture alone would not be an array
    count = max(size.map_count * size.passes, 2)
    slots = range(size.slots)
    arrays = tuple(gpu_objects.texture(square, layers=count, format="RGBA32F") for _ in slots)
    layers = max(size.map_count, 2)
    meshes = gpu_objects.texture(mesh_square, layers=layers, format="DEPTH_COMPONENT32F")
    if not size.is_deep:
        return OpacityMaps(values, size, arrays, meshes)
    side = size.side // START_TEXELS
    starts = gpu_objects.texture((2 * side, side * size.map_count), format="R32UI")
    return OpacityMaps(values, size, arrays, meshes, starts)


class HairInMaps(Protocol):
    """Hair that can be drawn into maps."""

    @property
    def state(self) -> Hashable:
        """Another value whenever its maps are others."""

    def draw_starts(self, maps: OpacityMaps, number: int, place: ShaderFeature) -> None:
        """Write into `maps.starts` where the layers of one map start and end.

        Args:
            number: of the map. place: the block of the maps, and which light it is.
        """

    def draw_layers(self, features: Sequence[ShaderFeature], meshes: ShaderFeature) -> None:
        """Draw all hair into the bound framebuffer, by a program with these features.

        Args:
            meshes: the depths of the first mesh, for hair that leaves out what is behind it.
        """


class OpacityDrawing:
    """Keeps the maps of one groom from draw to draw; making one touches no GPU.

    note: what the artist is to know of the last draw, or nothing.
    """

    def __init__(self) -> None:
        self._maps: OpacityMaps | None = None
        self._drawn: tuple[Any, ...] = ()
        self._meshes_drawn: tuple[Any, ...] = ()
        self._casters = MeshDepths()
        self.note = ""

    def maps(
        self,
        hair: HairInMaps,
        ball: Ball,
        lights: Sequence[Light],
        settings: VolumeSettings,
        casters: tuple[Caster, ...],
        spacing: float = 0.0,
    ) -> OpacityMaps:
        """The maps of a frame.

        Args:
            ball: around all hair.
            lights: in the order in which the shader knows them.
            casters: meshes, world space; another object whenever one is another.
            spacing: of strands whose hairs fill the space between them [m]; 0: none do.
        """
        frames = shadow_frames(lights, ball, settings)
        count = sum(frame is not None for frame in frames)
        size = fitted_size(settings, count, gpu.capabilities.max_texture_size_get())
        self.note = size_note(settings, count, size)
        size = even_size(size, spacing, ball.radius)
        values = pack_opacity(frames, settings, size)
        drawn = (hair.state, settings, values.tobytes(), tuple(map(id, casters)))
        if self._maps is None or self._drawn != drawn:
            shadowing = [index for index, frame in enumerate(frames) if frame is not None]
            self._maps = maps = self._maps_of(values, size)
            maps.forget_starts()
            self._draw_casters(maps, shadowing, casters)
            for number, light in enumerate(shadowing):
                _draw_map(maps, number, light, hair)
            self._drawn = drawn
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


def _draw_map(maps: OpacityMaps, number: int, light: int, hair: HairInMaps) -> None:
    """The map of one light: where its layers start, then what they hold."""
    place = ShaderFeature(
        blocks={"opacity": ("Opacity", maps.values)}, integers={"light_index": light}
    )
    meshes = ShaderFeature(textures={"opacity_meshes": ("DEPTH_2D_ARRAY", maps.meshes)})
    features = [place]
    if maps.starts is not None:
        hair.draw_starts(maps, number, place)
        features.append(
            ShaderFeature(
                name="deep",
                textures={"opacity_starts": ("UINT_2D", maps.starts)},
                integers={"map_index": number},
                defines={"DEEP": 1},
            )
        )
    slots = len(maps.slots)
    for turn in range(maps.passes):
        layer = number * maps.passes + turn
        target = gpu_objects.framebuffer(
            color_slots=tuple({"texture": slot, "layer": layer} for slot in maps.slots)
        )
        texels = ShaderFeature(
            name=f"{slots}",
            integers={"first_texel": turn * slots},
            outputs=tuple(("VEC4", f"layers_{slot}") for slot in range(slots)),
            defines={"TARGETS": slots},
        )
        with (
            drawing_into(target),
            drawing_state(depth_test="NONE", depth_write=False, blend="ADDITIVE_PREMULT"),
        ):
            target.clear(color=_NOTHING)
            hair.draw_layers([*features, texels], meshes)


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
