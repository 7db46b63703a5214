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

#: A capacity is at most 1 / step above the one before; the finest step that needs few draws.
_STEPS = (16, 8, 4, 2, 1)
#: Strands are drawn from near to far in this many steps if that leaves any capacities, and in more
#: if there are draws left.
_SLABS, _MAX_SLABS = 4, 16
#: draws of a groom's strands, and of those that throw the shadow of one light
MAX_CLASSES, MAX_MAP_CLASSES = 16, 5


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


def detail_classes(
    totals: Ints, depths: Floats | None = None, held: Ints | None = None
) -> tuple[Ints, tuple[DetailClass, ...]]:
    """The strands that are drawn, in order of their classes, and these classes.

    With depths near strands come first: what they hide is then not shaded. The depths are cut into
    slabs, and each slab has its own classes. Within a class strands keep their order, so that two
    pictures of one view are the same, and strands that are not drawn change no other's place.

    Args:
        totals: (strand_count,) pieces of each strand, 0 for those that are not drawn.
        depths: (strand_count,) how far each strand is, in any unit; None: the order is no matter.
        held: capacities that hold all totals, growing from 0; None: as few as MAX_CLASSES need.
    """
    if not len(totals):
        return np.zeros(0, np.intp), ()
    found = _series(totals, MAX_CLASSES if depths is None else MAX_CLASSES // _SLABS)
    series, used = found if held is None else (held, len(held))
    slabs = 1 if depths is None else min(max(MAX_CLASSES // max(used, 1), 1), _MAX_SLABS)
    place = np.searchsorted(series, totals)
    if depths is not None:
        place = place + _slabs(depths, slabs) * len(series)
    place[totals == 0] = slabs * len(series)
    order = np.argsort(place.astype(np.uint16), kind="stable")  # by radix, so in linear time
    counts = np.bincount(place, minlength=slabs * len(series))[: slabs * len(series)]
    first, classes = 0, []
    for slot in np.flatnonzero(counts).tolist():
        classes.append(DetailClass(int(series[slot % len(series)]), first, int(counts[slot])))
        first += classes[-1].count
    return order[:first], tuple(classes)


def _series(totals: Ints, most: int) -> tuple[Ints, int]:
    """The finest capacities of which these strands use this many or fewer, and how many."""
    present = np.flatnonzero(np.bincount(totals)[1:]) + 1
    for step in _STEPS:
        series = capacities(int(totals.max()), step)
        used = len(np.unique(np.searchsorted(series, present)))
        if used <= most:
            break
    return series, used


def spread_capacities(totals: Ints) -> Ints:
    """0, and MAX_MAP_CLASSES capacities or fewer, each for about as many strands.

    Few draws then waste little; of strands whose pieces change it would mix up their order.
    """
    places = np.linspace(0.0, 1.0, MAX_MAP_CLASSES + 1)
    return np.unique([0, *np.quantile(totals, places[1:], method="higher")])


def _slabs(depths: Floats, count: int) -> Ints:
    """Which of this many equal parts of all depths each lies in, 0 the nearest."""
    depths = np.nan_to_num(depths, nan=0.0, posinf=0.0, neginf=0.0)
    span = max(float(np.ptp(depths)), 1.0e-30)
    fraction = (depths - depths.min()) / span
    return np.minimum((fraction * count).astype(np.int64), count - 1)


@lru_cache(maxsize=64)
def capacities(most: int, step: int) -> Ints:
    """0, and all capacities up to the first that holds `most` pieces, growing."""
    series = [0]
    while series[-1] < most:
        series.append(series[-1] + max(series[-1] // step, 1))
    return np.array(series)
