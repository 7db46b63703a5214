"""The direction of hair in the UVs of an artist's own cards: the axis, and the root end.

The evidence for each island of UVs is how long its triangles are along u and along v, which of its
two ends is nearer to the head, and which is higher. Where one island is undecided, all others
decide: hair textures are painted with all roots on one side.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands.triangles import areas_of

#: The direction from root to tip in all UVs: "auto" finds it, the others are known.
type UvDirection = Literal["auto", "up", "down", "right", "left"]
#: (axis, whether the root is where the coordinate is largest)
_KNOWN: dict[str, tuple[int, bool]] = {
    "up": (1, False),
    "down": (1, True),
    "right": (0, False),
    "left": (0, True),
}

#: An island that is this many times longer along one axis decides for itself.
_CLEAR_LENGTH = 2.0
#: So does one whose ends differ by this, as a fraction of its length.
_CLEAR_END = 0.3
#: Differences of ends below this are no evidence.
_NO_END = 0.05
#: Weight of being higher, relative to being nearer to the head.
_HEIGHT_WEIGHT = 0.2
#: Fraction of an island's length that counts as one of its ends.
_END_FRACTION = 0.25


@dataclass(frozen=True)
class UvAxes:
    """The direction of each island.

    axis: (island_count,) 0 where hair runs along u, 1 along v.
    is_down: (island_count,) whether the root is where that coordinate is largest.
    is_against: (island_count,) whether it runs in another direction than the others.
    is_unsaid: (island_count,) whether the root end is unknown even from the others.
    """

    axis: Ints
    is_down: Bools
    is_against: Bools
    is_unsaid: Bools


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
        known_axis, known_end = _KNOWN[direction]
        nobody = np.zeros(count, bool)
        return UvAxes(np.full(count, known_axis), np.full(count, known_end), nobody, nobody)
    area = _sums(island, areas_of(corners))
    lengths = _lengths(corners, uv, island)
    ratio = np.log(np.maximum(lengths[:, 1], 1e-12) / np.maximum(lengths[:, 0], 1e-12))
    usual = int((area * ratio).sum() >= 0.0)
    is_clear = np.abs(ratio) > np.log(_CLEAR_LENGTH)
    axis = np.where(is_clear, (ratio > 0.0).astype(np.int64), usual)

    length = np.take_along_axis(lengths, axis[:, None], axis=1)[:, 0]
    end = _end_evidence(corners, uv, distance, island, axis) / np.maximum(length, 1e-12)
    is_down = np.zeros(len(axis), bool)
    is_against, is_unsaid = axis != usual, np.zeros(len(axis), bool)
    for each in (0, 1):
        own = axis == each
        vote = float((area * np.clip(end, -1.0, 1.0))[own].sum())
        is_strong = np.abs(end) > _CLEAR_END
        is_down[own] = np.where(is_strong, end > 0.0, vote > 0.0)[own]
        is_against |= own & is_strong & ((end > 0.0) != (vote > 0.0))
        if abs(vote) <= _NO_END * float(area[own].sum()):
            is_unsaid |= own & ~is_strong
    return UvAxes(axis, is_down, is_against, is_unsaid & ~is_against)


def coordinate_gradients(corners: Floats, uv: Floats) -> Floats:
    """Derivatives of the position by u and by v, (triangle_count, 2, 3) [m]; 0 where UVs have no
    area."""
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    first, second = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    by = np.divide(1.0, area, out=np.zeros_like(area), where=np.abs(area) > 1e-14)
    along_u = one * second[:, 1:] - two * first[:, 1:]
    along_v = two * first[:, :1] - one * second[:, :1]
    gradients: Floats = np.stack([along_u, along_v], axis=1) * by[:, None, None]
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
    total = np.maximum(_sums(island, weight), 1e-30)
    mean = np.stack([_sums(island, weight * speed[:, axis]) / total for axis in (0, 1)], axis=1)
    low, high = island_bounds(uv, island)
    lengths: Floats = mean * (high - low)
    return lengths


def _end_evidence(
    corners: Floats, uv: Floats, distance: Floats, island: Ints, axis: Ints
) -> Floats:
    """How much nearer to the head, and higher, the end of large coordinates is, (island_count,)
    [m]."""
    own = axis[island]
    coordinate = np.take_along_axis(uv, own[:, None, None], axis=2)[:, :, 0]
    low, high = island_bounds(coordinate, island)
    size = np.maximum(high - low, 1e-12)[island, None]
    fraction = ((coordinate - low[island, None]) / size).ravel()
    whose = np.repeat(island, 3)
    nearness = (_HEIGHT_WEIGHT * corners[:, :, 2] - distance).ravel()
    ends = []
    for is_end in (fraction <= _END_FRACTION, fraction >= 1.0 - _END_FRACTION):
        count = np.maximum(_sums(whose, is_end.astype(np.float64), len(axis)), 1.0)
        ends.append(_sums(whose, np.where(is_end, nearness, 0.0), len(axis)) / count)
    difference: Floats = ends[1] - ends[0]
    return difference


def _sums(island: Ints, values: Floats, count: int = 0) -> Floats:
    return np.bincount(island, values, minlength=count)
