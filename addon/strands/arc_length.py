"""Lengths along strands of any point counts, point by point."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints

#: Points that lie nearer than this to where evenly spaced ones are count as such, in lengths.
_EVEN = 0.02


def steps(points: Floats, offsets: Ints) -> Floats:
    """The length of the segment that ends at each point, (point_count,) float64 [m]; 0 at roots.

    Args:
        points: (point_count, 3) [m], strand after strand, root first.
        offsets: (strand_count + 1,), strand s is points[offsets[s]:offsets[s + 1]].
    """
    length = np.zeros(len(points))
    if len(points):
        step = np.diff(points.astype(np.float64), axis=0)
        np.sqrt(np.einsum("ij,ij->i", step, step), out=length[1:])
        length[offsets[:-1]] = 0.0
    return length


def lengths(points: Floats, offsets: Ints) -> Floats:
    """Arc length of each strand, (strand_count,) float32 [m]; arguments as of `steps`."""
    totals = np.concatenate([[0.0], np.cumsum(steps(points, offsets))])
    return (totals[offsets[1:]] - totals[offsets[:-1]]).astype(np.float32)


def along(points: Floats, offsets: Ints) -> Floats:
    """The fraction of its strand's length at which each point lies, (point_count,) float64; by the
    points' numbers where a strand has no length. Arguments as of `steps`.
    """
    counts = np.diff(offsets)
    total = np.cumsum(steps(points, offsets))
    reached = total - np.repeat(total[offsets[:-1]], counts)
    length = np.repeat(total[offsets[1:] - 1] - total[offsets[:-1]], counts)
    fraction = np.divide(reached, length, out=even(offsets), where=length > 0.0)
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
