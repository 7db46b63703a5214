"""Area lights: the light from a luminous panel, as one direction and one strength.

A panel shines from one side, with the same radiance P / (pi A) from every point. What arrives at a
point is the vector irradiance (Gershun 1939): the sum of all light times its direction. A matt
surface that sees the whole panel receives exactly the component of this vector along its normal. A
strand is lit from all around and receives more, since the light comes from many directions: 1 %
before a square twice its width away, 4 % at its width, 11 % at half and 23 % at a quarter of it. A
surface whose horizon cuts the panel receives more as well.

- A rectangle in closed form: Lambert 1760; Arvo 1995, "Applications of Irradiance Tensors".
- A disk in closed form: the contour integral of Lambert's formula around a circle.
- Ellipses, and panels of narrow spread, by a Gauss rule of 6 x 6 over the solid angle in which
  light arrives, within 1 % (2 % a tenth of the size from the rim). The panel is divided into rows
  by angle and each row by the sine: equal steps are equal solid angles (Archimedes' cylinder).
Spread as in Cycles: slats before the panel let (tan h - tan theta) / (tan h - h) of the light
through, with h half of the spread. The sides of a sheared object are taken as perpendicular.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats

type Vector = tuple[float, float, float]

#: squared half diagonal over squared distance below which a panel is computed as four points (less
#: for a narrow spread); in lib_lights
FAR_RATIO = 2.5e-3
#: points nearer to a panel's plane than this count as behind it [m]; in lib_lights
MIN_HEIGHT = 1.0e-9
#: minimum length of a side [m], and as a fraction of the other side
MIN_SIDE, MIN_ASPECT = 1.0e-7, 1.0e-3
#: minimum spread [rad]
MIN_SPREAD = float(np.radians(1.0))
#: tangent for a spread of a half turn
MAX_SPREAD_TANGENT = 1.0e8

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)


@dataclass(frozen=True)
class Panel:
    """The shining side of an area light around its middle, in world space.

    right, up, shines_along: unit vectors, perpendicular to each other.
    half_width, half_height: [m], along right and up; of an ellipse its half axes.
    spread: full angle [rad], up to pi, into which it shines.
    """

    right: Vector
    up: Vector
    shines_along: Vector
    half_width: float
    half_height: float
    is_round: bool = False
    spread: float = float(np.pi)

    @property
    def half_sides(self) -> tuple[float, float]:
        """Half width and half height [m], both above 0."""
        min_side = max(MIN_SIDE, MIN_ASPECT * max(self.half_width, self.half_height))
        return max(self.half_width, min_side), max(self.half_height, min_side)

    @property
    def has_full_spread(self) -> bool:
        return self.spread > np.pi - 1e-4

    @property
    def tangent(self) -> float:
        """Tangent of half of the spread."""
        if self.has_full_spread:
            return MAX_SPREAD_TANGENT
        return float(np.tan(0.5 * max(self.spread, MIN_SPREAD)))

    @property
    def normalizer(self) -> float:
        """Factor on the light that the slats let through, which keeps the panel's power."""
        return 1.0 / (self.tangent - float(np.arctan(self.tangent)))

    @property
    def quarter_position(self) -> float:
        """Where the four points that replace a far panel lie, as a fraction of its half sides."""
        return 0.5 if self.is_round else float(np.sqrt(1.0 / 3.0))

    @property
    def shape(self) -> str:
        """How it is computed: "rectangle" or "disk" in closed form, else "grid"."""
        width, height = self.half_sides
        if not self.has_full_spread or (self.is_round and abs(width - height) > 1e-6 * width):
            return "grid"
        return "disk" if self.is_round else "rectangle"


def vector_irradiance(panel: Panel, offsets: Floats) -> Floats:
    """The vector irradiance of one watt, (..., 3) [1/m^2], towards the panel; 0 behind it.

    Args:
        offsets: (..., 3) from the panel's middle [m], world space.
    """
    axes = np.array([panel.right, panel.up, panel.shines_along])
    x, y, height = np.moveaxis(np.asarray(offsets, np.float64) @ axes.T, -1, 0)
    is_before = height > MIN_HEIGHT
    height = np.where(is_before, height, 1.0)
    compute = {"rectangle": _rectangle, "disk": _disk, "grid": _grid}[panel.shape]
    found = compute(panel, x, y, height)
    squared = x * x + y * y + height * height
    width, depth = panel.half_sides
    far = FAR_RATIO * min(1.0, panel.tangent * panel.tangent)
    is_far = width * width + depth * depth < far * squared
    if panel.shape != "disk":
        found = np.where(is_far[..., None], _four_points(panel, x, y, height), found)
    return np.where(is_before[..., None], found, 0.0) @ axes


def _four_points(panel: Panel, x: Floats, y: Floats, height: Floats) -> Floats:
    """Vector irradiance of a panel so far away that the closed forms would lose their precision.

    Each of four points shines with a quarter of the power, P cos(theta) / (pi d^2); their variance
    along each axis is the panel's.
    """
    total = np.zeros((*x.shape, 3))
    a, b = np.array(panel.half_sides) * panel.quarter_position
    for u, v in ((-a - x, -b - y), (a - x, -b - y), (-a - x, b - y), (a - x, b - y)):
        squared = u * u + v * v + height * height
        shade = _slat_transmittance(panel, np.hypot(u, v) / height)
        strength = height * shade / (4.0 * np.pi * squared * squared)
        total += strength[..., None] * np.stack([u, v, -height], axis=-1)
    return total


def _rectangle(panel: Panel, x: Floats, y: Floats, height: Floats) -> Floats:
    """Half the sum, over the edges, of the angle that each subtends times the normal of its
    plane."""
    a, b = panel.half_sides
    left, right, bottom, top = -a - x, a - x, -b - y, b - y

    def edge(across: Floats, start: Floats, end: Floats) -> Floats:
        """The angle that an edge subtends from start to end, over the distance of its line."""
        distance = np.hypot(height, across)
        angle = np.arctan2((end - start) * distance, distance * distance + start * end)
        return angle / distance

    at_left, at_right = edge(left, bottom, top), edge(right, bottom, top)
    at_bottom, at_top = edge(bottom, left, right), edge(top, left, right)
    total = np.stack(
        [
            height * (at_left - at_right),
            height * (at_bottom - at_top),
            left * at_left - right * at_right + bottom * at_bottom - top * at_top,
        ],
        axis=-1,
    )
    return total / (8.0 * np.pi * a * b)


def _disk(panel: Panel, x: Floats, y: Floats, height: Floats) -> Floats:
    """By the distances to the rim's nearest and farthest points; p is the distance to the axis."""
    radius = panel.half_sides[0]
    p = np.hypot(x, y)
    product = np.hypot(height, p - radius) * np.hypot(height, p + radius)
    total = radius * radius + p * p + height * height + product
    rest = radius * radius + height * height - p * p
    # product + rest: both forms are equal but for rounding
    facing = np.where(
        rest > 0.0, product + rest, 4.0 * (p * height) ** 2 / (product + np.abs(rest))
    )
    scale = 1.0 / (np.pi * total * product)
    sideways = -2.0 * height * scale
    return np.stack([sideways * x, sideways * y, -facing * scale], axis=-1)


def _grid(panel: Panel, x: Floats, y: Floats, height: Floats) -> Floats:
    """Row by row over the part of the panel that shines to the point within its spread."""
    a, b = panel.half_sides
    reach = height * panel.tangent
    first = np.arctan(np.maximum(-b - y, -reach) / height)
    last = np.arctan(np.minimum(b - y, reach) / height)
    half = np.maximum(0.5 * (last - first), 0.0)
    total = np.zeros((*x.shape, 3))
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        v = height * np.tan(0.5 * (first + last) + half * node)
        distance = np.hypot(height, v)
        chord = a * np.sqrt(np.maximum(1.0 - ((v + y) / b) ** 2, 0.0)) if panel.is_round else a
        cone = np.sqrt(np.maximum(reach * reach - v * v, 0.0))
        low, high = np.maximum(-chord - x, -cone), np.minimum(chord - x, cone)
        total += (weight * half)[..., None] * _row(panel, height, v, distance, low, high)
    return total / (np.pi * 4.0 * a * b * (np.pi / 4.0 if panel.is_round else 1.0))


def _row(
    panel: Panel, height: Floats, v: Floats, distance: Floats, low: Floats, high: Floats
) -> Floats:
    """The light of one row, from low to high, integrated over the sine of the angle at the
    point."""
    first, last = low / np.hypot(distance, low), high / np.hypot(distance, high)
    half = np.maximum(0.5 * (last - first), 0.0)
    total = np.zeros((*v.shape, 3))
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        sine = 0.5 * (first + last) + half * node
        cosine = np.sqrt(np.maximum(1.0 - sine * sine, 1e-12))
        u = distance * sine / cosine
        fraction = weight * half * _slat_transmittance(panel, np.hypot(u, v) / height)
        direction = np.stack([sine, v / distance * cosine, -height / distance * cosine], axis=-1)
        total += fraction[..., None] * direction
    return total


def _slat_transmittance(panel: Panel, tangent: Floats) -> Floats:
    """What the slats let through, normalised, by the tangent of the angle to the panel's axis."""
    return np.maximum(panel.tangent - tangent, 0.0) * panel.normalizer
