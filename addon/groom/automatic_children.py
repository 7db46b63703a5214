"""How many children a groom needs: as many as cover its body with strands as fine as hair, and none
where its own curves do.

A few strands stand for a whole head of hair; TressFX draws follow hairs beside each of them (Martin
et al. 2014, TressFX: advanced real-time hair rendering, GPU Pro 5). Fewer still may be anything:
guides, fly-aways, a lock that was modelled on its own. There the artist decides.
"""

from __future__ import annotations

import math
from dataclasses import replace

from ..strands import StrandSet
from .children_settings import ChildrenSettings
from .widths import is_long, strands_for_cover

#: Most strands in all: no more than a viewport draws fluently. Fewer own strands get no children.
_MAX_STRANDS, _MIN_STRANDS = 300_000, 1_000
#: Parts of their length by which children are shorter at the most, and stray; length of a wave.
_SHORTER, _STRAY, _WAVE = 0.06, 0.01, 0.4
#: From how far short hair takes its shape. Strands that are as their nearest curves would lie in
#: patches, each of which answers light in its own way.
_SCATTER = 1.0


def are_few(own: StrandSet) -> bool:
    """Whether the strands may be anything, and more of them would be seen."""
    return own.strand_count < _MIN_STRANDS and strands_for_cover(own) > 1.0


def automatic(own: StrandSet, settings: ChildrenSettings) -> tuple[ChildrenSettings, float]:
    """Settings with their number and shape found from the artist's own strands, and how many
    strands are drawn for each of those: 1 where these are enough, or too few to tell.
    """
    count = own.strand_count
    if count < _MIN_STRANDS:
        return replace(settings, method="none"), 1.0
    parts = max(min(strands_for_cover(own), _MAX_STRANDS / count), 1.0)
    children = math.ceil((parts - 1.0) * count)
    if not children:
        return replace(settings, method="none"), 1.0
    return replace(
        settings,
        method="multi",
        strand_count=children,
        length_variation=_SHORTER,
        scatter=0.0 if is_long(own) else _SCATTER,
        clump=0.0,
        frizz=_STRAY,
        frizz_length=_WAVE,
        fly_aways=0.0,
        curl=0.0,
    ), parts
