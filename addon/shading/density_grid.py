"""Hair and body as a grid of cells: how much light each cell takes from a ray that crosses it.

    sigma = (pi / 4) 2 r (length of hair in a volume) / volume      [1/m]

is the extinction of randomly oriented cylinders of radius r, pi / 4 the mean of the sine between
hair and ray. The body is a shell that lets nothing through, three cells thick and one cell and a
half below its surface, so that hair at its root is not shut in by the cell that it stands in.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import StrandSet, Surface
from ..strands.closest_point import search_of

#: How far below the surface the middle of the body's shell lies [cells].
_SHELL_DEPTH = 2.5
#: Hair smaller than this gets cells as if it were that large [m].
_SMALLEST_HAIR = 1.0e-9
#: Optical depth of a cell of the body: exp(-30) is nothing.
_OPAQUE = 30.0
#: Segments that are cut up at once: numpy lets no other thread go on while it repeats and counts,
#: so that more of them would stop the window.
_AT_ONCE = 1 << 17


@dataclass(frozen=True)
class Grid:
    """Cubic cells around the hair: low corner (3,) [m], size of a cell [m], cells (x, y, z)."""

    low: Floats
    cell: float
    shape: tuple[int, int, int]

    def coordinates(self, points: Floats) -> Floats:
        """Points (n, 3) [m] in cells; cell i has its centre at i."""
        return ((points - self.low) / self.cell - 0.5).astype(np.float32)


def grid_around(strands: StrandSet, cell_count: int) -> Grid:
    """Cells over all strands, with two empty ones on each side."""
    low, high = (corner.astype(np.float64) for corner in strands.bounds())
    cell = max(float((high - low).max()), _SMALLEST_HAIR) / cell_count
    shape = np.ceil((high - low) / cell).astype(int) + 4
    return Grid(low - 2.0 * cell, cell, (int(shape[0]), int(shape[1]), int(shape[2])))


def hair_depth(strands: StrandSet, grid: Grid) -> Floats:
    """Optical depth of the hair across each cell, sigma x cell, of the grid's shape."""
    is_segment = np.ones(strands.point_count - 1, bool)
    is_segment[strands.offsets[1:-1] - 1] = False  # from one strand's tip to the next one's root
    starts = np.flatnonzero(is_segment)
    splat = np.zeros(int(np.prod(grid.shape)))
    for first in range(0, len(starts), _AT_ONCE):
        splat += _area_in_cells(strands, starts[first : first + _AT_ONCE], grid)
    # area per volume x cell = area / cell^2; spread as a trilinear splat would, on average
    return _spread((splat / grid.cell**2).reshape(grid.shape).astype(np.float32))


def _area_in_cells(strands: StrandSet, start: Ints, grid: Grid) -> Floats:
    """Seen area of the segments that begin at these CVs in each cell, (cell_count,) [m^2]."""
    step = strands.points[start + 1] - strands.points[start]
    length = np.linalg.norm(step, axis=1)
    piece_count = np.maximum(1, np.ceil(length / (0.7 * grid.cell))).astype(np.int64)
    segment = np.repeat(np.arange(len(start)), piece_count)
    first = np.repeat(np.cumsum(piece_count) - piece_count, piece_count)
    along = (np.arange(len(segment)) - first + 0.5) / piece_count[segment]
    middle = strands.points[start][segment] + step[segment] * along[:, None].astype(np.float32)

    radius = 0.5 * (strands.radius[start] + strands.radius[start + 1])
    area = (np.pi / 4.0) * 2.0 * radius * length / piece_count
    cell_count = int(np.prod(grid.shape))
    found: Floats = np.bincount(_flat_index(middle, grid), area[segment], minlength=cell_count)
    return found


def body_depth(body: Surface, grid: Grid) -> Floats:
    """Optical depth of the body across each cell: opaque on a shell below its surface, else 0.

    Parts that are thinner than the shell is deep, such as ears, have none.
    """
    depth = np.zeros(grid.shape, np.float32)
    shell, is_inside = _inset(body, grid)
    corners = shell[body.triangles[is_inside[body.triangles].all(axis=1)]]
    high = grid.low + grid.cell * np.array(grid.shape)
    points = _samples(corners, grid.cell, grid.low, high)
    coordinates = np.floor((points - grid.low) / grid.cell).astype(np.int64)
    is_near = ((coordinates >= 0) & (coordinates < grid.shape)).all(axis=1)
    depth[tuple(coordinates[is_near].T)] = _OPAQUE
    return _thickened(depth)


def _inset(body: Surface, grid: Grid) -> tuple[Floats, Bools]:
    """The body's vertices moved to the middle of the shell, and which came out inside the body."""
    normals = body.vertex_normals()
    inward = _SHELL_DEPTH * grid.cell
    shell = body.positions.astype(np.float64) - inward * normals
    margin = 2.0 * inward
    low, high = grid.low - margin, grid.low + grid.cell * np.array(grid.shape) + margin
    near = np.flatnonzero(((shell > low) & (shell < high)).all(axis=1))
    is_inside = np.ones(len(shell), bool)
    if len(near) and len(body.triangles):
        # of those that lie in one cell and face the same way, one is asked for all
        cells = np.floor(shell[near] / grid.cell).astype(np.int64)
        alike = np.concatenate([cells, normals[near] > 0.0], axis=1)
        _, asked, number = np.unique(alike, axis=0, return_index=True, return_inverse=True)
        is_inside[near] = _is_below(shell[near[asked]], body, 0.7 * inward)[number.ravel()]
    return shell, is_inside


def _is_below(points: Floats, body: Surface, depth: float) -> Bools:
    """Which points lie inside the body, and at least this far from its surface [m], (n,)."""
    closest = search_of(body).closest(points, depth)
    corner_normals = body.vertex_normals()[body.triangles[closest.triangle]]
    normal = np.einsum("nk,nkj->nj", closest.barycentric, corner_normals)
    height = np.einsum("ij,ij->i", points - closest.point, normal)
    result: Bools = (closest.distance > depth) & (height < 0.0)
    return result


def sample(values: Floats, coordinates: Floats) -> Floats:
    """Trilinear look-up in a grid, (n,); outside of it, its border's value."""
    limit = np.array(values.shape, np.float32) - 1.0
    inside = np.clip(coordinates, 0.0, limit)
    cell = np.minimum(inside.astype(np.int32), np.array(values.shape, np.int32) - 2)
    fraction = inside - cell
    strides = np.array([values.shape[1] * values.shape[2], values.shape[2], 1])
    flat, index = values.ravel(), cell @ strides
    total = np.zeros(len(coordinates), np.float32)
    for corner in itertools.product((0, 1), repeat=3):
        weight = np.prod(
            [
                fraction[:, axis] if far else 1.0 - fraction[:, axis]
                for axis, far in enumerate(corner)
            ],
            axis=0,
        )
        total += weight * flat[index + int(strides @ corner)]
    return total


def _flat_index(points: Floats, grid: Grid) -> Ints:
    cell = ((points - grid.low.astype(np.float32)) / np.float32(grid.cell)).astype(np.int32)
    x, y, z = np.clip(cell, 0, np.array(grid.shape, np.int32) - 1).T
    return (x * grid.shape[1] + y) * grid.shape[2] + z


def _spread(values: Floats) -> Floats:
    """Each value shared with its neighbours along each axis, 1/8, 3/4, 1/8; the border is empty."""
    for axis in range(3):
        shared = 0.75 * values
        layers, spread = np.moveaxis(values, axis, 0), np.moveaxis(shared, axis, 0)
        spread[1:] += 0.125 * layers[:-1]
        spread[:-1] += 0.125 * layers[1:]
        values = shared
    return values


def _thickened(values: Floats) -> Floats:
    """The largest of each cell and its six neighbours: no diagonal step gets through a shell."""
    result = values.copy()
    for axis in range(3):
        layers, thick = np.moveaxis(values, axis, 0), np.moveaxis(result, axis, 0)
        np.maximum(thick[1:], layers[:-1], out=thick[1:])
        np.maximum(thick[:-1], layers[1:], out=thick[:-1])
    return result


def _samples(corners: Floats, spacing: float, low: Floats, high: Floats) -> Floats:
    """Points on triangles (t, 3, 3) about a spacing apart, (n, 3), near the box only.

    Triangles are quartered until they are small; what leaves the box is dropped on the way, so
    that a floor of two large triangles costs no more than the hair above it.
    """
    found: list[Floats] = [np.zeros((0, 3))]
    while len(corners):
        is_near = (corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)
        corners = corners[is_near.all(axis=1)]
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        is_small = edges.max(axis=1) <= spacing
        found.append(corners[is_small].mean(axis=1))
        a, b, c = np.moveaxis(corners[~is_small], 1, 0)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        corners = np.concatenate([np.stack(quarter, axis=1) for quarter in quarters])
    return np.concatenate(found)
