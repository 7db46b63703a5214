"""Occlusion and light that card vertices take over from the strands of their cards.

A card lies in the middle of its strands, so it would see another part of the sky than they do. Each
vertex gets the mean over its card's strands at the same part of their length, weighted by hat
functions between the columns of vertices, so that the mean across the card is that of the strands.

The mean of light is weighted by the strands' visibility: one that is hidden among others sends
little light to an eye. The fraction of the sky that a strand sees approximates its visibility.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints, piece_starts
from ..strands.vectors import unit_or
from .card_mesh import CardMesh
from .sort import card_of_vertex

#: Pairs of vertices and strands in one batch.
_MAX_PAIRS = 1 << 18
#: Minimum distance of columns [m].
_MIN_WIDTH = 1.0e-12
#: Minimum visibility of a strand.
_MIN_VISIBILITY = 1.0e-6
#: Hair is short if it is shorter than this many times the depth of its card.
_MAX_SHORT_RATIO = 8.0
#: Extent of an even distribution over its standard deviation.
EXTENT_OVER_DEVIATION = np.sqrt(12.0)


@dataclass(frozen=True, eq=False)
class StrandShading:
    """Values of each vertex of a mesh.

    occlusion: (vertex_count,) float32: 1 open, 0 occluded.
    light: (vertex_count, k) float32, the mean of visible strands; None if that of the strands is
        None.
    depth: (vertex_count,) float32 [m], extent of its strands along the normal: that of evenly
        spread ones with the same variance. 0 where hair is so short that its tips are seen, which
        lie side by side.
    """

    occlusion: Floats
    light: Floats | None
    depth: Floats


def shading_from_strands(
    mesh: CardMesh, grid: Floats, occlusion: Floats, light: Floats | None, card: Ints
) -> StrandShading:
    """The values that a mesh takes over.

    Args:
        grid: (strand_count, cv_count, 3) [m], root first.
        occlusion: (strand_count, cv_count) of the strands.
        light: (strand_count, cv_count, k) of the strands; the first value is the fraction of the
            sky that is seen. None: unknown.
        card: (strand_count,) the card of each strand, from 0 without gaps; -1 without one. Cards of
            higher numbers represent the same strands again, in the same order.
    """
    length = np.linalg.norm(np.diff(grid, axis=1), axis=2).sum(axis=1)
    order = np.argsort(card, kind="stable")[np.count_nonzero(card < 0) :]
    count = np.bincount(card[order])
    start = piece_starts(count)
    own_card = card_of_vertex(mesh) % len(count)
    side, reach = _rows(mesh)
    plane = unit_or(np.cross(side, mesh.tangent), mesh.normal)
    occluded, depth = np.ones(len(own_card), np.float32), np.zeros(len(own_card), np.float32)
    lit = None if light is None else np.zeros((len(own_card), light.shape[2]), np.float32)
    # vertices of cards with similar numbers of strands together, so that little is left empty
    vertices = np.argsort(count[own_card], kind="stable")
    first = 0
    while first < len(vertices):
        max_strands = int(
            count[own_card[vertices[min(first + _MAX_PAIRS // 64, len(vertices)) - 1]]]
        )
        chosen = vertices[first : first + max(_MAX_PAIRS // max_strands, 1)]
        chosen = chosen[count[own_card[chosen]] <= max_strands]
        place = np.arange(max_strands)
        is_there = place < count[own_card[chosen], None]
        strand = order[start[own_card[chosen], None] + np.where(is_there, place, 0)]
        along = mesh.along[chosen]
        away = _interpolated(grid, strand, along) - mesh.positions[chosen, None]
        aside = np.abs(np.einsum("vsi,vi->vs", away, side[chosen]))
        weight = np.maximum(1.0 - aside / reach[chosen, None], 0.0) * is_there
        # where no strand is near, all count equally
        weight = np.where(weight.sum(axis=1, keepdims=True) > 0.0, weight, is_there)
        occluded[chosen] = _weighted_mean(
            _interpolated(occlusion[..., None], strand, along), weight
        )[:, 0]
        height = np.einsum("vsi,vi->vs", away, plane[chosen])[..., None]
        variance = _weighted_mean(height**2, weight) - _weighted_mean(height, weight) ** 2
        extent = EXTENT_OVER_DEVIATION * np.sqrt(np.maximum(variance[:, 0], 0.0))
        is_short = (
            _weighted_mean(length[strand][..., None], weight)[:, 0] < _MAX_SHORT_RATIO * extent
        )
        depth[chosen] = np.where(is_short, 0.0, extent)
        if light is not None and lit is not None:
            values = _interpolated(light, strand, along)
            lit[chosen] = _weighted_mean(
                values, weight * np.maximum(values[..., 0], _MIN_VISIBILITY)
            )
        first += len(chosen)
    return StrandShading(occluded, lit, depth)


def _weighted_mean(values: Floats, weight: Floats) -> Floats:
    """Weighted means over strands, (vertices, k), of (vertices, strands, k); weights
    (vertices, strands)."""
    mean: Floats = np.einsum("vsk,vs->vk", values, weight) / weight.sum(axis=1, keepdims=True)
    return mean


def _interpolated(values: Floats, strand: Ints, along: Floats) -> Floats:
    """Values interpolated between CVs, (n, m, channels), of strands (n, m) at parts (n,) of their
    length."""
    place = along * (values.shape[1] - 1)
    low = np.minimum(place.astype(np.int64), values.shape[1] - 2)
    fraction = (place - low)[:, None, None]
    before: Floats = values[strand, low[:, None]] * (1.0 - fraction)
    return before + values[strand, low[:, None] + 1] * fraction


def _rows(mesh: CardMesh) -> tuple[Floats, Floats]:
    """Unit vectors across each vertex' row, (vertex_count, 3), and the mean distance of the row's
    vertices, (vertex_count,) [m]."""
    card = card_of_vertex(mesh)
    order = np.lexsort((mesh.uv[:, 0], mesh.along, card))
    is_other = (np.diff(card[order]) != 0) | (np.diff(mesh.along[order]) != 0.0)
    is_row_start = np.concatenate([[True], is_other])
    first = np.flatnonzero(is_row_start)
    last = np.append(first[1:], len(order)) - 1
    across = mesh.positions[order[last]] - mesh.positions[order[first]]
    width = np.maximum(np.linalg.norm(across, axis=1), _MIN_WIDTH)
    row = np.empty(len(order), np.int64)
    row[order] = np.cumsum(is_row_start) - 1
    reach = np.maximum(width / np.maximum(last - first, 1), _MIN_WIDTH)
    return (across / width[:, None])[row], reach[row]
