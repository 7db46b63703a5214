"""Forces between hair and hair: a grid of density and velocity around all guides of a groom.

    FELT_PER_SECOND times a second, before a substep:
        deposit    each CV into its cell: the mass of the strands it stands for, and their motion
        look up    at each CV, from all others, smoothed: density, its gradient, mean motion
        feel       pressure    out of regions where hair is denser than at rest
                   cohesion    towards the others where it is less dense than at rest
                   friction    towards the mean motion

Volumetric forces after Petrovic, Henne and Anderson 2005, "Volumetric Methods for Simulation and
Rendering of Hair". Differences: density is compared with that of the same CV at rest, so that no
style is inflated; and the grid moves and turns with the groom, so that hair at rest stays in its
cells however the head moves.

Cells sum whole numbers, so sums do not depend on the order. The grid wraps around: hair may be
anywhere, and places that are a whole grid apart share a cell. The grid is as large as the groom at
rest, so at rest no cells are shared.

CVs of other grooms, see `neighbours`, are deposited too if they are in the cells around this
groom. Then the grid is as large as the groom is at that moment, so that they count nowhere else.

`reference/among.py` is a scalar implementation; gpu_shaders/among_*.glsl are the twins.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..arrays import Floats, Ints
from .settings import DynamicsSettings

#: Approximate rate at which hair feels other hair, a whole number of substeps apart [1/s].
FELT_PER_SECOND = 60.0
#: Units of a cell's whole numbers: the mass of a mean guide's CV, and the largest mass; a motion by
#: one cell per substep, and the largest motion in cells.
MASS, HEAVIEST, MOTION, FASTEST = 16, 127, 1024, 4
#: The width of cells lies between FINEST and COARSEST, in fractions of the hair's length; within
#: this range it is large enough for the median CV's cell to contain CROWD CVs at rest, and for the
#: grid to have at most ROOM cells per CV. The grid has at most SIDE cells along each axis.
CROWD, ROOM, FINEST, COARSEST, SIDE = 16, 2, 1.0 / 25.0, 1.0 / 8.0, 64
#: Offset of the grid, in cells, so that symmetric hair does not lie on the borders of cells.
BEGIN = np.array([0.37, 0.41, 0.43])
#: Relative differences of density below this are ignored: CVs move between cells one by one.
SLACK = 0.04
#: Lower limit of `HairGrid.full`, as a fraction of the median density at rest.
THIN = 0.25
#: At full volume, until hair feels again: displacement by pressure where the density has doubled
#: (PUSH), and by cohesion where it has vanished (PULL), in squared cells times the gradient of the
#: density's logarithm; its maximum [cells]; the rate of friction [1/s].
PUSH, PULL, FARTHEST, RUBBING = 1.4, 0.1, 0.4, 12.0
#: CVs are deposited where they will be after this fraction of the time until hair feels again, so
#: that locks meet before they have passed through each other.
AHEAD = 0.75
#: Factor of additional friction where the density has doubled: locks that meet stop.
PRESSED = 15.0
#: Number of cells around the groom in which other hair acts on it; multiple of which a grid has
#: cells along each axis.
REACHED, GROWN = 2, 4
#: Lower limit of divisors [density].
TINY = 1.0e-6


@dataclass(frozen=True, eq=False)
class HairGrid:
    """The grid of a groom, and its hair's density at rest.

    cell: width of a cell [m]. counts: (3,) of cells. middle: (3,) float64 world [m], of the roots.
    mass: (guide_count,) whole float32, MASS for a guide that stands for the mean number of strands.
    unit: metres of hair that a CV of mass 1 stands for.
    density: (cv_count, guide_count) float32, of the other CVs at each CV at rest.
    full: (cv_count, guide_count) float32, the density above which pressure acts: `density`, but no
        less than THIN of its median.
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
        others: hair of other grooms at rest; None: there is none.
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
        """The grid's place once the groom has turned, with the middle of its roots at `middle`."""
        return Place(
            np.asarray(middle, np.float32),
            (np.asarray(turn, np.float64).T / self.cell).astype(np.float32),
            self.counts,
        )


@dataclass(frozen=True)
class Place:
    """Where a grid stands in a frame.

    middle: (3,) float32 world [m]. into: (3, 3) float32, from the world to cells.
    counts: (3,) of cells. low: (3,) the lowest cell in which other hair counts.
    """

    middle: Floats
    into: Floats
    counts: tuple[int, int, int]
    low: tuple[int, int, int] = (0, 0, 0)

    def around(self, points: Floats) -> Place:
        """The same with enough cells for a groom at these points (3, n) world [m], and all hair
        that acts on it."""
        cells = self.cells(points)
        low = np.floor(cells.min(axis=1)).astype(int) - REACHED
        high = np.floor(cells.max(axis=1)).astype(int) + REACHED + 1
        counts = np.minimum(-(-(high - low) // GROWN) * GROWN, SIDE)
        x, y, z = np.maximum(counts, self.counts).tolist()
        first, second, third = low.tolist()
        return replace(self, counts=(x, y, z), low=(first, second, third))

    def cells(self, points: Floats) -> Floats:
        """Points (3, ...) world [m] in units of cells."""
        return _turned(self.into, points - _beside(self.middle, points)) + _beside(
            BEGIN.astype(np.float32), points
        )

    def out(self, shifts: Floats, scale: float) -> Floats:
        """Shifts (3, ...) in cells as shifts in the world [m], with `Strength.scale` applied."""
        return _turned(self.into.T * np.float32(scale), shifts)


@dataclass(frozen=True)
class Strength:
    """The strength of forces between hair, by the settings and the constants above.

    substeps: until hair feels again. push, pull: see PUSH. friction: its rate times that time.
    """

    substeps: int
    push: float
    pull: float
    friction: float

    @property
    def ahead(self) -> float:
        """How many substeps ahead of its place a CV is deposited."""
        return AHEAD * self.substeps

    def scale(self, cell: float) -> float:
        """The factor of `Place.out` from a shift in cells until hair feels again to the
        displacement that each substep adds."""
        return cell * cell / self.substeps**2

    @classmethod
    def of(cls, settings: DynamicsSettings, dt: float) -> Strength | None:
        """The strength by the settings; None if hair does not feel other hair."""
        if not settings.volume:
            return None
        substeps = max(round(1.0 / (FELT_PER_SECOND * dt)), 1)
        friction = RUBBING * settings.volume * substeps * dt
        return cls(substeps, PUSH * settings.volume, PULL * settings.volume, friction)


@dataclass(frozen=True)
class Among:
    """How hair feels other hair in a frame.

    turn: (3, 3) of the groom since rest.
    first: the frame's first substep, counted since the start.
    volume: (guide_count,) float32, painted factor of the setting; None: not painted.
    others: nearby hair of other grooms; None: there is none.
    """

    grid: HairGrid
    place: Place
    turn: Floats
    strength: Strength
    first: int
    volume: Floats | None = None
    others: Others | None = None

    def is_due(self, number: int) -> bool:
        """Whether hair feels other hair before this substep of the frame."""
        return (self.first + number) % self.strength.substeps == 0

    def pieces(self, count: int) -> list[range]:
        """The frame's substeps in ranges, each of which begins where hair feels other hair."""
        cuts = [0, *(number for number in range(1, count) if self.is_due(number)), count]
        return [range(*ends) for ends in pairwise(cuts)]

    def beside(self, other: Neighbours | None) -> Among:
        """The same with the hair of other grooms."""
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
    """CVs of other grooms.

    here: (3, n) float32 world [m], where they are deposited. step: (3, n) [m], their motion in a
        substep. mass: (n,) whole float32, see `HairGrid`.
    """

    here: Floats
    step: Floats
    mass: Floats

    @classmethod
    def of(cls, parts: Sequence[Others]) -> Others:
        """All parts, of which there is at least one, joined."""
        rows = ((part.here, part.step, part.mass) for part in parts)
        return cls(*(np.concatenate(each, axis=-1) for each in zip(*rows, strict=True)))

    def near(self, points: Floats, distance: float) -> Others:
        """The CVs that are within a distance [m] of the box around points (3, n)."""
        low, high = (_beside(end(axis=1), points) for end in (points.min, points.max))
        is_near = ((self.here >= low - distance) & (self.here <= high + distance)).all(axis=0)
        if is_near.all():
            return self
        chosen = np.flatnonzero(is_near)
        here, step = (rows.take(chosen, axis=1) for rows in (self.here, self.step))
        return Others(here, step, self.mass[chosen])

    def among(self, points: Floats) -> Floats:
        """Points (3, n), and the CVs that are in the box around them, (3, m)."""
        return np.concatenate([points, self.near(points, 0.0).here], axis=1)


@dataclass(frozen=True, eq=False)
class Neighbours:
    """What a groom feels of other grooms at a moment.

    grid: its own, with the others included at rest.
    others: their CVs, as far ahead as its own CVs are.
    own: (3, n) float32 world [m], where its own CVs are deposited.
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
    """The effect of other hair on each CV, (3, cv_count, guide_count) [m] each.

    Pressure is spread over substeps because it bears weight: all at once, it would throw hair up
    and let it fall again.

    Args:
        others: as far ahead as these CVs are deposited, see `Strength.ahead`.

    Returns:
        The motion per substep that friction takes away now, and the displacement by pressure and
        cohesion in each substep until hair feels again.
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
    """The grid's fields at each CV, of all other CVs, (..., cv_count, guide_count) float32.

    density: [mass per cell]. gradient: (3, ...) [density per cell]. motion: (3, ...) mean motion
        in a substep, world [m].
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
    """The sums of other hair, see `_sums`, from its CVs in the cells around the groom."""
    part = place.cells(others.here)
    nearest = np.floor(part + np.float32(0.5))
    low, counts = (np.array(each, np.float32)[:, None] for each in (place.low, place.counts))
    mass = others.mass * ((nearest >= low) & (nearest < low + counts)).all(axis=0)
    corner = np.floor(part)
    part -= corner
    across = whole_motion(others.step, cell) * mass
    return _sums(_wrapped(corner, place.counts), part, (mass, *across), place.counts)


def own_part(part: Floats) -> tuple[Floats, Floats]:
    """A CV's contribution to the density, (n,), and to the gradient, (3, n), at its own place, for
    a mass of 1.

    Along each axis, its cell is the nearer one of two. Smoothing leaves a half of the mass in it
    and a quarter in each neighbour, without slope in the cell itself.

    Args:
        part: see `_between`.
    """
    far = np.minimum(part, np.float32(1.0) - part)
    x, y, z = np.float32(0.5) - np.float32(0.25) * far
    slope = np.float32(0.5) * np.where(part < np.float32(0.5), -far, far)
    xy = x * y
    return xy * z, slope * np.stack([y * z, x * z, xy])


def whole_motion(motion: Floats, cell: float) -> Floats:
    """Motions [m] as whole numbers of cell / MOTION, clamped to FASTEST cells, float32."""
    limit = np.float32(FASTEST * MOTION)
    return np.rint(np.clip(motion * np.float32(MOTION / cell), -limit, limit))


def _wrapped(corner: Floats, counts: tuple[int, int, int]) -> Ints:
    """Cell numbers in a grid that wraps around, along each axis (3, n), from whole numbers."""
    return corner.astype(np.int32) % np.array(counts, np.int32)[:, None]


def _sums(
    low: Ints, part: Floats, lanes: tuple[Floats, ...], counts: tuple[int, int, int]
) -> Floats:
    """The sums of all CVs in the cells, (4, *counts) float32, whole numbers: mass, and mass times
    motion along each axis."""
    x, y, z = low + (part >= np.float32(0.5))
    after = tuple(count + 1 for count in counts)
    index = (x * after[1] + y) * after[2] + z
    padded = np.stack([np.bincount(index, lane, math.prod(after)) for lane in lanes])
    return _folded(padded.astype(np.float32).reshape(4, *after))


def _folded(padded: Floats) -> Floats:
    """Sums without the extra last cell along each axis, which is added to the first one."""
    for axis in (1, 2, 3):
        cells = np.moveaxis(padded, axis, 0)
        cells[0] += cells[-1]
        padded = np.moveaxis(cells[:-1], 0, axis)
    return padded


def _fields(sums: Floats) -> Floats:
    """Density, motion and the gradient of density in each cell, smoothed over the 27 cells around
    it, (x, y, z, 7).

    Each axis ends with its first cell repeated.
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
    """Sums smoothed along an axis by the weights 1/4, 1/2 and 1/4."""
    before, here, after = _three(sums, axis)
    smooth: Floats = before + after
    smooth *= np.float32(0.5)
    smooth += here
    smooth *= np.float32(0.5)
    return smooth


def _steep(sums: Floats, axis: int) -> Floats:
    """The central difference along an axis, per cell."""
    before, _, after = _three(sums, axis)
    steep: Floats = after - before
    steep *= np.float32(0.5)
    return steep


def _three(sums: Floats, axis: int) -> tuple[Floats, Floats, Floats]:
    """The previous, the same and the next cell of each along an axis, with the first repeated."""
    count = sums.shape[axis]
    around = sums.take(np.arange(-1, count + 2), axis=axis, mode="wrap")
    before, here, after = (
        around[(slice(None),) * axis + (slice(first, first + count + 1),)] for first in range(3)
    )
    return before, here, after


def _between(fields: Floats, low: Ints, part: Floats) -> Floats:
    """The fields interpolated between the middles of cells, (n, 7).

    Args:
        low: (3, n) the lowest of the eight cells whose middles are around a point.
        part: (3, n) the point's place between that middle and the next, from 0 to 1.
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
    """The width of cells for points (3, n) [m], see CROWD."""
    finest, coarsest = FINEST * size, COARSEST * size
    cell = max(min(max(finest, float(extent.max()) / (SIDE - 2)), coarsest), TINY)
    while cell < coarsest and (
        _crowd_of(points, cell) < CROWD
        or float(np.prod(extent / cell + 2.0)) > ROOM * points.shape[1]
    ):
        cell = min(cell * 1.1, coarsest)
    return cell


def _crowd_of(points: Floats, cell: float) -> float:
    """The median number of points that share a point's cell, including itself."""
    corner = np.floor((points - points.min(axis=1)[:, None]) / cell).astype(np.int64)
    key = (corner[0] * (1 << 20) + corner[1]) * (1 << 20) + corner[2]
    _, own, number = np.unique(key, return_inverse=True, return_counts=True)
    return float(np.median(number[own]))


def _beside(vector: Floats, points: Floats) -> Floats:
    return vector.reshape(3, *[1] * (points.ndim - 1))


def _turned(matrix: Floats, points: Floats) -> Floats:
    """matrix @ points, summed in the same order as on the GPU."""
    rows = [row[0] * points[0] + row[1] * points[1] + row[2] * points[2] for row in matrix]
    return np.stack(rows)
