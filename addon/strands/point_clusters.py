"""Points grouped by the cells of a grid, so that a result for a cell's middle helps all of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints

#: Maximum number of cells along each axis, so that three indices fit into 63 bits.
_MAX_CELLS = 1 << 20


@dataclass(frozen=True)
class PointClusters:
    """Points in the order of their cells.

    order: (point_count,) indices of the points, cluster by cluster.
    cluster: (point_count,) the cluster of each point in that order, ascending.
    middle: (cluster_count, 3), the mean of a cluster's points.
    away: (point_count,) distance of each point in that order from its cluster's middle.
    radius: (cluster_count,), the largest of these distances.
    """

    order: Ints
    cluster: Ints
    middle: Floats
    away: Floats
    radius: Floats


def cluster_points(points: Floats, size: float) -> PointClusters:
    """Group points (point_count, 3), at least one, by cells of this size, or of a larger one if the
    points would need more than _MAX_CELLS along an axis."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = max(size, float((high - low).max()) / _MAX_CELLS)
    cell = ((points - low) / size if size > 0.0 else np.zeros_like(points)).astype(np.int64)
    key = (cell[:, 0] * (_MAX_CELLS + 1) + cell[:, 1]) * (_MAX_CELLS + 1) + cell[:, 2]
    order = np.argsort(key, kind="stable")
    is_first = np.diff(key[order], prepend=-1) != 0
    cluster, first = np.cumsum(is_first) - 1, np.flatnonzero(is_first)
    gathered = points[order]
    counts = np.diff(np.append(first, len(points)))
    middle = np.add.reduceat(gathered, first, axis=0) / counts[:, None]
    away = np.linalg.norm(gathered - middle[cluster], axis=1)
    return PointClusters(order, cluster, middle, away, np.maximum.reduceat(away, first))
