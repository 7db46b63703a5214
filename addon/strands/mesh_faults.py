"""Faults that keep a mesh from being a closed surface, found by its edges."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Ints
from .surface import Surface


@dataclass(frozen=True, eq=False)
class Edges:
    """The edges of a welded mesh, without those of no length.

    uses: (edge_count,) number of triangles at each edge.
    turns: (edge_count,) how many more of these traverse it in one direction than in the other; 0
        if neighbours face the same side.
    """

    uses: Ints
    turns: Ints

    @property
    def are_closed(self) -> bool:
        """Whether the mesh has an inside: all edges are traversed equally often both ways."""
        return not self.turns.any()

    @cached_property
    def open_count(self) -> int:
        """Number of edges with a single triangle."""
        return int((self.uses == 1).sum())

    @cached_property
    def crowded_count(self) -> int:
        """Number of edges with more than two triangles."""
        return int((self.uses > 2).sum())

    @cached_property
    def opposed_count(self) -> int:
        """Number of edges between two triangles that face different sides."""
        return int(((self.uses == 2) & (self.turns != 0)).sum())


def edges_of(surface: Surface) -> Edges:
    return surface.compute_once(_edges_of)


def _edges_of(surface: Surface) -> Edges:
    corners = surface.welded_triangles().astype(np.int64)
    start, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    start, end = start[start != end], end[start != end]
    key = np.minimum(start, end) * len(surface.positions) + np.maximum(start, end)
    _, edge = np.unique(key, return_inverse=True)
    edge = np.asarray(edge).reshape(-1)
    turns = np.bincount(edge, np.sign(end - start)).astype(np.int64)
    return Edges(np.bincount(edge), np.abs(turns))
