"""Shadows between grooms: the optical depth of other grooms' hair between the lights and places.

A groom's maps only hold its own strands. So the optical depth of all other grooms for the first
lights is summed in a texture, a channel per light, at each CV of the groom's hair or at each pixel
of meshes. For a shadow from other hair, CVs are dense enough.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import Floats
from ..shading.lights import LIGHT_CAPACITY
from ..shading.volume.light_frame import Ball
from . import gpu_objects
from .feature_programs import UniformBlocks, bound
from .opacity_maps import OpacityMaps
from .shader_program import ShaderRecipe
from .shader_source import OTHER_TAU_LIGHTS

#: number of a groom that no place has
NO_GROOM = -5


_RECIPE = ShaderRecipe(
    name="inter_groom_shadow",
    compute="inter_groom_shadow.comp.glsl",
    structs=("struct_opacity.glsl",),
    textures=(("FLOAT_2D", "places"),),
    images=(("RGBA32F", "other_tau", "READ_WRITE"),),
    integers=("light_count", "own_number"),
)


class InterGroomShadow:
    """The result for one texture of places. Creating one does not touch the GPU."""

    def __init__(self) -> None:
        self.release()

    def release(self) -> None:
        """Release everything on the GPU; the next call makes it again."""
        self._blocks: list[UniformBlocks] = []
        self._other_tau: Any = None
        self._inputs: tuple[Any, ...] = ()
        self._kept_grooms: Sequence[
            tuple[int, OpacityMaps]
        ] = ()  # so that their ids are not reused

    def other_tau(
        self,
        places: Any,
        serial: int | None,
        grooms: Sequence[tuple[int, OpacityMaps]],
        light_count: int,
    ) -> Any:
        """An RGBA32F texture of the size of `places`: the optical depth for each light.

        Args:
            places: RGBA32F, xyz [m, world]; w the number of the groom whose hair is skipped;
                negative where there is no place.
            serial: changes whenever the places change; None: they always do.
            grooms: number and maps of each groom that may cast a shadow.
        """
        inputs = (serial, light_count, *((number, id(maps)) for number, maps in grooms))
        size = places.width, places.height
        if self._other_tau is None or (self._other_tau.width, self._other_tau.height) != size:
            self._other_tau = gpu_objects.texture(size, format="RGBA32F")
        elif serial is not None and inputs == self._inputs:
            return self._other_tau
        self._inputs, self._kept_grooms = inputs, grooms
        self._other_tau.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
        self._blocks += [UniformBlocks() for _ in range(len(grooms) - len(self._blocks))]
        for block, (number, maps) in zip(self._blocks, grooms, strict=False):
            shader = bound(
                _RECIPE,
                [maps.feature],
                block,
                textures={"places": places},
                images={"other_tau": self._other_tau},
                integers={
                    "light_count": min(light_count, OTHER_TAU_LIGHTS),
                    "own_number": number,
                },
            )
            shader.dispatch(size[0], size[1])
        return self._other_tau


def may_cast_shadow_on(maps: OpacityMaps, ball: Ball) -> bool:
    """Whether hair with these maps may cast a shadow on anything in a ball, for any of the first
    lights.

    Pure numpy.
    """
    rows = maps.values[: 5 * 4 * LIGHT_CAPACITY].reshape(5, LIGHT_CAPACITY, 4)
    for x, y, w, depth, light in rows[:, :OTHER_TAU_LIGHTS].swapaxes(0, 1).astype(np.float64):
        if light[0] >= 0.0 and _may_reach(x, y, w, depth, ball):
            return True
    return False


def _may_reach(x: Floats, y: Floats, w: Floats, depth: Floats, ball: Ball) -> bool:
    """Whether any of the ball is in a map, at or behind the depth at which the map begins."""
    center = np.append(ball.center, 1.0)
    if depth @ center + ball.radius * np.linalg.norm(depth[:3]) < 0.0:
        return False
    sides = (w - x, w + x, w - y, w + y)  # none of them is negative within the map
    return all(side @ center + ball.radius * np.linalg.norm(side[:3]) >= 0.0 for side in sides)
