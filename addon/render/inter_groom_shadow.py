"""How much hair of other grooms lies between the lights and places, which have maps of their own.

A groom's maps hold its own strands. What shades a strand or a mesh is more: at each CV of its own
hair, and at each pixel of meshes, what all other grooms have in the way of the first lights is
added up in a texture, a channel a light. CVs are close enough to each other for a shadow that comes
from elsewhere.
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

#: of a place that has no groom of its own
NOBODY = -5


_RECIPE = ShaderRecipe(
    name="inter_groom_shadow",
    compute="inter_groom_shadow.comp.glsl",
    structs=("struct_opacity.glsl",),
    textures=(("FLOAT_2D", "places"),),
    images=(("RGBA32F", "between", "READ_WRITE"),),
    integers=("light_count", "own_number"),
)


class InterGroomShadow:
    """Keeps what it has found for one texture of places; making one touches no GPU."""

    def __init__(self) -> None:
        self.release()

    def release(self) -> None:
        """Let go of all that lies on the GPU; the next call makes it again."""
        self._blocks: list[UniformBlocks] = []
        self._found: Any = None
        self._made_of: tuple[Any, ...] = ()
        self._kept: Sequence[tuple[int, OpacityMaps]] = ()  # so that their ids are of nothing else

    def at(
        self,
        places: Any,
        serial: int | None,
        grooms: Sequence[tuple[int, OpacityMaps]],
        light_count: int,
    ) -> Any:
        """A texture as large as that of the places, RGBA32F: the optical depth of each light.

        Args:
            places: RGBA32F, xyz [m, world]; w the number of the groom whose hair does not count;
                negative where there is nothing.
            serial: another number whenever the places are others; None: they always are.
            grooms: number and maps of each groom that may be in the way.
        """
        made_of = (serial, light_count, *((number, id(maps)) for number, maps in grooms))
        size = places.width, places.height
        if self._found is None or (self._found.width, self._found.height) != size:
            self._found = gpu_objects.texture(size, format="RGBA32F")
        elif serial is not None and made_of == self._made_of:
            return self._found
        self._made_of, self._kept = made_of, grooms
        self._found.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
        self._blocks += [UniformBlocks() for _ in range(len(grooms) - len(self._blocks))]
        for block, (number, maps) in zip(self._blocks, grooms, strict=False):
            shader = bound(
                _RECIPE,
                [maps.feature],
                block,
                textures={"places": places},
                images={"between": self._found},
                integers={
                    "light_count": min(light_count, OTHER_TAU_LIGHTS),
                    "own_number": number,
                },
            )
            shader.dispatch(size[0], size[1])
        return self._found


def may_shade(maps: OpacityMaps, ball: Ball) -> bool:
    """Whether hair with these maps may throw a shadow on anything in a ball; all light counts.

    Pure numpy.
    """
    rows = maps.values[: 5 * 4 * LIGHT_CAPACITY].reshape(5, LIGHT_CAPACITY, 4)
    for x, y, w, depth, light in rows[:, :OTHER_TAU_LIGHTS].swapaxes(0, 1).astype(np.float64):
        if light[0] >= 0.0 and _reaches(x, y, w, depth, ball):
            return True
    return False


def _reaches(x: Floats, y: Floats, w: Floats, depth: Floats, ball: Ball) -> bool:
    """Whether the ball, or what lies nearer to the light, is in a map."""
    center = np.append(ball.center, 1.0)
    if depth @ center + ball.radius * np.linalg.norm(depth[:3]) < 0.0:
        return False
    sides = (w - x, w + x, w - y, w + y)  # none of them is negative within the map
    return all(side @ center + ball.radius * np.linalg.norm(side[:3]) >= 0.0 for side in sides)
