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
_NODES_ACROSS, _NODES_ALONG = 5, 17
#: Weight of the tile's mean at each node, in stations of strands, and of texels without hair in the
#: average: they only matter where there are no strands.
_PRIOR_WEIGHT = 1.0e-3
#: Strands of less depth than this lie in a plane, in widths of a card.
_MIN_EXTENT = 1.0e-4


def relative_depths(maps: AtlasMaps, flat: FlatStrands, plan: AtlasPlan) -> Floats:
    """The depth of each texel's visible strand among the strands around it, relative to the average
    of its tile's visible strands, (h, w) float32.

    0.5 is the average; 0 and 1 lie in front of it and behind it by the whole depth of the strands,
    which is that of evenly spread ones with the same variance.
    """
    depths = np.full(maps.depth.shape, 0.5, np.float32)
    middle, extent = _depth_statistics(flat, plan)
    grid, (height, width) = plan.grid, maps.depth.shape
    edges_across, edges_along = tile_edges(width, grid.columns), tile_edges(height, grid.rows)
    for tile in range(len(plan.strips)):
        row, column = divmod(tile, grid.columns)
        texels = (
            slice(edges_along[row], edges_along[row + 1]),
            slice(edges_across[column], edges_across[column + 1]),
        )
        along = _node_weights(
            np.arange(texels[0].start, texels[0].stop), height, row, grid.rows, _NODES_ALONG
        )
        across = _node_weights(
            np.arange(texels[1].start, texels[1].stop), width, column, grid.columns, _NODES_ACROSS
        )
        mean, tile_extent = (along @ values[tile] @ across.T for values in (middle, extent))
        behind = 0.5 - (maps.depth[texels] - mean) / np.maximum(tile_extent, _MIN_EXTENT)
        behind = np.where(tile_extent > _MIN_EXTENT, np.clip(behind, 0.0, 1.0), 0.5)
        visible = np.average(behind, weights=maps.alpha[texels] + _PRIOR_WEIGHT)
        depths[texels] = 0.5 + 0.5 * (behind - visible)
    return depths


def _node_weights(texels: Floats, size: int, tile: int, tiles: int, nodes: int) -> Floats:
    """Weights of a tile's nodes at the middles of texels, (texels, nodes), linear between them."""
    place = ((texels + 0.5) / size * tiles - tile) * (nodes - 1)
    return np.maximum(1.0 - np.abs(place[:, None] - np.arange(nodes)), 0.0)


def _depth_statistics(flat: FlatStrands, plan: AtlasPlan) -> tuple[Floats, Floats]:
    """Mean and extent of the strands' depths at the nodes of the tiles, (tiles, along, across)."""
    tiles, grid = len(plan.strips), plan.grid
    tile = np.broadcast_to(plan.tile_of_strand[:, None], flat.depth.shape).ravel()
    place_in_tile = flat.place.reshape(-1, 2) * [grid.columns, grid.rows]
    place_in_tile -= np.stack([tile % grid.columns, tile // grid.columns], axis=-1)
    place = np.clip(place_in_tile, 0.0, 1.0) * [_NODES_ACROSS - 1, _NODES_ALONG - 1]
    low = np.minimum(place.astype(int), [_NODES_ACROSS - 2, _NODES_ALONG - 2])
    fraction, depth = place - low, flat.depth.ravel().astype(float)
    count = tiles * _NODES_ALONG * _NODES_ACROSS
    sums = np.zeros((3, count))
    for corner in ((0, 0), (0, 1), (1, 0), (1, 1)):
        weight = np.where(corner, fraction, 1.0 - fraction).prod(axis=1)
        node = (tile * _NODES_ALONG + low[:, 1] + corner[1]) * _NODES_ACROSS + low[:, 0] + corner[0]
        for sum_, values in zip(sums, (1.0, depth, depth**2), strict=True):
            sum_ += np.bincount(node, weight * values, count)
    by_node = sums.reshape(3, tiles, -1)
    whole = by_node.sum(axis=2, keepdims=True)
    by_node = by_node + _PRIOR_WEIGHT * whole / np.maximum(whole[:1], 1.0)
    mean, square = by_node[1:] / np.maximum(by_node[0], 1.0e-30)
    extent = EXTENT_OVER_DEVIATION * np.sqrt(np.maximum(square - mean**2, 0.0))
    shape = (tiles, _NODES_ALONG, _NODES_ACROSS)
    return mean.reshape(shape), extent.reshape(shape)
