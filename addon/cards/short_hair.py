"""Cards of short hair, such as fur: more of them, and simpler ones.

A card that is wide beside the length of its hair shows as a scale. So there are more cards, each
narrower, of a few triangles, as short hair bends little: no more triangles in all.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..strands import StrandSet
from .atlas_settings import AtlasSettings
from .settings import CardSettings
from .strip import mean_spacing

#: Hair is short if it is shorter than this fraction of the side of the square that its roots fill.
_SHORT = 0.12
#: How wide the square of a card's roots should be at most, as a fraction of the hair's length.
_NARROW = 0.25
#: How many times as many cards there may be, and the segments and columns of each: 8 triangles.
_MORE, _SEGMENTS, _COLUMNS = 3.0, 4, 1
#: How much narrower strands are in the atlas: cards that lie on a body are mostly seen from the
#: front, where a strand is as wide as it is.
_FACE_ON = 0.7


def fitted_to_length(
    settings: CardSettings, atlas: AtlasSettings, strands: StrandSet
) -> tuple[CardSettings, AtlasSettings, tuple[str, ...]]:
    """The settings that the cards of such hair are made by, and what the artist should know."""
    wanted, length = settings.card_count, float(np.median(strands.lengths()))
    if settings.source != "clusters" or strands.strand_count <= wanted:
        return settings, atlas, ()
    # the nearest of points at random is half as far as they are apart in a square grid
    side = 2.0 * mean_spacing(strands.roots) * strands.strand_count**0.5
    if length > _SHORT * side:
        return settings, atlas, ()
    enough = (side / max(_NARROW * length, 1e-12)) ** 2
    more = float(np.clip(enough / wanted, 1.0, _MORE))
    fitted = replace(
        settings,
        card_count=min(round(wanted * more), strands.strand_count, 20_000),
        segment_count=min(settings.segment_count, _SEGMENTS),
        column_count=min(settings.column_count, _COLUMNS),
    )
    note = (
        f"the hair is short beside {wanted:,} cards, so there are {fitted.card_count:,} of "
        f"{2 * fitted.segment_count * fitted.column_count} triangles or fewer"
    )
    return fitted, replace(atlas, strand_width=_FACE_ON * atlas.strand_width), (note,)
