"""Ambient occlusion of card vertices, taken over from the strands that the cards stand for.

A card lies in the middle of its strands, so what a place of it would see of the sky is not what
they see. Each vertex has the mean of its card's strands at the same part of their way, of which
near ones count most: as hat functions between the columns of vertices, so that what the card
shows across is on the mean what the strands have.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from .card_mesh import CardMesh
from .sort import card_of_vertex

#: Pairs of vertices and strands at work at the same time.
_PAIRS = 1 << 20
#: Columns that lie closer count as this far apart [m].
_MIN_WIDTH = 1.0e-12


def strands_occlusion(mesh: CardMesh, grid: Floats, occlusion: Floats, card: Ints) -> Floats:
    """How open each vertex is, (vertex_count,) float32: 1 open, 0 shut in.

    Args:
        grid: (strand_count, cv_count, 3) [m], root first.
        occlusion: (strand_count, cv_count) of the strands.
        card: (strand_count,) the card of each strand, from 0 without gaps; -1 without one. Cards of
            higher numbers stand for the same strands again, in the same order.
    """
    order = np.argsort(card, kind="stable")[np.count_nonzero(card < 0) :]
    count = np.bincount(card[order])
    start = np.cumsum(count) - count
    own = card_of_vertex(mesh) % len(count)
    side, reach = _rows(mesh)
    found = np.ones(len(own), np.float32)
    # vertices of cards with as many strands together, so that little is left empty
    vertices = np.argsort(count[own], kind="stable")
    first = 0
    while first < len(vertices):
        most = int(count[own[vertices[min(first + _PAIRS // 64, len(vertices)) - 1]]])
        chosen = vertices[first : first + max(_PAIRS // most, 1)]
        chosen = chosen[count[own[chosen]] <= most]
        place = np.arange(most)
        is_there = place < count[own[chosen], None]
        strand = order[start[own[chosen], None] + np.where(is_there, place, 0)]
        away = _at(grid, strand, mesh.along[chosen]) - mesh.positions[chosen, None]
        aside = np.abs(np.einsum("vsi,vi->vs", away, side[chosen]))
        weight = np.maximum(1.0 - aside / reach[chosen, None], 0.0) * is_there
        # where none is near, all count alike
        weight = np.where(weight.sum(axis=1, keepdims=True) > 0.0, weight, is_there)
        values = _at(occlusion[..., None], strand, mesh.along[chosen])[..., 0]
        found[chosen] = (weight * values).sum(axis=1) / weight.sum(axis=1)
        first += len(chosen)
    return found


def _at(values: Floats, strand: Ints, along: Floats) -> Floats:
    """Values of CVs between them, (n, m, channels): strands (n, m) at (n,) parts of their way."""
    place = along * (values.shape[1] - 1)
    low = np.minimum(place.astype(np.int64), values.shape[1] - 2)
    fraction = (place - low)[:, None, None]
    between: Floats = values[strand, low[:, None]] * (1.0 - fraction)
    return between + values[strand, low[:, None] + 1] * fraction


def _rows(mesh: CardMesh) -> tuple[Floats, Floats]:
    """Across each vertex' row, (vertex_count, 3) unit vectors, and how far apart its vertices are
    on the mean, (vertex_count,) [m]."""
    card = card_of_vertex(mesh)
    order = np.lexsort((mesh.uv[:, 0], mesh.along, card))
    is_other = (np.diff(card[order]) != 0) | (np.diff(mesh.along[order]) != 0.0)
    begins = np.concatenate([[True], is_other])
    first = np.flatnonzero(begins)
    last = np.append(first[1:], len(order)) - 1
    across = mesh.positions[order[last]] - mesh.positions[order[first]]
    width = np.maximum(np.linalg.norm(across, axis=1), _MIN_WIDTH)
    row = np.empty(len(order), np.int64)
    row[order] = np.cumsum(begins) - 1
    reach = np.maximum(width / np.maximum(last - first, 1), _MIN_WIDTH)
    return (across / width[:, None])[row], reach[row]
