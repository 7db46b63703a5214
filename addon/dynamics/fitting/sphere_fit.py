"""Approximating a mesh by a few balls that cover it well and hardly stick out.

Candidates are medial balls, which touch the surface from inside at two places or more. They are
found by shrinking (Ma, Bae and Choi 2012, "3D medial axis point approximation using nearest
neighbors and the normal field"): a ball tangent to a surface sample shrinks until it contains no
other part of the surface. All are then enlarged by the allowed overshoot.

Then the set is chosen that minimizes the gap, the mean over the surface of

    min_i max(0, |p - c_i| - r_i)^2,

by greedy choice, which is within 1 - 1/e of the optimum for such sums (Nemhauser, Wolsey and Fisher
1978). Finally each ball in turn is exchanged for a better one, if there is one.

Nothing is random: the same mesh gives the same balls.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...strands import Surface
from ...strands.closest_point import ClosestPointSearch
from ...strands.vectors import even_directions
from ..colliders.sphere_set import SphereSetCollider
from ..colliders.winding import winding_number
from .settings import SphereFitSettings
from .surface_samples import Boundary, SurfaceSamples, boundary_of, samples_of

#: Number of places on the mesh where the error is measured; on the balls up to twice as many.
_SAMPLE_COUNT = 6000


@dataclass(frozen=True)
class SphereError:
    """How well balls fit a mesh.

    gap: [m], how far the mesh lies outside of the balls, mean and max over the mesh.
    outside: [m], how far the surface of the balls lies outside of the mesh, mean and max over it.
    """

    gap_mean: float
    gap_max: float
    outside_mean: float
    outside_max: float


def measured_error(
    centers: Floats, radii: Floats, boundary: Boundary, search: ClosestPointSearch
) -> SphereError:
    """The error of balls that approximate a mesh.

    Args:
        centers, radii: (n, 3), (n,) [m], in the space of the boundary.
        search: of the boundary's closed surface.
    """
    balls = SphereSetCollider(centers, radii)
    samples = samples_of(boundary.mesh, _SAMPLE_COUNT).point.T.astype(np.float32)
    gap = np.maximum(balls.distance(samples)[0], 0.0)
    places = points_on_union(balls)
    outside = search.closest(places).distance
    outside[winding_number(places, boundary.surface) > 0.5] = 0.0
    return SphereError(
        float(gap.mean()), float(gap.max()), float(outside.mean()), float(outside.max(initial=0.0))
    )


def points_on_union(balls: SphereSetCollider) -> Floats:
    """Points (n, 3) spread evenly over the outer surface of a set of balls.

    Each ball gets points on a Fibonacci spiral in proportion to its area; points within another
    ball are removed.
    """
    area = balls.radii.astype(np.float64) ** 2
    places = []
    for center, radius, fraction in zip(balls.centers, balls.radii, area / area.sum(), strict=True):
        count = max(int(2 * _SAMPLE_COUNT * fraction), 16)
        places.append(center + float(radius) * even_directions(count))
    every = np.concatenate(places)
    distance, _ = balls.distance(every.T.astype(np.float32))
    result: Floats = every[distance > -1.0e-5 * float(balls.radii.max())]
    return result


#: Surface samples for each requested ball, and their minimum and maximum in all.
_SAMPLES, _MIN, _MAX = 40, 1200, 3000
#: Maximum number of shrinking steps.
_SHRINKS = 40
#: A ball that would shrink by less than this fraction has converged.
_MIN_SHRINK = 5.0e-3
#: Balls that differ by less than this fraction of the mesh's longest side are one candidate.
_MIN_DIFFERENCE = 0.006


@dataclass(frozen=True)
class SphereFit:
    """centers: (n, 3) float32 [m]. radii: (n,) float32 [m]. error: how well they fit."""

    centers: Floats
    radii: Floats
    error: SphereError


def fit_spheres(surface: Surface, settings: SphereFitSettings, *, place: str = "mesh") -> SphereFit:
    """Balls that approximate a mesh, in its space; fewer than requested if more would not help.

    Small holes, flipped faces and parts inside others do no harm.

    Args:
        place: names the mesh in messages.

    Raises:
        HairloomError: no faces, no size, no inside, or too thin for a ball.
    """
    boundary = boundary_of(surface, place)
    count = min(max(_SAMPLES * settings.sphere_count, _MIN), _MAX)
    samples = samples_of(boundary.mesh, count)
    search = ClosestPointSearch(boundary.surface)
    size = float(np.ptp(samples.point, axis=0).max())
    max_radius = float(np.ptp(boundary.surface.corners.reshape(-1, 3), axis=0).min()) / 2.0
    centers, radii = _distinct(
        *medial_balls(samples, boundary, search, max_radius), _MIN_DIFFERENCE * size
    )
    if not len(radii):
        raise HairloomError(
            "it is too thin to hold a ball", place=place, remedy="Choose a mesh with volume"
        )
    radii = radii + settings.overshoot * size
    gap = _gaps(samples.point, centers, radii)
    chosen = _exchanged(gap, _greedy(gap, settings.sphere_count))
    centers, radii = centers[chosen].astype(np.float32), radii[chosen].astype(np.float32)
    return SphereFit(centers, radii, measured_error(centers, radii, boundary, search))


def medial_balls(
    samples: SurfaceSamples, boundary: Boundary, search: ClosestPointSearch, max_radius: float
) -> tuple[Floats, Floats]:
    """Centers (n, 3) and radii (n,) of the largest ball inside that touches each sample.

    Args:
        search: of the boundary's surface.
        max_radius: [m], upper limit of the radii.
    """
    radius = _first_radii(samples, max_radius)
    point, inward = samples.point, -samples.normal
    active = np.arange(len(point))
    for _ in range(_SHRINKS):
        center = point[active] + inward[active] * radius[active, None]
        found = search.closest(center)
        displacement = found.point - point[active]
        smaller = _tangent_radius(displacement, inward[active], radius[active])
        shrinks = (found.distance < radius[active] * (1.0 - _MIN_SHRINK)) & (
            smaller < radius[active]
        )
        radius[active[shrinks]] = smaller[shrinks]
        active = active[shrinks]
        if not len(active):
            break
    center = point + inward * radius[:, None]
    radius = search.closest(center).distance  # not beyond the surface, even without convergence
    kept = (radius > 1.0e-6 * max_radius) & (winding_number(center, boundary.surface) > 0.5)
    return center[kept], radius[kept]


def _first_radii(samples: SurfaceSamples, max_radius: float) -> Floats:
    """Radii (n,) of tangent balls that contain no other sample: close to the final ones, and much
    faster than closest points."""
    max_radii = np.full(len(samples.point), max_radius)
    radius = max_radii.copy()
    for one, (point, normal) in enumerate(zip(samples.point, samples.normal, strict=True)):
        radius[one] = _tangent_radius(samples.point - point, -normal, max_radii).min()
    return radius


def _tangent_radius(displacement: Floats, inward: Floats, max_radius: Floats) -> Floats:
    """Radius (n,) of the ball that is tangent at a point, with its center in direction `inward`,
    (3,) or (n, 3), and passes through the point at `displacement` (n, 3) from there; `max_radius`
    (n,) if there is none."""
    along = (displacement * inward).sum(axis=1)
    squared = np.einsum("ij,ij->i", displacement, displacement)
    return np.divide(squared, 2.0 * along, out=max_radius.copy(), where=along > 0.0)


def _distinct(centers: Floats, radii: Floats, min_difference: float) -> tuple[Floats, Floats]:
    """Balls sorted by size, largest first, without those whose surface differs from an earlier
    one's by no more than `min_difference` [m] everywhere."""
    order = np.argsort(-radii, kind="stable")
    centers, radii = centers[order], radii[order]
    kept = np.ones(len(radii), bool)
    for one in range(len(radii)):
        if kept[one]:
            displacement = centers[one + 1 :] - centers[one]
            difference = (
                np.sqrt(np.einsum("ij,ij->i", displacement, displacement))
                + radii[one]
                - radii[one + 1 :]
            )
            kept[one + 1 :] &= difference > min_difference
    return centers[kept], radii[kept]


def _gaps(points: Floats, centers: Floats, radii: Floats) -> Floats:
    """Squared gap of every sample to every ball, (ball_count, sample_count) float32."""
    gap = np.empty((len(radii), len(points)), np.float32)
    for row, center, radius in zip(gap, centers, radii, strict=True):
        displacement = points - center
        distance = np.sqrt(np.einsum("ij,ij->i", displacement, displacement)) - radius
        row[:] = np.maximum(distance, 0.0) ** 2
    return gap


def _greedy(gap: Floats, count: int) -> list[int]:
    """Balls chosen one after the other, each with the smallest remaining gap."""
    chosen: list[int] = []
    left = np.full(gap.shape[1], np.inf, np.float32)
    for _ in range(min(count, len(gap))):
        total = np.minimum(gap, left).sum(axis=1)
        best = int(total.argmin())
        if chosen and total[best] >= left.sum():
            break  # the surface is covered
        chosen.append(best)
        left = np.minimum(left, gap[best])
    return chosen


def _exchanged(gap: Floats, chosen: list[int]) -> list[int]:
    """Each ball in turn exchanged for the best one in combination with the others."""
    for place, ball in enumerate(chosen):
        others = [other for other in chosen if other != ball]
        left = gap[others].min(axis=0) if others else np.inf
        total = np.minimum(gap, left).sum(axis=1)
        best = int(total.argmin())
        if total[best] < total[ball]:
            chosen[place] = best
    return chosen
