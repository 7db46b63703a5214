"""Lights as the renderer knows them, in Blender's own radiometric units.

Irradiance E is the power that falls on a square metre facing the light. A matt surface of albedo
a sends out the radiance a E cos / pi, which is what a pixel shows.
- A sun's strength is E itself [W/m^2], the same everywhere.
- A point light of power P [W] shines evenly into all directions: E = P / (4 pi d^2).
- The world is one colour [W/(m^2 sr)] from everywhere; a matt surface sends out a times it.
Colours are scene-linear Rec.709. Shadows are no matter of the lights.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..arrays import Floats
from ..errors import HairloomError

type Color = tuple[float, float, float]
type Vector = tuple[float, float, float]

LIGHT_CAPACITY = 8
#: closer to a point light than this its irradiance no longer grows [m]
NEAREST_DISTANCE = 1.0e-3


@dataclass(frozen=True)
class Light:
    """One light in world space.

    kind: "sun" or "point".
    vector: for a sun the unit direction towards it, for a point its position [m].
    power: rgb; for a sun irradiance [W/m^2], for a point radiant flux [W].
    """

    kind: Literal["sun", "point"]
    vector: Vector
    power: Color

    @classmethod
    def sun(
        cls,
        shines_along: Sequence[float] | Floats,
        color: Sequence[float] | Floats,
        strength: float,
    ) -> Light:
        """A sun that shines along a direction, of Blender's strength [W/m^2].

        Raises:
            HairloomError: the direction has no length.
        """
        along = np.asarray(shines_along, np.float64)
        length = float(np.linalg.norm(along))
        if not length > 0.0:
            raise HairloomError(
                "its direction has no length", place="sun light", remedy="Turn it to the hair"
            )
        return cls("sun", _triple(-along / length), _triple(np.multiply(color, strength)))

    @classmethod
    def point(
        cls, position: Sequence[float] | Floats, color: Sequence[float] | Floats, power: float
    ) -> Light:
        """A point light at a position [m], of Blender's power [W]."""
        return cls("point", _triple(position), _triple(np.multiply(color, power)))


def light_direction(light: Light, points: Floats) -> Floats:
    """Unit vectors from points (..., 3) towards the light."""
    points = np.asarray(points)
    if light.kind == "sun":
        return np.broadcast_to(np.asarray(light.vector, points.dtype), points.shape)
    away = np.asarray(light.vector, points.dtype) - points
    distance = np.linalg.norm(away, axis=-1, keepdims=True)
    return away / np.maximum(distance, NEAREST_DISTANCE)


def light_irradiance(light: Light, points: Floats) -> Floats:
    """Irradiance at points (..., 3) on a surface facing the light, (..., 3) rgb [W/m^2]."""
    points = np.asarray(points)
    power = np.asarray(light.power, points.dtype)
    if light.kind == "sun":
        return np.broadcast_to(power, points.shape)
    away = np.asarray(light.vector, points.dtype) - points
    distance = np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), NEAREST_DISTANCE)
    return power / (4.0 * np.pi * distance * distance)


def three_point_lights(view: Floats, strength: float = 1.0) -> tuple[Light, ...]:
    """A studio's key, fill and rim light as suns that hang on the camera.

    Args:
        view: (4, 4) world to view space, a rigid motion.
        strength: factor of all three.
    """
    to_world = np.linalg.inv(np.asarray(view, np.float64))[:3, :3]
    return tuple(
        Light.sun(-to_world @ np.array(towards), color, strength * irradiance)
        for towards, color, irradiance in _STUDIO
    )


#: direction towards the light in view space (x right, y up, z to the eye), colour, [W/m^2]
_STUDIO = (
    ((0.55, 0.7, 0.6), (1.0, 0.96, 0.90), 4.2),
    ((-0.9, 0.1, 0.5), (0.80, 0.90, 1.0), 1.0),
    ((-0.5, 0.55, -0.9), (1.0, 0.97, 0.93), 4.0),
)


def pack_lights(lights: Sequence[Light], ambient: Sequence[float]) -> Floats:
    """The block `Lights` of gpu_shaders/lib_lights.glsl in std140, (68,) float32.

    Lanes, in vec4: [0] xyz world colour, w light count; [1 .. 8] xyz direction or position,
    w 1 for a point; [9 .. 16] xyz power. Lights beyond the capacity are left out, weakest first.
    """
    kept = sorted(lights, key=lambda light: -sum(light.power) * _reach(light))[:LIGHT_CAPACITY]
    block = np.zeros((1 + 2 * LIGHT_CAPACITY, 4), np.float32)
    block[0] = (*ambient, len(kept))
    for index, light in enumerate(kept):
        block[1 + index] = (*light.vector, float(light.kind == "point"))
        block[1 + LIGHT_CAPACITY + index, :3] = light.power
    return block.ravel()


def _reach(light: Light) -> float:
    """Rough irradiance per unit of power, to compare lights: a point is taken as a metre away."""
    return 1.0 if light.kind == "sun" else 1.0 / (4.0 * np.pi)


def _triple(values: Sequence[float] | Floats) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
