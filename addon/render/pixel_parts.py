"""Parts of a picture that are drawn one after the other, because all of it at once has no room.

A part is a run of pixels, row by row; where one pixel alone is too much, a range of depths in it.
Pure numpy: importable without gpu.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Ints

#: the float bits of all depths, from 0 to 1, are below it; as floats above 0 do, they grow
DEPTH_END = 0x3F800001


@dataclass(frozen=True)
class PixelPart:
    """Pixels from `first` on, up to and without `end`, counted row by row from the bottom left, and
    depths from `near` on, up to and without `far`, as float bits.
    """

    first: int
    end: int
    near: int = 0
    far: int = DEPTH_END

    @property
    def halves(self) -> tuple[PixelPart, ...]:
        """Two parts that are this one, the farther first; none where it cannot be cut."""
        pixel = (self.first + self.end) // 2
        if self.end - self.first > 1:
            return replace(self, end=pixel), replace(self, first=pixel)
        return self.slabs

    @property
    def slabs(self) -> tuple[PixelPart, ...]:
        """The farther half of its depths and the nearer one; none where it has but one depth."""
        depth = (self.near + self.far) // 2
        if self.far - self.near > 1:
            return replace(self, near=depth), replace(self, far=depth)
        return ()

    def rows(self, across: int) -> range:
        """The rows that it touches, where a row has `across` pixels."""
        return range(self.first // across, (self.end - 1) // across + 1)


def pixel_parts(counts: Ints, capacity: int) -> list[PixelPart]:
    """As few parts as hold all pixels that have something, each with no more than has room.

    A pixel that has more by itself is a part of its own.

    Args:
        counts: (pixel_count,) how much there is in each.
        capacity: how much has room, at least 1.
    """
    passed = np.cumsum(counts, dtype=np.int64)
    parts: list[PixelPart] = []
    before = 0
    while len(passed) and before < passed[-1]:
        first = int(np.searchsorted(passed, before, side="right"))
        end = max(int(np.searchsorted(passed, before + capacity, side="right")), first + 1)
        parts.append(PixelPart(first, end))
        before = int(passed[end - 1])
    return parts
