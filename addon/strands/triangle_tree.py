"""A balanced tree of boxes over the triangles of a surface, to search those near a point.

Built and traversed level by level, so that numpy processes all points at once. A node of level n is
the box around 1 / 2^n of the triangles; node i has the children 2 i and 2 i + 1.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from .vectors import dot_rows

#: Triangles in a leaf; fewer cost more box tests, more cost more exact tests.
LEAF_SIZE = 4
#: Weight of the distance to a box relative to that of the distance to its middle, both squared; 2
#: to 8 find nearer leaves than either distance alone.
_BOX_WEIGHT = 4.0


@dataclass(frozen=True)
class TriangleTree:
    """The boxes, and the triangles of its leaves.

    levels: for each level (low, high), each (3, 2^level) float64, corners of the boxes.
    leaf_triangles: (leaf_count, LEAF_SIZE) indices; the last triangle may occur several times.
    """

    levels: tuple[tuple[Floats, Floats], ...]
    leaf_triangles: Ints

    def nearest_leaf(self, points: Floats) -> Ints:
        """The leaf reached by always entering the nearer child, (point_count,): a first guess.

        Boxes of children overlap, and a point in both is at distance 0 from both. So the distance
        to the middle of a box is added to the distance to the box.
        """
        # one row per axis: numpy is slow on rows of three
        place, node = np.ascontiguousarray(points.T), np.zeros(len(points), np.int64)
        for low, high in self.levels[1:]:
            middle = (low + high) / 2.0
            left, right = (
                _BOX_WEIGHT * _squared_distance(place, *_columns(child, low, high))
                + _squared_distance(place, *_columns(child, middle, middle))
                for child in (2 * node, 2 * node + 1)
            )
            node = 2 * node + (right < left)
        return node

    def leaves_within(
        self, points: Floats, squared_reach: Floats, limit: int
    ) -> tuple[Ints, Ints, Floats] | None:
        """All (point, leaf) pairs whose box is nearer than the point's reach, ascending by point,
        and the squared distance of each.

        None if this takes more than `limit` pairs at once: call again with fewer points.
        """
        place = np.ascontiguousarray(points.T)
        point, node = np.arange(len(points)), np.zeros(len(points), np.int64)
        distance: Floats = np.zeros(len(points))
        for low, high in self.levels[1:]:
            point, node = np.repeat(point, 2), np.repeat(2 * node, 2)
            node[1::2] += 1
            distance = _squared_distance(*_columns(point, place), *_columns(node, low, high))
            near = np.flatnonzero(distance < squared_reach.take(point))
            point, node, distance = point.take(near), node.take(near), distance.take(near)
            if len(point) > limit:
                return None
        return point, node, distance


def build_tree(corners: Floats) -> TriangleTree:
    """A tree by median splits of the triangle centres along each node's longest axis.

    Args:
        corners: (triangle_count, 3, 3) float64, at least one triangle.
    """
    depth = max(0, int(np.ceil(np.log2(len(corners) / LEAF_SIZE))))
    padded = np.minimum(np.arange(LEAF_SIZE << depth), len(corners) - 1)
    # one row per axis: numpy is slow on rows of three
    columns = np.ascontiguousarray(corners.transpose(1, 2, 0))
    leaves = _median_leaves(columns.mean(axis=0), padded, depth)
    low = columns.min(axis=0).take(leaves, axis=1).min(axis=1)
    high = columns.max(axis=0).take(leaves, axis=1).max(axis=1)
    levels = [(low, high)]
    for _ in range(depth):
        low = np.minimum(low[:, ::2], low[:, 1::2])
        high = np.maximum(high[:, ::2], high[:, 1::2])
        levels.append((low, high))
    return TriangleTree(tuple(reversed(levels)), np.ascontiguousarray(leaves.T))


def _median_leaves(centers: Floats, order: Ints, depth: int) -> Ints:
    """`order` as leaves, one per column, so that the two halves of every node lie on either side of
    its median.

    Args:
        centers: (3, triangle_count).
    """
    nodes = order[:, None]  # one per column
    for _ in range(depth):
        inside = centers.take(nodes, axis=1)
        axis = (inside.max(axis=1) - inside.min(axis=1)).argmax(axis=0)
        along = np.take_along_axis(inside, axis[None, None], axis=0)[0]
        nodes = np.take_along_axis(nodes, along.argsort(axis=0, kind="stable"), axis=0)
        half = len(nodes) // 2
        nodes = np.stack([nodes[:half], nodes[half:]], axis=2).reshape(half, -1)
    return nodes


def _columns(columns: Ints, *tables: Floats) -> Iterator[Floats]:
    """These columns of each table (3, n)."""
    return (table.take(columns, axis=1) for table in tables)


def _squared_distance(points: Floats, low: Floats, high: Floats) -> Floats:
    """The squared distance of points to boxes, pair by pair, (n,); columns (3, n)."""
    outside = low - points
    points = points - high
    np.maximum(outside, points, out=outside)
    np.maximum(outside, 0.0, out=outside)
    return dot_rows(outside, outside)
