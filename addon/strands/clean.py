"""From untrusted curves to a `StrandSet`: unusable curves are dropped and counted by reason."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from ..arrays import Bools, Floats, Ints
from .colors import usable_colors
from .strand_set import DEFAULT_RADIUS, StrandSet

#: Shortest usable strand as a fraction of its distance from the origin: below it float32 resolves
#: no direction.
MIN_RELATIVE_LENGTH = 1.0e-6
#: A radius larger than the median by this factor is a broken number.
_MAX_RADIUS_RATIO = 100.0
#: Radius given to pointed tips, as a fraction of the median: a fibre needs some width.
_POINTED_RADIUS = 1.0e-3
#: A coordinate beyond this is a broken number, whatever the size of the hair [m].
MAX_COORDINATE = 1.0e6


@dataclass(frozen=True)
class Cleaned:
    """The usable strands, their curves, and how many others were dropped for which reason."""

    strands: StrandSet
    dropped: dict[str, int]
    curve_indices: Ints  # (strand_count,) among the input


def clean(
    points: Floats,
    offsets: Ints,
    *,
    radius: Floats | None = None,
    group: Ints | None = None,
    root_uv: Floats | None = None,
    color: Floats | None = None,
    seed: Ints | None = None,
    unusable: Mapping[str, Bools] = MappingProxyType({}),
) -> Cleaned:
    """Make a `StrandSet` from curves of any origin.

    Args:
        points: (point_count, 3) [m].
        offsets: (curve_count + 1,), ascending from 0 to point_count.
        radius: (point_count,) [m]; 0 at a pointed tip becomes a very small radius. Values that are
            no radii, see `are_valid_widths`, become the median of the others, or 0.04 mm if there
            are none.
        group: (curve_count,); absent: one group, 0.
        root_uv: (curve_count, 2); values that are not finite become 0.
        color: (point_count, 3) scene-linear; see `usable_colors`.
        seed: (curve_count,); see `StrandSet`.
        unusable: reason -> (curve_count,) curves to drop for this reason, whatever their points.
    """
    points = np.asarray(points, np.float32).reshape(-1, 3)
    offsets = np.asarray(offsets, np.int64)
    counts = np.diff(offsets)
    curve_count = len(counts)
    color = None if color is None else usable_colors(color, offsets)
    if not unusable and radius is not None and _are_clean(points, offsets, radius, root_uv):
        group = np.zeros(curve_count, np.int32) if group is None else group
        strands = StrandSet(points, offsets, radius, group, root_uv, color=color, seed=seed)
        return Cleaned(strands, {}, np.arange(curve_count))

    faults = {
        **unusable,
        "fewer than two points": counts < 2,
        "a point that is not finite": _any_per_curve(~np.isfinite(points).all(axis=1), offsets),
        "a point farther than 1,000 km away": _any_per_curve(
            (np.abs(points) > MAX_COORDINATE).any(axis=1), offsets
        ),
        "no length": _no_length(points, offsets),
    }
    usable = np.ones(curve_count, bool)
    dropped: dict[str, int] = {}
    for reason, is_faulty in faults.items():
        count = int((is_faulty & usable).sum())
        if count:
            dropped[reason] = count
        usable &= ~is_faulty

    curve_indices = np.flatnonzero(usable)
    is_point_usable = np.repeat(usable, counts)
    strands = StrandSet(
        points=points[is_point_usable],
        offsets=np.concatenate([[0], np.cumsum(counts[curve_indices])]).astype(np.int32),
        radius=_usable_radius(radius, offsets)[is_point_usable],
        group=np.zeros(len(curve_indices), np.int32)
        if group is None
        else np.asarray(group)[curve_indices],
        root_uv=None
        if root_uv is None
        else np.nan_to_num(root_uv, posinf=0, neginf=0)[curve_indices],
        has_widths=radius is not None and bool(are_valid_widths(np.asarray(radius), offsets).any()),
        color=None if color is None else color[is_point_usable],
        seed=None if seed is None else np.asarray(seed)[curve_indices],
    )
    return Cleaned(strands, dropped, curve_indices)


def _are_clean(points: Floats, offsets: Ints, radius: Floats, root_uv: Floats | None) -> bool:
    """Whether nothing needs to be dropped or replaced, as is usual; False may be a false alarm."""
    if len(offsets) < 2 or np.diff(offsets).min() < 2:
        return False
    # a sum of squares is finite, or below a limit, only if each of the squares is
    if not np.vdot(points, points) < MAX_COORDINATE**2 or np.min(radius) <= 0.0:
        return False
    if np.max(radius) > _MAX_RADIUS_RATIO * np.min(radius):
        return False
    others = [radius] if root_uv is None else [radius, root_uv]
    if not all(np.isfinite(np.vdot(each, each)) for each in others):
        return False
    reach = points[offsets[1:] - 1] - points[offsets[:-1]]
    shortest = MIN_RELATIVE_LENGTH * float(np.abs(points).max())
    return bool((np.einsum("ij,ij->i", reach, reach) >= 3.0 * shortest**2).all())


def _any_per_curve(flags: Bools, offsets: Ints) -> Bools:
    totals = np.concatenate([[0], np.cumsum(flags)])
    return totals[offsets[1:]] > totals[offsets[:-1]]


def _no_length(points: Floats, offsets: Ints) -> Bools:
    """Which curves have boxes without extent; if their points are finite, they have no length."""
    box, away = np.zeros((2, len(offsets) - 1, 3), np.float32)
    filled = np.flatnonzero(np.diff(offsets) > 0)
    if len(filled):
        starts = offsets[filled]
        finite = np.nan_to_num(points, nan=0.0, posinf=0.0, neginf=0.0)
        box[filled] = np.maximum.reduceat(finite, starts) - np.minimum.reduceat(finite, starts)
        away[filled] = np.maximum.reduceat(np.abs(finite), starts)
    return (box <= MIN_RELATIVE_LENGTH * away.max(axis=1, keepdims=True)).all(axis=1)


def _usable_radius(radius: Floats | None, offsets: Ints) -> Floats:
    if radius is None:
        return np.full(offsets[-1], DEFAULT_RADIUS, np.float32)
    radius = np.asarray(radius, np.float32)
    is_width = are_valid_widths(radius, offsets)
    is_positive = is_width & (radius > 0.0)
    typical = (
        _upper_median(radius[is_positive]) if is_positive.any() else np.float32(DEFAULT_RADIUS)
    )
    return np.where(
        is_positive, radius, np.where(is_width, typical * np.float32(_POINTED_RADIUS), typical)
    )


def are_valid_widths(radius: Floats, offsets: Ints) -> Bools:
    """Which values can be radii or widths of one groom, (point_count,).

    They are finite, positive and not far larger than the others. 0 is a width as well if the strand
    has other widths: it is pointed there.

    Args:
        radius: (point_count,). offsets: (strand_count + 1,), see `clean`.
    """
    is_width: Bools = np.isfinite(radius) & (radius > 0.0)
    if is_width.any():
        is_width &= radius <= _MAX_RADIUS_RATIO * _upper_median(radius[is_width])
    has_others = np.repeat(_any_per_curve(is_width, offsets), np.diff(offsets))
    return is_width | (has_others & (radius == 0.0))


def _upper_median(values: Floats) -> Floats:
    """The median; the larger of the two middle values if their number is even."""
    half = len(values) // 2
    middle: Floats = np.partition(values, half)[half]
    return middle
