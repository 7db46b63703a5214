"""Cards begin on the skin.

A card runs along the mean of its strands. Their roots lie around it on a skin that curves away on
all sides, so that their mean lies under it, and a card that rises as slowly as combed hair does
would come out of it a finger's breadth later: a parting would be bare. What of a card's first
piece lies under the skin is put onto it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Floats
from ..strands import Surface
from ..strands.closest_point import search_of
from .card_mesh import CardMesh

#: How far along a card its vertices are put onto the skin.
_FIRST = 0.2
#: How high above the skin they are put, as a fraction of the usual width of a card there.
_CLEARANCE = 0.02
#: What lies deeper than cards are usually wide is no beginning of a card.
_DEEPEST = 1.0


def on_skin(mesh: CardMesh, head: Surface | None, width: float) -> CardMesh:
    """The same cards, none of which begins under the skin.

    Args:
        head: in the space of the cards; None leaves them as they are.
        width: that cards usually have [m].
    """
    near = np.flatnonzero(mesh.along < _FIRST)
    if head is None or not len(near) or not len(head.triangles):
        return mesh
    places = mesh.positions[near].astype(np.float64)
    found = search_of(head).closest(places, reach=_DEEPEST * width)
    normal = head.vertex_normals()[head.triangles[found.triangle]]
    outwards: Floats = np.einsum("nk,nki->ni", found.barycentric, normal)
    height = np.einsum("ni,ni->n", places - found.point, outwards)
    is_under = (height < _CLEARANCE * width) & (found.distance < _DEEPEST * width)
    positions = mesh.positions.copy()
    positions[near[is_under]] = (found.point + _CLEARANCE * width * outwards)[is_under]
    return replace(mesh, positions=positions)
