"""Hair and body as a grid of cells: how much light each cell takes from a ray that crosses it.

    sigma = (pi / 4) 2 r (length of hair in a volume) / volume      [1/m]

is the extinction of randomly oriented cylinders of radius r, pi / 4 the mean of the sine between
hair and ray. The body is an opaque shell, three cells thick with its middle two and a half cells
below the surface, so that roots of hair do not lie in opaque cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import StrandSet, Surface
from ..strands.closest_point import search_of
from ..strands.vectors import dot_rows

#: How far below the surface the middle of the body's shell lies [cells].
_SHELL_DEPTH = 2.5
#: Number of cell sizes in each doubling, and of cells along the side of a block.
_SIZES_PER_DOUBLING, _BLOCK_SIDE = 16, 16
#: Minimum number of cells along a typical hair, so that fur on a large body is not lost in one
#: layer of cells; and the maximum number of all cells, which limits the former.
_MIN_CELLS_ALONG_HAIR, _MAX_CELLS = 6, 1_000_000
#: Hair smaller than this gets cells as if it were that large [m].
_SMALLEST_HAIR = 1.0e-9
#: Minimum of the hair's size, as a fraction of its distance from the origin, and of a cell's size,
#: as a fraction of the hair's.
_MIN_RELATIVE_SIZE = 1.0e-9
#: Optical depth of a cell of the body: exp(-30) is nothing.
_OPAQUE = 30.0
#: Segments that are cut up at once: numpy blocks other threads while it counts, so more would
#: freeze the window.
_SEGMENTS_PER_BATCH = 1 << 17
#: Points looked up at once: they stay in the cache.
_POINTS_PER_BATCH = 1 << 14


@dataclass(frozen=True)
class Grid:
    """Cubic cells around the hair: low corner (3,) [m], size of a cell [m], cells (x, y, z)."""

    low: Floats
    cell: float
    shape: tuple[int, int, int]

    @classmethod
    def of_cells(cls, first: Ints, count: Ints, cell: float) -> Self:
        """Cells (x, y, z) of the lattice through the origin."""
        return cls(first * cell, cell, (int(count[0]), int(count[1]), int(count[2])))

    @property
    def first(self) -> Ints:
        """Number of the low corner's cell in the lattice, (3,)."""
        return np.rint(self.low / self.cell).astype(np.int64)

    def aligned_to_blocks(self) -> Grid:
        """The grid of whole blocks of the lattice that holds this one."""
        first = self.first // _BLOCK_SIDE * _BLOCK_SIDE
        last = -(-(self.first + np.array(self.shape)) // _BLOCK_SIDE) * _BLOCK_SIDE
        return Grid.of_cells(first, last - first, self.cell)

    def crop(self, values: Floats, whole: Grid) -> Floats:
        """This grid's values, shaped as its cells, out of those of a grid that contains it."""
        first = self.first - whole.first
        x, y, z = map(slice, first, first + np.array(self.shape))
        return values[x, y, z]

    def coordinates(self, points: Floats) -> Floats:
        """Points (n, 3) [m] in cells; cell i has its centre at i."""
        low = self.low.astype(np.float32)
        return (points - low) * np.float32(1.0 / self.cell) - np.float32(0.5)


@dataclass(frozen=True, eq=False)
class Field:
    """Values (k, x, y, z) at the centres of a grid's cells."""

    grid: Grid
    values: Floats

    def at(self, points: Floats) -> Floats:
        """Values at points (n, 3) [m], (k, n) float32, see `sample`."""
        return sample(self.values, self.grid.coordinates(points))


def grid_around(strands: StrandSet, cell_count: int, max_cells: int | None = None) -> Grid:
    """Cells over all strands, with two empty ones on each side: without these at most `cell_count`
    along the longest side, or more for short hair, see `_MIN_CELLS_ALONG_HAIR`.

    They belong to one of few lattices through the origin, so that hair keeps its cells while it is
    combed.

    Args:
        max_cells: maximum number of all cells for short hair; None: `_MAX_CELLS`.
    """
    low, high = (corner.astype(np.float64) for corner in strands.bounds())
    farthest = float(np.maximum(np.abs(low), np.abs(high)).max())
    size = max(float((high - low).max()), _SMALLEST_HAIR, _MIN_RELATIVE_SIZE * farthest)
    max_cell_size = size / (cell_count - 1)
    volume = float(np.prod(np.maximum(high - low, max_cell_size)))
    min_cell_size = (volume / (max_cells or _MAX_CELLS)) ** (1.0 / 3.0)
    max_cell_size = min(
        max_cell_size,
        max(
            _typical_reach(strands) / _MIN_CELLS_ALONG_HAIR,
            min_cell_size,
            size * _MIN_RELATIVE_SIZE,
        ),
    )
    cell = 2.0 ** (np.ceil(np.log2(max_cell_size) * _SIZES_PER_DOUBLING) / _SIZES_PER_DOUBLING)
    first = np.floor(low / cell).astype(np.int64) - 2
    last = np.floor(high / cell).astype(np.int64) + 2
    return Grid.of_cells(first, last + 1 - first, float(cell))


def _typical_reach(strands: StrandSet) -> float:
    """Median distance from root to tip [m]."""
    ends = strands.points[strands.offsets[1:] - 1] - strands.roots
    return float(np.median(np.sqrt(np.einsum("ij,ij->i", ends, ends))))


def hair_depth(strands: StrandSet, grid: Grid) -> Floats:
    """Optical depth of the hair across each cell, sigma x cell, of the grid's shape."""
    splat = np.zeros(int(np.prod(grid.shape)))
    tips = strands.offsets[1:] - 1
    for first in range(0, strands.point_count - 1, _SEGMENTS_PER_BATCH):
        cvs = slice(first, min(first + _SEGMENTS_PER_BATCH, strands.point_count - 1))
        to_next_root = tips[np.searchsorted(tips, cvs.start) : np.searchsorted(tips, cvs.stop)]
        splat += _area_in_cells(strands, cvs, to_next_root - first, grid)
    # area per volume x cell = area / cell^2; spread as a trilinear splat would, on average
    return _blurred((splat / grid.cell**2).reshape(grid.shape).astype(np.float32))


def _area_in_cells(strands: StrandSet, cvs: slice, tip_numbers: Ints, grid: Grid) -> Floats:
    """Mean projected area, in each cell, of the segments that begin at these CVs, (cell_count,)
    [m^2].

    Args:
        tip_numbers: numbers of those CVs that are tips and begin no segment.
    """
    # by axes, as numpy is slow at rows of three
    points = grid.coordinates(strands.points[cvs.start : cvs.stop + 1]).T + np.float32(0.5)
    points = np.ascontiguousarray(points)
    start, step = points[:, :-1], points[:, 1:] - points[:, :-1]
    length = np.sqrt(dot_rows(step, step))  # in cells
    length[tip_numbers] = 0.0
    pieces = np.maximum(1, np.ceil(length / np.float32(0.7))).astype(np.int64)
    radius = strands.radius[cvs.start : cvs.stop + 1]
    area = (np.pi / 4.0 * grid.cell) * (radius[1:] + radius[:-1]) * length / pieces
    found: Floats = np.zeros(int(np.prod(grid.shape)))
    for count in np.unique(pieces).tolist():
        members = np.flatnonzero(pieces == count)
        begin, whole, part = start[:, members], step[:, members], area[members]
        for piece in range(count):
            middle = begin + whole * np.float32((piece + 0.5) / count)
            found += np.bincount(_flat_index(middle, grid), part, minlength=len(found))
    return found


def body_depth(body: Surface, grid: Grid) -> Floats:
    """Optical depth of the body across each cell: opaque on a shell below its surface, else 0.

    Parts thinner than the shell's depth, such as ears, have no shell.
    """
    depth = np.zeros(grid.shape, np.float32)
    shell, is_inside = _inset(body, grid)
    corners = shell[body.triangles[is_inside[body.triangles].all(axis=1)]]
    high = grid.low + grid.cell * np.array(grid.shape)
    points = subdivided_triangles(corners, grid.cell, grid.low, high).mean(axis=1)
    coordinates = np.floor((points - grid.low) / grid.cell).astype(np.int64)
    is_near = ((coordinates >= 0) & (coordinates < grid.shape)).all(axis=1)
    depth[tuple(coordinates[is_near].T)] = _OPAQUE
    return _dilated(depth)


def _inset(body: Surface, grid: Grid) -> tuple[Floats, Bools]:
    """The body's vertices moved to the middle of the shell, and which of them lie inside the
    body."""
    normals = body.vertex_normals()
    inward = _SHELL_DEPTH * grid.cell
    shell = body.positions.astype(np.float64) - inward * normals
    margin = 2.0 * inward
    low, high = grid.low - margin, grid.low + grid.cell * np.array(grid.shape) + margin
    near = np.flatnonzero(((shell > low) & (shell < high)).all(axis=1))
    is_inside = np.ones(len(shell), bool)
    if len(near) and len(body.triangles):
        # one vertex is tested for all that lie in one cell and face the same way
        cells = np.floor(shell[near] / grid.cell).astype(np.int64)
        keys = np.concatenate([cells, normals[near] > 0.0], axis=1)
        _, samples, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        is_inside[near] = _is_below(shell[near[samples]], body, 0.7 * inward)[number.ravel()]
    return shell, is_inside


def _is_below(points: Floats, body: Surface, depth: float) -> Bools:
    """Which points lie inside the body, and at least this far from its surface [m], (n,)."""
    closest = search_of(body).closest(points, depth)
    corner_normals = body.vertex_normals()[body.triangles[closest.triangle]]
    normal = np.einsum("nk,nkj->nj", closest.barycentric, corner_normals)
    height = np.einsum("ij,ij->i", points - closest.point, normal)
    result: Bools = (closest.distance > depth) & (height < 0.0)
    return result


def sample(grids: Floats, coordinates: Floats) -> Floats:
    """Trilinear look-up at (n, 3) in grids (k, x, y, z), (k, n) float32; outside of them, their
    border's values."""
    found = np.empty((len(grids), len(coordinates)), np.float32)
    shape, flat = grids.shape[1:], grids.reshape(len(grids), -1)
    along_x, along_y = shape[1] * shape[2], shape[2]
    for first in range(0, len(coordinates), _POINTS_PER_BATCH):
        batch = slice(first, first + _POINTS_PER_BATCH)
        # by axes, as numpy is slow at rows of three
        inside = np.ascontiguousarray(coordinates[batch].T, np.float32)
        for place, count in zip(inside, shape, strict=True):
            np.clip(place, 0.0, count - 1, out=place)
        cell = np.minimum(inside.astype(np.int32), np.array(shape, np.int32)[:, None] - 2)
        inside -= cell
        low = (cell[0] * along_x + cell[1] * along_y + cell[2]).astype(np.int64)
        corners = [low + (along_x * x + along_y * y) for x in (0, 1) for y in (0, 1)]
        ends = [(corner, corner + 1) for corner in corners]
        for grid, target in zip(flat, found, strict=True):
            edges = [
                _lerp_in_place(grid.take(one), grid.take(other), inside[2]) for one, other in ends
            ]
            near = _lerp_in_place(edges[0], edges[1], inside[1])
            far = _lerp_in_place(edges[2], edges[3], inside[1])
            target[batch] = _lerp_in_place(near, far, inside[0])
    return found


def _lerp_in_place(one: Floats, other: Floats, part: Floats) -> Floats:
    """Linear interpolation, written to `one`; overwrites `other` too."""
    other -= one
    other *= part
    one += other
    return one


def _flat_index(points: Floats, grid: Grid) -> Ints:
    """Flat indices of the cells that hold points (3, n), given in cells from the low corner."""
    x, y, z = points.astype(np.int32)
    for axis, count in zip((x, y, z), grid.shape, strict=True):
        np.clip(axis, 0, count - 1, out=axis)
    return (x * grid.shape[1] + y) * grid.shape[2] + z


def _blurred(values: Floats) -> Floats:
    """Each value shared with its neighbours along each axis, 1/8, 3/4, 1/8; the border is empty."""
    for axis in range(3):
        shared = 0.75 * values
        layers, spread = np.moveaxis(values, axis, 0), np.moveaxis(shared, axis, 0)
        spread[1:] += 0.125 * layers[:-1]
        spread[:-1] += 0.125 * layers[1:]
        values = shared
    return values


def _dilated(values: Floats) -> Floats:
    """The largest of each cell and its six neighbours: no diagonal step gets through a shell."""
    result = values.copy()
    for axis in range(3):
        layers, thick = np.moveaxis(values, axis, 0), np.moveaxis(result, axis, 0)
        np.maximum(thick[1:], layers[:-1], out=thick[1:])
        np.maximum(thick[:-1], layers[1:], out=thick[:-1])
    return result


def subdivided_triangles(corners: Floats, size: float, low: Floats, high: Floats) -> Floats:
    """Triangles (t, 3, 3) cut up until no edge is longer than size, (n, 3, 3), near the box only.

    Triangles are quartered until they are small; what leaves the box is dropped on the way, so
    that a floor of two large triangles costs no more than the hair above it.
    """
    found: list[Floats] = [np.zeros((0, 3, 3))]
    while len(corners):
        is_near = (corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)
        corners = corners[is_near.all(axis=1)]
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        is_small = edges.max(axis=1) <= size
        found.append(corners[is_small])
        a, b, c = np.moveaxis(corners[~is_small], 1, 0)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        corners = np.concatenate([np.stack(quarter, axis=1) for quarter in quarters])
    return np.concatenate(found)
