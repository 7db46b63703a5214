"""How well a set of balls stands for a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats
from ...strands.closest_point import ClosestPointSearch
from ..colliders.sphere_set import SphereSetCollider
from ..colliders.winding import winding_number
from .surface_samples import Boundary, samples_of

#: Places on the mesh, and on the balls, at which the error is measured.
_PLACES = 6000


@dataclass(frozen=True)
class SphereError:
    """gap: [m], how far the mesh lies outside of the balls, mean and max over the mesh.
    outside: [m], how far the balls' own surface lies outside of the mesh, mean and max over it.
    """

    gap_mean: float
    gap_max: float
    outside_mean: float
    outside_max: float


def measured_error(
    centers: Floats, radii: Floats, boundary: Boundary, search: ClosestPointSearch
) -> SphereError:
    """Args:
    centers, radii: (n, 3), (n,) [m], in the space of the boundary.
    search: of the boundary's closed surface.
    """
    balls = SphereSetCollider(centers, radii)
    samples = samples_of(boundary.mesh, _PLACES).point.T.astype(np.float32)
    gap = np.maximum(balls.distance(samples)[0], 0.0)
    places = union_places(balls)
    outside = search.closest(places).distance
    outside[winding_number(places, boundary.surface) > 0.5] = 0.0
    return SphereError(
        float(gap.mean()), float(gap.max()), float(outside.mean()), float(outside.max(initial=0.0))
    )


def union_places(balls: SphereSetCollider) -> Floats:
    """Points (n, 3) spread evenly over the outside of a set of balls.

    Each ball has its share by area on a spiral (Fibonacci), without those within another ball.
    """
    area = balls.radii.astype(np.float64) ** 2
    places = []
    for center, radius, fraction in zip(balls.centers, balls.radii, area / area.sum(), strict=True):
        count = max(int(2 * _PLACES * fraction), 16)
        up = 1.0 - (2.0 * np.arange(count) + 1.0) / count
        turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
        across = np.sqrt(1.0 - up * up)
        sphere = np.stack([across * np.cos(turn), across * np.sin(turn), up], axis=1)
        places.append(center + float(radius) * sphere)
    every = np.concatenate(places)
    distance, _ = balls.distance(every.T.astype(np.float32))
    result: Floats = every[distance > -1.0e-5 * float(balls.radii.max())]
    return result
