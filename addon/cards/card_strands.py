"""Strands for cards: equally many points, evenly spaced, one at each row of a card."""

from __future__ import annotations

import numpy as np

from ..arrays import Ints
from ..strands import StrandSet
from ..strands.resample import evenly_spaced, resample

#: Where strands have as many points as they need, cards have at least this many rows,
_FEWEST = 16
#: and enough of them for this fraction of the strands,
_SERVED = 0.9
#: unless all strands had more points than this together.
_MAX_POINTS = 4_000_000


def card_strands(strands: StrandSet) -> StrandSet:
    """The same strands with one point count, evenly spaced; unchanged if they are so already."""
    if not strands.is_uniform:
        return resample(strands, row_count(strands.point_counts))
    if strands.uneven_length_fractions is None:
        return strands
    return evenly_spaced(strands, int(strands.point_counts[0]))


def row_count(point_counts: Ints) -> int:
    """How many rows the cards of strands with these point counts, (strand_count,), have."""
    served = int(np.quantile(point_counts, _SERVED, method="higher"))
    return max(min(served, _MAX_POINTS // len(point_counts)), _FEWEST)
