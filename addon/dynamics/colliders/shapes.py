"""Analytic colliders: balls and capsules.

Each is a `colliders.Collider` in its own object space. A mesh is a `distance_field.DistanceField`,
a union of balls a `sphere_set.SphereSetCollider`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats, Ints
from ...errors import HairloomError

#: Lengths below this count as zero [m].
TINY = np.float32(1.0e-9)


@dataclass(frozen=True)
class SphereCollider:
    """A ball. center: (3,) float32 object space [m]. radius: [m].

    Raises:
        HairloomError: a place that is not finite, or a radius that is not above zero.
    """

    center: Floats
    radius: float

    def __post_init__(self) -> None:
        _set_place(self, "center")
        if not is_solid(self.radius, self.center):
            raise HairloomError(
                f"a ball at {self.center} with radius {self.radius} has no volume",
                place="sphere collider",
                remedy="Give it a finite place and a radius above zero",
            )

    @property
    def bounds(self) -> tuple[Floats, float]:
        return self.center, float(self.radius)

    @property
    def curve_radius(self) -> float:
        return float(self.radius)

    def near(self, points: Floats, reach: Floats | float) -> Ints:
        return np.arange(points.shape[1])

    def distance(self, points: Floats) -> tuple[Floats, Floats]:
        return distance_from(points - self.center[:, None], self.radius)


@dataclass(frozen=True)
class CapsuleCollider:
    """A rod with round ends; a ball if both ends coincide.

    start, end: (3,) float32 object space [m], centers of the two round ends. radius: [m].

    Raises:
        HairloomError: an end that is not finite, or a radius that is not above zero.
    """

    start: Floats
    end: Floats
    radius: float

    def __post_init__(self) -> None:
        _set_place(self, "start")
        _set_place(self, "end")
        if not is_solid(self.radius, np.stack([self.start, self.end])):
            raise HairloomError(
                f"a capsule from {self.start} to {self.end} with radius {self.radius} "
                "has no volume",
                place="capsule collider",
                remedy="Give it finite ends and a radius above zero",
            )

    @property
    def bounds(self) -> tuple[Floats, float]:
        half = (self.end - self.start) / np.float32(2.0)
        return self.start + half, float(np.linalg.norm(half)) + float(self.radius)

    @property
    def curve_radius(self) -> float:
        return float(self.radius)

    def near(self, points: Floats, reach: Floats | float) -> Ints:
        return np.arange(points.shape[1])

    def distance(self, points: Floats) -> tuple[Floats, Floats]:
        """From the closest point of the axis, at its fraction 0 (start) to 1 (end)."""
        axis = self.end - self.start
        length_squared = np.maximum((axis * axis).sum(), TINY * TINY)
        outward = points - self.start[:, None]
        fraction = outward[0] * axis[0] + outward[1] * axis[1] + outward[2] * axis[2]
        fraction = np.clip(fraction / length_squared, np.float32(0.0), np.float32(1.0))
        outward -= axis[:, None] * fraction
        return distance_from(outward, self.radius)


def distance_from(outward: Floats, radius: Floats | float) -> tuple[Floats, Floats]:
    """Signed distance (n,) and its gradient (3, n) of a round solid.

    Args:
        outward: (3, n) [m], from the closest point of the solid's axis, or its center.
        radius: [m], one or (n,).
    """
    length = np.sqrt(outward[0] ** 2 + outward[1] ** 2 + outward[2] ** 2)
    gradient = outward / np.maximum(length, TINY)
    gradient[2, length < TINY] = 1.0  # on the axis, all directions are equivalent
    return length - np.asarray(radius, np.float32), gradient


def is_solid(radius: Floats | float, places: Floats) -> bool:
    """Whether all radii are finite and above zero, and all places finite."""
    values = np.asarray(radius)
    return bool(np.isfinite(places).all() and (values > 0.0).all() and np.isfinite(values).all())


def _set_place(solid: SphereCollider | CapsuleCollider, name: str) -> None:
    """Make a field of a frozen solid a (3,) float32 array."""
    place = np.asarray(getattr(solid, name), np.float32)
    if place.shape != (3,):
        raise HairloomError(
            f"its {name} has shape {place.shape} instead of (3,)",
            place="collider",
            remedy="Give three coordinates",
        )
    object.__setattr__(solid, name, place)
