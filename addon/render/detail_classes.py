"""Classes of strands with similar numbers of pieces, each drawn by one instanced draw.

The gpu module has no indirect draw, and all instances of a draw have the same number of vertices.
So all strands of a class get as many vertices as its capacity needs; those that need fewer collapse
the rest onto their tip.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..arrays import Floats, Ints

#: A capacity is at most 1 / step larger than the one before. Steps are tried from the finest on
#: until few enough draws are needed.
_STEPS = (16, 8, 4, 2, 1)
#: Number of depth slabs in which strands are drawn, from near to far; up to the second number if
#: there are draws left.
_SLABS, _MAX_SLABS = 4, 16
#: Most draws of a groom's strands, and of those that cast the shadow of one light.
MAX_CLASSES, MAX_MAP_CLASSES = 16, 5


@dataclass(frozen=True)
class DetailClass:
    """One instanced draw.

    capacity: pieces for which each of its instances has vertices.
    first: index of its first strand in the order.
    count: number of strands.
    """

    capacity: int
    first: int
    count: int

    @property
    def vertex_count(self) -> int:
        """Vertices of all its instances: two per station, with one station more than pieces."""
        return 2 * (self.capacity + 1) * self.count


def detail_classes(
    totals: Ints, depths: Floats | None = None, fixed_capacities: Ints | None = None
) -> tuple[Ints, tuple[DetailClass, ...]]:
    """The indices of the strands that are drawn, ordered by class, and the classes.

    With depths, near strands come first, so that what they hide is not shaded. The depths are
    divided into slabs, each with its own classes. Within a class strands keep their order, so that
    two pictures of one view are the same, and omitting strands does not reorder the others.

    Args:
        totals: (strand_count,) pieces of each strand, 0 for those that are not drawn.
        depths: (strand_count,) depth of each strand, in any unit; None: the order does not matter.
        fixed_capacities: capacities up to the largest total, rising from 0; None: chosen for
            MAX_CLASSES.
    """
    if not len(totals):
        return np.zeros(0, np.intp), ()
    found = _series(totals, MAX_CLASSES if depths is None else MAX_CLASSES // _SLABS)
    series, used = found if fixed_capacities is None else (fixed_capacities, len(fixed_capacities))
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


def _series(totals: Ints, max_pieces: int) -> tuple[Ints, int]:
    """The finest series of capacities of which these strands use at most `max_pieces`, and how many
    they use."""
    present = np.flatnonzero(np.bincount(totals)[1:]) + 1
    for step in _STEPS:
        series = capacities(int(totals.max()), step)
        used = len(np.unique(np.searchsorted(series, present)))
        if used <= max_pieces:
            break
    return series, used


def spread_capacities(totals: Ints) -> Ints:
    """0, and at most MAX_MAP_CLASSES capacities, each for about the same number of strands.

    So few draws waste little. Not for strands whose pieces change, whose order would change too.
    """
    places = np.linspace(0.0, 1.0, MAX_MAP_CLASSES + 1)
    return np.unique([0, *np.quantile(totals, places[1:], method="higher")])


def _slabs(depths: Floats, count: int) -> Ints:
    """The index of the depth slab of each strand, of `count` equal ones, 0 the nearest."""
    depths = np.nan_to_num(depths, nan=0.0, posinf=0.0, neginf=0.0)
    span = max(float(np.ptp(depths)), 1.0e-30)
    fraction = (depths - depths.min()) / span
    return np.minimum((fraction * count).astype(np.int64), count - 1)


@lru_cache(maxsize=64)
def capacities(max_pieces: int, step: int) -> Ints:
    """0, and all capacities up to the first of at least `max_pieces` pieces, ascending, (n,)."""
    series = [0]
    while series[-1] < max_pieces:
        series.append(series[-1] + max(series[-1] // step, 1))
    return np.array(series)
