"""What lies beyond the border of an island: the skin across a seam, or the rim of the mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Bools, Floats, Ints
from ...strands import Surface
from .chart import Chart, barycentric
from .near_borders import along_border
from .seams import Borders

#: [texels] how far an island continues where nothing lies across, for interpolation
_RIM = 2.0
#: [texels] maximum distance of a place from the triangle that it is assigned to
_SLACK = 1.0


@dataclass(frozen=True, eq=False)
class Gutter:
    """Skin that is shown at places beyond borders, (n, ...).

    triangle, weights: of all three corners; is_shown: whether there is any.
    rim: weights of the nearest place on the border, in the border's own triangle.
    """

    triangle: Ints
    weights: Floats
    is_shown: Bools
    rim: Floats


def gutter_at(
    surface: Surface,
    chart: Chart,
    borders: Borders,
    triangle_island: Ints,
    covered: Ints,
    border: Ints,
    points: Floats,
) -> Gutter:
    """What lies at places (n, 2) beyond these borders (n,).

    Args:
        covered: (rows, columns) the triangle of each covered texel, -1 where there is none.
    """
    rim = rim_weights(chart, borders, border, points)
    own, other = borders.triangle[border], borders.other[border]
    beyond = _unfolded(surface, chart, borders, border, points)
    rows, columns = chart.shape
    column, row = np.clip(np.floor(beyond), 0, [columns - 1, rows - 1]).astype(int).T
    found = covered[row, column]
    is_same = (found >= 0) & (triangle_island[found] == triangle_island[other])
    triangle = np.where(is_same, found, other)
    weights = clamped(barycentric(chart.place[triangle], beyond))
    off = np.linalg.norm(placed(chart, triangle, weights) - beyond, axis=1)
    is_across = (other >= 0) & (off < _SLACK)
    is_near = np.linalg.norm(placed(chart, own, rim) - points, axis=1) < _RIM
    return Gutter(
        np.where(is_across, triangle, own),
        np.where(is_across[:, None], weights, rim),
        is_across | is_near,
        rim,
    )


def rim_weights(chart: Chart, borders: Borders, border: Ints, points: Floats) -> Floats:
    """Weights (n, 3), in a border's own triangle, of the place on it nearest to each point."""
    own, start, end = borders.triangle[border], borders.start[border], borders.end[border]
    fraction = along_border(points, chart.place[own, start], chart.place[own, end])
    weights, number = np.zeros((len(points), 3)), np.arange(len(points))
    weights[number, start], weights[number, end] = 1.0 - fraction, fraction
    return weights


def clamped(weights: Floats) -> Floats:
    """Weights (n, 3) of a place inside the triangle."""
    inside = np.maximum(weights, 0.0)
    return inside / inside.sum(axis=1, keepdims=True)


def placed(chart: Chart, triangle: Ints, weights: Floats) -> Floats:
    """Where the weights (n, 3) of triangles (n,) lie in the map, (n, 2)."""
    return np.einsum("ni,nij->nj", weights, chart.place[triangle])


def _unfolded(
    surface: Surface, chart: Chart, borders: Borders, border: Ints, points: Floats
) -> Floats:
    """Where, in the map of the triangle across the seam, a place lies that is beyond the seam in
    ours.

    The two triangles are laid flat side by side, as large as they are in the world.
    """
    own, other = borders.triangle[border], borders.other[border]
    ends = borders.start[border], borders.end[border]
    along, height, aside = _shape(surface, own, *ends)
    start, edge, third = _corners(chart, own, *ends)
    # the place in metres along the edge, and away from the own triangle
    offset = points - start
    area = edge[:, 0] * third[:, 1] - edge[:, 1] * third[:, 0]
    by_third = (edge[:, 0] * offset[:, 1] - edge[:, 1] * offset[:, 0]) / area
    by_edge = (offset[:, 0] * third[:, 1] - offset[:, 1] * third[:, 0]) / area
    metres_along = by_edge * along + by_third * aside
    metres_away = -by_third * height

    ends = borders.other_start[border], borders.other_end[border]
    along, height, aside = _shape(surface, other, *ends)
    start, edge, third = _corners(chart, other, *ends)
    by_third = metres_away / height
    by_edge = (metres_along - by_third * aside) / along
    return start + by_edge[:, None] * edge + by_third[:, None] * third


def _corners(chart: Chart, triangle: Ints, start: Ints, end: Ints) -> tuple[Floats, Floats, Floats]:
    """An edge's start in the map, and from there the vectors to its end and to the third corner."""
    place = chart.place
    first, third = place[triangle, start], place[triangle, 3 - start - end]
    return first, place[triangle, end] - first, third - first


def _shape(
    surface: Surface, triangle: Ints, start: Ints, end: Ints
) -> tuple[Floats, Floats, Floats]:
    """Length of an edge, height of the triangle above it, and position of the third corner along
    it, all [m]; triangles without area count as if they had a little.
    """
    corners = surface.corners[triangle].astype(np.float64)
    number = np.arange(len(triangle))
    edge = corners[number, end] - corners[number, start]
    third = corners[number, 3 - start - end] - corners[number, start]
    length = np.maximum(np.linalg.norm(edge, axis=1), 1e-12)
    aside = np.einsum("ij,ij->i", edge, third) / length
    height = np.linalg.norm(third - edge * (aside / length)[:, None], axis=1)
    return length, np.maximum(height, 1e-12), aside
