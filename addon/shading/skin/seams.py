"""The islands of a UV map, their borders, and what lies across each seam."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Bools, Floats, Ints
from ...strands import Surface

#: [texels] corners nearer than this in the map are the same place
_SAME_PLACE = 1e-3


@dataclass(frozen=True, eq=False)
class Borders:
    """Edges where an island of the map ends, each from the side of its island.

    triangle, start, end: (n,) the edge's triangle, and which of its corners are the edge's ends.
    other, other_start, other_end: the same for the triangle across the seam, corner by corner;
        other is -1 where the mesh itself ends, or where more than two triangles meet.
    """

    triangle: Ints
    start: Ints
    end: Ints
    other: Ints
    other_start: Ints
    other_end: Ints

    @property
    def seams(self) -> Borders:
        """Those with a triangle across."""
        kept = self.other >= 0
        return Borders(
            self.triangle[kept],
            self.start[kept],
            self.end[kept],
            self.other[kept],
            self.other_start[kept],
            self.other_end[kept],
        )


def find_borders(surface: Surface, place: Floats, is_mapped: Bools) -> tuple[Borders, Ints]:
    """The borders, and each triangle's island (triangle_count,), -1 where it has none.

    Vertices at the same place count as one: many files split them along seams.

    Args:
        place: (triangle_count, 3, 2) of the corners in the map [texels].
        is_mapped: (triangle_count,) whether a triangle has a place in the map at all.
    """
    vertex = surface.welded_triangles()
    mapped = np.flatnonzero(is_mapped)
    triangle, start = np.repeat(mapped, 3), np.tile(np.arange(3), len(mapped))
    end = (start + 1) % 3
    low, high = np.sort([vertex[triangle, start], vertex[triangle, end]], axis=0)
    is_edge = low != high
    triangle, start, end = triangle[is_edge], start[is_edge], end[is_edge]
    key = low[is_edge] * (vertex.max(initial=0) + 1) + high[is_edge]
    partner = _partners(key)

    other = np.where(partner >= 0, triangle[partner], -1)
    turns = vertex[triangle, start] == vertex[other, start[partner]]
    other_start = np.where(turns, start[partner], end[partner])
    other_end = np.where(turns, end[partner], start[partner])
    gap = np.maximum(
        np.abs(place[triangle, start] - place[other, other_start]).max(axis=1),
        np.abs(place[triangle, end] - place[other, other_end]).max(axis=1),
    )
    is_joined = (partner >= 0) & (gap < _SAME_PLACE)
    island = np.full(len(place), -1)
    joined = np.stack([triangle, other], axis=1)[is_joined]
    island[mapped] = _connected(joined, len(place))[mapped]
    borders = (triangle, start, end, other, other_start, other_end)
    return Borders(*(array[~is_joined] for array in borders)), island


def copies_of(vertex: Ints, place: Floats, is_mapped: Bools, island: Ints) -> tuple[Floats, Ints]:
    """All places of each vertex in the map: rows of x, y and island, sorted by vertex, and the
    vertex of each row.

    Args:
        vertex: (triangle_count, 3), see `Surface.welded_triangles`. Others as in `find_borders`.
    """
    number = vertex[is_mapped].ravel()
    where = place[is_mapped].reshape(-1, 2)
    rounded = np.round(where / (4.0 * _SAME_PLACE)).astype(np.int64)
    _, kept = np.unique(np.column_stack([number, rounded]), axis=0, return_index=True)
    rows = np.column_stack([where, np.repeat(island[is_mapped], 3)])[kept]
    return rows, number[kept]


def _partners(key: Ints) -> Ints:
    """For each entry the other one with its key; -1 unless there are just two."""
    order = np.argsort(key, kind="stable")
    _, first, count = np.unique(key[order], return_index=True, return_counts=True)
    one, two = order[first[count == 2]], order[first[count == 2] + 1]
    partner = np.full(len(key), -1)
    partner[one], partner[two] = two, one
    return partner


def _connected(edges: Ints, count: int) -> Ints:
    """The lowest number that is connected to each of `count` things, (count,)."""
    label = np.arange(count)
    while len(edges):
        least = label[edges].min(axis=1)
        before = label.copy()
        np.minimum.at(label, before[edges[:, 0]], least)
        np.minimum.at(label, before[edges[:, 1]], least)
        label = label[label]
        if np.array_equal(label, before):
            break
    return label
