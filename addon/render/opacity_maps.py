"""The lights' opacity maps: how much hair lies between each light and every place.

    starts  R32UI: depths of the first and the last hair, for deep layers
    spans   RGBA32F: start and thickness of the layers in each block of texels, with their slopes
    meshes  depth array: depth of the first mesh
    slots   RGBA32F arrays, as many as are attached to a framebuffer at once, at most six: four
            layers per texel

Each light that casts shadows has a map. In `starts` and `spans` maps are squares, stacked
vertically, with the last hair or the thickness to the right of the first hair or the start. In the
slots, a map has as many array layers as it takes passes to draw all its texels, with texel t in
slot t % slots.

Drawn are, in this order, the depths of meshes; start and end of deep layers, without hair that
meshes hide; and the sums of the layers, by additive blending. Only changes are drawn again, so that
a moving camera costs nothing. Shadows of lights that are attached to a moving view lag a little.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import gpu
import numpy as np

from ..arrays import Floats
from ..shading.lights import LIGHT_CAPACITY, Light
from ..shading.volume.light_frame import Ball, LightFrame
from ..shading.volume.map_size import (
    START_TEXELS,
    MapSize,
    fitted_size,
    size_for_spacing,
    size_note,
)
from ..shading.volume.opacity import layer_ends
from ..shading.volume.settings import VolumeSettings
from ..shading.volume.shadow_lights import shadow_frames
from . import gpu_memory, gpu_objects
from .mesh_depths import MeshDepths
from .shader_feature import ShaderFeature
from .shader_program import ShaderRecipe, program
from .shader_source import LAYER_TEXEL_CAPACITY
from .snapshot import Caster
from .textures import drawing_into, drawing_state

_NOTHING = (0.0, 0.0, 0.0, 0.0)
#: while a view turns: typical and largest angle by which shadows lag behind its lights [rad]
_LAG, _MAX_LAG = float(np.radians(8.0)), float(np.radians(20.0))
_SPANS_RECIPE = ShaderRecipe(
    name="opacity_spans",
    compute="opacity_spans.comp.glsl",
    structs=("struct_opacity.glsl",),
    textures=(("UINT_2D", "starts"),),
    images=(("RGBA32F", "spans"),),
    integers=("map_index", "side"),
)
_NO_STARTS_RECIPE = ShaderRecipe(
    name="opacity_no_starts",
    compute="opacity_no_starts.comp.glsl",
    images=(("R32UI", "starts"),),
    integers=("map_index", "side"),
)


@dataclass(frozen=True, eq=False)
class OpacityMaps:
    """The inputs of shading: the block `Opacity`, and the textures.

    note: a note on them to the artist, or empty.
    """

    values: Floats
    size: MapSize
    slots: tuple[Any, ...]
    meshes: Any
    starts: Any = None
    spans: Any = None
    note: str = ""

    @property
    def passes(self) -> int:
        """Array layers of a map in each slot: one for each pass that draws it."""
        return self.size.passes

    @property
    def mesh_feature(self) -> ShaderFeature:
        """The feature of programs that skip hair behind meshes, whose depths are drawn first."""
        return ShaderFeature(textures={"opacity_meshes": ("DEPTH_2D_ARRAY", self.meshes)})

    @property
    def feature(self) -> ShaderFeature:
        """The feature of programs that read the maps."""
        arrays = {f"opacity_{slot}": array for slot, array in enumerate(self.slots)}
        named = {name: ("FLOAT_2D_ARRAY", array) for name, array in arrays.items()}
        named["opacity_meshes"] = ("DEPTH_2D_ARRAY", self.meshes)
        is_deep = self.starts is not None
        if is_deep:
            named |= self.span_feature.textures
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

    @property
    def span_feature(self) -> ShaderFeature:
        """The feature of programs that read start and end of deep layers."""
        return ShaderFeature(
            name="deep", textures={"opacity_spans": ("FLOAT_2D", self.spans)}, defines={"DEEP": 1}
        )

    def compute_spans(self, number: int) -> None:
        """Compute the spans of one map from its first and last depths."""
        side = self.size.side // START_TEXELS
        shader = program(_SPANS_RECIPE)
        shader.bind(
            textures={"starts": self.starts},
            images={"spans": self.spans},
            integers={"map_index": number, "side": side},
        )
        shader.dispatch(side, side)

    def clear_starts(self, number: int) -> None:
        """Clear the first and last depths of one map to those without hair."""
        side = self.size.side // START_TEXELS
        shader = program(_NO_STARTS_RECIPE)
        shader.bind(images={"starts": self.starts}, integers={"map_index": number, "side": side})
        shader.dispatch(2 * side, side)


def new_maps(values: Floats, size: MapSize) -> OpacityMaps:
    """Maps of this size, whose textures have yet to be drawn."""
    square, mesh_square = (size.side, size.side), (size.mesh_side, size.mesh_side)
    # an array needs at least two layers
    count = max(size.map_count * size.passes, 2)
    slots = range(size.slots)
    arrays = tuple(gpu_objects.texture(square, layers=count, format="RGBA32F") for _ in slots)
    layers = max(size.map_count, 2)
    meshes = gpu_objects.texture(mesh_square, layers=layers, format="DEPTH_COMPONENT32F")
    if not size.is_deep:
        return OpacityMaps(values, size, arrays, meshes)
    side = size.side // START_TEXELS
    starts = gpu_objects.texture((2 * side, side * size.map_count), format="R32UI")
    spans = gpu_objects.texture((2 * side, side * size.map_count), format="RGBA32F")
    return OpacityMaps(values, size, arrays, meshes, starts, spans)


class HairInMaps(Protocol):
    """Hair that can be drawn into maps."""

    @property
    def state(self) -> Hashable:
        """A value that changes whenever the hair's maps change."""

    def draw_starts(self, maps: OpacityMaps, number: int, place: ShaderFeature) -> None:
        """Write the depths at which the layers of one map start and end into `maps.starts`.

        Args:
            number: of the map. place: the block of the maps, and the light's index.
        """

    def draw_layers(self, features: Sequence[ShaderFeature]) -> None:
        """Draw all hair into the bound framebuffer, by a program with these features."""


class OpacityDrawing:
    """The maps of one groom, kept from draw to draw. Creating one does not touch the GPU.

    has_stale_maps: some maps are of earlier positions of their lights, see `maps`.
    """

    def __init__(self) -> None:
        self._maps: OpacityMaps | None = None
        self._drawn_of: tuple[Any, ...] = ()
        self._frames: dict[int, LightFrame] = {}
        self._meshes_drawn: dict[int, tuple[Any, ...]] = {}
        self._casters = MeshDepths()
        self.has_stale_maps = False

    def maps(
        self,
        hair: HairInMaps,
        ball: Ball,
        lights: Sequence[Light],
        settings: VolumeSettings,
        casters: tuple[Caster, ...],
        spacing: float = 0.0,
        *,
        is_turning: bool = False,
    ) -> OpacityMaps:
        """The maps of a frame.

        Args:
            ball: around all hair.
            lights: in the order of the shader's lights.
            casters: meshes, world space; pass a new object for each change.
            spacing: distance of strands that represent the hairs between them [m]; 0: none do.
            is_turning: the lights are attached to a view that moves. Then at most one map per frame
                is drawn again, as long as all of them lag little.
        """
        frames = dict(enumerate(shadow_frames(lights, ball, settings)))
        wanted = {light: frame for light, frame in frames.items() if frame is not None}
        largest = gpu.capabilities.max_texture_size_get()
        room = gpu_memory.shadow_map_budget()
        size = fitted_size(settings, len(wanted), room, largest)
        note = size_note(settings, len(wanted), room, size)
        size = size_for_spacing(size, spacing, ball.radius)
        place = ball.center.tobytes(), ball.radius
        drawn_of = (
            hair.state,
            settings,
            size,
            note,
            *place,
            tuple(wanted),
            tuple(map(id, casters)),
        )
        is_other = self._maps is None or self._drawn_of != drawn_of
        if is_other:
            self._frames = {}
        due = lights_to_redraw(self._frames, wanted, is_turning=is_turning)
        if self._maps is None or is_other or due:
            self._frames |= {light: wanted[light] for light in due}
            values = pack_opacity([self._frames.get(light) for light in frames], settings, size)
            self._maps = maps = replace(self._maps_of(values, size), note=note)
            self._casters.hold(casters)
            places = [(number, light) for number, light in enumerate(wanted) if light in due]
            # all meshes first: else Mesa on the CPU reads depths of a map that is still being drawn
            for number, light in places:
                self._draw_casters(maps, number, light, casters)
            for number, light in places:
                _draw_map(maps, number, light, hair)
            self._drawn_of = drawn_of
        self.has_stale_maps = bool(lights_to_redraw(self._frames, wanted))
        return self._maps

    def _maps_of(self, values: Floats, size: MapSize) -> OpacityMaps:
        """Maps with these values, and the textures of the draw before if they have this size."""
        if self._maps is not None and self._maps.size == size:
            return replace(self._maps, values=values)
        self._meshes_drawn = {}
        return new_maps(values, size)

    def _draw_casters(
        self, maps: OpacityMaps, number: int, light: int, casters: tuple[Caster, ...]
    ) -> None:
        """Draw the depths of meshes, if the meshes or the light's view have changed."""
        rows = maps.values[: 4 * 4 * LIGHT_CAPACITY].reshape(4, LIGHT_CAPACITY, 4)[:, light]
        seen = tuple(map(id, casters)), rows.tobytes()
        if self._meshes_drawn.get(number) != seen:
            self._casters.draw(maps.meshes, number, rows)
            self._meshes_drawn[number] = seen


def lights_to_redraw(
    drawn_frames: Mapping[int, LightFrame],
    wanted_frames: Mapping[int, LightFrame],
    *,
    is_turning: bool = False,
) -> tuple[int, ...]:
    """The lights whose maps are to be drawn, or drawn again.

    Args:
        drawn_frames, wanted_frames: frames by light; either none or all are drawn.
        is_turning: as for `OpacityDrawing.maps`.
    """
    if not drawn_frames:
        return tuple(wanted_frames)
    lags = {
        light: _angle_between(drawn_frames[light], frame) for light, frame in wanted_frames.items()
    }
    behind = tuple(
        light
        for light, frame in wanted_frames.items()
        if (drawn_frames[light].to_map != frame.to_map).any()
    )
    if not is_turning or not behind or max(lags.values()) > _MAX_LAG:
        return behind
    last = max(behind, key=lambda light: lags[light])
    return (last,) if lags[last] > _LAG else ()


def _angle_between(one: LightFrame, other: LightFrame) -> float:
    """The angle between the directions of two frames [rad]."""
    along = one.to_depth[:3], other.to_depth[:3]
    lengths = np.linalg.norm(along[0]) * np.linalg.norm(along[1])
    return float(np.arccos(np.clip(along[0] @ along[1] / lengths, -1.0, 1.0)))


def _draw_map(maps: OpacityMaps, number: int, light: int, hair: HairInMaps) -> None:
    """Draw the map of one light: the starts of its layers, then their sums."""
    place = ShaderFeature(
        blocks={"opacity": ("Opacity", maps.values)}, integers={"light_index": light}
    )
    features = [place, maps.mesh_feature]
    if maps.starts is not None:
        maps.clear_starts(number)
        hair.draw_starts(maps, number, place)
        maps.compute_spans(number)
        features += [maps.span_feature, ShaderFeature(integers={"map_index": number})]
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
            hair.draw_layers([*features, texels])


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
