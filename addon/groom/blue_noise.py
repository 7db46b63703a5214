"""Roots spread over a surface like blue noise, so that every beginning of them is spread as well.

Darts are thrown at the surface in levels. A dart stays as a root if no root so far is nearer than
the level's radius (dart throwing: Cook 1986, ACM Trans. Graph. 5, 51); the radius shrinks from
level to level, so that the roots fill up evenly at any count (McCool and Fiume 1992, Hierarchical
Poisson disk sampling distributions). Where hair is to grow half as densely the radius is longer by
the root of two. Darts, levels and batches never depend on how many roots are asked for.

Limitations: distances are straight ones, not along the surface, so two sheets nearer to each other
than their roots share the room.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..errors import HairloomError
from ..strands import Surface
from .dart_throwing import SampleCells, Samples, first_come
from .grown import checked_weights

#: Roots of the first level; each level is to have more by the next factor.
_FIRST_COUNT, _GROWTH = 8.0, 2.0**0.5
#: Disks of random darts fill a plane when area / radius^2 x this many lie on it: 0.547 of the area
#: is covered by those of half the radius (Feder 1980), 0.547 x 4 / pi.
_PACKING = 0.697
#: Darts of a level as a factor of the roots it is to have, and the batches they come in.
_SAMPLES, _BATCHES = 3.0, 3
#: A level that gets less than this part of its roots shows that the surface is full, unless it is
#: one of the first, where chance could show the same.
_FULL, _FIRST_SURE = 0.02, 500.0
#: Where hair grows more thinly than this part of the densest place, distances grow no more.
_THINNEST = 2.0**-12
#: Plain roots drawn at once where the surface is full.
_PLAIN = 65_536


def spread_roots(
    surface: Surface, count: int, density: Floats | None, seed: int
) -> tuple[Ints, Floats]:
    """Roots spread by area x density: triangle (count,) and barycentric (count, 3).

    The roots of a smaller count are exactly the first ones of a larger count, for the same seed.

    Args:
        density: (vertex_count,), not negative, linear within a triangle; None: 1 everywhere.

    Raises:
        HairloomError: the surface has no area on which hair may grow, or a density that does not
            fit it or is not finite.
    """
    target = _Target.of(surface, checked_weights(density, surface, "density"))
    roots, level = Samples.none(), 0
    is_full = False
    while len(roots) < count and not is_full:
        roots, is_full = _filled(target, roots, level, seed, count)
        level += 1
    batch = 0
    while len(roots) < count:
        roots = roots.and_also(target.samples(_PLAIN, [seed, 1, batch]))
        batch += 1
    return roots.triangle[:count], roots.barycentric[:count]


def require_area(mass: Floats) -> None:
    """Raise if there is no area x density in this mass of any parts."""
    if not mass.sum() > 0.0:
        raise HairloomError(
            "there is no area on which hair may grow",
            place="head",
            remedy="Choose a mesh with faces, and a density above 0 on some of them",
        )


@dataclass(frozen=True)
class _Target:
    """corners: (triangle_count, 3, 3) float64 [m], from the middle of the surface.
    density: (triangle_count, 3) at the corners, 1 at the most.
    reached: (3 x triangle_count,) mass of each corner's share, added up [m^2].
    """

    corners: Floats
    density: Floats
    reached: Floats

    @classmethod
    def of(cls, surface: Surface, density: Floats | None) -> _Target:
        corners = surface.corners.astype(np.float64)
        weights = np.ones(len(surface.positions)) if density is None else density
        on_corner = weights[surface.triangles] / max(float(weights.max(initial=0.0)), 1e-300)
        edge = corners[:, 1:] - corners[:, :1]
        area = 0.5 * np.linalg.norm(np.cross(edge[:, 0], edge[:, 1]), axis=1)
        mass = area[:, None] / 3.0 * on_corner
        require_area(mass)
        used = corners[mass.sum(axis=1) > 0.0]
        middle = (used.min(axis=(0, 1)) + used.max(axis=(0, 1))) / 2.0
        return cls(corners - middle, on_corner, np.cumsum(mass))

    @property
    def mass(self) -> float:
        return float(self.reached[-1])

    def samples(self, count: int, stream: list[int]) -> Samples:
        """Random points by area x density.

        A density linear between corners is the sum of three that fall from 1 at a corner to 0;
        points of such a one are spacings of three random cuts, two of them joined
        (Devroye 1986, chapter V.2: Dirichlet with 2, 1, 1).
        """
        random = np.random.default_rng(stream)
        last = np.searchsorted(self.reached, self.mass)  # the last share that is not empty
        fraction = np.searchsorted(self.reached, random.random(count) * self.mass, side="right")
        triangle, corner = np.divmod(np.minimum(fraction, last), 3)
        _, middle, last_cut = np.sort(random.random((count, 3)), axis=1).T
        rows, barycentric = np.arange(count), np.empty((count, 3))
        barycentric[rows, corner] = middle
        barycentric[rows, (corner + 1) % 3] = last_cut - middle
        barycentric[rows, (corner + 2) % 3] = 1.0 - last_cut
        point = np.einsum("nk,nkj->nj", barycentric, self.corners[triangle])
        density = np.einsum("nk,nk->n", barycentric, self.density[triangle])
        return Samples(triangle, barycentric, point, np.maximum(density, _THINNEST) ** -0.5)


def _filled(
    target: _Target, roots: Samples, level: int, seed: int, count: int
) -> tuple[Samples, bool]:
    """The roots and those of one more level, until there are `count`; and whether it is full."""
    wanted = _FIRST_COUNT * _GROWTH**level
    radius = float(np.sqrt(_PACKING * target.mass / wanted))
    dart_count = int(np.ceil(_SAMPLES * wanted / _BATCHES))
    before = len(roots)
    old = SampleCells(roots, radius)
    for batch in range(_BATCHES):
        if len(roots) >= count:
            return roots, False
        samples = target.samples(dart_count, [seed, 0, level, batch])
        samples = samples.take(~old.covers(samples))
        new = SampleCells(roots.take(np.arange(before, len(roots))), radius)
        samples = samples.take(~new.covers(samples))
        roots = roots.and_also(samples.take(first_come(samples, radius)))
    return roots, wanted >= _FIRST_SURE and len(roots) - before < _FULL * wanted
