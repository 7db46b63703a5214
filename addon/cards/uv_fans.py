"""Vertices of cards as in exported files.

Where a card's UVs are mirrored or folded, its tangent frame flips, and exporters that write
tangents split vertices. They are split in the mesh too, so that its indices are those of the file.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..arrays import Bools, Ints
from .card_mesh import VERTEX_FIELDS, CardMesh
from .sort import connected_components


def split_fans(mesh: CardMesh, back: Ints) -> tuple[CardMesh, Ints]:
    """The same mesh, whose triangles share a vertex only if they are connected around it by edges
    and their UVs have the same orientation, as MikkTSpace groups them (Mikkelsen 2008, "Simulation
    of Wrinkled Surfaces Revisited"). Vertices without a triangle are left out.

    Args:
        back: (triangle_count, 3) its triangles in another order, which are returned with the new
            vertices.
    """
    triangles = mesh.triangles
    uv = mesh.uv[triangles].astype(np.float64)
    one, two = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    is_mirrored = one[:, 0] * two[:, 1] > one[:, 1] * two[:, 0]
    # each corner has two edges; corners at one vertex with a common edge belong to one fan
    own = triangles.astype(np.int64)
    edges = [_edges(own, np.roll(own, step, axis=1), is_mirrored) for step in (1, 2)]
    _, number = np.unique(np.stack(edges, axis=2), return_inverse=True)
    fan = connected_components(number.reshape(-1, 2)[:, [0, 1, 1]]).astype(np.int64)
    vertex, corner = np.unique(own.ravel() * max(len(fan), 1) + fan, return_inverse=True)
    used = vertex // max(len(fan), 1)
    vertices: dict[str, Any] = {name: getattr(mesh, name)[used] for name in VERTEX_FIELDS}
    split = replace(mesh, triangles=corner.reshape(-1, 3), **vertices)
    place = np.empty(len(back), np.int64)
    place[np.lexsort(back.T)] = np.lexsort(triangles.T)
    return split, split.triangles[place]


def _edges(vertex: Ints, other: Ints, is_turned: Bools) -> Ints:
    """A number for each edge as seen from a vertex, with the orientation of the UVs,
    (triangle_count, 3)."""
    low, high = np.minimum(vertex, other), np.maximum(vertex, other)
    pair = low * (int(high.max(initial=0)) + 1) + high
    number: Ints = (pair * 2 + (vertex == high)) * 2 + is_turned[:, None]
    return number
