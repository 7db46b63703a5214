"""The smooth curve of a strand: one cubic Bezier per segment, through all of its CVs.

The tangent at a CV is half the vector from its previous to its next neighbour (Catmull and Rom
1974, the uniform form), so for a segment from p1 to p2 with the neighbours p0 and p3:

    b0 = p1    b1 = p1 + (p2 - p0) / 6    b2 = p2 - (p3 - p1) / 6    b3 = p2

Beyond its ends a strand is extrapolated straight. Segments share end points and tangents there.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints


def extended(grid: Floats) -> Floats:
    """The CVs, extrapolated straight by one before the root and one after the tip.

    (strand_count, cv_count, 3) becomes (strand_count, cv_count + 2, 3); at least two CVs.
    """
    before = 2.0 * grid[:, :1] - grid[:, 1:2]
    after = 2.0 * grid[:, -1:] - grid[:, -2:-1]
    return np.concatenate([before, grid, after], axis=1)


def bezier(grid: Floats) -> Floats:
    """Control points of each segment, (strand_count, cv_count - 1, 4, 3), from CVs (S, C, 3)."""
    cvs = extended(grid)
    p0, p1, p2, p3 = cvs[:, :-3], cvs[:, 1:-2], cvs[:, 2:-1], cvs[:, 3:]
    return np.stack([p1, p1 + (p2 - p0) / 6.0, p2 - (p3 - p1) / 6.0, p2], axis=2)


def points_at(grid: Floats, strand: Ints, segment: Ints, u: Floats) -> Floats:
    """Points of the curves, (n, 3), given the strand, segment and parameter u in [0, 1] of each."""
    last = grid.shape[1] - 1
    rows = basis_weights(np.asarray(u))
    result = np.zeros((len(rows), 3), np.result_type(grid, np.float32))
    cvs = extended(grid).reshape(-1, 3)
    first = np.asarray(strand, np.int64) * (last + 3) + segment
    for neighbour in range(4):
        result += rows[:, neighbour, None].astype(result.dtype) * cvs[first + neighbour]
    return result


def basis_weights(u: Floats) -> Floats:
    """The weights of p0, p1, p2 and p3 at u in [0, 1], (n, 4), sum 1."""
    v = 1.0 - u
    return np.stack(
        [
            -0.5 * u * v * v,
            1.0 + u * u * (1.5 * u - 2.5),
            1.0 + v * v * (1.5 * v - 2.5),
            -0.5 * v * u * u,
        ],
        axis=-1,
    )
