"""The renderer's lights, in Blender's own radiometric units.

Irradiance E is the power that falls on a square metre facing the light. A matt surface of albedo
a sends out the radiance a E cos / pi, which is what a pixel shows.
- A sun's strength is E itself [W/m^2], the same everywhere.
- A point light of power P [W] shines evenly into all directions: E = P / (4 pi d^2). With a radius
  r it is a disk that faces the lit point, E = P / (4 pi (d^2 + r^2)), or a ball, inside of which E
  no longer grows; both as in Cycles.
- A spot of power P is a point light of that power, restricted to a cone. - An area light of power P
sends it out from one side of a panel, see area_lights.py. - The world is radiance [W/(m^2 sr)] by
direction, see environment.py; under an even one, a matt surface sends out a times its radiance.
Colours are scene-linear Rec.709. Shadows are not part of the lights.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ..arrays import Floats
from ..errors import HairloomError
from ..strands.vectors import triple
from .area_lights import Panel, vector_irradiance

type Color = tuple[float, float, float]
type Vector = tuple[float, float, float]

LIGHT_CAPACITY = 8
#: number of harmonics of orders 1 and 2, see environment.py
HARMONIC_COUNT = 8
#: distance from a point light below which its irradiance no longer grows [m]; far below any hair
NEAREST_DISTANCE = 1.0e-6

#: forms, in the order of their numbers in lib_lights.glsl
_SHAPES = ("sun", "point", "spot", "rectangle", "disk", "grid", "round grid")


@dataclass(frozen=True)
class Cone:
    """The cone of a spot, as in Cycles: a smooth step of the angle's cosine.

    axes: (3, 3) rows that turn a direction in world space into the spot's own axes, in which it
        shines along -z; a scaled object squeezes its cone.
    size: full angle [rad].
    blend: fraction of the cone over which its rim fades, 0 to 1.
    """

    axes: tuple[Vector, Vector, Vector]
    size: float
    blend: float

    @property
    def max_angle(self) -> float:
        """The largest angle to its axis, in world space, at which it lets light through [rad]."""
        right, up, back = np.linalg.norm(np.array(self.axes, np.float64), axis=1)
        squeezed = back / max(min(right, up), 1e-30)
        return float(np.arctan(np.tan(0.5 * min(self.size, np.pi)) * squeezed))

    @property
    def fade(self) -> tuple[float, float]:
        """Middle and half width of the rim, in 1 - cos of the angle to the axis."""
        rim = 1.0 - float(np.cos(0.5 * max(self.size, 1e-3)))
        half = 0.5 * rim * max(self.blend, 1e-4)
        return rim - half, half


@dataclass(frozen=True)
class Light:
    """One light in world space.

    kind: "sun", "point", "spot" or "area".
    vector: for a sun the unit direction towards it, for others their position [m].
    power: rgb; for a sun irradiance [W/m^2], for others radiant flux [W].
    angle: of a sun's disk [rad], 0 to pi; widens its shadows and highlights only.
    radius: of a point or spot [m].
    is_ball: with a radius it is a ball, not a disk that faces the lit point.
    cone: of a spot.
    panel: of an area light.
    casts_shadow: whether hair and meshes block it.
    name: as the artist sees it.
    is_from_world: it is a bright lobe of the world, and shines only where the world's light is
    used.
    map_roll: turn of its shadow maps about its rays [rad]. Samples of a soft light differ in it, so
    that edges of texels do not show in their mean.
    """

    kind: Literal["sun", "point", "spot", "area"]
    vector: Vector
    power: Color
    radius: float = 0.0
    is_ball: bool = False
    cone: Cone | None = None
    panel: Panel | None = None
    casts_shadow: bool = True
    name: str = field(default="", compare=False)
    is_from_world: bool = False
    angle: float = 0.0
    map_roll: float = 0.0

    @classmethod
    def sun(
        cls,
        shines_along: Sequence[float] | Floats,
        color: Sequence[float] | Floats,
        strength: float,
        angle: float = 0.0,
    ) -> Light:
        """A sun that shines along a direction, of Blender's strength [W/m^2] and angle [rad].

        Raises:
            HairloomError: the direction has no length.
        """
        along = np.asarray(shines_along, np.float64)
        length = float(np.linalg.norm(along))
        if not length > 0.0:
            raise HairloomError(
                "its direction has no length", place="sun light", remedy="Turn it to the hair"
            )
        power = triple(np.multiply(color, strength))
        return cls("sun", triple(-along / length), power, angle=angle)

    @classmethod
    def point(
        cls,
        position: Sequence[float] | Floats,
        color: Sequence[float] | Floats,
        power: float,
        radius: float = 0.0,
        is_ball: bool = False,
    ) -> Light:
        """A point light at a position [m], of Blender's power [W]."""
        rgb = triple(np.multiply(color, power))
        return cls("point", triple(position), rgb, radius, is_ball)

    @classmethod
    def spot(
        cls,
        position: Sequence[float] | Floats,
        color: Sequence[float] | Floats,
        power: float,
        cone: Cone,
        radius: float = 0.0,
        is_ball: bool = False,
    ) -> Light:
        """A spot at a position [m], of Blender's power [W]."""
        rgb = triple(np.multiply(color, power))
        return cls("spot", triple(position), rgb, radius, is_ball, cone)

    @classmethod
    def area(
        cls,
        position: Sequence[float] | Floats,
        color: Sequence[float] | Floats,
        power: float,
        panel: Panel,
    ) -> Light:
        """An area light around a position [m], of Blender's power [W]."""
        return cls("area", triple(position), triple(np.multiply(color, power)), panel=panel)

    @property
    def softening(self) -> tuple[float, float]:
        """What a radius adds to the squared distance, and the minimum of the sum [m^2]."""
        squared = self.radius * self.radius
        nearest = NEAREST_DISTANCE * NEAREST_DISTANCE
        return (0.0, max(squared, nearest)) if self.is_ball else (squared, nearest)


def kinds_needed(lights: Sequence[Light]) -> int:
    """LIGHT_KINDS of lib_lights.glsl: 0 suns alone, 1 points and spots too, 2 all kinds."""
    if any(light.kind == "area" for light in lights):
        return 2
    return int(any(light.kind != "sun" for light in lights))


def light_at(light: Light, points: Floats) -> tuple[Floats, Floats]:
    """Direction and irradiance of one light at points (..., 3), each (..., 3).

    Unit vectors towards the light (to a panel, the mean direction of its light), and rgb on a
    surface that faces it [W/m^2].
    """
    points = np.asarray(points)
    power = np.asarray(light.power, points.dtype)
    vector = np.asarray(light.vector, points.dtype)
    if light.kind == "sun":
        return np.broadcast_to(vector, points.shape), np.broadcast_to(power, points.shape)
    away = vector - points
    to_light = _unit(away)
    if light.panel is not None:
        arriving = vector_irradiance(light.panel, -away)
        strength = np.linalg.norm(arriving, axis=-1, keepdims=True)
        mean = (arriving / np.maximum(strength, 1e-30)).astype(points.dtype)
        return np.where(strength > 0.0, mean, to_light), power * strength.astype(points.dtype)
    added, least = light.softening
    squared = np.maximum(np.sum(away * away, axis=-1, keepdims=True) + added, least)
    evenly = power / (4.0 * np.pi * squared)
    if light.cone is None:
        return to_light, evenly
    width = np.minimum((added + least) / squared, 1.0)
    return to_light, evenly * _cone_fraction(light.cone, away, width)


def light_irradiance(light: Light, points: Floats) -> Floats:
    """The irradiance of `light_at` alone."""
    return light_at(light, points)[1]


def _cone_fraction(cone: Cone, away: Floats, width: Floats) -> Floats:
    """The fraction of light that a cone lets through, (..., 1); `away` points from places to the
    light.

    A light with a radius blurs the rim. The variances of the cone's smooth step and of the disk,
    seen at an angle whose squared sine is `width` (..., 1), add up (a disk's cross-section has 5 /
    4 the variance of a smooth step of its width). The disk's points also lie, on average, farther
    off the axis than its middle. The result is within 1 % of the maximum.
    """
    own = -away @ np.array(cone.axes, away.dtype).T
    x, y, ahead = own[..., :1], own[..., 1:2], -own[..., 2:]
    squared = np.maximum(np.sum(own * own, axis=-1, keepdims=True), 1e-30)
    length = np.sqrt(squared)
    aside = x * x + y * y
    # 1 - cos, exact also where the cosine is nearly 1
    off_axis = np.where(
        ahead > 0.0, aside / (length * (length + np.maximum(ahead, 0.0))), 1.0 - ahead / length
    )
    off_axis = off_axis + 0.25 * width * (1.0 - off_axis)
    middle, own_half = cone.fade
    half = np.sqrt(own_half * own_half + 1.25 * width * aside / squared)
    fraction = np.clip(0.5 * (middle + half - off_axis) / half, 0.0, 1.0)
    return fraction * fraction * (3.0 - 2.0 * fraction)


def _unit(away: Floats) -> Floats:
    return away / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-15)


def three_point_lights(view: Floats) -> tuple[Light, ...]:
    """A studio's key, fill and rim light as suns that are attached to the camera.

    Args:
        view: (4, 4) world to view space, a rigid motion.
    """
    to_world = np.linalg.inv(np.asarray(view, np.float64))[:3, :3]
    return tuple(
        Light.sun(-to_world @ np.array(towards), color, irradiance)
        for towards, color, irradiance in _STUDIO
    )


#: direction towards the light in view space (x right, y up, z to the eye), colour, [W/m^2]
_STUDIO = (
    ((0.55, 0.7, 0.6), (1.0, 0.96, 0.90), 3.8),
    ((-0.9, 0.1, 0.5), (0.80, 0.90, 1.0), 1.6),
    ((-0.5, 0.55, -0.9), (1.0, 0.97, 0.93), 2.4),
)


def brightest_lights(lights: Iterable[Light], place: Floats) -> tuple[Light, ...]:
    """The lights that are brightest at a place, (3,) [m], brightest first; LIGHT_CAPACITY at
    most."""
    at = np.asarray(place, np.float64)
    strengths = [(light, float(light_irradiance(light, at).sum())) for light in lights]
    in_order = sorted(strengths, key=lambda each: -each[1])
    return tuple(light for light, _ in in_order[:LIGHT_CAPACITY])


def packed_lights(lights: Sequence[Light]) -> list[Light]:
    """The lights that fit into the shaders' block: the first ones, so their order is
    `brightest_lights`'s."""
    return list(lights[:LIGHT_CAPACITY])


def pack_lights(
    lights: Sequence[Light], ambient: Sequence[float], harmonics: Floats | None = None
) -> Floats:
    """The block `Lights` of gpu_shaders/struct_lights.glsl in std140, (196,) float32."""
    kept = packed_lights(lights)
    block = np.zeros((1 + 5 * LIGHT_CAPACITY + HARMONIC_COUNT, 4), np.float32)
    block[0] = (*ambient, len(kept))
    of_lights = block[1:-HARMONIC_COUNT]
    for index, light in enumerate(kept):
        of_lights[index::LIGHT_CAPACITY] = _light_vectors(light)
    if harmonics is not None:
        block[-HARMONIC_COUNT:, :3] = harmonics
    return block.ravel()


def _light_vectors(light: Light) -> Floats:
    """One light's five vec4, see struct_lights.glsl."""
    lanes = np.zeros((5, 4))
    lanes[0, :3], lanes[1, :3] = light.vector, light.power
    shape: str = light.kind
    if light.panel is not None:
        panel = light.panel
        shape = "round grid" if panel.shape == "grid" and panel.is_round else panel.shape
        lanes[2:, :3] = panel.right, panel.up, panel.shines_along
        lanes[1:, 3] = panel.normalizer, *panel.half_sides, panel.tangent
    elif light.kind != "sun":
        lanes[1, 3], lanes[2, 3] = light.softening
    if light.cone is not None:
        lanes[2:, :3] = light.cone.axes
        lanes[3:, 3] = light.cone.fade
    lanes[0, 3] = _SHAPES.index(shape)
    return lanes
