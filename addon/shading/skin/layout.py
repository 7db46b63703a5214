"""The skin unfolded: which point of a head each texel of its UV map shows, beyond seams as well.

Reference: Green 2004, GPU Gems, chapter 16, "Real-Time Approximations to Subsurface Scattering";
D'Eon and Luebke 2007, GPU Gems 3, chapter 14, for the stretch of the map.

    gutter | island       A texel in the gutter beside a seam shows the skin on the seam's other
     x x x | + + +        side, as if the island there had been unfolded once more: so the
     x x x | + + +        blur does not end at the seam. Where islands lie closer together than
     x x x | + + +        their gutters are wide, a gutter ends half way.

A texel is blurred with texels of its own island, and of that island's gutter, alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats, Ints
from ...strands import Surface
from .chart import Chart, barycentric, chart_of, covering
from .gutter import clamped, gutter_at
from .near_borders import nearest_borders
from .seams import Borders, copies_of, find_borders

#: [texels] how far an island continues beyond its borders
GUTTER = 32
#: [texels] how far from a seam its two sides begin to be blended
CLOSING = 8.0
#: [m per texel] minimum of the stretch
_MIN_STRETCH = 1e-9


@dataclass(frozen=True, eq=False)
class SkinLayout:
    """What each texel shows; arrays (rows, columns, ...), places as in chart.py.

    island: -1 where a texel shows nothing, as where triangles overlap.
    triangle, weights: the skin that it shows; weights of the second and third corner.
    stretch: [m] of skin that a texel is wide, and high.
    seam: number of the island's nearest seam; -1 where none is as near as CLOSING.
    seams: (seam_count, 2, 4) each seam's start and end: x and y in its own island, and in the one
        across; seam_islands: (seam_count, 2) the two islands.
    copies: (n, 3) x, y and island of all places of the vertices at seams' ends; end_copies:
        (seam_count, 2, 2) for its start and its end, the first row of `copies` and how many there
        are.
    place: (triangle_count, 3, 2) of the corners; triangle_island: (triangle_count,).
    """

    island: Ints
    triangle: Ints
    weights: Floats
    stretch: Floats
    seam: Ints
    seams: Floats
    seam_islands: Ints
    copies: Floats
    end_copies: Ints
    place: Floats
    triangle_island: Ints

    @property
    def is_empty(self) -> bool:
        """Whether no texel shows any skin."""
        return not (self.island >= 0).any()


def skin_layout(surface: Surface, resolution: int) -> SkinLayout:
    """The layout of a surface: depends on its triangles and UVs, and on its current shape.

    It is empty where there are no UVs.

    Args:
        resolution: texels along the longer side of the map.
    """
    uv = surface.corner_uv
    if uv is None:
        uv = np.full((len(surface.triangles), 3, 2), np.nan, np.float32)
    chart = chart_of(uv, resolution, min(GUTTER, resolution // 8))
    borders, triangle_island = find_borders(surface, chart.place, chart.is_mapped)
    triangle, overlaps = covering(chart)
    covered = triangle.ravel() >= 0
    island = np.where(covered, triangle_island[triangle.ravel()], -1)
    island[overlaps.ravel()] = -2
    nearest = nearest_borders(
        borders, chart.place, triangle_island, island.reshape(chart.shape), GUTTER
    ).ravel()
    corner_stretch = _corner_stretch(surface, chart, triangle_island)

    weights, stretch = np.zeros((len(island), 3)), np.ones((len(island), 2))
    shown = triangle.ravel().copy()
    inside = np.flatnonzero(island >= 0)
    own = shown[inside]
    weights[inside] = clamped(barycentric(chart.place[own], _middle(inside, chart)))
    stretch[inside] = np.einsum("ni,nij->nj", weights[inside], corner_stretch[own])

    outside = np.flatnonzero((island == -1) & (nearest >= 0))
    border = nearest[outside]
    gutter = gutter_at(
        surface, chart, borders, triangle_island, triangle, border, _middle(outside, chart)
    )
    own, kept = borders.triangle[border], gutter.is_shown
    island[outside[kept]] = triangle_island[own][kept]
    shown[outside], weights[outside] = gutter.triangle, gutter.weights
    stretch[outside] = np.einsum("ni,nij->nj", gutter.rim, corner_stretch[own])

    island = np.where(island >= 0, island, -1).reshape(chart.shape)
    seams = borders.seams
    places, seam_islands = _seams(chart, seams, triangle_island)
    return SkinLayout(
        island,
        shown.reshape(chart.shape),
        weights[:, 1:].reshape(*chart.shape, 2),
        np.maximum(stretch, _MIN_STRETCH).reshape(*chart.shape, 2),
        _nearest_seam(island, chart, seams, triangle_island),
        places,
        seam_islands,
        *_copies(surface, chart, seams, triangle_island),
        chart.place,
        triangle_island,
    )


def _middle(texel: Ints, chart: Chart) -> Floats:
    """The middles of texels that are counted row by row, (n, 2)."""
    columns = chart.shape[1]
    return np.stack([texel % columns + 0.5, texel // columns + 0.5], axis=1)


def _nearest_seam(island: Ints, chart: Chart, seams: Borders, triangle_island: Ints) -> Ints:
    """See SkinLayout.seam."""
    asked = np.where(island >= 0, island, -2)
    return nearest_borders(seams, chart.place, triangle_island, asked, CLOSING)


def _seams(chart: Chart, seams: Borders, triangle_island: Ints) -> tuple[Floats, Ints]:
    """See SkinLayout.seams, and seam_islands."""
    place, own, other = chart.place, seams.triangle, seams.other
    ends = ((seams.start, seams.other_start), (seams.end, seams.other_end))
    both = [np.concatenate([place[own, one], place[other, two]], axis=1) for one, two in ends]
    return np.stack(both, axis=1), triangle_island[np.stack([own, other], axis=1)]


def _copies(
    surface: Surface, chart: Chart, seams: Borders, triangle_island: Ints
) -> tuple[Floats, Ints]:
    """See SkinLayout.copies and end_copies."""
    vertex = surface.welded_triangles()
    copies, of_vertex = copies_of(vertex, chart.place, chart.is_mapped, triangle_island)
    ends = np.stack([vertex[seams.triangle, end] for end in (seams.start, seams.end)], axis=1)
    first, last = (np.searchsorted(of_vertex, ends, side) for side in ("left", "right"))
    return copies, np.stack([first, last - first], axis=2)


def _corner_stretch(surface: Surface, chart: Chart, triangle_island: Ints) -> Floats:
    """Width and height of a texel at each corner [m], (triangle_count, 3, 2).

    The mean of the triangles around a vertex, weighted by their area in the map, since the size
    jumps from triangle to triangle (D'Eon and Luebke blur it).
    """
    found = np.ones((len(chart.place), 3, 2))
    mapped = np.flatnonzero(chart.is_mapped)
    edges = np.moveaxis(chart.place[mapped, 1:] - chart.place[mapped, :1], 1, 2)
    corners = surface.corners[mapped].astype(np.float64)
    sides = np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 2)
    stretch = np.linalg.norm(sides @ np.linalg.inv(edges), axis=1)
    area = np.abs(np.linalg.det(edges))

    vertex = surface.triangles[mapped].astype(np.int64)
    vertex += triangle_island[mapped, None] * len(surface.positions)
    _, number = np.unique(vertex, return_inverse=True)
    number = np.asarray(number).reshape(vertex.shape)
    total, weight = np.zeros((number.max(initial=0) + 1, 2)), np.zeros(number.max(initial=0) + 1)
    for corner in range(3):
        np.add.at(total, number[:, corner], stretch * area[:, None])
        np.add.at(weight, number[:, corner], area)
    found[mapped] = (total / np.maximum(weight, 1e-300)[:, None])[number]
    return found
