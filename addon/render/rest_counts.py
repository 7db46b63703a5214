"""Counts of strands at rest, from which the next frames estimate how much they need.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Ints
from ..refine.settings import DetailSettings
from .strand_layout import StrandLayout

#: possible numbers of pieces of a slot, and the overhead of a slot in stations
_PIECES, _SLOT_COST = range(2, 65), 1
#: margins on the last counts: of slots, which are all drawn, and of fragments, which take memory
_SPARE_SLOTS, _SPARE_FRAGMENTS = 1.03, 1.25


@dataclass(frozen=True, eq=False)
class RestCounts:
    """The counts of a groom in a view when it was last at rest.

    layout, settings: of its strands. scale: pixels per metre at its middle.
    slot_pieces: pieces of a slot. slots: number that strands fill. fragments: upper bound.
    strands, pieces: numbers drawn.
    """

    layout: StrandLayout
    settings: DetailSettings
    scale: float
    slot_pieces: int
    slots: int
    fragments: int
    strands: int
    pieces: int

    def matches(self, layout: StrandLayout, settings: DetailSettings) -> bool:
        """Whether these counts are for such strands."""
        return self.layout.has_same_counts(layout) and self.settings == settings

    def slots_at(self, scale: float) -> int:
        """Slots needed at this scale [pixels per metre], at least one for each strand."""
        zoom = max(scale / self.scale, 1.0)
        growth = 1.0 if self.settings.mode == "fixed" else zoom**0.5  # as in Wang's bound
        return max(int(self.slots * growth * _SPARE_SLOTS), self.layout.strand_count)

    def fragments_at(self, scale: float) -> int:
        """Fragments needed at this scale [pixels per metre]."""
        return int(self.fragments * max(scale / self.scale, 1.0) * _SPARE_FRAGMENTS)


def best_slot_pieces(pieces: Ints) -> tuple[int, int]:
    """The number of pieces per slot with which the fewest stations are drawn, and the number of
    slots.

    Args:
        pieces: of each strand, (strand_count,).
    """
    counts = np.bincount(pieces)[1:]
    each, sizes = np.arange(1, len(counts) + 1), np.array(_PIECES)
    slots = (-(-each[None] // sizes[:, None]) * counts).sum(axis=1)
    best = int(np.argmin(slots * (sizes + 1 + _SLOT_COST)))
    return int(sizes[best]), int(slots[best])
