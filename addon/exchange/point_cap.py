"""Fewer points for the curves that have too many; all others stay as they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..strands import StrandSet
from ..strands.resample import arc_length_positions
from .groom import points_of


@dataclass(frozen=True)
class PointCap:
    """Where the new points lie between the old ones, the same for all values and all frames.

    left, right: (new_count,) indices of old points.
    weight: (new_count,) float32, of the right one.
    offsets: (strand_count + 1,) int32, of the new points.
    """

    left: Ints
    right: Ints
    weight: Floats
    offsets: Ints

    def apply(self, values: Floats) -> Floats:
        """Values of the old points (point_count, ...) at the new ones."""
        weight = self.weight.reshape(-1, *[1] * (values.ndim - 1))
        return values[self.left] * (1.0 - weight) + values[self.right] * weight


def point_cap(strands: StrandSet, most: int) -> PointCap | None:
    """Equally spaced points, `most` of them, for each longer strand; None where none is longer."""
    counts = strands.point_counts
    long = np.flatnonzero(counts > most)
    if not len(long):
        return None
    new_counts = np.minimum(counts, most)
    offsets = np.concatenate([[0], np.cumsum(new_counts)]).astype(np.int32)
    first = np.repeat(strands.offsets[:-1] - offsets[:-1], new_counts)
    left = np.arange(offsets[-1]) + first
    right, weight = left.copy(), np.zeros(len(left), np.float32)

    own_left, own_weight = arc_length_positions(strands.take(long), most)
    old = points_of(strands, long)
    places = (offsets[long][:, None] + np.arange(most)).ravel()
    left[places] = old[own_left.ravel()]
    right[places] = left[places] + 1
    weight[places] = own_weight.ravel()
    return PointCap(left, right, weight, offsets)
