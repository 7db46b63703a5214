"""A mesh as a set of balls: few balls that cover it well and hardly stick out.

Candidates are medial balls, which touch the surface at two places or more from inside; they are
found by shrinking (Ma, Bae and Choi 2012, "3D medial axis point approximation using nearest
neighbors and the normal field"): a ball tangent to a surface sample gets smaller until it holds no
other part of the surface. All are then made larger by what may stick out.

Of these the set is chosen that leaves the least gap, the mean over the surface of

    min_i max(0, |p - c_i| - r_i)^2,

by greedy choice, which is within 1 - 1/e of the best for such sums (Nemhauser, Wolsey and Fisher
1978), then each ball in turn is exchanged for a better one, if there is one.

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
        places.append(center + float(radius) * even_directions(count))
    every = np.concatenate(places)
    distance, _ = balls.distance(every.T.astype(np.float32))
    result: Floats = every[distance > -1.0e-5 * float(balls.radii.max())]
    return result


#: Surface samples for each ball asked for, and the least and most in all.
_SAMPLES, _MIN, _MAX = 40, 1200, 3000
#: Steps at most until a ball no longer shrinks.
_SHRINKS = 40
#: A ball that shrinks by less than this fraction has found its place.
_SETTLED = 5.0e-3
#: Balls that differ by less than this fraction of the mesh's longest side are one candidate.
_ALIKE = 0.006


@dataclass(frozen=True)
class SphereFit:
    """centers: (n, 3) float32 [m]. radii: (n,) float32 [m]. error: how well they fit."""

    centers: Floats
    radii: Floats
    error: SphereError


def fit_spheres(surface: Surface, settings: SphereFitSettings, *, place: str = "mesh") -> SphereFit:
    """Balls that stand for a mesh, in its space; fewer than asked for where no more would help.

    Small holes, flipped faces and parts within others do no harm.

    Args:
        place: names the mesh in messages.

    Raises:
        HairloomError: no faces, no size, or no inside.
    """
    boundary = boundary_of(surface, place)
    count = min(max(_SAMPLES * settings.sphere_count, _MIN), _MAX)
    samples = samples_of(boundary.mesh, count)
    search = ClosestPointSearch(boundary.surface)
    size = float(np.ptp(samples.point, axis=0).max())
    widest = float(np.ptp(boundary.surface.corners.reshape(-1, 3), axis=0).min()) / 2.0
    centers, radii = _distinct(*medial_balls(samples, boundary, search, widest), _ALIKE * size)
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
    samples: SurfaceSamples, boundary: Boundary, search: ClosestPointSearch, widest: float
) -> tuple[Floats, Floats]:
    """Centers (n, 3) and radii (n,) of the largest ball inside that touches each sample.

    Args:
        search: of the boundary's surface.
        widest: [m], no ball is larger.
    """
    radius = _first_radii(samples, widest)
    point, inward = samples.point, -samples.normal
    going = np.arange(len(point))
    for _ in range(_SHRINKS):
        center = point[going] + inward[going] * radius[going, None]
        found = search.closest(center)
        displacement = found.point - point[going]
        smaller = _tangent_radius(displacement, inward[going], radius[going])
        shrinks = (found.distance < radius[going] * (1.0 - _SETTLED)) & (smaller < radius[going])
        radius[going[shrinks]] = smaller[shrinks]
        going = going[shrinks]
        if not len(going):
            break
    center = point + inward * radius[:, None]
    radius = search.closest(center).distance  # never beyond the surface, whatever was left to do
    kept = (radius > 1.0e-6 * widest) & (winding_number(center, boundary.surface) > 0.5)
    return center[kept], radius[kept]


def _first_radii(samples: SurfaceSamples, widest: float) -> Floats:
    """Radii (n,) of the tangent balls that hold no other sample: nearly those that are looked for,
    and much sooner found than by closest points."""
    most = np.full(len(samples.point), widest)
    radius = most.copy()
    for one, (point, normal) in enumerate(zip(samples.point, samples.normal, strict=True)):
        radius[one] = _tangent_radius(samples.point - point, -normal, most).min()
    return radius


def _tangent_radius(displacement: Floats, inward: Floats, widest: Floats) -> Floats:
    """Radius (n,) of the ball that touches a place, with its center inwards (3,) or (n, 3), and
    goes through another one, `displacement` (n, 3) from there; `widest` (n,) where none does."""
    along = (displacement * inward).sum(axis=1)
    squared = np.einsum("ij,ij->i", displacement, displacement)
    return np.divide(squared, 2.0 * along, out=widest.copy(), where=along > 0.0)


def _distinct(centers: Floats, radii: Floats, alike: float) -> tuple[Floats, Floats]:
    """Balls, large ones first, without those that differ from an earlier one by less than `alike`
    [m] everywhere."""
    order = np.argsort(-radii, kind="stable")
    centers, radii = centers[order], radii[order]
    kept = np.ones(len(radii), bool)
    for one in range(len(radii)):
        if kept[one]:
            displacement = centers[one + 1 :] - centers[one]
            apart = (
                np.sqrt(np.einsum("ij,ij->i", displacement, displacement))
                + radii[one]
                - radii[one + 1 :]
            )
            kept[one + 1 :] &= apart > alike
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
    """The balls that leave the least gap, one after the other."""
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
    """Each ball in turn exchanged for the best one beside the others."""
    for place, ball in enumerate(chosen):
        others = [other for other in chosen if other != ball]
        left = gap[others].min(axis=0) if others else np.inf
        total = np.minimum(gap, left).sum(axis=1)
        best = int(total.argmin())
        if total[best] < total[ball]:
            chosen[place] = best
    return chosen
