"""The Morton order of points, which keeps most neighbours in space close together (Morton 1966)."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints

#: Bits of each coordinate's cell.
_BITS = 10


def morton_code(points: Floats) -> Ints:
    """The Morton code of each point (n, 3) in a grid over their box, (n,) int64: the interleaved
    bits of its cell's coordinates."""
    code = np.zeros(len(points), np.int64)
    if not len(points):
        return code
    low, high = points.min(axis=0), points.max(axis=0)
    max_cell = (1 << _BITS) - 1
    cells = ((points - low) / max(float((high - low).max()), 1e-30) * max_cell).astype(np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code
