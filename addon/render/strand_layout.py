"""The layout of strand data in textures: all texels of a strand side by side in one row.

`strand_rows` is for the same number of texels per strand, `StrandLayout` for point counts that
differ. Twin of gpu_shaders/lib_strand_texel.glsl. Pure numpy: importable without gpu.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from ..arrays import Floats, Ints
from .shader_source import STRAND_ROWS

#: Segments whose detail factors are in one texel, see lib_detail_packing.glsl.
FACTORS_IN_TEXEL = 16


def strand_rows(values: Floats) -> Floats:
    """Per-CV values (strand_count, cv_count, channels) as texture rows, one per strand.

    Strand s is in row s % 16384, from column (s // 16384) * cv_count on: beyond 16384 strands, the
    largest texture side, further column blocks follow. Unused texels are 0. If there is one value
    per strand, rows hold 16384 strands each, since adjacent texels are fetched together.

    Raises:
        ValueError: more strands than blocks of columns can hold.
    """
    strand_count, cv_count, channels = values.shape
    width, height = strand_rows_size(strand_count, cv_count)
    if cv_count == 1:
        padded = np.zeros((height * width, channels), np.float32)
        padded[:strand_count] = values[:, 0]
        return padded.reshape(height, width, channels)
    if width == cv_count:
        return values
    blocks = width // cv_count
    padded = np.zeros((blocks * STRAND_ROWS, cv_count, channels), np.float32)
    padded[:strand_count] = values
    columns = padded.reshape(blocks, STRAND_ROWS, cv_count, channels).swapaxes(0, 1)
    return np.ascontiguousarray(columns).reshape(STRAND_ROWS, blocks * cv_count, channels)


def strand_rows_size(strand_count: int, cv_count: int) -> tuple[int, int]:
    """Width and height of a texture in that layout.

    Raises:
        ValueError: more strands than blocks of columns can hold.
    """
    blocks = max(-(-strand_count // STRAND_ROWS), 1)
    if cv_count == 1:
        return min(max(strand_count, 1), STRAND_ROWS), blocks
    if blocks * cv_count > STRAND_ROWS:
        raise ValueError(f"{strand_count} strands of {cv_count} CVs do not fit a texture")
    return blocks * cv_count, strand_count if blocks == 1 else STRAND_ROWS


def from_strand_rows(pixels: Floats, strand_count: int, cv_count: int) -> Floats:
    """The inverse of `strand_rows`, (strand_count, cv_count, channels)."""
    height, width, channels = pixels.shape
    if cv_count == 1:
        return pixels.reshape(-1, 1, channels)[:strand_count]
    blocks = pixels.reshape(height, width // cv_count, cv_count, channels).swapaxes(0, 1)
    return blocks.reshape(-1, cv_count, channels)[:strand_count]


@dataclass(frozen=True, eq=False)
class StrandLayout:
    """The layout of strands' points in a texture, one texel per point.

    Strands of one point count have the layout of `strand_rows`, which needs no copy. Others fill
    rows of 16384 texels, one after the other; a strand that does not fit into the rest of a row
    begins the next one.

    offsets: (strand_count + 1,), strand s has the points offsets[s] to offsets[s + 1] - 1.

    Raises:
        ValueError: a strand of fewer than two points, or more points than a texture can hold.
    """

    offsets: Ints

    def __post_init__(self) -> None:
        if self.strand_count and self.counts.min() < 2:
            raise ValueError("a strand has fewer than two points")
        width, height = self.size
        if max(width, height) > STRAND_ROWS or self._factors[-1] >= 2**24:
            raise ValueError(f"{self.point_count} points do not fit a texture")

    @classmethod
    def uniform(cls, strand_count: int, cv_count: int) -> StrandLayout:
        """The layout of strands with the same number of points."""
        return cls(np.arange(strand_count + 1, dtype=np.int32) * np.int32(cv_count))

    def has_same_counts(self, other: StrandLayout) -> bool:
        """Whether both are of strands with the same point counts."""
        return self is other or np.array_equal(self.offsets, other.offsets)

    @property
    def strand_count(self) -> int:
        return len(self.offsets) - 1

    @property
    def point_count(self) -> int:
        return int(self.offsets[-1])

    @cached_property
    def counts(self) -> Ints:
        """Points of each strand, (strand_count,)."""
        return np.diff(self.offsets)

    @cached_property
    def max_point_count(self) -> int:
        """The largest point count of a strand, 0 if there are no strands."""
        return int(self.counts.max(initial=0))

    @cached_property
    def cv_count(self) -> int:
        """The point count of all strands; 0 if they differ."""
        if not self.strand_count:
            return 2
        first = int(self.counts[0])
        return first if (self.counts == first).all() else 0

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the texture; 1 and 1 for no strands."""
        if not self.strand_count:
            return 1, 1
        if self.cv_count:
            return strand_rows_size(self.strand_count, self.cv_count)
        return min(self.point_count, STRAND_ROWS), len(self._rows) - 1

    @cached_property
    def spans(self) -> Floats:
        """For each strand the texel of its first point, its number of points, and the index of the
        first texel of its detail factors, (strand_count, 4) float32; exact below 2^24.

        The values of the texture strand_spans, which has the layout of `strand_rows`.
        """
        spans = np.zeros((self.strand_count, 4), np.float32)
        strands = np.arange(self.strand_count)
        if self.cv_count:
            spans[:, 0] = strands // STRAND_ROWS * self.cv_count
            spans[:, 1] = strands % STRAND_ROWS
        else:
            row = np.searchsorted(self._rows, strands, side="right") - 1
            spans[:, 0] = self.offsets[:-1] - self.offsets[self._rows[row]]
            spans[:, 1] = row
        spans[:, 2] = self.counts
        spans[:, 3] = self._factors[:-1]
        return spans

    @property
    def factor_size(self) -> tuple[int, int]:
        """Width and height of the texture of all detail factors."""
        texels = max(int(self._factors[-1]), 1)
        return min(texels, STRAND_ROWS), -(-texels // STRAND_ROWS)

    def pixels(self, values: Floats) -> Floats:
        """Values (point_count, channels) in the layout of the texture, (height, width, channels)
        float32; unused texels are 0.
        """
        channels = values.shape[1]
        if self.cv_count:
            return strand_rows(values.reshape(-1, self.cv_count, channels))
        width, height = self.size
        pixels = np.zeros((height, width, channels), np.float32)
        for row, (start, end) in enumerate(self._row_points):
            pixels[row, : end - start] = values[start:end]
        return pixels

    def values(self, pixels: Floats) -> Floats:
        """The inverse of `pixels`, (point_count, channels)."""
        channels = pixels.shape[2]
        if self.cv_count:
            return from_strand_rows(pixels, self.strand_count, self.cv_count).reshape(-1, channels)
        rows = [pixels[row, : end - start] for row, (start, end) in enumerate(self._row_points)]
        return np.concatenate(rows)

    @cached_property
    def _rows(self) -> Ints:
        """The first strand of each row, and the strand count; for point counts that differ."""
        rows = [0]
        while rows[-1] < self.strand_count:
            room = self.offsets[rows[-1]] + STRAND_ROWS
            after = int(np.searchsorted(self.offsets, room, side="right")) - 1
            if after == rows[-1]:
                raise ValueError(f"a strand has more than {STRAND_ROWS} points")
            rows.append(after)
        return np.array(rows)

    @property
    def _row_points(self) -> list[tuple[int, int]]:
        """Begin and end of the points in each row."""
        ends = self.offsets[self._rows].tolist()
        return list(pairwise(ends))

    @cached_property
    def _factors(self) -> Ints:
        """The first texel of each strand's detail factors, and the number of all texels."""
        texels = (self.counts - 2) // FACTORS_IN_TEXEL + 1
        return np.concatenate([[0], np.cumsum(texels, dtype=np.int64)])


NO_STRANDS = StrandLayout(np.zeros(1, np.int32))
