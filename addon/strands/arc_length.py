"""Lengths along strands of any point counts, point by point."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints

#: Points that lie nearer than this to where evenly spaced ones are count as such, in lengths.
_EVEN = 0.02
#: Points looked at at once: they stay in the cache.
_AT_ONCE = 16_384
#: Parts of a power of two by which a typical length counts.
_TYPICAL = 512


def steps(points: Floats, offsets: Ints) -> Floats:
    """The length of the segment that ends at each point, (point_count,) float64 [m]; 0 at roots.

    Args:
        points: (point_count, 3) [m], strand after strand, root first.
        offsets: (strand_count + 1,), strand s is points[offsets[s]:offsets[s + 1]].
    """
    length = np.zeros(len(points))
    for first in range(0, len(points) - 1, _AT_ONCE):
        # by axes, as numpy is slow at rows of three
        rows = np.ascontiguousarray(points[first : first + _AT_ONCE + 1].T, np.float64)
        step = rows[:, 1:] - rows[:, :-1]
        step *= step
        x, y, z = step
        x += z
        x += y
        np.sqrt(x, out=length[first + 1 : first + 1 + len(x)])
    length[offsets[:-1]] = 0.0
    return length


def lengths(points: Floats, offsets: Ints) -> Floats:
    """Arc length of each strand, (strand_count,) float32 [m]; arguments as of `steps`."""
    if len(offsets) < 2:
        return np.zeros(0, np.float32)
    total: Floats = np.add.reduceat(steps(points, offsets), offsets[:-1])
    return total.astype(np.float32)


def typical(length: Floats) -> float:
    """The median of lengths (n,) by its first binary digits: a brush that touches some strands does
    not change what is measured by it everywhere else."""
    mantissa, exponent = np.frexp(np.median(length))
    return float(np.ldexp(np.round(mantissa * _TYPICAL), exponent)) / _TYPICAL


def reached(points: Floats, offsets: Ints) -> Floats:
    """The distance from the root along its strand at each point, (point_count,) float64 [m]; that
    of one strand does not depend on others, nor by rounding. Arguments as of `steps`.
    """
    length, counts = steps(points, offsets), np.diff(offsets)
    if len(counts) and (counts == counts[0]).all():
        return np.cumsum(length.reshape(len(counts), -1), axis=1).ravel()
    for count in np.unique(counts).tolist():
        own = offsets[:-1][counts == count, None] + np.arange(count)
        length[own] = np.cumsum(length[own], axis=1)
    return length


def along(points: Floats, offsets: Ints) -> Floats:
    """The fraction of its strand's length at which each point lies, (point_count,) float64; by the
    points' numbers where a strand has no length. Arguments as of `steps`.
    """
    return along_of(reached(points, offsets), offsets)


def along_of(length: Floats, offsets: Ints) -> Floats:
    """`along` of what was `reached`."""
    whole = np.repeat(length[offsets[1:] - 1], np.diff(offsets))
    fraction = np.divide(length, whole, out=even(offsets), where=whole > 0.0)
    fraction[offsets[1:] - 1] = 1.0
    return np.minimum(fraction, 1.0)


def uneven_along(points: Floats, offsets: Ints) -> Floats | None:
    """`along` as float32; None where points are about evenly spaced, as resampling spaces them."""
    fraction = along(points, offsets)
    if np.abs(fraction - even(offsets)).max(initial=0.0) < _EVEN:
        return None
    return fraction.astype(np.float32)


def even(offsets: Ints) -> Floats:
    """What `along` is for evenly spaced points, (point_count,) float64."""
    counts = np.diff(offsets)
    number = np.arange(offsets[-1]) - np.repeat(offsets[:-1], counts)
    return number / np.repeat(np.maximum(counts - 1, 1), counts)


def first_as_far(along: Floats, offsets: Ints, wanted: Floats) -> Ints:
    """The first point of each strand that is as far along it as wanted, (strand_count, n).

    Args:
        along: see `reached`. wanted: (strand_count, n) [m], no farther than its tip.
    """
    number = np.arange(len(wanted))
    length = np.maximum(along[offsets[1:] - 1], np.finfo(np.float64).tiny)
    # ascending over all strands, so that one search serves them all; as the number of a strand
    # takes of its digits, it may find the point before or after
    every = along / np.repeat(length, np.diff(offsets)) + 2.0 * np.repeat(number, np.diff(offsets))
    asked = wanted / length[:, None] + 2.0 * number[:, None]
    right = np.searchsorted(every, asked.ravel(), side="left").reshape(wanted.shape)
    low, high = offsets[:-1, None], offsets[1:, None] - 1
    right = np.clip(right, low, high)
    right = np.where(along[np.maximum(right - 1, low)] >= wanted, np.maximum(right - 1, low), right)
    return np.where(along[right] < wanted, np.minimum(right + 1, high), right)
