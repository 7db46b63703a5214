"""The nearest of some points, exact, for very many places at once."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from .side_by_side import THREADS, side_by_side

#: Distances measured at once: few enough for the cache, many enough for numpy.
_TABLE = 65_536
#: So few are measured sooner than points are left out.
_FEW = 4096
#: Places of which a part goes to another thread.
_MANY = 1024


def nearest_points(places: Floats, among: Floats, count: int) -> tuple[Ints, Floats]:
    """The nearest points of each place, nearest first; of those as near the first one.

    Places are halved until few points can be the nearest of any of them: none that is farther from
    their middle than the last answer for the middle, and their extent twice.

    Args:
        places: (n, 3) [m].
        among: (m, 3) [m], at least one.

    Returns:
        index: (n, min(count, m)) into `among`.
        distance: (n, min(count, m)) float64 [m], a place's own not depending on other places.
    """
    kept = min(count, len(among))
    index = np.zeros((len(places), kept), np.int64)
    distance = np.zeros((len(places), kept))
    # as they are, so that an answer does not depend on what else is asked, nor by rounding; by
    # axes, as numpy is slow at rows of three
    place, point = (
        np.ascontiguousarray(np.asarray(each).T, np.float64) for each in (places, among)
    )
    begin: list[Ints] = [np.arange(len(places))] if len(places) else []
    while len(begin) < THREADS and len(places) > _MANY:
        begin = [half for own in begin for half in _halves(own, place.take(own, axis=1))]
    side_by_side(lambda own: _search(own, place, point, index, distance), begin)
    return index, distance


def _search(own: Ints, place: Floats, point: Floats, index: Ints, distance: Floats) -> None:
    """The answer for some places, see `nearest_points`, in rows."""
    kept = index.shape[1]
    # memory that is asked for again takes as long as what is done in it
    memory = np.empty((2, max(_TABLE, point.shape[1])))
    parts = [(own, np.arange(point.shape[1]), point)]
    while parts:
        own, possible, there = parts.pop()
        here = place.take(own, axis=1)
        if len(own) * len(possible) > _FEW:
            low, high = here.min(axis=1), here.max(axis=1)
            is_near = _possible(there, kept, (low + high) / 2.0, (high - low) / 2.0, memory)
            possible, there = possible.take(is_near), there.take(is_near, axis=1)
        if len(own) > 1 and len(own) * len(possible) > _TABLE:
            parts += [(half, possible, there) for half in _halves(own, here)]
            continue
        squared = _squared(here, there, memory)
        rows = np.arange(len(own))
        for rank in range(kept):
            best = squared.argmin(axis=1)
            index[own, rank] = possible[best]
            distance[own, rank] = np.sqrt(squared[rows, best])
            squared[rows, best] = np.inf


def _halves(own: Ints, here: Floats) -> tuple[Ints, Ints]:
    """Some places, which lie here, (3, n), in two halves along their longest side."""
    along = here[np.ptp(here, axis=1).argmax()]
    halves = own[along.argpartition(len(own) // 2)]
    middle = (len(halves) + 1) // 2
    return halves[:middle], halves[middle:]


def _squared(places: Floats, points: Floats, memory: Floats) -> Floats:
    """Squared distances of places (3, n) to points (3, m), (n, m), in this memory."""
    shape = places.shape[1], points.shape[1]
    gap, squared = (each[: shape[0] * shape[1]].reshape(shape) for each in memory)
    for axis in range(3):
        target = gap if axis else squared
        np.subtract(places[axis, :, None], points[axis], out=target)
        target *= target
        if axis:
            squared += gap
    return squared


def _possible(there: Floats, kept: int, center: Floats, half: Floats, memory: Floats) -> Ints:
    """Which of some points (3, n) may be among the `kept` nearest of any place in this box."""
    squared = _squared(center[:, None], there, memory)[0]
    nearest = np.sqrt(np.partition(squared, kept - 1)[kept - 1])
    reach = (nearest + 2.0 * np.sqrt((half**2).sum())) * (1.0 + 1e-9) + 1e-300
    return np.flatnonzero(np.sqrt(squared, out=squared) <= reach)
