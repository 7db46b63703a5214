"""A small wig with much baby hair."""

from __future__ import annotations

import numpy as np
from small_wig import GUIDES, sheet, wig_strands

from hairloom.addon import rig_flow
from hairloom.addon.arrays import Bools
from hairloom.addon.groom.children_settings import ChildrenSettings


def wig() -> rig_flow.Rig:
    children = ChildrenSettings(
        method="multi", strand_count=500, length_variation=0.0, baby_hair=0.8
    )
    return rig_flow.prepare(wig_strands(), sheet(), GUIDES, place="a wig", children=children)


def short_strands(rig: rig_flow.Rig) -> Bools:
    """(strand_count,) whether a strand is baby hair: no other setting shortens strands here."""
    length = rig.strands.lengths()
    is_short: Bools = length < 0.5 * np.median(length)
    assert 20 < is_short.sum() < 400
    return is_short
