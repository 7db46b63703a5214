"""The smooth curve of a strand: one cubic Bezier a segment, through all of its CVs.

The tangent at a CV is half the way from its neighbour before to its neighbour after (Catmull and
Rom 1974, the uniform form), so for a segment from p1 to p2 with the neighbours p0 and p3:

    b0 = p1    b1 = p1 + (p2 - p0) / 6    b2 = p2 - (p3 - p1) / 6    b3 = p2

Beyond its ends a strand goes on straight. Segments share their ends and the tangents there. All is
linear in the CVs, so mixing smoothed guides equals smoothing the mixed guides (Nguyen and Donnelly
2005, GPU Gems 2, chapter 23, interpolate after smoothing, because that smooths fewer strands).
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints

#: Multiplications of one product of matrices. BLAS spreads larger ones over threads, which wait for
#: each other longer than they work: 4 ms for 762 strands on a busy machine instead of 0.1.
_PRODUCT = 1 << 18


def extended(grid: Floats) -> Floats:
    """The CVs with one more before the root and one after the tip, straight on.

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


def smoothed(grid: Floats, pieces: int) -> Floats:
    """Points of the curves, `pieces` evenly spaced ones a segment, the CVs among them bit for bit.

    (strand_count, cv_count, 3) becomes (strand_count, (cv_count - 1) * pieces + 1, 3) float32.
    """
    segment_count = grid.shape[1] - 1
    segment = np.append(np.repeat(np.arange(segment_count), pieces), segment_count - 1)
    u = np.append(np.tile(np.arange(pieces) / pieces, segment_count), 1.0)
    return _combined(grid, segment, u)


def smoothed_at(grid: Floats, along: Floats) -> Floats:
    """Points of the curves at places from root, 0, to tip, 1, even in the CVs' numbers.

    (strand_count, cv_count, 3) and (point_count,) give (strand_count, point_count, 3) float32.
    """
    segment_count = grid.shape[1] - 1
    place = np.clip(np.asarray(along, np.float64), 0.0, 1.0) * segment_count
    segment = np.minimum(place.astype(np.int64), segment_count - 1)
    return _combined(grid, segment, place - segment)


def points_at(grid: Floats, strand: Ints, segment: Ints, u: Floats) -> Floats:
    """Points of the curves, (n, 3), each of one strand, in one segment, u in [0, 1] along it."""
    last = grid.shape[1] - 1
    rows = basis_weights(np.asarray(u))
    result = np.zeros((len(rows), 3), np.result_type(grid, np.float32))
    cvs = extended(grid).reshape(-1, 3)
    first = np.asarray(strand, np.int64) * (last + 3) + segment
    for neighbour in range(4):
        result += rows[:, neighbour, None].astype(result.dtype) * cvs[first + neighbour]
    return result


def basis_weights(u: Floats) -> Floats:
    """What p0, p1, p2 and p3 weigh at u in [0, 1], (n, 4), sum 1."""
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


def _combined(grid: Floats, segment: Ints, u: Floats) -> Floats:
    """The same places (n,) on all strands: (strand_count, n, 3) float32.

    One product of matrices over numbers that lie in a row, x, y and z of all CVs of a strand.
    """
    strand_count, cv_count, _ = grid.shape
    weight = np.zeros((len(segment), cv_count + 2))
    np.put_along_axis(weight, segment[:, None] + np.arange(4), basis_weights(u), axis=1)
    # what the CVs beyond the ends weigh goes to those that they follow from
    weight[:, [1, 2]] += weight[:, :1] * [2.0, -1.0]
    weight[:, [-2, -3]] += weight[:, -1:] * [2.0, -1.0]
    rows = np.kron(weight[:, 1:-1].T, np.eye(3)).astype(np.float32)
    flat = np.ascontiguousarray(grid, np.float32).reshape(strand_count, cv_count * 3)
    points = np.empty((strand_count, rows.shape[1]), np.float32)
    chunk = max(1, _PRODUCT // rows.size)
    for start in range(0, strand_count, chunk):
        np.matmul(flat[start : start + chunk], rows, out=points[start : start + chunk])
    return points.reshape(strand_count, len(segment), 3)
