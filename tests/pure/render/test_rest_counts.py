"""The number of slots for moving strands."""

from __future__ import annotations

import numpy as np

from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.rest_counts import RestCounts, best_slot_pieces
from hairloom.addon.render.strand_layout import StrandLayout


def test_the_slot_size_minimises_the_cost() -> None:
    assert best_slot_pieces(np.full(100, 12)) == (12, 100)
    assert best_slot_pieces(np.zeros(5, int)) == (2, 0)
    mixed = np.array([3] * 900 + [60] * 100)
    pieces, slots = best_slot_pieces(mixed)
    assert slots == 900 * -(-3 // pieces) + 100 * -(-60 // pieces)
    assert slots * (pieces + 2) < 1000 * 62, "not as large as the largest"


def test_nearer_views_get_more_slots_and_each_strand_has_one() -> None:
    layout = StrandLayout.uniform(50, 4)
    counts = RestCounts(layout, DetailSettings(), 100.0, 8, 80, 3000, 50, 500)
    assert 80 <= counts.slots_at(100.0) < 90 and counts.slots_at(1.0) == counts.slots_at(100.0)
    assert 160 <= counts.slots_at(400.0) < 180, "pieces grow as the root of the size does"
    assert counts.fragments_at(400.0) >= 4 * 3000
    few = RestCounts(layout, DetailSettings(), 100.0, 8, 10, 300, 5, 50)
    assert few.slots_at(100.0) == 50, "those that were hidden may be seen"
    assert counts.matches(StrandLayout.uniform(50, 4), DetailSettings())
    assert not counts.matches(StrandLayout.uniform(51, 4), DetailSettings())
    assert not counts.matches(layout, DetailSettings(error=2.0))
