"""Shadows of meshes on meshes: one or more shadow maps for each light.

Maps are drawn only when a mesh or a light changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import gpu
import numpy as np

from ..arrays import Floats
from ..shading.lights import LIGHT_CAPACITY, Light
from ..shading.mesh_shadow_settings import MeshShadowSettings
from ..shading.volume.light_frame import LightFrame
from ..shading.volume.mesh_frames import (
    MESH_FRAME_CAPACITY,
    Extent,
    ball_of_casters,
    extent_of,
    mesh_frames,
)
from . import gpu_memory, gpu_objects
from .hashed_alpha import shifts
from .mesh_depths import MeshDepths
from .shader_feature import ShaderFeature
from .shader_program import released_with_shaders
from .snapshot import Caster, surface_of

_TEXEL_BYTES = 4
#: number, for hashed_alpha.shifts, of the sequence that shifts look-ups from sample to sample
_SEQUENCE = 1


@dataclass(frozen=True, eq=False)
class MeshShadows:
    """The inputs of shading: the block `MeshShadows` without a shift, and the maps."""

    values: Floats
    depths: Any

    def feature(self, sample: int) -> ShaderFeature:
        """The feature of programs that read the maps in one sample of a picture. Look-ups are
        shifted from sample to sample, so that the mean has smooth edges.
        """
        values = self.values.copy()
        values[-4:-2] = 2.0 * (np.add(shifts(_SEQUENCE, sample), 0.5) % 1.0) - 1.0
        return ShaderFeature(
            name="depths",
            blocks={"mesh_shadows": ("MeshShadows", values)},
            textures={"mesh_depths": ("DEPTH_2D_ARRAY", self.depths)},
            defines={"MESH_SHADOWS": 1},
        )


class MeshShadowPass:
    """The mesh shadow maps of a scene. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self.release()
        released_with_shaders(self)

    def release(self) -> None:
        """Release everything on the GPU; the next draw makes it again."""
        self._casters = MeshDepths()
        self._extents: list[tuple[Caster, Extent]] = []
        self._drawn: tuple[Any, ...] = ()
        self._maps: MeshShadows | None = None
        self._shape = (0, 0)

    def maps(
        self, casters: Sequence[Caster], lights: Sequence[Light], settings: MeshShadowSettings
    ) -> MeshShadows | None:
        """The maps of a moment; None if no mesh can shade another one.

        Args:
            casters: in world space; pass a new object for each change.
            lights: in the order of the shader's lights.
        """
        if not settings.mesh_shadows:
            self.release()
            return None
        frames = self._frames(casters, lights)
        if not any(frames):
            return None
        layers = max(sum(map(len, frames)), 2)  # an array needs at least two layers
        most = gpu.capabilities.max_texture_size_get()
        side = mesh_map_side(
            settings.mesh_resolution, layers, most, gpu_memory.mesh_shadow_map_budget()
        )
        values = pack_mesh_shadows(frames, side)
        wanted = (tuple(map(id, casters)), values.tobytes())
        if self._maps is None or self._drawn != wanted:
            self._maps = MeshShadows(values, self._texture(side, layers))
            self._casters.hold(casters)
            for layer, frame in enumerate(frame for each in frames for frame in each):
                rows = np.stack([*frame.to_map[[0, 1, 3]], frame.to_depth])
                self._casters.draw(self._maps.depths, layer, rows)
            self._drawn = wanted
        return self._maps

    def _frames(
        self, casters: Sequence[Caster], lights: Sequence[Light]
    ) -> list[tuple[LightFrame, ...]]:
        """The frames of each light's maps."""
        kept = {id(caster): extent for caster, extent in self._extents}
        self._extents = [
            (each, kept[id(each)] if id(each) in kept else extent_of(surface_of(each)))
            for each in casters
            if len(surface_of(each).triangles)
        ]
        ball = ball_of_casters([extent for _, extent in self._extents])
        return [] if ball is None else [mesh_frames(each, ball) for each in lights[:LIGHT_CAPACITY]]

    def _texture(self, side: int, layers: int) -> Any:
        """The texture of the draw before if it has this size, else a new one."""
        if self._maps is not None and self._shape == (side, layers):
            return self._maps.depths
        self._shape = side, layers
        return gpu_objects.texture((side, side), layers=layers, format="DEPTH_COMPONENT32F")


def mesh_map_side(requested: int, layers: int, max_side: int, max_bytes: int) -> int:
    """Texels along a side of each map: as requested, if memory (`max_bytes`) and the GPU
    (`max_side`) allow."""
    return max(min(requested, max_side, int(np.sqrt(max_bytes / (_TEXEL_BYTES * layers)))), 1)


def pack_mesh_shadows(frames: Sequence[Sequence[LightFrame]], side: int) -> Floats:
    """The block `MeshShadows` of gpu_shaders/struct_mesh_shadows.glsl in std140, (804,) float32.

    Args:
        frames: of each light. side: texels along a side of each map.
    """
    rows = np.zeros((4, MESH_FRAME_CAPACITY, 4), np.float32)
    of_lights = np.zeros((LIGHT_CAPACITY, 4), np.float32)
    number = 0
    for index, each in enumerate(frames[:LIGHT_CAPACITY]):
        of_lights[index, :2] = number, len(each)
        for frame in each:
            rows[:3, number], rows[3, number] = frame.to_map[[0, 1, 3]], frame.to_depth
            number += 1
    words = np.array([0.0, 0.0, side, 0.0], np.float32)
    return np.concatenate([rows.ravel(), of_lights.ravel(), words])
