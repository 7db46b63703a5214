"""Exact nearest points, for very many places at once."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from .parallel import THREADS, parallel_map

#: Maximum number of distances measured at once: few enough for the cache, many enough for numpy.
_MAX_DISTANCES = 65_536
#: Up to this many distances, brute force is faster than ruling out points first.
_BRUTE_FORCE_LIMIT = 4096
#: More places than this are split over threads.
_MAX_PLACES_PER_PART = 1024


def nearest_points(places: Floats, candidates: Floats, count: int) -> tuple[Ints, Floats]:
    """The `count` nearest points of each place, nearest first; ties go to the lower index.

    Places are halved until few points can be among the nearest of any place in a half. A point is
    ruled out if it is farther from the middle of the places' box than the middle's `count`-th
    nearest point plus the diagonal of the box.

    Args:
        places: (n, 3) [m].
        candidates: (m, 3) [m], at least one.

    Returns:
        index: (n, min(count, m)) into `candidates`.
        distance: (n, min(count, m)) float64 [m]; independent of the other places.
    """
    count = min(count, len(candidates))
    index = np.zeros((len(places), count), np.int64)
    distance = np.zeros((len(places), count))
    # not relative to a common centre, so that a result does not depend on other places, not even
    # by rounding; one row per axis, as numpy is slow on rows of three
    place, point = (
        np.ascontiguousarray(np.asarray(each).T, np.float64) for each in (places, candidates)
    )
    begin: list[Ints] = [np.arange(len(places))] if len(places) else []
    while len(begin) < THREADS and len(places) > _MAX_PLACES_PER_PART:
        begin = [half for own in begin for half in _halves(own, place.take(own, axis=1))]
    parallel_map(lambda own: _search(own, place, point, index, distance), begin)
    return index, distance


def _search(own: Ints, place: Floats, point: Floats, index: Ints, distance: Floats) -> None:
    """Write the results of places `own` into `index` and `distance`; points are rows (3, n)."""
    count = index.shape[1]
    # allocated once: allocation would take as long as the work itself
    memory = np.empty((2, max(_MAX_DISTANCES, point.shape[1])))
    parts = [(own, np.arange(point.shape[1]), point)]
    while parts:
        own, remaining, there = parts.pop()
        here = place.take(own, axis=1)
        if len(own) * len(remaining) > _BRUTE_FORCE_LIMIT:
            low, high = here.min(axis=1), here.max(axis=1)
            is_near = _may_be_nearest(there, count, (low + high) / 2.0, (high - low) / 2.0, memory)
            remaining, there = remaining.take(is_near), there.take(is_near, axis=1)
        if len(own) > 1 and len(own) * len(remaining) > _MAX_DISTANCES:
            parts += [(half, remaining, there) for half in _halves(own, here)]
            continue
        squared = _squared(here, there, memory)
        rows = np.arange(len(own))
        for rank in range(count):
            best = squared.argmin(axis=1)
            index[own, rank] = remaining[best]
            distance[own, rank] = np.sqrt(squared[rows, best])
            squared[rows, best] = np.inf


def _halves(own: Ints, here: Floats) -> tuple[Ints, Ints]:
    """Places `own` at positions `here` (3, n), halved along the longest side of their box."""
    along = here[np.ptp(here, axis=1).argmax()]
    halves = own[along.argpartition(len(own) // 2)]
    middle = (len(halves) + 1) // 2
    return halves[:middle], halves[middle:]


def _squared(places: Floats, points: Floats, memory: Floats) -> Floats:
    """Squared distances of places (3, n) to points (3, m), (n, m), stored in `memory`."""
    shape = places.shape[1], points.shape[1]
    gap, squared = (each[: shape[0] * shape[1]].reshape(shape) for each in memory)
    for axis in range(3):
        target = gap if axis else squared
        np.subtract(places[axis, :, None], points[axis], out=target)
        target *= target
        if axis:
            squared += gap
    return squared


def _may_be_nearest(
    there: Floats, count: int, center: Floats, half: Floats, memory: Floats
) -> Ints:
    """Which points `there` (3, n) may be among the `count` nearest of any place in this box."""
    squared = _squared(center[:, None], there, memory)[0]
    nearest = np.sqrt(np.partition(squared, count - 1)[count - 1])
    reach = (nearest + 2.0 * np.sqrt((half**2).sum())) * (1.0 + 1e-9) + 1e-300
    return np.flatnonzero(np.sqrt(squared, out=squared) <= reach)
