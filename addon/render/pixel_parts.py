"""Parts of a picture that are drawn one after the other, because all of it at once has no room.

A part is a run of pixels, row by row; where one pixel alone is too much, a range of depths in it.
Depths are cut where hair is, which may be a thousandth of all: each part is a draw of all strands.
Pure numpy: importable without gpu.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Ints
from ..shading.volume.light_frame import Ball
from .camera import Camera

#: the float bits of all depths, from 0 to 1, are below it; as floats above 0 do, they grow
DEPTH_END = 0x3F800001
ALL_DEPTHS = range(DEPTH_END)
#: of the distance of the farthest hair, how near the nearest is expected
_NEAREST = 1.0 / 16.0


@dataclass(frozen=True)
class PixelPart:
    """Pixels from `first` on, up to and without `end`, counted row by row from the bottom left, and
    depths from `near` on, up to and without `far`, as float bits.

    expected: depths that hair may have; others are in a part all the same.
    """

    first: int
    end: int
    near: int = 0
    far: int = DEPTH_END
    expected: range = ALL_DEPTHS

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
        if self.far - self.near < 2:
            return ()
        low, high = max(self.near, self.expected.start), min(self.far, self.expected.stop)
        if high - low < 2:
            low, high = self.near, self.far
        depth = (low + high) // 2
        return replace(self, near=depth), replace(self, far=depth)

    def rows(self, across: int) -> range:
        """The rows that it touches, where a row has `across` pixels."""
        return range(self.first // across, (self.end - 1) // across + 1)


def pixel_parts(
    counts: Ints, capacity: int, longest: int | None = None, expected: range = ALL_DEPTHS
) -> list[PixelPart]:
    """As few parts as hold all pixels that have something, each with no more than has room.

    A pixel that has more by itself is a part of its own. A part with a pixel that has more than
    `longest` is two, by depth, the farther one first.

    Args:
        counts: (pixel_count,) how much there is in each.
        capacity: how much has room, at least 1.
        longest: how much of a pixel can be drawn at once; None: as much as there is.
        expected: see PixelPart.
    """
    passed = np.cumsum(counts, dtype=np.int64)
    parts: list[PixelPart] = []
    before = 0
    while len(passed) and before < passed[-1]:
        first = int(np.searchsorted(passed, before, side="right"))
        end = max(int(np.searchsorted(passed, before + capacity, side="right")), first + 1)
        part = PixelPart(first, end, expected=expected)
        is_too_long = longest is not None and counts[first:end].max() > longest
        parts += part.slabs if is_too_long else (part,)
        before = int(passed[end - 1])
    return parts


def expected_depths(ball: Ball, camera: Camera) -> range:
    """The float bits of depths that a ball has in a picture, where it does not reach the eye."""
    away = -float(camera.view[2, :3] @ ball.center + camera.view[2, 3])
    farthest = away + ball.radius
    seen = -np.array([max(away - ball.radius, _NEAREST * farthest), farthest])
    (_, _, scale, shift), (_, _, slope, weight) = camera.projection[2:]
    depths = 0.5 + 0.5 * (scale * seen + shift) / np.maximum(slope * seen + weight, 1e-30)
    near, far = np.clip(depths, 0.0, 1.0).astype(np.float32).view(np.int32).tolist()
    return range(near, far + 1)
