"""Cards of short hair, such as fur: more of them, and simpler ones.

A card that is wide relative to the length of its hair looks like a scale. So there are more cards,
each narrower and of few triangles, since short hair bends little: the total does not grow.
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
#: Maximum side of the square of a card's roots, as a fraction of the hair's length.
_MAX_CARD_WIDTH = 0.25
#: Maximum factor on the number of cards, and segments and columns of each: 8 triangles.
_MAX_COUNT_FACTOR, _SEGMENTS, _COLUMNS = 3.0, 4, 1
#: Factor on the strands' width in the atlas: cards that lie on a body are mostly seen from the
#: front, where strands need no widening.
_STRAND_WIDTH_FACTOR = 0.7


def fitted_to_length(
    settings: CardSettings, atlas: AtlasSettings, strands: StrandSet
) -> tuple[CardSettings, AtlasSettings, tuple[str, ...]]:
    """The settings for the cards of such hair, and notes for the artist."""
    wanted, length = settings.card_count, float(np.median(strands.lengths()))
    if settings.source != "clusters" or strands.strand_count <= wanted:
        return settings, atlas, ()
    # the nearest of random points is half as far as the spacing of a square grid
    side = 2.0 * mean_spacing(strands.roots) * strands.strand_count**0.5
    if length > _SHORT * side:
        return settings, atlas, ()
    enough = (side / max(_MAX_CARD_WIDTH * length, 1e-12)) ** 2
    more = float(np.clip(enough / wanted, 1.0, _MAX_COUNT_FACTOR))
    fitted = replace(
        settings,
        card_count=min(round(wanted * more), strands.strand_count, 20_000),
        segment_count=min(settings.segment_count, _SEGMENTS),
        column_count=min(settings.column_count, _COLUMNS),
    )
    note = (
        f"the hair is too short for {wanted:,} cards, so there are {fitted.card_count:,} of "
        f"{2 * fitted.segment_count * fitted.column_count} triangles or fewer"
    )
    return fitted, replace(atlas, strand_width=_STRAND_WIDTH_FACTOR * atlas.strand_width), (note,)
