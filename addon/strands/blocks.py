"""Strands of about one point count side by side, so that numpy moves many points at once.

The points of one number lie side by side, as planes (3, count, n): what belongs to a strand is
never repeated for its points.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints

#: Points of a block, so that they stay in the processor's cache, and by how many times as many
#: points as another a strand beside it may have.
_POINTS, _PADDING = 16384, 1.2


@dataclass(frozen=True, eq=False)
class Block:
    """Strands that are moved together.

    strands: which; all of them have `count` points, or fewer.
    points: (n, count) theirs, where a strand that has fewer repeats its tip; a slice where all have
        as many and lie side by side.
    """

    strands: Ints | slice
    count: int
    points: Ints | slice

    @classmethod
    def of(cls, strands: Ints, offsets: Ints) -> Block:
        counts = offsets[strands + 1] - offsets[strands]
        count, first, after = int(counts.max()), int(strands[0]), int(strands[-1]) + 1
        if counts.min() == count and after - first == len(strands):
            return cls(slice(first, after), count, slice(int(offsets[first]), int(offsets[after])))
        number = np.minimum(np.arange(count), counts[:, None] - 1)
        return cls(strands, count, offsets[strands, None] + number)

    def planes(self, values: Floats) -> Floats:
        """Values (point_count, ...) of its points, (..., count, n)."""
        taken = values[self.points]
        return np.ascontiguousarray(taken.reshape(-1, self.count, *values.shape[1:]).T)

    def put(self, values: Floats, planes: Floats) -> None:
        """Write these, in place."""
        if isinstance(self.points, slice):
            rows = values[self.points].reshape(-1, self.count, len(planes))
            for axis, plane in enumerate(planes):  # twice as fast as all at once
                rows[..., axis] = plane.T
        else:
            values[self.points] = planes.T


def blocks_of(offsets: Ints) -> Iterator[Block]:
    """All strands; strand s is points offsets[s]:offsets[s + 1], at least one."""
    counts = np.diff(offsets)
    order = np.argsort(counts, kind="stable")
    sizes, first = counts[order], 0
    while first < len(order):
        most = np.searchsorted(sizes, sizes[first] * _PADDING, side="right")
        last = min(int(most), first + max(_POINTS // int(sizes[first]), 1))
        yield Block.of(order[first:last], offsets)
        first = last
