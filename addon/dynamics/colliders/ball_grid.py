"""A grid that narrows down which of many balls may be nearest to a point.

Moving a point changes distances by no more than the point moves. So the nearest ball at any point
of a cell with center c and half diagonal h is one of those with

    d_i(c) <= min_j d_j(c) + 2 h,

and no point of the cell is nearer to a ball than min_j d_j(c) - h. The same criterion narrows down
the balls of a block of cells first, which saves most of the work.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats, Ints

#: Cells along the longest side of the balls' box, and cells of a block along each side.
RESOLUTION, BLOCK = 40, 4
#: Pairs of points and balls measured at once.
PAIR_LIMIT = 1 << 18
#: Fraction of a cell added to h, for rounding.
_SLACK = 1.0e-3


@dataclass(frozen=True)
class BallGrid:
    """The balls that may be nearest to a point of each cell.

    low: (3,) float32 [m], corner of cell (0, 0, 0). cell: edge [m]. shape: (3,) cells.
    min_distance: (cell_count,) float32 [m], lower limit of the distance of the cell's points.
    cell_row, row_begin: (cell_count,) and (cell_count + 1,); the balls of cell c are
        ball[begin[row[c]]:begin[row[c] + 1]].
    """

    low: Floats
    cell: float
    shape: Ints
    min_distance: Floats
    cell_row: Ints
    row_begin: Ints
    ball_index: Ints


def ball_grid(centers: Floats, radii: Floats) -> BallGrid:
    """The grid of balls; centers: (n, 3), radii: (n,) float32 [m]."""
    low, high = box_of(centers, radii)
    cell = float((high - low).max()) / RESOLUTION
    blocks = np.ceil((high - low) / (cell * BLOCK) - _SLACK).astype(np.int64)
    blocks = np.maximum(blocks, 1)
    shape = blocks * BLOCK
    half = np.float32(cell * (np.sqrt(3.0) / 2.0 + _SLACK))
    block = np.stack(np.unravel_index(np.arange(blocks.prod()), blocks)) * BLOCK  # first cells
    inside = np.stack(np.unravel_index(np.arange(BLOCK**3), (BLOCK,) * 3))
    steps = np.array([shape[1] * shape[2], shape[2], 1])
    nearest = np.empty(shape.prod(), np.float32)
    row = np.empty(shape.prod(), np.int64)
    offset = (cell * (inside + 0.5)).astype(np.float32)
    counts, balls, done = [], [], 0
    for part in np.array_split(block, -(-block.shape[1] * len(radii) // (PAIR_LIMIT >> 4)), axis=1):
        corner = (low[:, None] + cell * part).astype(np.float32)
        which, ball = _may_be_nearest(corner + np.float32(cell * BLOCK / 2), centers, radii, half)
        distance = _pair_distances(corner[:, which], offset, centers[ball], radii[ball])
        first = np.flatnonzero(np.diff(which, prepend=-1))
        min_distance = np.minimum.reduceat(distance, first, axis=1)
        is_near = distance <= (min_distance + 2.0 * half)[:, which]
        counts.append(np.add.reduceat(is_near, first, axis=1, dtype=np.int64).ravel())
        balls.append(ball[np.nonzero(is_near)[1]])
        cells = (steps @ inside)[:, None] + steps @ part
        nearest[cells] = min_distance - half
        row[cells] = done + np.arange(cells.size).reshape(cells.shape)
        done += cells.size
    begin = np.concatenate([[0], np.cumsum(np.concatenate(counts))])
    return BallGrid(low, cell, shape, nearest, row, begin, np.concatenate(balls))


def box_of(centers: Floats, radii: Floats) -> tuple[Floats, Floats]:
    """Lowest and highest corner (3,) of the box around all balls."""
    return (centers - radii[:, None]).min(axis=0), (centers + radii[:, None]).max(axis=0)


def ball_distances(points: Floats, centers: Floats, radii: Floats) -> Floats:
    """Signed distance [m] of every ball to every point (3, m), (n, m)."""
    squared = np.zeros((len(radii), points.shape[1]), np.float32)
    for axis, row in enumerate(points):
        displacement = row - centers[:, axis, None]
        displacement *= displacement
        squared += displacement
    distance: Floats = np.sqrt(squared, out=squared)
    distance -= radii[:, None]
    return distance


def _may_be_nearest(
    middle: Floats, centers: Floats, radii: Floats, half: np.float32
) -> tuple[Ints, Ints]:
    """Pairs (block, ball), ascending by block, of balls that may be nearest somewhere in a block.

    Args:
        middle: (3, m) of the blocks. half: [m], half the diagonal of a cell.
    """
    distance = ball_distances(middle, centers, radii)
    reach = distance.min(axis=0) + np.float32(2.0 * BLOCK) * half
    which, ball = np.nonzero((distance <= reach).T)
    return which, ball


def _pair_distances(corner: Floats, offset: Floats, centers: Floats, radii: Floats) -> Floats:
    """Signed distance [m] of each pair's ball, (n, 3) and (n,), from the points at all offsets
    (3, m) from the pair's corner (3, n), (m, n)."""
    squared = np.zeros((offset.shape[1], len(radii)), np.float32)
    for axis in range(3):
        displacement = (corner[axis] - centers[:, axis]) + offset[axis, :, None]
        displacement *= displacement
        squared += displacement
    distance: Floats = np.sqrt(squared, out=squared)
    distance -= radii
    return distance
