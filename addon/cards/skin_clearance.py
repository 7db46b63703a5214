"""Cards moved out of the skin: at their roots, and between the rows of coarse levels.

A card runs along the mean of its strands. Their roots lie on a skin that curves away on all sides,
so their mean lies under the skin, and a card that rises as slowly as combed hair would come out a
finger's breadth later: a parting would be bare. So vertices near a card's root that lie under the
skin are put onto it.

A coarser card is straight between its rows, while the skin bulges out between them: the card would
sink in there, and a parting would grow bald from level to level. So both rows are raised by the
depth of the places between them under the skin.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Bools, Floats
from ..strands import Surface
from ..strands.closest_point import search_of
from .card_mesh import CardMesh

#: Up to this place along a card its vertices are put onto the skin.
_ROOT_PART = 0.2
#: Height above the skin at which they are put, as a fraction of the median width of cards at the
#: root.
_CLEARANCE = 0.02
#: Vertices deeper than this under the skin, in the same unit, are left where they are.
_MAX_DEPTH = 1.0
#: Places on an edge that are tested.
_EDGE_FRACTIONS = (0.25, 0.5, 0.75)


def lift_roots(mesh: CardMesh, head: Surface | None, width: float) -> CardMesh:
    """The same cards, none of which begins under the skin.

    Args:
        head: in the space of the cards; None leaves them as they are.
        width: median width of cards at the root [m].
    """
    near = np.flatnonzero(mesh.along < _ROOT_PART)
    if head is None or not len(near) or not len(head.triangles):
        return mesh
    skin, outwards, is_under = _closest_skin(head, mesh.positions[near], width)
    positions = mesh.positions.copy()
    positions[near[is_under]] = (skin + _CLEARANCE * width * outwards)[is_under]
    return replace(mesh, positions=positions)


def raise_between_rows(mesh: CardMesh, head: Surface | None, width: float) -> CardMesh:
    """The same cards, raised where they sink into the skin between their rows.

    Args:
        head, width: as for `lift_roots`.
    """
    if head is None or not len(mesh.triangles) or not len(head.triangles):
        return mesh
    edges = np.concatenate([mesh.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    one, other = np.unique(np.sort(edges, axis=1), axis=0).T
    ends = mesh.positions[one], mesh.positions[other]
    raised = np.zeros((len(mesh.positions), 3))
    max_rise = np.zeros(len(mesh.positions))
    for part in _EDGE_FRACTIONS:
        place = ends[0] * (1.0 - part) + ends[1] * part
        skin, outwards, is_under = _closest_skin(head, place, width)
        needed = np.einsum("ni,ni->n", skin - place, outwards) + _CLEARANCE * width
        for vertex in (one[is_under], other[is_under]):
            order = np.argsort(needed[is_under], kind="stable")  # of several the largest is last
            vertex, rise = vertex[order], needed[is_under][order]
            direction = outwards[is_under][order]
            is_more = rise > max_rise[vertex]
            max_rise[vertex[is_more]] = rise[is_more]
            raised[vertex[is_more]] = (rise[:, None] * direction)[is_more]
    return replace(mesh, positions=(mesh.positions + raised).astype(np.float32))


def _closest_skin(head: Surface, places: Floats, width: float) -> tuple[Floats, Floats, Bools]:
    """The closest points on the skin, its normals there, and which places are under it or hardly
    above."""
    places = places.astype(np.float64)
    found = search_of(head).closest(places, reach=_MAX_DEPTH * width)
    normal = head.vertex_normals()[head.triangles[found.triangle]]
    outwards: Floats = np.einsum("nk,nki->ni", found.barycentric, normal)
    height = np.einsum("ni,ni->n", places - found.point, outwards)
    is_under = (height < _CLEARANCE * width) & (found.distance < _MAX_DEPTH * width)
    return found.point, outwards, is_under
