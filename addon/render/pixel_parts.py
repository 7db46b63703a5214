"""Parts of a picture that are drawn one after the other, if all of it does not fit into memory.

A part is a run of pixels, row by row; if a single pixel is too much, a range of depths in it.
Depths are divided within the range of the hair, which may be a thousandth of all depths, since each
part costs a draw of all strands.
Pure numpy: importable without gpu.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Ints
from ..shading.volume.light_frame import Ball
from .camera import Camera

#: end of the range of float bits of depths from 0 to 1; bits of floats from 0 on rise with them
DEPTH_END = 0x3F800001
ALL_DEPTHS = range(DEPTH_END)
#: smallest expected distance of hair, as a fraction of the largest
_NEAREST = 1.0 / 16.0


@dataclass(frozen=True)
class PixelPart:
    """Pixels from `first` up to but without `end`, counted row by row from the bottom left, and
    depths from `near` up to but without `far`, as float bits.

    expected: range of the hair's depths, used to divide parts; other depths are in parts too.
    """

    first: int
    end: int
    near: int = 0
    far: int = DEPTH_END
    expected: range = ALL_DEPTHS

    @property
    def halves(self) -> tuple[PixelPart, ...]:
        """This part divided in two, by pixels or else by `slabs`; empty if it cannot be divided."""
        pixel = (self.first + self.end) // 2
        if self.end - self.first > 1:
            return replace(self, end=pixel), replace(self, first=pixel)
        return self.slabs

    @property
    def slabs(self) -> tuple[PixelPart, ...]:
        """The farther and the nearer half of its depths; empty if it has only one depth."""
        if self.far - self.near < 2:
            return ()
        low, high = max(self.near, self.expected.start), min(self.far, self.expected.stop)
        if high - low < 2:
            low, high = self.near, self.far
        depth = (low + high) // 2
        return replace(self, near=depth), replace(self, far=depth)

    def rows(self, across: int) -> range:
        """The rows that it touches, for rows of `across` pixels."""
        return range(self.first // across, (self.end - 1) // across + 1)


def pixel_parts(
    counts: Ints, capacity: int, longest: int | None = None, expected: range = ALL_DEPTHS
) -> list[PixelPart]:
    """The fewest parts that cover all pixels with fragments, each with no more than fit.

    A pixel with more fragments than that is a part by itself. A part that has a pixel with more
    than `longest` is divided in two by depth, the farther first.

    Args:
        counts: (pixel_count,) fragments of each pixel.
        capacity: number of fragments that fit, at least 1.
        longest: most fragments of a pixel that can be drawn at once; None: any number.
        expected: see PixelPart.
    """
    cumulative = np.cumsum(counts, dtype=np.int64)
    parts: list[PixelPart] = []
    before = 0
    while len(cumulative) and before < cumulative[-1]:
        first = int(np.searchsorted(cumulative, before, side="right"))
        end = max(int(np.searchsorted(cumulative, before + capacity, side="right")), first + 1)
        part = PixelPart(first, end, expected=expected)
        is_too_long = longest is not None and counts[first:end].max() > longest
        parts += part.slabs if is_too_long else (part,)
        before = int(cumulative[end - 1])
    return parts


def expected_depths(ball: Ball, camera: Camera) -> range:
    """The float bits of a ball's depths in a picture, limited to distances of at least _NEAREST."""
    away = -float(camera.view[2, :3] @ ball.center + camera.view[2, 3])
    farthest = away + ball.radius
    seen = -np.array([max(away - ball.radius, _NEAREST * farthest), farthest])
    (_, _, scale, shift), (_, _, slope, weight) = camera.projection[2:]
    depths = 0.5 + 0.5 * (scale * seen + shift) / np.maximum(slope * seen + weight, 1e-30)
    near, far = np.clip(depths, 0.0, 1.0).astype(np.float32).view(np.int32).tolist()
    return range(near, far + 1)
