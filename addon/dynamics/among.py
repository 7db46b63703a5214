"""Hair among hair: a grid of density and velocity around all guides of a groom.

    every KICKS_PER_SECOND, before a substep:
        deposit    each CV into the cell where it is: the strands that it stands for, and their motion
        look up    at each CV, of all others: density, its gradient, mean motion
        kick       pressure    from where it is denser than it was at rest, to where it is less dense
                   cohesion    back to the others, where it is less dense than it was at rest
                   friction    towards the mean motion

Volumetric forces after Petrovic, Henne and Anderson 2005, "Volumetric Methods for Simulation and
Rendering of Hair". Differences: density is compared with that of the same CV at rest, so that no
style is inflated; and the grid goes with the groom and turns with it, so that hair at rest stays in
its cells however the head moves.

A cell sums whole numbers, so its sums depend on no order. The grid wraps around: hair may be
anywhere, and places that are a whole grid apart share their cells. It is as large as the groom at
rest, so at rest none do.

`reference/among.py` holds the same, one CV after the other; gpu_shaders/among_*.glsl are its twins.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from ..arrays import Floats, Ints
from .settings import DynamicsSettings

#: How often hair feels other hair, nearly: a whole number of substeps apart [1/s].
KICKS_PER_SECOND = 90.0
#: The whole numbers of a cell: what a CV of a mean guide weighs, at most; a cell of motion in a
#: substep, and how many cells count.
MASS, HEAVIEST, MOTION, FASTEST = 16, 127, 1024, 4
#: A cell is as wide as it takes for a CV to have this many others in its own at rest, between these
#: fractions of the hair's length. The grid has at most so many cells to a side.
CROWD, FINEST, COARSEST, SIDE = 6, 1.0 / 40.0, 1.0 / 8.0, 64
#: Where a grid begins, in cells: nothing that is symmetric lies on the border of cells.
BEGIN = np.array([0.37, 0.41, 0.43])
#: Densities that differ by less than this part count as equal: CVs go from cell to cell one by one.
SLACK = 0.15
#: At full volume: how far pressure and cohesion move a CV in the time between two kicks, where the
#: density is twice what it was or nothing, in squared cells times the gradient of its logarithm;
#: how far at most [cells]; and the rate at which friction takes differences of speed [1/s].
PUSH, PULL, FARTHEST, RUBBING = 0.3, 0.06, 0.25, 8.0
#: What divides nothing [cells' worth of hair].
TINY = 1.0e-6


@dataclass(frozen=True, eq=False)
class HairGrid:
    """Where the hair of a groom was at rest.

    cell: how wide [m]. counts: (3,) of cells. middle: (3,) float64 world [m], of the roots.
    mass: (guide_count,) whole float32, MASS for a guide that stands for as many strands as the mean.
    density: (cv_count, guide_count) float32 of the others at each CV.
    typical: the median of these.
    """

    cell: float
    counts: tuple[int, int, int]
    middle: Floats
    mass: Floats
    density: Floats
    typical: float

    @classmethod
    def at_rest(cls, position: Floats, size: float, strands: Floats | None) -> HairGrid:
        """Args:
        position: (3, cv_count, guide_count) world [m].
        size: the hair's length [m].
        strands: (guide_count,) how many each guide stands for; None: equally many.
        """
        middle = position[:, 0].mean(axis=1, dtype=np.float64)
        mass = _masses(strands, position.shape[2])
        extent = float(np.ptp(position.reshape(3, -1), axis=1).max())
        cell = _cell_of(position.reshape(3, -1), size, extent)
        counts = [
            min(math.ceil(one / cell) + 2, SIDE) for one in np.ptp(position.reshape(3, -1), axis=1)
        ]
        grid = cls(cell, (counts[0], counts[1], counts[2]), middle, mass, position[0], 0.0)
        still = Felt.of(grid, grid.place(np.eye(3), middle), position, np.zeros_like(position))
        typical = float(np.median(still.density))
        return cls(grid.cell, grid.counts, middle, mass, still.density, max(typical, TINY))

    def place(self, turn: Floats, middle: Floats) -> Place:
        """Where the grid stands as the groom has turned, and its roots' middle has gone."""
        return Place(
            np.asarray(middle, np.float32),
            (np.asarray(turn, np.float64).T / self.cell).astype(np.float32),
        )

    @property
    def full(self) -> Floats:
        """The density (cv_count, guide_count) above which a CV is crowded; to it others compare."""
        return np.maximum(self.density, np.float32(self.typical))


@dataclass(frozen=True)
class Place:
    """middle: (3,) float32 world [m]. into: (3, 3) float32, from the world to cells."""

    middle: Floats
    into: Floats

    def cells(self, points: Floats) -> Floats:
        """Points (3, ...) world [m] in cells."""
        return _turned(self.into, points - _beside(self.middle, points)) + _beside(
            BEGIN.astype(np.float32), points
        )

    def out(self, ways: Floats, cell: float) -> Floats:
        """Ways (3, ...) in cells, in the world [m]."""
        return _turned(self.into.T * np.float32(cell * cell), ways)


@dataclass(frozen=True)
class Strength:
    """What the setting makes of the numbers above, in one kick.

    substeps: from one kick to the next. push, pull: see PUSH. friction: part of a difference of
    speed that goes.
    """

    substeps: int
    push: float
    pull: float
    friction: float

    @classmethod
    def of(cls, settings: DynamicsSettings, dt: float) -> Strength | None:
        """None where hair does not feel other hair."""
        if not settings.volume:
            return None
        substeps = max(round(1.0 / (KICKS_PER_SECOND * dt)), 1)
        friction = 1.0 - math.exp(-RUBBING * settings.volume * substeps * dt)
        return cls(substeps, PUSH * settings.volume, PULL * settings.volume, friction)


@dataclass(frozen=True)
class Among:
    """How hair feels other hair in a frame. first: its first substep, counted since the start."""

    grid: HairGrid
    place: Place
    strength: Strength
    first: int

    def is_due(self, number: int) -> bool:
        """Whether there is a kick before this substep of the frame."""
        return (self.first + number) % self.strength.substeps == 0

    def pieces(self, count: int) -> list[range]:
        """The frame's substeps, cut where kicks are due."""
        cuts = [0, *(number for number in range(1, count) if self.is_due(number)), count]
        return [range(*ends) for ends in pairwise(cuts)]

    def kick(self, position: Floats, previous: Floats) -> Floats:
        """See `kick`."""
        return kick(self.grid, self.place, self.strength, position, previous)


def kick(
    grid: HairGrid, place: Place, strength: Strength, position: Floats, previous: Floats
) -> Floats:
    """What is to be taken from `previous`, in its shape (3, cv_count, guide_count) [m]."""
    motion = position - previous
    felt = Felt.of(grid, place, position, motion)
    full = grid.full
    over = np.clip(felt.density / full - np.float32(1.0 + SLACK), 0.0, 1.0)
    under = np.clip((grid.density - felt.density) / full - np.float32(SLACK), 0.0, 1.0)
    amount = over * np.float32(-strength.push) + under * np.float32(strength.pull)
    way = felt.gradient * (amount / np.maximum(felt.density, np.float32(TINY)))
    far = np.sqrt((way * way).sum(axis=0))
    way *= np.float32(FARTHEST) / np.maximum(far, np.float32(FARTHEST))
    kicked = place.out(way, grid.cell / strength.substeps)
    rubbed = np.minimum(felt.density / full, np.float32(1.0)) * np.float32(strength.friction)
    kicked += (felt.motion - motion) * rubbed
    return kicked


@dataclass(frozen=True)
class Felt:
    """Of the other CVs at each, (..., cv_count, guide_count) float32.

    density: [MASS a cell]. gradient: (3, ...) [the same a cell]. motion: (3, ...) world [m].
    """

    density: Floats
    gradient: Floats
    motion: Floats

    @classmethod
    def of(cls, grid: HairGrid, place: Place, position: Floats, motion: Floats) -> Felt:
        points = place.cells(position.reshape(3, -1))
        mass = np.broadcast_to(grid.mass, position.shape[1:]).reshape(-1)
        whole = whole_motion(motion.reshape(3, -1), grid.cell) * mass
        own = np.stack([mass, *whole], axis=-1)
        corner = np.floor(points)
        sums = _sums(corner, own, grid.counts)
        found = _looked_up(sums, corner, points - corner, own, grid.counts)
        density, across, gradient = found[:, 0], found[:, 1:4].T, found[:, 4:].T
        mean = across / np.maximum(density, np.float32(TINY)) * np.float32(grid.cell / MOTION)
        shape = position.shape[1:]
        return cls(density.reshape(shape), gradient.reshape(3, *shape), mean.reshape(3, *shape))


def whole_motion(motion: Floats, cell: float) -> Floats:
    """Ways [m] in whole parts of a cell, float32."""
    limit = np.float32(FASTEST * MOTION)
    return np.rint(np.clip(motion * np.float32(MOTION / cell), -limit, limit))


def spline(fraction: Floats) -> tuple[Floats, Floats]:
    """The quadratic B-spline over three cells, and its slope, (3, ...): of the cell before, of the
    one that holds the point at this fraction, and of the next."""
    beside = fraction - np.float32(0.5)
    low, high = np.float32(0.5) - beside, np.float32(0.5) + beside
    half = np.float32(0.5)
    weight = np.stack([half * low * low, np.float32(0.75) - beside * beside, half * high * high])
    return weight, np.stack([-low, np.float32(-2.0) * beside, high])


def _looked_up(
    sums: Floats, corner: Floats, fraction: Floats, own: Floats, counts: tuple[int, int, int]
) -> Floats:
    """(point_count, 7): mass and motion of the others, and the gradient of their mass."""
    weight, slope = spline(fraction)  # (3 cells, 3 axes, n)
    steps = range(3)
    index = np.stack([_index_along(corner, axis, counts) for axis in steps])  # (axis, cell, n)
    found = np.zeros((len(own), 7), np.float32)
    for z, y in product(steps, steps):
        row = index[2, z] + index[1, y]
        along, steep = np.zeros((len(own), 4), np.float32), np.zeros(len(own), np.float32)
        for x in steps:
            here = sums.take(row + index[0, x], axis=0)
            if x == y == z == 1:
                here -= own
            steep += here[:, 0] * slope[x, 0]
            here *= weight[x, 0][:, None]
            along += here
        both = weight[y, 1] * weight[z, 2]
        found[:, 4] += steep * both
        found[:, 5] += along[:, 0] * (slope[y, 1] * weight[z, 2])
        found[:, 6] += along[:, 0] * (weight[y, 1] * slope[z, 2])
        along *= both[:, None]
        found[:, :4] += along
    return found


def _sums(corner: Floats, own: Floats, counts: tuple[int, int, int]) -> Floats:
    """What all CVs leave in the cells, (cell_count, 4) float32 of whole numbers."""
    index = sum(_index_along(corner, axis, counts)[1] for axis in range(3))
    total = math.prod(counts)
    return np.stack(
        [np.bincount(index, own[:, column], total) for column in range(4)], axis=-1
    ).astype(np.float32)


def _index_along(corner: Floats, axis: int, counts: tuple[int, int, int]) -> Ints:
    """What the cell before, the cell itself and the next add to an index, (3, n): x counts first."""
    stride = math.prod(counts[:axis])
    cell = np.mod(corner[axis], np.float32(counts[axis])).astype(np.int64)
    around = cell + np.array([[-1], [0], [1]])
    return (around % counts[axis]) * stride


def _masses(strands: Floats | None, guide_count: int) -> Floats:
    if strands is None or not strands.any():
        return np.full(guide_count, MASS, np.float32)
    mass = np.rint(strands * (MASS / strands.mean()))
    return np.clip(mass, 1, HEAVIEST).astype(np.float32)


def _cell_of(points: Floats, size: float, extent: float) -> float:
    """How wide the cells are, for points (3, n) [m]."""
    finest, coarsest = FINEST * size, COARSEST * size
    cell = max(min(max(finest, extent / (SIDE - 2)), coarsest), TINY)
    while cell < coarsest and _crowd_of(points, cell) < CROWD:
        cell = min(cell * 1.2, coarsest)
    return cell


def _crowd_of(points: Floats, cell: float) -> float:
    """How many points are in the same cell as a point, the median."""
    corner = np.floor((points - points.min(axis=1)[:, None]) / cell).astype(np.int64)
    key = (corner[0] * (1 << 20) + corner[1]) * (1 << 20) + corner[2]
    _, own, number = np.unique(key, return_inverse=True, return_counts=True)
    return float(np.median(number[own]))


def _beside(vector: Floats, points: Floats) -> Floats:
    return vector.reshape(3, *[1] * (points.ndim - 1))


def _turned(matrix: Floats, points: Floats) -> Floats:
    """matrix @ points, in the order of sums that the GPU takes."""
    rows = [row[0] * points[0] + row[1] * points[1] + row[2] * points[2] for row in matrix]
    return np.stack(rows)
