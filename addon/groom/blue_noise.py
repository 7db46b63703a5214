"""Roots spread over a surface as blue noise, in an order of which every prefix is spread as well.

Darts are thrown at the surface in levels. A dart stays as a root if no root so far is nearer than
the level's radius (dart throwing: Cook 1986, ACM Trans. Graph. 5, 51); the radius shrinks from
level to level, so that the roots fill up evenly at any count (McCool and Fiume 1992, Hierarchical
Poisson disk sampling distributions). Where hair is to grow half as densely the radius is longer by
the root of two. Darts, levels and batches do not depend on the number of roots that is requested.

Each triangle gets its own darts, from its own random numbers. So a triangle that is split, added or
removed changes only the roots around it, and rounding, which differs with the size of a scene,
changes hardly any. Otherwise each of these would give another groom.

Limitation: distances are straight, not along the surface, so two sheets that are nearer to each
other than their roots share the space for roots.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints, number_in_piece
from ..errors import HairloomError
from ..strands.parallel import even_slices, parallel_map
from .counter_random import key_of, uniform
from .dart_throwing import SampleCells, Samples, accepted_samples
from .triangle_subdivision import Pieces

#: Roots of the first level, and the factor by which each level has more than the one before.
_FIRST_COUNT, _GROWTH = 8.0, 2.0**0.5
#: Random darts fill a plane when there are this many x area / radius^2 of them: disks of half the
#: radius then cover 0.547 of the area (Feder 1980), and 0.547 x 4 / pi is this.
_PACKING = 0.697
#: Darts of a level for each root that it is to have, and the number of batches they come in.
_SAMPLES, _BATCHES = 3.0, 3
#: The surface is full if a level gets less than this fraction of its roots, and is to have at least
#: this many, so that it is not chance.
_FULL, _FIRST_SURE = 0.02, 500.0
#: Densities below this fraction of the highest one count as this, which limits distances.
_MIN_DENSITY = 2.0**-12
#: A thread gets at least about this many darts.
_MIN_SAMPLES_PER_THREAD = 4096
#: Plain random roots drawn at once when the surface is full.
_PLAIN = 65_536


def spread_roots(pieces: Pieces, count: int, seed: int, whole: Pieces | None = None) -> Samples:
    """Roots spread by area x density over pieces of a surface, `count` of them.

    The roots of a smaller count are exactly the first ones of a larger count, for the same seed.

    Args:
        whole: the surface that `pieces` are a part of; None: they are all of it.

    Raises:
        HairloomError: there is no area on which hair may grow.
    """
    target = _Target.of(pieces, pieces if whole is None else whole)
    roots, level = Samples.none(), 0
    is_full = False
    while len(roots) < count and not is_full:
        roots, is_full = _filled(target, roots, level, seed, count)
        level += 1
    batch = 0
    while len(roots) < count:
        plain = target.samples(_PLAIN / target.part, key_of(seed, 1, 0, batch))
        roots = roots.concatenated(_shuffled(plain))
        batch += 1
    return roots.take(np.arange(count))


def require_area(mass: Floats) -> None:
    """Refuse to scatter roots over nothing.

    Args:
        mass: area x density of each part [m^2], of any shape.

    Raises:
        HairloomError: it is 0 everywhere.
    """
    if not mass.sum() > 0.0:
        raise HairloomError(
            "there is no area on which hair may grow",
            place="head",
            remedy="Choose a mesh with faces, and a density above 0 on some of them",
        )


@dataclass(frozen=True)
class _Target:
    """corners: (piece_count, 3, 3) float64 [m], from the middle of the pieces.
    density: (piece_count, 3) at the corners, scaled to a maximum of 1 on the whole surface.
    mass: (piece_count,) area x density [m^2].
    part: the fraction of the whole surface's mass that the pieces have.
    key: (piece_count,) keys of their random numbers.
    """

    corners: Floats
    density: Floats
    mass: Floats
    part: float
    key: Ints

    @classmethod
    def of(cls, pieces: Pieces, whole: Pieces) -> _Target:
        peak = max(float(whole.density.max(initial=0.0)), 1e-300)
        mass = pieces.mass / peak
        require_area(mass)
        used = pieces.point[mass > 0.0]
        middle = (used.min(axis=(0, 1)) + used.max(axis=(0, 1))) / 2.0
        part = float(mass.sum() / (whole.mass.sum() / peak))
        return cls(pieces.point - middle, pieces.density / peak, mass, min(part, 1.0), pieces.key)

    @property
    def whole_mass(self) -> float:
        """The mass of the whole surface [m^2], hardly changed by the choice of pieces."""
        return float(self.mass.sum()) / self.part

    def samples(self, count: float, stream: Ints) -> Samples:
        """Random points by area x density, `count` on the whole surface, in the pieces' order.

        A density that is linear between corners is a sum of three, each of which falls from a
        corner to 0. The barycentric coordinates of a random point of one of these are the spacings
        of three random cuts, two spacings joined (Devroye 1986, chapter V.2: Dirichlet with 2, 1,
        1).
        """
        least = int(_MIN_SAMPLES_PER_THREAD * len(self.mass) / max(count * self.part, 1.0)) + 1
        parts = even_slices(len(self.mass), least)
        found = parallel_map(lambda some: self._samples(count, stream, some), parts)
        return functools.reduce(Samples.concatenated, found)

    def _samples(self, count: float, stream: Ints, some: slice) -> Samples:
        """`samples` on some of the pieces."""
        piece_key = key_of(self.key[some], stream)
        wanted = self.mass[some] * (count / self.whole_mass)
        counts = np.floor(wanted + uniform(piece_key, 0)).astype(np.int64)
        piece = np.repeat(np.arange(len(counts)), counts)
        number = number_in_piece(counts)
        key = key_of(piece_key[piece], 1 + number)
        piece += some.start
        density = self.density.take(piece, axis=0)
        reached = np.cumsum(density, axis=1)
        corner = (uniform(key, 0)[:, None] * reached[:, 2:] >= reached[:, :2]).sum(axis=1)
        one, two, three = (uniform(key, cut) for cut in (1, 2, 3))
        low, high = np.minimum(one, two), np.maximum(one, two)
        middle, last_cut = np.maximum(low, np.minimum(high, three)), np.maximum(high, three)
        rows, barycentric = np.arange(len(piece)), np.empty((len(piece), 3))
        barycentric[rows, corner] = middle
        barycentric[rows, (corner + 1) % 3] = last_cut - middle
        barycentric[rows, (corner + 2) % 3] = 1.0 - last_cut
        point = np.einsum("nk,nkj->nj", barycentric, self.corners.take(piece, axis=0))
        reach = np.maximum(np.einsum("nk,nk->n", barycentric, density), _MIN_DENSITY) ** -0.5
        return Samples(piece, barycentric, point, reach, key)


def _shuffled(samples: Samples) -> Samples:
    """Samples in random order, which depends on the key of each alone."""
    return samples.take(np.argsort(uniform(samples.key, 4)))


def _filled(
    target: _Target, roots: Samples, level: int, seed: int, count: int
) -> tuple[Samples, bool]:
    """The roots with those of one more level, until there are `count`; and whether the surface is
    full."""
    wanted = _FIRST_COUNT * _GROWTH**level
    radius = float(np.sqrt(_PACKING * target.whole_mass / wanted))
    before = len(roots)
    old = SampleCells(roots, radius)
    for batch in range(_BATCHES):
        if len(roots) >= count:
            return roots, False
        dart_count = _SAMPLES * wanted / _BATCHES
        samples = target.samples(dart_count, key_of(seed, 0, level, batch))
        samples = samples.take(~old.covers(samples))
        new = SampleCells(roots.take(np.arange(before, len(roots))), radius)
        samples = _shuffled(samples.take(~new.covers(samples)))
        roots = roots.concatenated(samples.take(accepted_samples(samples, radius)))
    here = wanted * target.part
    return roots, here >= _FIRST_SURE and len(roots) - before < _FULL * here
