"""Arc lengths along strands, point by point; point counts may differ."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints, number_in_piece

#: Points off by less than this fraction of the strand's length count as evenly spaced.
_EVEN_TOLERANCE = 0.02
#: Points processed at once, so that they stay in the cache.
_CHUNK = 16_384
#: `typical_length` rounds the mantissa of the median to multiples of 1 / _MANTISSA_STEPS.
_MANTISSA_STEPS = 512


def segment_lengths(points: Floats, offsets: Ints) -> Floats:
    """The length of the segment that ends at each point, (point_count,) float64 [m]; 0 at roots.

    Args:
        points: (point_count, 3) [m], strand by strand, root first.
        offsets: (strand_count + 1,), strand s is points[offsets[s]:offsets[s + 1]].
    """
    length = np.zeros(len(points))
    for first in range(0, len(points) - 1, _CHUNK):
        # one row per axis: numpy is slow on rows of three
        rows = np.ascontiguousarray(points[first : first + _CHUNK + 1].T, np.float64)
        step = rows[:, 1:] - rows[:, :-1]
        step *= step
        x, y, z = step
        x += z
        x += y
        np.sqrt(x, out=length[first + 1 : first + 1 + len(x)])
    length[offsets[:-1]] = 0.0
    return length


def strand_lengths(points: Floats, offsets: Ints) -> Floats:
    """Arc length of each strand, (strand_count,) float32 [m]; arguments as for
    `segment_lengths`."""
    if len(offsets) < 2:
        return np.zeros(0, np.float32)
    total: Floats = np.add.reduceat(segment_lengths(points, offsets), offsets[:-1])
    return total.astype(np.float32)


def typical_length(length: Floats) -> float:
    """The median of lengths (n,), rounded to its first binary digits.

    Rounded so that combing a few strands does not change the unit that all others are measured in.
    """
    mantissa, exponent = np.frexp(np.median(length))
    return float(np.ldexp(np.round(mantissa * _MANTISSA_STEPS), exponent)) / _MANTISSA_STEPS


def arc_lengths(points: Floats, offsets: Ints) -> Floats:
    """The distance of each point from its root, along the strand, (point_count,) float64 [m].

    The values of a strand do not depend on other strands, not even by rounding. Arguments as for
    `segment_lengths`.
    """
    length, counts = segment_lengths(points, offsets), np.diff(offsets)
    if len(counts) and (counts == counts[0]).all():
        return np.cumsum(length.reshape(len(counts), -1), axis=1).ravel()
    for count in np.unique(counts).tolist():
        own = offsets[:-1][counts == count, None] + np.arange(count)
        length[own] = np.cumsum(length[own], axis=1)
    return length


def length_fractions(points: Floats, offsets: Ints) -> Floats:
    """The fraction of its strand's length at which each point lies, (point_count,) float64.

    Where a strand has no length, its points are spaced evenly. Arguments as for `segment_lengths`.
    """
    return length_fractions_from(arc_lengths(points, offsets), offsets)


def length_fractions_from(length: Floats, offsets: Ints) -> Floats:
    """`length_fractions`, (point_count,), computed from the result of `arc_lengths`."""
    whole = np.repeat(length[offsets[1:] - 1], np.diff(offsets))
    fraction = np.divide(length, whole, out=even_fractions(offsets), where=whole > 0.0)
    fraction[offsets[1:] - 1] = 1.0
    return np.minimum(fraction, 1.0)


def uneven_length_fractions(points: Floats, offsets: Ints) -> Floats | None:
    """`length_fractions` as float32; None if all points are about evenly spaced, as after
    resampling."""
    fraction = length_fractions(points, offsets)
    if np.abs(fraction - even_fractions(offsets)).max(initial=0.0) < _EVEN_TOLERANCE:
        return None
    return fraction.astype(np.float32)


def even_fractions(offsets: Ints) -> Floats:
    """`length_fractions` for evenly spaced points, (point_count,) float64."""
    counts = np.diff(offsets)
    return number_in_piece(counts) / np.repeat(np.maximum(counts - 1, 1), counts)


def first_point_at_arc_length(along: Floats, offsets: Ints, target: Floats) -> Ints:
    """The first point of each strand at or past each target arc length, (strand_count, n).

    Args:
        along: see `arc_lengths`. target: (strand_count, n) [m], no farther than the tip.
    """
    number = np.arange(len(target))
    length = np.maximum(along[offsets[1:] - 1], np.finfo(np.float64).tiny)
    # keys ascend over all strands, so that one search does for all; a large strand number costs
    # digits of the fraction, so the search may be off by one point, which the end corrects
    keys = along / np.repeat(length, np.diff(offsets)) + 2.0 * np.repeat(number, np.diff(offsets))
    target_keys = target / length[:, None] + 2.0 * number[:, None]
    right = np.searchsorted(keys, target_keys.ravel(), side="left").reshape(target.shape)
    low, high = offsets[:-1, None], offsets[1:, None] - 1
    right = np.clip(right, low, high)
    right = np.where(along[np.maximum(right - 1, low)] >= target, np.maximum(right - 1, low), right)
    return np.where(along[right] < target, np.minimum(right + 1, high), right)
