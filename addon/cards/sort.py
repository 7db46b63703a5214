"""The order in which cards are drawn: from the inside to the outside of the hair.

For a head with hair that is nearly back to front from every side, so that blending needs no
sorting at run time (Scheuermann 2004, "Rendering with approximate depth sorting"). Whole cards are
sorted, never single triangles.

Limitations: one number a card cannot express that two cards change places along their way; hair
that swings far from its rest shape, such as a ponytail, has to be its own mesh or to be sorted at
run time.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Floats, Ints
from ..strands import Surface
from ..strands.closest_point import closest_point
from .card_mesh import OF_VERTICES, CardMesh

#: Vertices of a card whose distance from the head is measured; more hardly change the order.
SAMPLE_COUNT = 7


def inside_out_order(mesh: CardMesh, head: Surface | None) -> CardMesh:
    """The same cards, nearest to the head first; the vertices follow their cards.

    The triangles of a card stay together and in their order; cards at equal distance keep theirs.

    Args:
        head: in the space of the mesh; without one the middle of the hair stands for it.
    """
    return reordered(mesh, card_distances(mesh, head))


def reordered(mesh: CardMesh, key: Floats | Ints) -> CardMesh:
    """The same cards by ascending key, one a card number; equal keys keep their order."""
    triangles = np.argsort(key[mesh.card], kind="stable")
    owner = card_of_vertex(mesh)
    vertices = np.argsort(key[owner], kind="stable")
    place = np.empty(len(vertices), np.int32)
    place[vertices] = np.arange(len(vertices), dtype=np.int32)
    moved = {name: getattr(mesh, name)[vertices] for name in OF_VERTICES}
    return replace(
        mesh, triangles=place[mesh.triangles[triangles]], card=mesh.card[triangles], **moved
    )


def card_distances(mesh: CardMesh, head: Surface | None) -> Floats:
    """Median distance of each card from the head [m], (highest card number + 1,).

    From the head's surface; without a head from the middle of the mesh. A card number that no
    triangle has gets 0.
    """
    if not len(mesh.triangles):
        return np.zeros(0)
    owner = card_of_vertex(mesh)
    vertices = np.argsort(owner, kind="stable")
    counts = np.bincount(owner)
    starts = np.cumsum(counts) - counts
    share = (np.arange(SAMPLE_COUNT) + 0.5) / SAMPLE_COUNT
    used = np.flatnonzero(counts)
    picks = vertices[starts[used, None] + (counts[used, None] * share).astype(np.int64)]
    points = mesh.positions[picks.ravel()]
    if head is None:
        distance = np.linalg.norm(points - mesh.positions.mean(axis=0), axis=1)
    else:
        distance = closest_point(points, head).distance
    distances = np.zeros(len(counts))
    distances[used] = np.median(distance.reshape(picks.shape), axis=1)
    return distances


def card_of_vertex(mesh: CardMesh) -> Ints:
    """The card that each vertex belongs to, (vertex_count,); 0 for a vertex without triangles."""
    card = np.zeros(len(mesh.positions), np.int64)
    card[mesh.triangles] = mesh.card[:, None]
    return card


def connected_components(triangles: Ints) -> Ints:
    """Which connected piece each triangle belongs to, (triangle_count,) int32.

    Pieces are numbered by their lowest vertex. Hooking and pointer jumping (Shiloach and Vishkin
    1982): across each edge the higher root is hung below the lower one, then all vertices are led
    to their roots and the edges that became loops are forgotten; few rounds, each over all edges.

    Args:
        triangles: (triangle_count, 3) vertex indices.
    """
    if not len(triangles):
        return np.zeros(0, np.int32)
    first, second, third = np.asarray(triangles, np.int32).T
    root = np.arange(int(triangles.max()) + 1, dtype=np.int32)
    one, two = np.concatenate([first, second]), np.concatenate([second, third])
    while len(one):
        root[np.maximum(one, two)] = np.minimum(one, two)
        _lead_to_roots(root)
        one, two = root[one], root[two]
        is_open = one != two
        one, two = one[is_open], two[is_open]
    is_used = np.zeros(len(root), bool)
    is_used[root[first]] = True
    number = np.cumsum(is_used, dtype=np.int32) - 1
    return number[root[first]]


def _lead_to_roots(root: Ints) -> None:
    """Pointer jumping in place: afterwards each vertex names a vertex that names itself."""
    while True:
        further = root[root]
        if (further == root).all():
            return
        root[:] = further
