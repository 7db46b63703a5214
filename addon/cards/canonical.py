"""One numbering of a mesh's cards, vertices and triangles, whatever order they come in.

A search that starts from the order at hand ends in another one each time. So cards are numbered by
where they are before they are sorted, and sorting a mesh that is sorted changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Ints
from .card_mesh import OF_CARDS, OF_VERTICES, CardMesh


@dataclass(frozen=True)
class Canonical:
    """mesh: the same cards; the triangles of a card follow each other from root to tip.
    triangle: (triangle_count,) which triangle of the source each of its triangles is.
    """

    mesh: CardMesh
    triangle: Ints


def canonical(mesh: CardMesh) -> Canonical:
    """The mesh numbered by the way from the root, then by place, then by UV.

    What is alike in all of these keeps the order of its vertices.
    """
    vertices, rank = _by_place(mesh)
    number = np.empty(len(vertices), np.int32)
    number[vertices] = np.arange(len(vertices), dtype=np.int32)
    corners = _lowest_first(number[mesh.triangles])
    first, second, third = rank[corners].T
    inside = np.lexsort((corners[:, 0], third, second, first))  # the last counts most
    names, place = np.unique(mesh.card[inside], return_index=True)
    cards = names[np.argsort(place)]
    card = np.zeros(int(names.max(initial=-1)) + 1, np.int32)
    card[cards] = np.arange(len(cards), dtype=np.int32)
    order = inside[np.argsort(card[mesh.card[inside]], kind="stable")]
    numbered = replace(
        mesh,
        triangles=corners[order],
        card=card[mesh.card[order]],
        **{name: getattr(mesh, name)[vertices] for name in OF_VERTICES},
        **{name: getattr(mesh, name)[cards] for name in OF_CARDS},
    )
    return Canonical(numbered, order)


def _by_place(mesh: CardMesh) -> tuple[Ints, Ints]:
    """Vertices from root to tip, and the rank of each of these, which those that are alike share;
    (vertex_count,) each."""
    keys = np.column_stack([mesh.along, mesh.positions, mesh.uv])
    vertices = np.lexsort(keys.T[::-1])
    keys = keys[vertices]
    is_other = np.ones(len(keys), bool)
    is_other[1:] = (keys[1:] != keys[:-1]).any(axis=1)
    return vertices, np.cumsum(is_other)


def _lowest_first(triangles: Ints) -> Ints:
    """The same triangles, each turned so that its lowest number comes first, (n, 3)."""
    turned = (triangles.argmin(axis=1)[:, None] + np.arange(3)) % 3
    return np.take_along_axis(triangles, turned, axis=1)
