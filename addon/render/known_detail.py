"""What was counted of strands at rest, from which the next frames guess how much they need.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Ints
from ..refine.settings import DetailSettings
from .strand_layout import StrandLayout

#: pieces that a slot may have, and what a slot costs beside its stations, in stations
_PIECES, _SLOT_COST = range(2, 65), 1
#: more than was counted last: of slots, which are all drawn, and of fragments, which take memory
_SPARE_SLOTS, _SPARE_FRAGMENTS = 1.03, 1.25


@dataclass(frozen=True, eq=False)
class KnownDetail:
    """What was counted of a groom in a view when it was last at rest.

    layout, settings: of its strands. scale: pixels of a metre at its middle.
    slot_pieces: pieces a slot. slots: how many strands fill. fragments: how many they may have.
    strands, pieces: how many are drawn.
    """

    layout: StrandLayout
    settings: DetailSettings
    scale: float
    slot_pieces: int
    slots: int
    fragments: int
    strands: int
    pieces: int

    def is_of(self, layout: StrandLayout, settings: DetailSettings) -> bool:
        """Whether it says something about these strands."""
        return self.layout.is_as(layout) and self.settings == settings

    def slots_at(self, scale: float) -> int:
        """Room for them where a metre is as many pixels: all strands have a slot at least."""
        nearer = max(scale / self.scale, 1.0)
        grown = 1.0 if self.settings.mode == "fixed" else nearer**0.5  # as Wang's bound does
        return max(int(self.slots * grown * _SPARE_SLOTS), self.layout.strand_count)

    def fragments_at(self, scale: float) -> int:
        """How many of them there may be where a metre is as many pixels."""
        return int(self.fragments * max(scale / self.scale, 1.0) * _SPARE_FRAGMENTS)


def best_slot_pieces(pieces: Ints) -> tuple[int, int]:
    """Of how many pieces slots are best, so that few stations are drawn, and how many these are.

    Args:
        pieces: of each strand, (strand_count,).
    """
    counts = np.bincount(pieces)[1:]
    each, sizes = np.arange(1, len(counts) + 1), np.array(_PIECES)
    slots = (-(-each[None] // sizes[:, None]) * counts).sum(axis=1)
    best = int(np.argmin(slots * (sizes + 1 + _SLOT_COST)))
    return int(sizes[best]), int(slots[best])
