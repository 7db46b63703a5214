"""The number of children that a groom needs: as many as cover the body with strands as fine as
hair, and none where its own curves already do.

A few strands can represent a whole head of hair; TressFX draws follow hairs beside each of them
(Martin et al. 2014, TressFX: advanced real-time hair rendering, GPU Pro 5). Still fewer strands may
be anything: guides, fly-aways, or a lock modelled on its own. There the artist decides.
"""

from __future__ import annotations

import math
from dataclasses import replace

from ..strands import StrandSet
from .children_settings import ChildrenSettings
from .widths import is_long, strands_for_cover

#: Maximum strands in all, which a viewport still draws fluently; fewer own strands than the second
#: number get no children.
_MAX_STRANDS, _MIN_STRANDS = 300_000, 1_000
#: Length variation, frizz and frizz length of automatic children.
_LENGTH_VARIATION, _FRIZZ, _FRIZZ_LENGTH = 0.06, 0.01, 0.4
#: Scatter of short hair. Without it strands would be shaped like their nearest curve, and lie in
#: patches that each reflect light in their own way.
_SCATTER = 1.0


def is_too_sparse(own: StrandSet) -> bool:
    """Whether the strands are too few to tell what they are, and to cover the body."""
    return own.strand_count < _MIN_STRANDS and strands_for_cover(own) > 1.0


def automatic_settings(
    own: StrandSet, settings: ChildrenSettings
) -> tuple[ChildrenSettings, float]:
    """Settings with the number and shape of children found from the artist's own strands; and how
    many strands are drawn for each of these: 1 where they are enough, or too few to tell.
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
        length_variation=_LENGTH_VARIATION,
        scatter=0.0 if is_long(own) else _SCATTER,
        clump=0.0,
        frizz=_FRIZZ,
        frizz_length=_FRIZZ_LENGTH,
        fly_aways=0.0,
        curl=0.0,
    ), parts
