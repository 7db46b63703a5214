"""Resampling strands by arc length to a common point count, so that they form a dense grid."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from .arc_length import arc_lengths, first_point_at_arc_length
from .strand_set import StrandSet


def resample(strands: StrandSet, cv_count: int) -> StrandSet:
    """The same strands with `cv_count` points each, equally spaced along the polyline.

    Roots and tips stay exactly where they are. A set that already has this count is returned
    unchanged, so that an artist's own spacing survives.
    """
    if strands.strand_count == 0 or (strands.point_counts == cv_count).all():
        return strands
    return evenly_spaced(strands, cv_count)


def evenly_spaced(strands: StrandSet, cv_count: int) -> StrandSet:
    """`resample` that also respaces strands which already have this count."""
    left, weight = arc_length_positions(strands, cv_count)
    points = _mix(strands.points, left, weight[..., None])
    radius = _mix(strands.radius, left, weight)
    color = strands.color
    if color is not None:
        color = _mix(color, left, weight[..., None]).reshape(-1, 3)
    return StrandSet(
        points.reshape(-1, 3),
        np.arange(strands.strand_count + 1, dtype=np.int32) * cv_count,
        radius.reshape(-1),
        strands.group,
        strands.root_uv,
        strands.root_triangle,
        strands.root_barycentric,
        color,
        strands.has_widths,
        strands.seed,
    )


def arc_length_positions(strands: StrandSet, cv_count: int) -> tuple[Ints, Floats]:
    """Where equally spaced samples lie: the point before each, and the weight of the next point.

    Returns:
        left: (strand_count, cv_count) indices into points.
        weight: (strand_count, cv_count) in [0, 1].
    """
    return positions_at(arc_lengths(strands.points, strands.offsets), strands.offsets, cv_count)


def positions_at(along: Floats, offsets: Ints, cv_count: int) -> tuple[Ints, Floats]:
    """`arc_length_positions` from the arc length `along` at each point, see `arc_lengths`."""
    first, last = offsets[:-1], offsets[1:] - 1
    target = along[last, None] * np.linspace(0.0, 1.0, cv_count)
    right = first_point_at_arc_length(along, offsets, target)
    right = np.clip(right, first[:, None] + 1, last[:, None])
    left = right - 1
    span = along[right] - along[left]
    weight = np.divide(target - along[left], span, out=np.zeros_like(target), where=span > 0.0)
    weight = np.clip(weight, 0.0, 1.0)
    left[:, 0], weight[:, 0] = first, 0.0
    left[:, -1], weight[:, -1] = last - 1, 1.0
    return left, weight.astype(np.float32)


def _mix(values: Floats, left: Ints, weight: Floats) -> Floats:
    # take is three times as fast as indexing
    near, far = values.take(left, axis=0), values.take(left + 1, axis=0)
    near *= 1.0 - weight
    far *= weight
    near += far
    return near
