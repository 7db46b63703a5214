"""Which triangles cover which points of a plane: intersection of parallel rays with triangles, all
at once.

Rays of one direction, seen along it, are points, and a ray meets a triangle where the triangle
covers its point. The points are sorted into a grid of cells, row by row, so that those between two
columns of one row are consecutive. A triangle is cut into the rows that it crosses, as a rasteriser
cuts it into scan lines, and in each row tests the points between its left and right end there.

Coordinates come first in all arrays, and the data of a pair are read together: most of the time
goes into reading from memory.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints, piece_starts, rows_of_ranges

#: Maximum number of cells, whose numbers thus fit 16 bits, which numpy sorts fastest; and of rows.
_MAX_CELLS, _MAX_ROWS = 1 << 16, 250
#: Rows that a triangle of typical height crosses.
_ROWS_PER_TRIANGLE = 3.0
#: Pairs of points and triangles tested at once: they stay in the processor's cache.
_CHUNK = 1 << 15
#: Edges that rise by less than this count as level, in rows.
_MIN_RISE = 1.0e-6


@dataclass(frozen=True)
class PointGrid:
    """Points of a plane sorted by their cells.

    order: (n,) index of each sorted point before sorting.
    places: (n, 2) float32, the sorted points.
    starts: (row_count * column_count + 1,) index of the first sorted point of each cell.
    low, cell: (2,) float32, the lowest corner, and width and height of a cell.
    """

    order: Ints
    places: Floats
    starts: Ints
    low: Floats
    cell: Floats
    row_count: int
    column_count: int


@dataclass(frozen=True)
class Crossings:
    """Pairs of a point and a triangle that contains it.

    point, triangle: (m,) indices into the places before sorting, and into the triangles.
    second, third: (m,) float32, barycentric coordinates of the triangle's second and third corner.
    """

    point: Ints
    triangle: Ints
    second: Floats
    third: Floats


def point_grid(places: Floats, triangle_height: float) -> PointGrid:
    """Sort points into cells.

    Args:
        places: (2, n) float32, at least one.
        triangle_height: of a typical triangle, in the unit of the places.
    """
    low = places.min(axis=1)
    width, height = np.maximum(places.max(axis=1) - low, 1e-9)
    row_height = max(height / (_MAX_ROWS - 1), triangle_height / _ROWS_PER_TRIANGLE)
    row_count = int(height / row_height) + 2
    column_count = _MAX_CELLS // row_count
    cell = np.array([width / (column_count - 2), row_height], np.float32)
    column, row = ((places - low[:, None]) / cell[:, None]).astype(np.int64)
    number = row * column_count + column
    order = np.argsort(number.astype(np.uint16), kind="stable")
    starts = np.zeros(row_count * column_count + 1, np.int64)
    np.cumsum(np.bincount(number, minlength=len(starts) - 1), out=starts[1:])
    sorted_places = np.ascontiguousarray(places.T[order])
    return PointGrid(order, sorted_places, starts, low, cell, row_count, column_count)


def crossings(grid: PointGrid, corners: Floats) -> Iterator[Crossings]:
    """All points that lie in triangles, in portions; triangles without area contain none.

    Args:
        corners: (3, 2, triangle_count) float32, corner by corner.
    """
    triangle, start, count = _spans(grid, corners)
    forms = _barycentric_forms(corners)
    total = np.cumsum(count)
    first = 0
    while first < len(count):
        done = total[first - 1] if first else 0
        last = max(int(np.searchsorted(total, done + _CHUNK, side="right")), first + 1)
        part = slice(first, last)
        yield _points_in_triangles(grid, forms, triangle[part], start[part], count[part])
        first = last


def _spans(grid: PointGrid, corners: Floats) -> tuple[Ints, Ints, Ints]:
    """(triangle, first sorted point, number of points) for each row of cells that a triangle
    crosses."""
    x, y = np.moveaxis((corners - grid.low[:, None]) / grid.cell[:, None], 1, 0)
    lowest, highest = _corner_minimum(y), _corner_maximum(y)
    first = np.clip(lowest, 0, grid.row_count).astype(np.int64)
    beyond = np.clip(np.floor(highest) + 1, 0, grid.row_count).astype(np.int64)
    is_beside = (_corner_maximum(x) < 0) | (_corner_minimum(x) >= grid.column_count)
    rows = np.where(is_beside, 0, np.maximum(beyond - first, 0))
    triangle = np.repeat(np.arange(len(rows)), rows)
    row = rows_of_ranges(first, rows)
    left, right = _ends_in_row(x, y, triangle, row.astype(np.float32))
    begin = np.clip(left, 0, grid.column_count).astype(np.int64)
    end = np.clip(np.floor(right) + 1, 0, grid.column_count).astype(np.int64)
    first_cell = row * grid.column_count
    start = grid.starts.take(first_cell + begin)
    count = grid.starts.take(first_cell + end) - start
    with_points = np.flatnonzero(count > 0)
    return triangle.take(with_points), start.take(with_points), count.take(with_points)


def _corner_minimum(corners: Floats) -> Floats:
    return np.minimum(np.minimum(corners[0], corners[1]), corners[2])


def _corner_maximum(corners: Floats) -> Floats:
    return np.maximum(np.maximum(corners[0], corners[1]), corners[2])


def _ends_in_row(x: Floats, y: Floats, triangle: Ints, row: Floats) -> tuple[Floats, Floats]:
    """Left and right end of the part of each triangle that lies between y = row and row + 1.

    x, y: (3, triangle_count) in cells. Each edge contributes the ends of its part in the row.
    """
    left = np.full(len(row), np.inf, np.float32)
    right = np.full(len(row), -np.inf, np.float32)
    for one, two in ((0, 1), (1, 2), (2, 0)):
        low, high = np.minimum(y[one], y[two]), np.maximum(y[one], y[two])
        rise = y[two] - y[one]
        slope = np.divide(x[two] - x[one], rise, np.zeros_like(rise), where=high - low > _MIN_RISE)
        edge = np.stack([x[one] - slope * y[one], slope, low, high], axis=1).take(triangle, axis=0)
        enter, leave = np.maximum(edge[:, 2], row), np.minimum(edge[:, 3], row + 1)
        at_enter = edge[:, 0] + edge[:, 1] * enter
        at_leave = edge[:, 0] + edge[:, 1] * leave
        is_in = enter <= leave
        left = np.minimum(left, np.where(is_in, np.minimum(at_enter, at_leave), np.inf))
        right = np.maximum(right, np.where(is_in, np.maximum(at_enter, at_leave), -np.inf))
    return left, right


def _barycentric_forms(corners: Floats) -> Floats:
    """Each triangle's second and third coordinate as a + b x + c y, (triangle_count, 6) float32."""
    first, one, two = corners[0], corners[1] - corners[0], corners[2] - corners[0]
    area = one[0] * two[1] - two[0] * one[1]
    is_flat = area == 0.0
    inverse = 1.0 / np.where(is_flat, 1.0, area)
    second, third = (two[1] * inverse, -two[0] * inverse), (-one[1] * inverse, one[0] * inverse)
    of_second, of_third = (-(bx * first[0] + by_ * first[1]) for bx, by_ in (second, third))
    of_second[is_flat] = -np.inf
    return np.stack([of_second, *second, of_third, *third], axis=1)


def _points_in_triangles(
    grid: PointGrid, forms: Floats, triangle: Ints, start: Ints, count: Ints
) -> Crossings:
    """The points of spans that lie in their triangles."""
    begin = piece_starts(count)
    is_next = np.zeros(int(begin[-1] + count[-1]), np.int8)
    is_next[begin[1:]] = 1
    span = np.cumsum(is_next, dtype=np.int64)
    point = np.arange(len(span)) + (start - begin).take(span)
    place = grid.places.take(point, axis=0)
    x, y = place[:, 0], place[:, 1]
    form = forms.take(triangle, axis=0).take(span, axis=0)
    second = form[:, 0] + form[:, 1] * x + form[:, 2] * y
    third = form[:, 3] + form[:, 4] * x + form[:, 5] * y
    inside = np.flatnonzero((second >= 0.0) & (third >= 0.0) & (second + third <= 1.0))
    return Crossings(
        grid.order.take(point.take(inside)),
        triangle.take(span.take(inside)),
        second.take(inside),
        third.take(inside),
    )
