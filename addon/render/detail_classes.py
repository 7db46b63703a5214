"""Strands put into classes of about as many pieces, each of which is one instanced draw.

The gpu module has no indirect draw, and all instances of a draw have equally many vertices. So the
strands of a class all get the vertices of its capacity, and those that need fewer let the rest
fall onto their tip.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..arrays import Floats, Ints

#: A capacity is at most 1 / 16 above the one before, and below 32 each number is one.
_STEP = 16
#: Strands are drawn from near to far in this many steps.
_SLABS = 16


@dataclass(frozen=True)
class DetailClass:
    """One instanced draw.

    capacity: pieces that each of its instances has vertices for.
    first: place of its first strand in the order.
    count: how many strands it has.
    """

    capacity: int
    first: int
    count: int

    @property
    def vertex_count(self) -> int:
        """Of all its instances: two a station, and one station more than pieces."""
        return 2 * (self.capacity + 1) * self.count


def detail_classes(totals: Ints, depths: Floats) -> tuple[Ints, tuple[DetailClass, ...]]:
    """The strands that are drawn, in order of their classes, and these classes.

    Near strands come first: what they hide is then not shaded. The depths are cut into slabs, and
    each slab has its own classes. Within a class strands keep their order, so that two pictures
    of one view are the same, and strands that are not drawn change no other's place.

    Args:
        totals: (strand_count,) pieces of each strand, 0 for those that are not drawn.
        depths: (strand_count,) how far each strand is, in any unit.
    """
    if not len(totals):
        return np.zeros(0, np.intp), ()
    series = capacities(int(totals.max()))
    place = _slabs(depths) * len(series) + np.searchsorted(series, totals)
    place[totals == 0] = _SLABS * len(series)
    order = np.argsort(place.astype(np.uint16), kind="stable")  # by radix, so in linear time
    counts = np.bincount(place, minlength=_SLABS * len(series))[: _SLABS * len(series)]
    first, classes = 0, []
    for slot in np.flatnonzero(counts).tolist():
        classes.append(DetailClass(int(series[slot % len(series)]), first, int(counts[slot])))
        first += classes[-1].count
    return order[:first], tuple(classes)


def _slabs(depths: Floats) -> Ints:
    """Which of _SLABS equal parts of all depths each lies in, 0 the nearest."""
    depths = np.nan_to_num(depths, nan=0.0, posinf=0.0, neginf=0.0)
    span = max(float(np.ptp(depths)), 1.0e-30)
    fraction = (depths - depths.min()) / span
    return np.minimum((fraction * _SLABS).astype(np.int64), _SLABS - 1)


@lru_cache(maxsize=64)
def capacities(most: int) -> Ints:
    """0, and all capacities up to the first that holds `most` pieces, growing."""
    series = [0]
    while series[-1] < most:
        series.append(series[-1] + max(series[-1] // _STEP, 1))
    return np.array(series)
