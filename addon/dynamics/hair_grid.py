"""Forces between hair and hair: a grid of density and velocity around all guides of a groom.

    UPDATES_PER_SECOND times a second, before a substep:
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

`reference/hair_grid.py` is a scalar implementation; gpu_shaders/hair_grid_*.glsl are the twins.
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
UPDATES_PER_SECOND = 60.0
#: Units of a cell's whole numbers: the mass of a mean guide's CV, and the largest mass; a motion by
#: one cell per substep, and the largest motion in cells.
MEAN_MASS, MAX_MASS, MOTION_UNITS, MAX_MOTION = 16, 127, 1024, 4
#: The width of cells lies between MIN_CELL and MAX_CELL, in fractions of the hair's length; within
#: this range it is large enough for the median CV's cell to contain MIN_CVS_PER_CELL CVs at rest,
#: and for the grid to have at most MAX_CELLS_PER_CV cells per CV. The grid has at most
#: MAX_CELLS_PER_AXIS cells along each axis.
MIN_CELL, MAX_CELL = 1.0 / 25.0, 1.0 / 8.0
MIN_CVS_PER_CELL, MAX_CELLS_PER_CV, MAX_CELLS_PER_AXIS = 16, 2, 64
#: Offset of the grid, in cells, so that symmetric hair does not lie on the borders of cells.
GRID_OFFSET = np.array([0.37, 0.41, 0.43])
#: Relative differences of density below this are ignored: CVs move between cells one by one.
DENSITY_TOLERANCE = 0.04
#: Lower limit of `HairGrid.pressure_threshold`, as a fraction of the median density at rest.
MIN_REST_DENSITY = 0.25
#: At full volume, until hair feels again: displacement by pressure where the density has doubled
#: (PRESSURE), and by cohesion where it has vanished (COHESION), in squared cells times the gradient
#: of the density's logarithm; its maximum [cells]; the rate of friction [1/s].
PRESSURE, COHESION, MAX_SHIFT, FRICTION_RATE = 1.4, 0.1, 0.4, 12.0
#: CVs are deposited where they will be after this fraction of the time until hair feels again, so
#: that locks meet before they have passed through each other.
LOOK_AHEAD = 0.75
#: Factor of additional friction where the density has doubled: locks that meet stop.
PRESSED_FRICTION = 15.0
#: Number of cells around the groom in which other hair acts on it; multiple of which a grid has
#: cells along each axis.
MARGIN_CELLS, CELL_COUNT_STEP = 2, 4
#: Lower limit of divisors [density].
MIN_DENSITY = 1.0e-6


@dataclass(frozen=True, eq=False)
class HairGrid:
    """The grid of a groom, and its hair's density at rest.

    cell: width of a cell [m]. counts: (3,) of cells. middle: (3,) float64 world [m], of the roots.
    mass: (guide_count,) whole float32, MEAN_MASS for a guide that stands for the mean number of
        strands.
    hair_per_mass: metres of hair that a CV of mass 1 stands for.
    rest_density: (cv_count, guide_count) float32, of the other CVs at each CV at rest.
    pressure_threshold: (cv_count, guide_count) float32, the density above which pressure acts:
        `rest_density`, but no less than MIN_REST_DENSITY of its median.
    """

    cell: float
    counts: tuple[int, int, int]
    middle: Floats
    mass: Floats
    hair_per_mass: float
    rest_density: Floats
    pressure_threshold: Floats

    @classmethod
    def at_rest(
        cls,
        position: Floats,
        size: float,
        strands: Floats | None,
        neighbour_cvs: NeighbourCvs | None = None,
    ) -> HairGrid:
        """Args:
        position: (3, cv_count, guide_count) world [m].
        size: the hair's length [m].
        strands: (guide_count,) how many each guide stands for; None: equally many.
        neighbour_cvs: hair of other grooms at rest; None: there is none.
        """
        middle = position[:, 0].mean(axis=1, dtype=np.float64)
        mass = _guide_masses(strands, position.shape[2])
        hair_per_mass = hair_length_of_cvs(strands, size, *position.shape[1:]).mean() / MEAN_MASS
        points = position.reshape(3, -1)
        extent = np.ptp(points, axis=1)
        cell = _cell_size(
            points if neighbour_cvs is None else neighbour_cvs.append_nearby_to(points),
            extent,
            size,
        )
        x, y, z = np.minimum(np.ceil(extent / cell) + 2, MAX_CELLS_PER_AXIS).astype(int).tolist()
        bare = cls(cell, (x, y, z), middle, mass, float(hair_per_mass), position[0], position[0])
        placement = bare.placement(np.eye(3), middle)
        placement = placement if neighbour_cvs is None else placement.enclosing(points)
        density = GridSample.of(
            bare, placement, position, np.zeros_like(position), neighbour_cvs
        ).density
        pressure_threshold = np.maximum(
            density, np.float32(max(MIN_REST_DENSITY * float(np.median(density)), MIN_DENSITY))
        )
        return replace(bare, rest_density=density, pressure_threshold=pressure_threshold)

    def placement(self, rotation: Floats, middle: Floats) -> GridPlacement:
        """The grid's place once the groom has turned by a rotation (3, 3), with the middle of its
        roots at `middle`, (3,) world [m]."""
        return GridPlacement(
            np.asarray(middle, np.float32),
            (np.asarray(rotation, np.float64).T / self.cell).astype(np.float32),
            self.counts,
        )


@dataclass(frozen=True)
class GridPlacement:
    """Where a grid stands in a frame.

    middle: (3,) float32 world [m]. world_to_cells: (3, 3) float32, from the world to cells.
    counts: (3,) of cells. lowest_cell: (3,) the lowest cell in which other hair counts.
    """

    middle: Floats
    world_to_cells: Floats
    counts: tuple[int, int, int]
    lowest_cell: tuple[int, int, int] = (0, 0, 0)

    def enclosing(self, points: Floats) -> GridPlacement:
        """The same with enough cells for a groom at these points (3, n) world [m], and all hair
        that acts on it."""
        cells = self.to_cells(points)
        low = np.floor(cells.min(axis=1)).astype(int) - MARGIN_CELLS
        high = np.floor(cells.max(axis=1)).astype(int) + MARGIN_CELLS + 1
        counts = np.minimum(
            -(-(high - low) // CELL_COUNT_STEP) * CELL_COUNT_STEP, MAX_CELLS_PER_AXIS
        )
        x, y, z = np.maximum(counts, self.counts).tolist()
        first, second, third = low.tolist()
        return replace(self, counts=(x, y, z), lowest_cell=(first, second, third))

    def to_cells(self, points: Floats) -> Floats:
        """Points (3, ...) world [m] in units of cells."""
        return _rotated(self.world_to_cells, points - _as_column(self.middle, points)) + _as_column(
            GRID_OFFSET.astype(np.float32), points
        )

    def to_world(self, shifts: Floats, scale: float) -> Floats:
        """Shifts (3, ...) in cells as shifts in the world [m], with
        `InteractionStrength.displacement_factor` applied."""
        return _rotated(self.world_to_cells.T * np.float32(scale), shifts)


@dataclass(frozen=True)
class InteractionStrength:
    """The strength of forces between hair, by the settings and the constants above.

    substeps: until hair feels again. pressure, cohesion: see PRESSURE. friction: its rate times
        that time.
    """

    substeps: int
    pressure: float
    cohesion: float
    friction: float

    @property
    def look_ahead(self) -> float:
        """How many substeps ahead of its place a CV is deposited."""
        return LOOK_AHEAD * self.substeps

    def displacement_factor(self, cell: float) -> float:
        """The factor of `GridPlacement.to_world` from a shift in cells until hair feels again to
        the displacement that each substep adds."""
        return cell * cell / self.substeps**2

    @classmethod
    def of(cls, settings: DynamicsSettings, dt: float) -> InteractionStrength | None:
        """The strength by the settings; None if hair does not feel other hair."""
        if not settings.volume:
            return None
        substeps = max(round(1.0 / (UPDATES_PER_SECOND * dt)), 1)
        friction = FRICTION_RATE * settings.volume * substeps * dt
        return cls(substeps, PRESSURE * settings.volume, COHESION * settings.volume, friction)


@dataclass(frozen=True)
class HairInteraction:
    """How hair feels other hair in a frame.

    rotation: (3, 3) of the groom since rest.
    first_substep: the frame's first substep, counted since the start.
    volume: (guide_count,) float32, painted factor of the setting; None: not painted.
    neighbour_cvs: nearby hair of other grooms; None: there is none.
    """

    grid: HairGrid
    placement: GridPlacement
    rotation: Floats
    strength: InteractionStrength
    first_substep: int
    volume: Floats | None = None
    neighbour_cvs: NeighbourCvs | None = None

    def is_due(self, number: int) -> bool:
        """Whether hair feels other hair before this substep of the frame."""
        return (self.first_substep + number) % self.strength.substeps == 0

    def substep_ranges(self, count: int) -> list[range]:
        """The frame's substeps in ranges, each of which begins where hair feels other hair."""
        boundaries = [0, *(number for number in range(1, count) if self.is_due(number)), count]
        return [range(*ends) for ends in pairwise(boundaries)]

    def with_neighbours(self, neighbours: Neighbours | None) -> HairInteraction:
        """The same with the hair of other grooms."""
        if neighbours is None:
            return self
        placement = neighbours.grid.placement(self.rotation, self.placement.middle).enclosing(
            neighbours.own_position
        )
        return replace(
            self, grid=neighbours.grid, placement=placement, neighbour_cvs=neighbours.neighbour_cvs
        )

    def friction_and_push(self, position: Floats, previous: Floats) -> tuple[Floats, Floats]:
        """See `friction_and_push`."""
        return friction_and_push(
            self.grid,
            self.placement,
            self.strength,
            position,
            previous,
            self.volume,
            self.neighbour_cvs,
        )


@dataclass(frozen=True, eq=False)
class NeighbourCvs:
    """CVs of other grooms.

    position: (3, n) float32 world [m], where they are deposited. motion: (3, n) [m], their motion
        in a substep. mass: (n,) whole float32, see `HairGrid`.
    """

    position: Floats
    motion: Floats
    mass: Floats

    @classmethod
    def joined(cls, parts: Sequence[NeighbourCvs]) -> NeighbourCvs:
        """All parts, of which there is at least one, joined."""
        rows = ((part.position, part.motion, part.mass) for part in parts)
        return cls(*(np.concatenate(each, axis=-1) for each in zip(*rows, strict=True)))

    def near_box(self, points: Floats, distance: float) -> NeighbourCvs:
        """The CVs that are within a distance [m] of the box around points (3, n)."""
        low, high = (_as_column(end(axis=1), points) for end in (points.min, points.max))
        is_near = ((self.position >= low - distance) & (self.position <= high + distance)).all(
            axis=0
        )
        if is_near.all():
            return self
        chosen = np.flatnonzero(is_near)
        here, step = (rows.take(chosen, axis=1) for rows in (self.position, self.motion))
        return NeighbourCvs(here, step, self.mass[chosen])

    def append_nearby_to(self, points: Floats) -> Floats:
        """Points (3, n), and the CVs that are in the box around them, (3, m)."""
        return np.concatenate([points, self.near_box(points, 0.0).position], axis=1)


@dataclass(frozen=True, eq=False)
class Neighbours:
    """What a groom feels of other grooms at a moment.

    grid: its own, with the others included at rest.
    neighbour_cvs: their CVs, as far ahead as its own CVs are.
    own_position: (3, n) float32 world [m], where its own CVs are deposited.
    """

    grid: HairGrid
    neighbour_cvs: NeighbourCvs
    own_position: Floats


def friction_and_push(
    grid: HairGrid,
    placement: GridPlacement,
    strength: InteractionStrength,
    position: Floats,
    previous: Floats,
    volume: Floats | None = None,
    neighbour_cvs: NeighbourCvs | None = None,
) -> tuple[Floats, Floats]:
    """The effect of other hair on each CV, (3, cv_count, guide_count) [m] each.

    Pressure is spread over substeps because it bears weight: all at once, it would throw hair up
    and let it fall again.

    Args:
        neighbour_cvs: as far ahead as these CVs are deposited, see
            `InteractionStrength.look_ahead`.

    Returns:
        The motion per substep that friction takes away now, and the displacement by pressure and
        cohesion in each substep until hair feels again.
    """
    motion = position - previous
    sample = GridSample.of(
        grid, placement, position + motion * np.float32(strength.look_ahead), motion, neighbour_cvs
    )
    ratio = sample.density / grid.pressure_threshold
    compression = np.clip(ratio - np.float32(1.0 + DENSITY_TOLERANCE), 0.0, 1.0)
    expansion = np.clip(
        grid.rest_density / grid.pressure_threshold - ratio - np.float32(DENSITY_TOLERANCE),
        0.0,
        1.0,
    )
    amount = compression * np.float32(-strength.pressure) + expansion * np.float32(
        strength.cohesion
    )
    if volume is not None:
        amount *= volume
    shift = sample.gradient * (amount / np.maximum(sample.density, np.float32(MIN_DENSITY)))
    length = np.sqrt((shift * shift).sum(axis=0))
    shift *= np.float32(MAX_SHIFT) / np.maximum(length, np.float32(MAX_SHIFT))
    friction = np.minimum(ratio, np.float32(1.0)) + compression * np.float32(PRESSED_FRICTION)
    if volume is not None:
        friction *= volume
    friction = np.float32(1.0) - np.exp(friction * np.float32(-strength.friction))
    slowed = (motion - sample.motion) * friction
    return slowed, placement.to_world(shift, strength.displacement_factor(grid.cell))


@dataclass(frozen=True)
class GridSample:
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
        placement: GridPlacement,
        position: Floats,
        motion: Floats,
        neighbour_cvs: NeighbourCvs | None = None,
    ) -> GridSample:
        mass = np.broadcast_to(grid.mass, position.shape[1:]).reshape(-1)
        momentum = whole_motion(motion.reshape(3, -1), grid.cell) * mass
        fraction = placement.to_cells(position.reshape(3, -1))
        corner = np.floor(fraction)
        fraction -= corner
        low = _wrapped(corner, placement.counts)
        sums = _sums(low, fraction, (mass, *momentum), placement.counts)
        if neighbour_cvs is not None:
            sums += neighbour_sums(placement, neighbour_cvs, grid.cell)
        fields = _interpolated(_fields(sums), low, fraction)
        own, own_gradient = own_contribution(fraction)
        density = fields[:, 0] - own * mass
        gradient = fields[:, 4:].T - own_gradient * mass
        mean_motion = fields[:, 1:4].T - momentum * own
        mean_motion *= np.float32(grid.cell / MOTION_UNITS) / np.maximum(
            density, np.float32(MIN_DENSITY)
        )
        vectors = (rows.reshape(position.shape) for rows in (gradient, mean_motion))
        return cls(density.reshape(position.shape[1:]), *vectors)


def neighbour_sums(placement: GridPlacement, neighbour_cvs: NeighbourCvs, cell: float) -> Floats:
    """The sums of other hair from its CVs in the cells around the groom, shaped as `_sums`."""
    fraction = placement.to_cells(neighbour_cvs.position)
    nearest = np.floor(fraction + np.float32(0.5))
    low, counts = (
        np.array(each, np.float32)[:, None] for each in (placement.lowest_cell, placement.counts)
    )
    mass = neighbour_cvs.mass * ((nearest >= low) & (nearest < low + counts)).all(axis=0)
    corner = np.floor(fraction)
    fraction -= corner
    momentum = whole_motion(neighbour_cvs.motion, cell) * mass
    return _sums(_wrapped(corner, placement.counts), fraction, (mass, *momentum), placement.counts)


def own_contribution(fraction: Floats) -> tuple[Floats, Floats]:
    """A CV's contribution to the density, (n,), and to the gradient, (3, n), at its own place, for
    a mass of 1.

    Along each axis, its cell is the nearer one of two. Smoothing leaves a half of the mass in it
    and a quarter in each neighbour, without slope in the cell itself.

    Args:
        fraction: see `_interpolated`.
    """
    away = np.minimum(fraction, np.float32(1.0) - fraction)
    x, y, z = np.float32(0.5) - np.float32(0.25) * away
    slope = np.float32(0.5) * np.where(fraction < np.float32(0.5), -away, away)
    xy = x * y
    return xy * z, slope * np.stack([y * z, x * z, xy])


def whole_motion(motion: Floats, cell: float) -> Floats:
    """Motions [m] as whole numbers of cell / MOTION_UNITS, clamped to MAX_MOTION cells, float32."""
    limit = np.float32(MAX_MOTION * MOTION_UNITS)
    return np.rint(np.clip(motion * np.float32(MOTION_UNITS / cell), -limit, limit))


def _wrapped(corner: Floats, counts: tuple[int, int, int]) -> Ints:
    """Cell numbers in a grid that wraps around, along each axis (3, n), from whole numbers."""
    return corner.astype(np.int32) % np.array(counts, np.int32)[:, None]


def _sums(
    low: Ints, fraction: Floats, lanes: tuple[Floats, ...], counts: tuple[int, int, int]
) -> Floats:
    """The sums of all CVs in the cells, (4, *counts) float32, whole numbers: mass, and mass times
    motion along each axis."""
    x, y, z = low + (fraction >= np.float32(0.5))
    after = tuple(count + 1 for count in counts)
    index = (x * after[1] + y) * after[2] + z
    padded = np.stack([np.bincount(index, lane, math.prod(after)) for lane in lanes])
    return _with_last_cells_folded(padded.astype(np.float32).reshape(4, *after))


def _with_last_cells_folded(padded: Floats) -> Floats:
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
        *_smooth(_smooth(_central_difference(sums[:1], x), y), z),
        *_smooth(_central_difference(over_x[:1], y), z),
        *_central_difference(over_xy[:1], z),
    ]
    return np.stack(lanes, axis=-1)


def _smooth(sums: Floats, axis: int) -> Floats:
    """Sums smoothed along an axis by the weights 1/4, 1/2 and 1/4."""
    before, here, after = _shifted_cells(sums, axis)
    smooth: Floats = before + after
    smooth *= np.float32(0.5)
    smooth += here
    smooth *= np.float32(0.5)
    return smooth


def _central_difference(sums: Floats, axis: int) -> Floats:
    """The central difference along an axis, per cell."""
    before, _, after = _shifted_cells(sums, axis)
    difference: Floats = after - before
    difference *= np.float32(0.5)
    return difference


def _shifted_cells(sums: Floats, axis: int) -> tuple[Floats, Floats, Floats]:
    """The previous, the same and the next cell of each along an axis, with the first repeated."""
    count = sums.shape[axis]
    around = sums.take(np.arange(-1, count + 2), axis=axis, mode="wrap")
    before, here, after = (
        around[(slice(None),) * axis + (slice(first, first + count + 1),)] for first in range(3)
    )
    return before, here, after


def _interpolated(fields: Floats, low: Ints, fraction: Floats) -> Floats:
    """The fields interpolated between the middles of cells, (n, 7).

    Args:
        low: (3, n) the lowest of the eight cells whose middles are around a point.
        fraction: (3, n) the point's place between that middle and the next, from 0 to 1.
    """
    _, count_y, count_z, _ = fields.shape
    rows = fields.reshape(-1, fields.shape[-1])
    x, y, z = fraction
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


def hair_length_of_cvs(
    strands: Floats | None, size: float, cv_count: int, guide_count: int
) -> Floats:
    """Metres of hair that each CV of a guide stands for, (guide_count,).

    Args:
        strands: see `HairGrid.at_rest`. size: the hair's length [m].
    """
    if strands is None or not strands.any():
        strands = np.ones(guide_count)
    return strands * (size / max(cv_count - 1, 1))


def _guide_masses(strands: Floats | None, guide_count: int) -> Floats:
    if strands is None or not strands.any():
        return np.full(guide_count, MEAN_MASS, np.float32)
    mass = np.rint(strands * (MEAN_MASS / strands.mean()))
    return np.clip(mass, 1, MAX_MASS).astype(np.float32)


def _cell_size(points: Floats, extent: Floats, size: float) -> float:
    """The width of cells for points (3, n) [m], see MIN_CVS_PER_CELL."""
    finest, coarsest = MIN_CELL * size, MAX_CELL * size
    cell = max(
        min(max(finest, float(extent.max()) / (MAX_CELLS_PER_AXIS - 2)), coarsest), MIN_DENSITY
    )
    while cell < coarsest and (
        _median_points_per_cell(points, cell) < MIN_CVS_PER_CELL
        or float(np.prod(extent / cell + 2.0)) > MAX_CELLS_PER_CV * points.shape[1]
    ):
        cell = min(cell * 1.1, coarsest)
    return cell


def _median_points_per_cell(points: Floats, cell: float) -> float:
    """The median number of points that share a point's cell, including itself."""
    corner = np.floor((points - points.min(axis=1)[:, None]) / cell).astype(np.int64)
    key = (corner[0] * (1 << 20) + corner[1]) * (1 << 20) + corner[2]
    _, own, number = np.unique(key, return_inverse=True, return_counts=True)
    return float(np.median(number[own]))


def _as_column(vector: Floats, points: Floats) -> Floats:
    return vector.reshape(3, *[1] * (points.ndim - 1))


def _rotated(matrix: Floats, points: Floats) -> Floats:
    """matrix @ points, summed in the same order as on the GPU."""
    rows = [row[0] * points[0] + row[1] * points[1] + row[2] * points[2] for row in matrix]
    return np.stack(rows)
