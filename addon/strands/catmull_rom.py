"""The uniform Catmull-Rom curve through the points of strands, as Blender draws hair curves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Floats, Ints


def points_on_curve(grid: Floats, left: Ints, t: Floats) -> Floats:
    """Points of the curves through these CVs, (n, k, 3).

    The neighbours that the end segments lack are extrapolated straight.

    Args:
        grid: (n, cv_count, 3). left: (n, k) segments. t: (n, k) parameters in them, 0 to 1.
    """
    ends = [2.0 * grid[:, :1] - grid[:, 1:2], grid, 2.0 * grid[:, -1:] - grid[:, -2:-1]]
    extended = np.concatenate(ends, axis=1)
    number = left + np.arange(len(grid))[:, None] * extended.shape[1]
    result = np.empty((*number.shape, 3), grid.dtype)
    for axis in range(3):  # one by one: numpy is slow on rows of three
        along = np.ascontiguousarray(extended[..., axis])
        result[..., axis] = catmull_rom([along.take(number + step) for step in range(4)], t)
    return result


def catmull_rom(points: Sequence[Floats], t: Floats) -> Floats:
    """The curve between the second of four points, at t = 0, and the third, at t = 1; all arrays
    broadcast.
    """
    p0, p1, p2, p3 = points
    m1, m2 = 0.5 * (p2 - p0), 0.5 * (p3 - p1)  # the tangents
    chord = p2 - p1
    point: Floats = p1 + t * (m1 + t * (3.0 * chord - 2.0 * m1 - m2 + t * (m1 + m2 - 2.0 * chord)))
    return point


def catmull_rom_derivative(points: Sequence[Floats], t: Floats) -> Floats:
    """The derivative of `catmull_rom` by t."""
    p0, p1, p2, p3 = points
    m1, m2 = 0.5 * (p2 - p0), 0.5 * (p3 - p1)
    chord = p2 - p1
    derivative: Floats = m1 + t * (
        2.0 * (3.0 * chord - 2.0 * m1 - m2) + t * 3.0 * (m1 + m2 - 2.0 * chord)
    )
    return derivative


def even_points_on_curve(grid: Floats, count: int) -> Floats:
    """The curves sampled at `count` even parameters each, (n, count, 3); both ends stay."""
    left, t = even_parameters(grid.shape[1], count)
    shape = len(grid), count
    return points_on_curve(grid, np.broadcast_to(left, shape), np.broadcast_to(t, shape))


def even_parameters(cv_count: int, count: int) -> tuple[Ints, Floats]:
    """The even parameters: segment (count,), and t in it (count,) float32 from 0 to 1."""
    place = np.linspace(0.0, cv_count - 1.0, count)
    left = np.minimum(place.astype(np.int64), cv_count - 2)
    return left, (place - left).astype(np.float32)
