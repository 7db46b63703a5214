"""Centre lines: strands of few CVs that follow the path of the strand without its curls.

Resampling a curl with CVs more than half a turn apart aliases. A centre line therefore takes the
mean of the strand around each CV, weighted by a tent that reaches to the neighbouring CVs: a low
pass that removes what the CVs cannot represent.

A strand is straight between its points, so the mean is exact: with G'' = P along the strand, the
mean around s is (G(s - h) - 2 G(s) + G(s + h)) / h^2 for a tent of half-width h.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Floats
from .arc_length import first_point_at_arc_length
from .resample import evenly_spaced
from .strand_set import StrandSet

#: If resampling shortens a strand by less than this fraction, its CVs represent all of its curls.
_MAX_LENGTH_LOSS = 0.02
#: Maximum `curl_slack` of a segment: where curls cancel out, it would have no limit.
_MAX_SLACK = 20.0
#: Points averaged at once, so that they stay in the cache.
_CHUNK = 32_768


def center_lines(strands: StrandSet, cv_count: int) -> StrandSet:
    """The centre lines of strands: `cv_count` CVs each, at equal fractions of their lengths.

    Strands that already have `cv_count` points are respaced too, because riding relies on these
    fractions. Roots and tips stay where they are. Strands without curls are merely resampled.
    """
    lines = evenly_spaced(strands, cv_count)
    if cv_count < 3:
        return lines
    length = strands.lengths()
    shortened = np.flatnonzero(length - lines.lengths() > _MAX_LENGTH_LOSS * length)
    if not len(shortened):
        return lines
    points, counts = lines.grid.copy(), strands.point_counts[shortened]
    for count in np.unique(counts).tolist():
        own = shortened[counts == count]
        for some in np.array_split(own, -(-len(own) * count // _CHUNK)):
            rows = strands.offsets[some, None] + np.arange(count)
            points[some, 1:-1] = _means(strands.points.take(rows, axis=0), cv_count)
    return replace(lines, points=points.reshape(-1, 3))


def curl_slack(length: Floats, lines: Floats) -> Floats | None:
    """How far each segment of centre lines can be stretched until its curls are straight, as a
    fraction of its length, (n, cv_count - 1) float32; None if no strand is curled.

    Args:
        length: (n,) [m] of the strands; the CVs lie evenly along them.
        lines: (n, cv_count, 3) [m].
    """
    segment = np.linalg.norm(np.diff(lines, axis=1), axis=2)
    slack = length[:, None] / segment.shape[1] / np.maximum(segment, 1.0e-12) - 1.0
    is_curled = length - segment.sum(axis=1) > _MAX_LENGTH_LOSS * length
    if not is_curled.any():
        return None
    return np.where(is_curled[:, None], np.clip(slack, 0.0, _MAX_SLACK), 0.0).astype(np.float32)


def _means(grid: Floats, cv_count: int) -> Floats:
    """The tent-weighted means of strands (n, count, 3) at their inner CVs, (n, cv_count - 2, 3)."""
    # one row per axis: numpy is slow on rows of three
    place = np.ascontiguousarray(grid.transpose(2, 0, 1), np.float64)
    root = place[:, :, :1].copy()
    place -= root
    step = np.diff(place, axis=2)
    length = np.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
    along = _running_sums(length)
    target = along[:, -1:] * np.linspace(0.0, 1.0, cv_count)
    offsets = np.arange(len(grid) + 1) * grid.shape[1]
    left = first_point_at_arc_length(along.ravel(), offsets, target) - 1
    left = np.maximum(left, offsets[:-1, None])
    inside = target - along.take(left)
    # the segment in which each CV lies
    segment = left - np.arange(len(grid))[:, None]
    slope = 1.0 / np.maximum(length.take(segment), np.finfo(np.float64).tiny)
    means = np.empty((len(grid), cv_count - 2, 3))
    for axis in range(3):
        near, far = place[axis, :, :-1], place[axis, :, 1:]
        first_integral = _running_sums(0.5 * length * (near + far))
        mean = first_integral[:, :-1] + length * (2.0 * near + far) / 6.0
        second_integral = _running_sums(length * mean)
        integral = place[axis].take(left) / 2.0 + inside * step[axis].take(segment) * slope / 6.0
        integral = first_integral.take(left) + inside * integral
        integral = second_integral.take(left) + inside * integral
        means[..., axis] = np.diff(integral, 2, axis=1)
    spacing = along[:, -1:, None] / (cv_count - 1)
    means /= spacing * spacing
    return means + root.transpose(1, 2, 0)


def _running_sums(parts: Floats) -> Floats:
    """Running sums of parts (n, k), from 0 to the total, (n, k + 1)."""
    total = np.zeros((len(parts), parts.shape[1] + 1))
    np.cumsum(parts, axis=1, out=total[:, 1:])
    return total
