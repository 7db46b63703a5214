"""A UV map as texels: where corners lie, and which triangle covers which texel.

Places are in texels: the middle of texel (column, row) is (column + 0.5, row + 0.5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Bools, Floats, Ints

#: [texels] a texel this far outside a triangle still counts as covered, so that none falls between
#: two triangles; two triangles overlap if it lies this far inside both
_TOLERANCE, _OVERLAP = 1e-3, 1e-6
#: [texels] offset from a texel's middle to where it is tested: edges of tidy maps run through
#: middles
_ASIDE = (0.0137, 0.0071)
_REACH = _TOLERANCE + max(_ASIDE)
#: [texels^2] smaller triangles have no place in the map
_MIN_AREA = 1e-7
#: [UV units] minimum extent of a map
_MIN_EXTENT = 1e-9
#: pairs of triangle and texel in one batch
_PAIRS = 1_000_000


@dataclass(frozen=True, eq=False)
class Chart:
    """place: (triangle_count, 3, 2) of the corners; is_mapped: (triangle_count,); shape: rows and
    columns of texels.
    """

    place: Floats
    is_mapped: Bools
    shape: tuple[int, int]


def chart_of(corner_uv: Floats, resolution: int, margin: int) -> Chart:
    """The map wherever it lies in UV space, `resolution` texels along its longer side.

    Args:
        corner_uv: (triangle_count, 3, 2); triangles with values that are not finite are not mapped.
        margin: texels around it.
    """
    uv = np.asarray(corner_uv, np.float64)
    is_finite = np.isfinite(uv).all(axis=(1, 2))
    if not is_finite.any():
        return Chart(np.zeros_like(uv), is_finite, (0, 0))
    low, high = uv[is_finite].min(axis=(0, 1)), uv[is_finite].max(axis=(0, 1))
    extent = float((high - low).max())
    if extent < _MIN_EXTENT:
        return Chart(np.zeros_like(uv), np.zeros_like(is_finite), (0, 0))
    scale = (resolution - 2 * margin) / extent
    place = np.where(is_finite[:, None, None], (uv - low) * scale + margin, 0.0)
    columns, rows = np.ceil((high - low) * scale).astype(int) + 2 * margin
    return Chart(place, is_finite & (np.abs(_doubled_area(place)) > _MIN_AREA), (rows, columns))


def covering(chart: Chart) -> tuple[Ints, Bools]:
    """The triangle that covers each texel's middle, (rows, columns), -1 where none does; and
    whether several do.
    """
    rows, columns = chart.shape
    depth = np.full(rows * columns, -np.inf)
    triangle, layers = np.full(rows * columns, -1), np.zeros(rows * columns, np.int64)
    for chosen, texel in _boxes(chart):
        middle = np.stack([texel % columns + 0.5, texel // columns + 0.5], axis=1)
        inside = _depth_inside(chart.place[chosen], middle + _ASIDE)
        np.add.at(layers, texel[inside > _OVERLAP], 1)
        order = np.argsort(inside, kind="stable")
        order = order[inside[order] > -_TOLERANCE]
        # the last write wins: the deepest inside
        order = order[inside[order] > depth[texel[order]]]
        depth[texel[order]], triangle[texel[order]] = inside[order], chosen[order]
    return triangle.reshape(chart.shape), (layers > 1).reshape(chart.shape)


def barycentric(place: Floats, points: Floats) -> Floats:
    """Weights of the corners (n, 3, 2) at points (n, 2), (n, 3)."""
    a, b, c = place[:, 0], place[:, 1], place[:, 2]
    area = _doubled_area(place)
    second = _cross(points - a, c - a) / area
    third = _cross(b - a, points - a) / area
    return np.stack([1.0 - second - third, second, third], axis=1)


def _boxes(chart: Chart) -> list[tuple[Ints, Ints]]:
    """(triangle, texel) of all texels in each triangle's box, in batches."""
    mapped = np.flatnonzero(chart.is_mapped)
    if not len(mapped):
        return []
    rows, columns = chart.shape
    place = chart.place[mapped]
    limit = np.array([columns, rows]) - 1
    low = np.clip(np.ceil(place.min(axis=1) - 0.5 - _REACH), 0, limit).astype(int)
    high = np.clip(np.floor(place.max(axis=1) - 0.5 + _REACH), 0, limit).astype(int)
    width, height = np.maximum(high - low + 1, 0).T
    count = width * height
    batch = np.cumsum(count) // _PAIRS
    found: list[tuple[Ints, Ints]] = []
    for part in np.split(np.arange(len(mapped)), np.flatnonzero(np.diff(batch)) + 1):
        which = np.repeat(part, count[part])
        first = np.repeat(np.cumsum(count[part]) - count[part], count[part])
        number = np.arange(len(which)) - first
        column, row = low[which, 0] + number % width[which], low[which, 1] + number // width[which]
        found.append((mapped[which], row * columns + column))
    return found


def _depth_inside(place: Floats, points: Floats) -> Floats:
    """How far points (n, 2) lie inside a triangle each, (n,); negative outside."""
    turn = np.sign(_doubled_area(place))
    depth = np.full(len(points), np.inf)
    for corner in range(3):
        start, along = place[:, corner], place[:, (corner + 1) % 3] - place[:, corner]
        length = np.maximum(np.linalg.norm(along, axis=1), 1e-12)
        depth = np.minimum(depth, turn * _cross(along, points - start) / length)
    return depth


def _doubled_area(place: Floats) -> Floats:
    return _cross(place[:, 1] - place[:, 0], place[:, 2] - place[:, 0])


def _cross(one: Floats, two: Floats) -> Floats:
    area: Floats = one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]
    return area
