"""Points gathered by the cells of a grid, so that what is found for a cell's middle serves all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints

#: Cells along each axis at most, so that three indices fit into 63 bits.
_MAX_CELLS = 1 << 20


@dataclass(frozen=True)
class PointClusters:
    """Points in the order of their cells.

    order: (point_count,) indices of the points, cluster after cluster.
    cluster: (point_count,) of each point in that order, ascending.
    middle: (cluster_count, 3), the mean of the points.
    away: (point_count,) distance of each point in that order from its middle.
    radius: (cluster_count,), the largest of these.
    """

    order: Ints
    cluster: Ints
    middle: Floats
    away: Floats
    radius: Floats


def clustered(points: Floats, size: float) -> PointClusters:
    """Gather points (point_count, 3), at least one, by cells of this size, or larger ones where
    the points reach too far."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = max(size, float((high - low).max()) / _MAX_CELLS)
    cell = ((points - low) / size if size > 0.0 else np.zeros_like(points)).astype(np.int64)
    key = (cell[:, 0] * (_MAX_CELLS + 1) + cell[:, 1]) * (_MAX_CELLS + 1) + cell[:, 2]
    order = np.argsort(key, kind="stable")
    begins = np.diff(key[order], prepend=-1) != 0
    cluster, first = np.cumsum(begins) - 1, np.flatnonzero(begins)
    gathered = points[order]
    counts = np.diff(np.append(first, len(points)))
    middle = np.add.reduceat(gathered, first, axis=0) / counts[:, None]
    away = np.linalg.norm(gathered - middle[cluster], axis=1)
    return PointClusters(order, cluster, middle, away, np.maximum.reduceat(away, first))
