"""Hair among hair: a grid of density and velocity around all guides of a groom.

    FELT_PER_SECOND times a second, before a substep:
        deposit    each CV into the cell where it is: what strands it stands for, and their motion
        look up    at each CV, of all others, smoothed: density, its gradient, mean motion
        feel       pressure    out of where hair is denser than it was at rest
                   cohesion    back to the others, where it is less dense than it was at rest
                   friction    towards the mean motion

Volumetric forces after Petrovic, Henne and Anderson 2005, "Volumetric Methods for Simulation and
Rendering of Hair". Differences: density is compared with that of the same CV at rest, so that no
style is inflated; and the grid goes with the groom and turns with it, so that hair at rest stays in
its cells however the head moves.

A cell sums whole numbers, so its sums depend on no order. The grid wraps around: hair may be
anywhere, and places that are a whole grid apart share their cells. It is as large as the groom at
rest, so at rest none do.

Other grooms leave their CVs in this grid too, see `neighbours`, as far as they are in the cells
around this one's own. It is as large as the groom is then, so that none of theirs counts elsewhere.

`reference/among.py` holds the same, one CV after the other; gpu_shaders/among_*.glsl are its twins.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..arrays import Floats, Ints
from .settings import DynamicsSettings

#: How often hair feels other hair, nearly: a whole number of substeps apart [1/s].
FELT_PER_SECOND = 60.0
#: The whole numbers of a cell: what a CV of a mean guide weighs, at most; a cell of motion in a
#: substep, and how many cells count.
MASS, HEAVIEST, MOTION, FASTEST = 16, 127, 1024, 4
#: A cell is as wide as it takes for a CV to have this many others in its own at rest, and for the
#: grid to have at most this many cells for each CV, between these fractions of the hair's length.
#: The grid has at most SIDE cells to a side.
CROWD, ROOM, FINEST, COARSEST, SIDE = 16, 2, 1.0 / 25.0, 1.0 / 8.0, 64
#: Where a grid begins, in cells: nothing that is symmetric lies on the border of cells.
BEGIN = np.array([0.37, 0.41, 0.43])
#: Densities that differ by less than this part count as equal: CVs go from cell to cell one by one.
SLACK = 0.04
#: Where the median density at rest is more than a CV's own, it is crowded from this part of it on.
THIN = 0.25
#: At full volume: how far pressure and cohesion move a CV until hair feels again, where the
#: density is twice what it was or nothing, in squared cells times the gradient of its logarithm;
#: how far at most [cells]; and the rate at which friction takes differences of speed [1/s].
PUSH, PULL, FARTHEST, RUBBING = 1.4, 0.1, 0.4, 12.0
#: CVs count where they will be after this part of the time until hair feels again: locks meet
#: before they have gone through each other.
AHEAD = 0.75
#: How many times more friction there is where the density is twice what it was: locks that meet
#: stop.
PRESSED = 15.0
#: Cells beyond the groom's own in which other hair acts on it; and by how many cells a grid grows.
REACHED, GROWN = 2, 4
#: What divides nothing [cells' worth of hair].
TINY = 1.0e-6


@dataclass(frozen=True, eq=False)
class HairGrid:
    """Where the hair of a groom was at rest.

    cell: how wide [m]. counts: (3,) of cells. middle: (3,) float64 world [m], of the roots.
    mass: (guide_count,) whole float32, MASS for a guide that stands for as many strands as most.
    unit: metres of hair that a CV of mass 1 stands for.
    density: (cv_count, guide_count) float32 of the others at each CV.
    full: the same, the density above which a CV is crowded; others are compared with it.
    """

    cell: float
    counts: tuple[int, int, int]
    middle: Floats
    mass: Floats
    unit: float
    density: Floats
    full: Floats

    @classmethod
    def at_rest(
        cls, position: Floats, size: float, strands: Floats | None, others: Others | None = None
    ) -> HairGrid:
        """Args:
        position: (3, cv_count, guide_count) world [m].
        size: the hair's length [m].
        strands: (guide_count,) how many each guide stands for; None: equally many.
        others: hair of others there; None: there is none.
        """
        middle = position[:, 0].mean(axis=1, dtype=np.float64)
        mass = _masses(strands, position.shape[2])
        unit = hair_of_cvs(strands, size, *position.shape[1:]).mean() / MASS
        points = position.reshape(3, -1)
        extent = np.ptp(points, axis=1)
        cell = _cell_of(points if others is None else others.among(points), extent, size)
        x, y, z = np.minimum(np.ceil(extent / cell) + 2, SIDE).astype(int).tolist()
        bare = cls(cell, (x, y, z), middle, mass, float(unit), position[0], position[0])
        place = bare.place(np.eye(3), middle)
        place = place if others is None else place.around(points)
        density = Felt.of(bare, place, position, np.zeros_like(position), others).density
        full = np.maximum(density, np.float32(max(THIN * float(np.median(density)), TINY)))
        return replace(bare, density=density, full=full)

    def place(self, turn: Floats, middle: Floats) -> Place:
        """Where the grid stands as the groom has turned, and its roots' middle has gone."""
        return Place(
            np.asarray(middle, np.float32),
            (np.asarray(turn, np.float64).T / self.cell).astype(np.float32),
            self.counts,
        )


@dataclass(frozen=True)
class Place:
    """Where a grid stands.

    middle: (3,) float32 world [m]. into: (3, 3) float32, from the world to cells.
    counts: (3,) of cells. low: the lowest one in which other hair counts.
    """

    middle: Floats
    into: Floats
    counts: tuple[int, int, int]
    low: tuple[int, int, int] = (0, 0, 0)

    def around(self, points: Floats) -> Place:
        """The same with cells enough for all that acts on a groom at these points (3, n) world
        [m]."""
        cells = self.cells(points)
        low = np.floor(cells.min(axis=1)).astype(int) - REACHED
        high = np.floor(cells.max(axis=1)).astype(int) + REACHED + 1
        counts = np.minimum(-(-(high - low) // GROWN) * GROWN, SIDE)
        x, y, z = np.maximum(counts, self.counts).tolist()
        first, second, third = low.tolist()
        return replace(self, counts=(x, y, z), low=(first, second, third))

    def cells(self, points: Floats) -> Floats:
        """Points (3, ...) world [m] in cells."""
        return _turned(self.into, points - _beside(self.middle, points)) + _beside(
            BEGIN.astype(np.float32), points
        )

    def out(self, shifts: Floats, scale: float) -> Floats:
        """Shifts (3, ...) in cells, in the world [m], times the scale over the square of a cell."""
        return _turned(self.into.T * np.float32(scale), shifts)


@dataclass(frozen=True)
class Strength:
    """What the setting makes of the numbers above.

    substeps: until hair feels again. push, pull: see PUSH. friction: rate times that time.
    """

    substeps: int
    push: float
    pull: float
    friction: float

    @property
    def ahead(self) -> float:
        """How many substeps of its motion ahead a CV counts."""
        return AHEAD * self.substeps

    def scale(self, cell: float) -> float:
        """From a shift in cells until hair feels again to what a substep adds, see `Place.out`."""
        return cell * cell / self.substeps**2

    @classmethod
    def of(cls, settings: DynamicsSettings, dt: float) -> Strength | None:
        """None where hair does not feel other hair."""
        if not settings.volume:
            return None
        substeps = max(round(1.0 / (FELT_PER_SECOND * dt)), 1)
        friction = RUBBING * settings.volume * substeps * dt
        return cls(substeps, PUSH * settings.volume, PULL * settings.volume, friction)


@dataclass(frozen=True)
class Among:
    """How hair feels other hair in a frame.

    turn: (3, 3) of the groom since rest.
    first: its first substep, counted since the start.
    volume: (guide_count,) float32, by which the setting is multiplied where it is painted; None: it
        is not.
    others: other hair that is near; None: there is none.
    """

    grid: HairGrid
    place: Place
    turn: Floats
    strength: Strength
    first: int
    volume: Floats | None = None
    others: Others | None = None

    def is_due(self, number: int) -> bool:
        """Whether hair feels before this substep of the frame."""
        return (self.first + number) % self.strength.substeps == 0

    def pieces(self, count: int) -> list[range]:
        """The frame's substeps, cut where hair feels."""
        cuts = [0, *(number for number in range(1, count) if self.is_due(number)), count]
        return [range(*ends) for ends in pairwise(cuts)]

    def beside(self, other: Neighbours | None) -> Among:
        """The same where other hair is near."""
        if other is None:
            return self
        place = other.grid.place(self.turn, self.place.middle).around(other.own)
        return replace(self, grid=other.grid, place=place, others=other.others)

    def feel(self, position: Floats, previous: Floats) -> tuple[Floats, Floats]:
        """See `feel`."""
        return feel(
            self.grid, self.place, self.strength, position, previous, self.volume, self.others
        )


@dataclass(frozen=True, eq=False)
class Others:
    """CVs of other hair.

    here: (3, n) float32 world [m], where they count. step: how they move in a substep.
    mass: (n,) whole float32, see `HairGrid`.
    """

    here: Floats
    step: Floats
    mass: Floats

    @classmethod
    def of(cls, parts: Sequence[Others]) -> Others:
        """All of them as one; there is at least one."""
        rows = ((part.here, part.step, part.mass) for part in parts)
        return cls(*(np.concatenate(each, axis=-1) for each in zip(*rows, strict=True)))

    def near(self, points: Floats, distance: float) -> Others:
        """Those that are at most this far [m] from the box around points (3, n)."""
        low, high = (_beside(end(axis=1), points) for end in (points.min, points.max))
        is_near = ((self.here >= low - distance) & (self.here <= high + distance)).all(axis=0)
        if is_near.all():
            return self
        chosen = np.flatnonzero(is_near)
        here, step = (rows.take(chosen, axis=1) for rows in (self.here, self.step))
        return Others(here, step, self.mass[chosen])

    def among(self, points: Floats) -> Floats:
        """Points (3, n) and those that are in the box around them."""
        return np.concatenate([points, self.near(points, 0.0).here], axis=1)


@dataclass(frozen=True, eq=False)
class Neighbours:
    """What a groom feels of others at a moment.

    grid: its own, in which they are at rest. others: as far ahead as its own CVs count.
    own: (3, n) float32 world [m], where these count.
    """

    grid: HairGrid
    others: Others
    own: Floats


def feel(
    grid: HairGrid,
    place: Place,
    strength: Strength,
    position: Floats,
    previous: Floats,
    volume: Floats | None = None,
    others: Others | None = None,
) -> tuple[Floats, Floats]:
    """What friction takes from the motion of each CV at once, and what pressure and cohesion add in
    each substep until hair feels again; both (3, cv_count, guide_count) [m].

    Pressure that bears weight acts evenly: at once, it would throw the hair up and let it fall.

    Args:
        others: as far ahead as these CVs count.
    """
    motion = position - previous
    felt = Felt.of(grid, place, position + motion * np.float32(strength.ahead), motion, others)
    ratio = felt.density / grid.full
    over = np.clip(ratio - np.float32(1.0 + SLACK), 0.0, 1.0)
    under = np.clip(grid.density / grid.full - ratio - np.float32(SLACK), 0.0, 1.0)
    amount = over * np.float32(-strength.push) + under * np.float32(strength.pull)
    if volume is not None:
        amount *= volume
    shift = felt.gradient * (amount / np.maximum(felt.density, np.float32(TINY)))
    far = np.sqrt((shift * shift).sum(axis=0))
    shift *= np.float32(FARTHEST) / np.maximum(far, np.float32(FARTHEST))
    rubbed = np.minimum(ratio, np.float32(1.0)) + over * np.float32(PRESSED)
    if volume is not None:
        rubbed *= volume
    rubbed = np.float32(1.0) - np.exp(rubbed * np.float32(-strength.friction))
    taken = (motion - felt.motion) * rubbed
    return taken, place.out(shift, strength.scale(grid.cell))


@dataclass(frozen=True)
class Felt:
    """Of the other CVs at each, (..., cv_count, guide_count) float32.

    density: [MASS a cell]. gradient: (3, ...) [the same a cell]. motion: (3, ...) world [m].
    """

    density: Floats
    gradient: Floats
    motion: Floats

    @classmethod
    def of(
        cls,
        grid: HairGrid,
        place: Place,
        position: Floats,
        motion: Floats,
        others: Others | None = None,
    ) -> Felt:
        mass = np.broadcast_to(grid.mass, position.shape[1:]).reshape(-1)
        across = whole_motion(motion.reshape(3, -1), grid.cell) * mass
        part = place.cells(position.reshape(3, -1))
        corner = np.floor(part)
        part -= corner
        low = _wrapped(corner, place.counts)
        sums = _sums(low, part, (mass, *across), place.counts)
        if others is not None:
            sums += others_in(place, others, grid.cell)
        found = _between(_fields(sums), low, part)
        own, steep = own_part(part)
        density = found[:, 0] - own * mass
        gradient = found[:, 4:].T - steep * mass
        moving = found[:, 1:4].T - across * own
        moving *= np.float32(grid.cell / MOTION) / np.maximum(density, np.float32(TINY))
        vectors = (rows.reshape(position.shape) for rows in (gradient, moving))
        return cls(density.reshape(position.shape[1:]), *vectors)


def others_in(place: Place, others: Others, cell: float) -> Floats:
    """What other hair leaves in the cells, see `_sums`: of what is in those around the groom."""
    part = place.cells(others.here)
    nearest = np.floor(part + np.float32(0.5))
    low, counts = (np.array(each, np.float32)[:, None] for each in (place.low, place.counts))
    mass = others.mass * ((nearest >= low) & (nearest < low + counts)).all(axis=0)
    corner = np.floor(part)
    part -= corner
    across = whole_motion(others.step, cell) * mass
    return _sums(_wrapped(corner, place.counts), part, (mass, *across), place.counts)


def own_part(part: Floats) -> tuple[Floats, Floats]:
    """What a CV finds of itself, (n,), and of itself in the gradient, (3, n), for a mass of 1.

    Its own cell is the nearer one of the two along each axis. Smoothing leaves a half of it there
    and a quarter in each neighbour, and no slope there.

    Args:
        part: see `_between`.
    """
    far = np.minimum(part, np.float32(1.0) - part)
    x, y, z = np.float32(0.5) - np.float32(0.25) * far
    slope = np.float32(0.5) * np.where(part < np.float32(0.5), -far, far)
    xy = x * y
    return xy * z, slope * np.stack([y * z, x * z, xy])


def whole_motion(motion: Floats, cell: float) -> Floats:
    """Ways [m] in whole parts of a cell, float32."""
    limit = np.float32(FASTEST * MOTION)
    return np.rint(np.clip(motion * np.float32(MOTION / cell), -limit, limit))


def _wrapped(corner: Floats, counts: tuple[int, int, int]) -> Ints:
    """Which cell of a grid that wraps around it is, along each axis (3, n), for whole numbers."""
    return corner.astype(np.int32) % np.array(counts, np.int32)[:, None]


def _sums(
    low: Ints, part: Floats, lanes: tuple[Floats, ...], counts: tuple[int, int, int]
) -> Floats:
    """What all CVs leave in the cells, (4, *counts) float32 of whole numbers."""
    x, y, z = low + (part >= np.float32(0.5))
    after = tuple(count + 1 for count in counts)
    index = (x * after[1] + y) * after[2] + z
    padded = np.stack([np.bincount(index, lane, math.prod(after)) for lane in lanes])
    return _folded(padded.astype(np.float32).reshape(4, *after))


def _folded(padded: Floats) -> Floats:
    """One cell more along each axis, which is the first one again, added to that."""
    for axis in (1, 2, 3):
        cells = np.moveaxis(padded, axis, 0)
        cells[0] += cells[-1]
        padded = np.moveaxis(cells[:-1], 0, axis)
    return padded


def _fields(sums: Floats) -> Floats:
    """Of each cell from the 27 around: density, motion and the gradient of density, (x, y, z, 7).

    Each axis ends with its first cell once more.
    """
    x, y, z = 1, 2, 3
    over_x = _smooth(sums, x)
    over_xy = _smooth(over_x, y)
    lanes = [
        *_smooth(over_xy, z),
        *_smooth(_smooth(_steep(sums[:1], x), y), z),
        *_smooth(_steep(over_x[:1], y), z),
        *_steep(over_xy[:1], z),
    ]
    return np.stack(lanes, axis=-1)


def _smooth(sums: Floats, axis: int) -> Floats:
    """A quarter, a half and a quarter of three cells."""
    before, here, after = _three(sums, axis)
    smooth: Floats = before + after
    smooth *= np.float32(0.5)
    smooth += here
    smooth *= np.float32(0.5)
    return smooth


def _steep(sums: Floats, axis: int) -> Floats:
    """Half of what the next cell has more than the one before."""
    before, _, after = _three(sums, axis)
    steep: Floats = after - before
    steep *= np.float32(0.5)
    return steep


def _three(sums: Floats, axis: int) -> tuple[Floats, Floats, Floats]:
    """Of each cell along an axis, and of the first once more: that before, itself, the next."""
    count = sums.shape[axis]
    around = sums.take(np.arange(-1, count + 2), axis=axis, mode="wrap")
    before, here, after = (
        around[(slice(None),) * axis + (slice(first, first + count + 1),)] for first in range(3)
    )
    return before, here, after


def _between(fields: Floats, low: Ints, part: Floats) -> Floats:
    """The fields (n, 7) between the middles of cells.

    Args:
        low: (3, n) the lowest of the eight cells whose middles are around a point.
        part: (3, n) how far the point is from that middle to the next.
    """
    _, count_y, count_z, _ = fields.shape
    rows = fields.reshape(-1, fields.shape[-1])
    x, y, z = part
    first = (low[0] * count_y + low[1]) * count_z + low[2]
    found = np.zeros((len(first), rows.shape[1]), np.float32)
    for beyond_x, weight_x in ((0, np.float32(1.0) - x), (count_y * count_z, x)):
        for beyond_y, weight_xy in ((0, weight_x - weight_x * y), (count_z, weight_x * y)):
            weight = weight_xy * z
            for beyond_z, each in ((0, weight_xy - weight), (1, weight)):
                here = rows.take(first + (beyond_x + beyond_y + beyond_z), axis=0)
                here *= each[:, None]
                found += here
    return found


def hair_of_cvs(strands: Floats | None, size: float, cv_count: int, guide_count: int) -> Floats:
    """Metres of hair that each CV of a guide stands for, (guide_count,).

    Args:
        strands: see `HairGrid.at_rest`. size: the hair's length [m].
    """
    if strands is None or not strands.any():
        strands = np.ones(guide_count)
    return strands * (size / max(cv_count - 1, 1))


def _masses(strands: Floats | None, guide_count: int) -> Floats:
    if strands is None or not strands.any():
        return np.full(guide_count, MASS, np.float32)
    mass = np.rint(strands * (MASS / strands.mean()))
    return np.clip(mass, 1, HEAVIEST).astype(np.float32)


def _cell_of(points: Floats, extent: Floats, size: float) -> float:
    """How wide the cells are, for points (3, n) [m]."""
    finest, coarsest = FINEST * size, COARSEST * size
    cell = max(min(max(finest, float(extent.max()) / (SIDE - 2)), coarsest), TINY)
    while cell < coarsest and (
        _crowd_of(points, cell) < CROWD
        or float(np.prod(extent / cell + 2.0)) > ROOM * points.shape[1]
    ):
        cell = min(cell * 1.1, coarsest)
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
