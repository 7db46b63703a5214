"""Blocks of strands with similar point counts, so that numpy processes many points at once.

A block's points are stored as planes (3, count, n), point number by point number, so that values of
a strand broadcast over its points without being repeated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints

#: Points of a block, so that they stay in the processor's cache, and the largest ratio between the
#: point counts of a block's strands.
_POINTS, _PADDING = 16384, 1.2


@dataclass(frozen=True, eq=False)
class Block:
    """Strands that are processed together.

    strands: (n,) indices; each strand has at most `count` points.
    points: (n, count) indices of their points, a shorter strand's padded with its tip; a slice if
        all strands have `count` points and are contiguous.
    """

    strands: Ints | slice
    count: int
    points: Ints | slice

    @classmethod
    def of(cls, strands: Ints, offsets: Ints) -> Block:
        """The block of strands (n,), which ascend where their point counts are equal; offsets as of
        `blocks_of`.
        """
        counts = offsets[strands + 1] - offsets[strands]
        count, first, after = int(counts.max()), int(strands[0]), int(strands[-1]) + 1
        if counts.min() == count and after - first == len(strands):
            return cls(slice(first, after), count, slice(int(offsets[first]), int(offsets[after])))
        number = np.minimum(np.arange(count), counts[:, None] - 1)
        return cls(strands, count, offsets[strands, None] + number)

    def planes(self, values: Floats) -> Floats:
        """The block's part of values (point_count, ...) as planes, (..., count, n)."""
        taken = values[self.points]
        return np.ascontiguousarray(taken.reshape(-1, self.count, *values.shape[1:]).T)

    def write(self, values: Floats, planes: Floats) -> None:
        """Write planes (..., count, n) into values (point_count, ...), in place."""
        if isinstance(self.points, slice):
            rows = values[self.points].reshape(-1, self.count, len(planes))
            for axis, plane in enumerate(planes):  # twice as fast as one assignment
                rows[..., axis] = plane.T
        else:
            values[self.points] = planes.T


def blocks_of(offsets: Ints) -> Iterator[Block]:
    """All strands in blocks; strand s is points offsets[s]:offsets[s + 1], at least one."""
    counts = np.diff(offsets)
    order = np.argsort(counts, kind="stable")
    sizes, first = counts[order], 0
    while first < len(order):
        similar_end = np.searchsorted(sizes, sizes[first] * _PADDING, side="right")
        last = min(int(similar_end), first + max(_POINTS // int(sizes[first]), 1))
        yield Block.of(order[first:last], offsets)
        first = last
