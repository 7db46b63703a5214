"""How deep the visible strand of each texel of an atlas lies among the strands around it.

Some of the visible strands lie at the front of their tile's strands and are lit; others lie deeper,
in the shade of their neighbours. Without that difference each card has one brightness, and hair
looks like scales.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from .atlas import AtlasPlan
from .atlas_maps import AtlasMaps, tile_edges
from .bake_strands import FlatStrands
from .strand_shading import EXTENT_OVER_DEVIATION

#: Nodes across and along a tile, between which the mean and the extent of depths are interpolated.
_ACROSS, _ALONG = 5, 17
#: Weight of the tile's mean at each node, in stations of strands, and of texels without hair in the
#: average: they only matter where there are no strands.
_PRIOR = 1.0e-3
#: Strands of less depth than this lie in a plane, in widths of a card.
_FLAT = 1.0e-4


def places_in_depth(maps: AtlasMaps, flat: FlatStrands, plan: AtlasPlan) -> Floats:
    """The depth of each texel's visible strand among the strands around it, relative to the average
    of its tile's visible strands, (h, w) float32.

    0.5 is the average; 0 and 1 lie in front of it and behind it by the whole depth of the strands,
    which is that of evenly spread ones with the same variance.
    """
    places = np.full(maps.depth.shape, 0.5, np.float32)
    middle, extent = _spread(flat, plan)
    grid, (height, width) = plan.grid, maps.depth.shape
    edges_across, edges_along = tile_edges(width, grid.columns), tile_edges(height, grid.rows)
    for tile in range(len(plan.strips)):
        row, column = divmod(tile, grid.columns)
        own = (
            slice(edges_along[row], edges_along[row + 1]),
            slice(edges_across[column], edges_across[column + 1]),
        )
        along = _between(np.arange(own[0].start, own[0].stop), height, row, grid.rows, _ALONG)
        across = _between(
            np.arange(own[1].start, own[1].stop), width, column, grid.columns, _ACROSS
        )
        mean, deep = (along @ values[tile] @ across.T for values in (middle, extent))
        behind = 0.5 - (maps.depth[own] - mean) / np.maximum(deep, _FLAT)
        behind = np.where(deep > _FLAT, np.clip(behind, 0.0, 1.0), 0.5)
        visible = np.average(behind, weights=maps.alpha[own] + _PRIOR)
        places[own] = 0.5 + 0.5 * (behind - visible)
    return places


def _between(texels: Floats, size: int, tile: int, tiles: int, nodes: int) -> Floats:
    """Weights of a tile's nodes at the middles of texels, (texels, nodes), linear between them."""
    at = ((texels + 0.5) / size * tiles - tile) * (nodes - 1)
    return np.maximum(1.0 - np.abs(at[:, None] - np.arange(nodes)), 0.0)


def _spread(flat: FlatStrands, plan: AtlasPlan) -> tuple[Floats, Floats]:
    """Mean and extent of the strands' depths at the nodes of the tiles, (tiles, along, across)."""
    tiles, grid = len(plan.strips), plan.grid
    tile = np.broadcast_to(plan.tile_of_strand[:, None], flat.depth.shape).ravel()
    own = flat.place.reshape(-1, 2) * [grid.columns, grid.rows]
    own -= np.stack([tile % grid.columns, tile // grid.columns], axis=-1)
    at = np.clip(own, 0.0, 1.0) * [_ACROSS - 1, _ALONG - 1]
    low = np.minimum(at.astype(int), [_ACROSS - 2, _ALONG - 2])
    beyond, depth = at - low, flat.depth.ravel().astype(float)
    count = tiles * _ALONG * _ACROSS
    sums = np.zeros((3, count))
    for corner in ((0, 0), (0, 1), (1, 0), (1, 1)):
        weight = np.where(corner, beyond, 1.0 - beyond).prod(axis=1)
        node = (tile * _ALONG + low[:, 1] + corner[1]) * _ACROSS + low[:, 0] + corner[0]
        for sum_, values in zip(sums, (1.0, depth, depth**2), strict=True):
            sum_ += np.bincount(node, weight * values, count)
    by_node = sums.reshape(3, tiles, -1)
    whole = by_node.sum(axis=2, keepdims=True)
    by_node = by_node + _PRIOR * whole / np.maximum(whole[:1], 1.0)
    mean, square = by_node[1:] / np.maximum(by_node[0], 1.0e-30)
    extent = EXTENT_OVER_DEVIATION * np.sqrt(np.maximum(square - mean**2, 0.0))
    shape = (tiles, _ALONG, _ACROSS)
    return mean.reshape(shape), extent.reshape(shape)
