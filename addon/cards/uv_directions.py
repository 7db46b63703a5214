"""The direction of hair in the UVs of an artist's own cards: the axis, and the root end.

The evidence for each island of UVs is how long its triangles are along u and along v, which of its
two ends is nearer to the head, and which is higher. Where one island is undecided, all others
decide: hair textures are painted with all roots on one side.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..arrays import Bools, Floats, Ints, sums_by
from ..strands.triangles import areas_of

#: The direction from root to tip in all UVs: "auto" finds it, the others are known.
type UvDirection = Literal["auto", "up", "down", "right", "left"]
#: (axis, whether the root is where the coordinate is largest)
_DIRECTIONS: dict[str, tuple[int, bool]] = {
    "up": (1, False),
    "down": (1, True),
    "right": (0, False),
    "left": (0, True),
}

#: An island that is this many times longer along one axis decides for itself.
_CLEAR_LENGTH_RATIO = 2.0
#: So does one whose ends differ by this, as a fraction of its length.
_CLEAR_END_DIFFERENCE = 0.3
#: Differences of ends below this are no evidence.
_MIN_END_DIFFERENCE = 0.05
#: Weight of being higher, relative to being nearer to the head.
_HEIGHT_WEIGHT = 0.2
#: Fraction of an island's length that counts as one of its ends.
_END_FRACTION = 0.25


@dataclass(frozen=True)
class UvAxes:
    """The direction of each island.

    axis: (island_count,) 0 where hair runs along u, 1 along v.
    is_reversed: (island_count,) whether the root is where that coordinate is largest.
    is_deviating: (island_count,) whether it runs in another direction than the others.
    is_undecided: (island_count,) whether the root end is unknown even from the others.
    """

    axis: Ints
    is_reversed: Bools
    is_deviating: Bools
    is_undecided: Bools


def uv_axes(
    corners: Floats, uv: Floats, distance: Floats, island: Ints, direction: UvDirection = "auto"
) -> UvAxes:
    """Find the direction of each island.

    Args:
        corners: (triangle_count, 3, 3) [m].
        uv: (triangle_count, 3, 2).
        distance: (triangle_count, 3) from the head [m].
        island: (triangle_count,) numbered from 0 without gaps.
        direction: of all islands, when it is known.
    """
    if direction != "auto":
        count = int(island.max()) + 1
        known_axis, known_end = _DIRECTIONS[direction]
        none = np.zeros(count, bool)
        return UvAxes(np.full(count, known_axis), np.full(count, known_end), none, none)
    area = sums_by(island, areas_of(corners))
    lengths = _lengths(corners, uv, island)
    ratio = np.log(np.maximum(lengths[:, 1], 1e-12) / np.maximum(lengths[:, 0], 1e-12))
    usual_axis = int((area * ratio).sum() >= 0.0)
    is_clear = np.abs(ratio) > np.log(_CLEAR_LENGTH_RATIO)
    axis = np.where(is_clear, (ratio > 0.0).astype(np.int64), usual_axis)

    length = np.take_along_axis(lengths, axis[:, None], axis=1)[:, 0]
    end = _end_evidence(corners, uv, distance, island, axis) / np.maximum(length, 1e-12)
    is_reversed = np.zeros(len(axis), bool)
    is_deviating, is_undecided = axis != usual_axis, np.zeros(len(axis), bool)
    for each in (0, 1):
        own = axis == each
        vote = float((area * np.clip(end, -1.0, 1.0))[own].sum())
        is_strong = np.abs(end) > _CLEAR_END_DIFFERENCE
        is_reversed[own] = np.where(is_strong, end > 0.0, vote > 0.0)[own]
        is_deviating |= own & is_strong & ((end > 0.0) != (vote > 0.0))
        if abs(vote) <= _MIN_END_DIFFERENCE * float(area[own].sum()):
            is_undecided |= own & ~is_strong
    return UvAxes(axis, is_reversed, is_deviating, is_undecided & ~is_deviating)


def coordinate_gradients(corners: Floats, uv: Floats) -> Floats:
    """Derivatives of the position by u and by v, (triangle_count, 2, 3) [m]; 0 where UVs have no
    area."""
    edge_1, edge_2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    uv_edge_1, uv_edge_2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area = uv_edge_1[:, 0] * uv_edge_2[:, 1] - uv_edge_1[:, 1] * uv_edge_2[:, 0]
    inverse = np.divide(1.0, area, out=np.zeros_like(area), where=np.abs(area) > 1e-14)
    along_u = edge_1 * uv_edge_2[:, 1:] - edge_2 * uv_edge_1[:, 1:]
    along_v = edge_2 * uv_edge_1[:, :1] - edge_1 * uv_edge_2[:, :1]
    gradients: Floats = np.stack([along_u, along_v], axis=1) * inverse[:, None, None]
    return gradients


def island_bounds(values: Floats, island: Ints) -> tuple[Floats, Floats]:
    """Minimum and maximum of (triangle_count, 3, ...) values of each island."""
    order = np.argsort(island, kind="stable")
    starts = np.searchsorted(island[order], np.arange(int(island.max()) + 1))
    low = np.minimum.reduceat(values.min(axis=1)[order], starts)
    high = np.maximum.reduceat(values.max(axis=1)[order], starts)
    return low, high


def _lengths(corners: Floats, uv: Floats, island: Ints) -> Floats:
    """Lengths of each island along u and along v, (island_count, 2) [m]."""
    speed = np.linalg.norm(coordinate_gradients(corners, uv), axis=2)
    weight = areas_of(corners) * (speed > 0.0).all(axis=1)
    total = np.maximum(sums_by(island, weight), 1e-30)
    mean = np.stack([sums_by(island, weight * speed[:, axis]) / total for axis in (0, 1)], axis=1)
    low, high = island_bounds(uv, island)
    lengths: Floats = mean * (high - low)
    return lengths


def _end_evidence(
    corners: Floats, uv: Floats, distance: Floats, island: Ints, axis: Ints
) -> Floats:
    """How much nearer to the head, and higher, the end of large coordinates is, (island_count,)
    [m]."""
    corner_axis = axis[island]
    coordinate = np.take_along_axis(uv, corner_axis[:, None, None], axis=2)[:, :, 0]
    low, high = island_bounds(coordinate, island)
    size = np.maximum(high - low, 1e-12)[island, None]
    fraction = ((coordinate - low[island, None]) / size).ravel()
    corner_island = np.repeat(island, 3)
    nearness = (_HEIGHT_WEIGHT * corners[:, :, 2] - distance).ravel()
    ends = []
    for is_end in (fraction <= _END_FRACTION, fraction >= 1.0 - _END_FRACTION):
        count = np.maximum(sums_by(corner_island, is_end.astype(np.float64), len(axis)), 1.0)
        ends.append(sums_by(corner_island, np.where(is_end, nearness, 0.0), len(axis)) / count)
    difference: Floats = ends[1] - ends[0]
    return difference
