"""The nearest of some points, exact, for very many places at once."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints

#: Distances measured at once: few enough for the cache, many enough for numpy.
_TABLE = 65_536


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
    # as they are, so that an answer does not depend on what else is asked, nor by rounding
    place, point = np.asarray(places, np.float64), np.asarray(among, np.float64)
    parts: list[tuple[Ints, Ints]] = []
    if len(places):
        parts.append((np.arange(len(places)), np.arange(len(among))))
    while parts:
        own, possible = parts.pop()
        low, high = place[own].min(axis=0), place[own].max(axis=0)
        possible = _possible(point, possible, kept, (low + high) / 2.0, (high - low) / 2.0)
        if len(own) > 1 and len(own) * len(possible) > _TABLE:
            halves = place[own, (high - low).argmax()].argpartition(len(own) // 2)
            parts += [(own[half], possible) for half in np.array_split(halves, 2)]
            continue
        gaps = (place[own, axis, None] - point[possible, axis] for axis in range(3))
        squared = sum(gap * gap for gap in gaps)
        rows = np.arange(len(own))
        for rank in range(kept):
            best = squared.argmin(axis=1)
            index[own, rank] = possible[best]
            distance[own, rank] = np.sqrt(squared[rows, best])
            squared[rows, best] = np.inf
    return index, distance


def _possible(point: Floats, chosen: Ints, kept: int, center: Floats, half: Floats) -> Ints:
    """Which of the chosen points may be among the `kept` nearest of any place in this box."""
    offset = point[chosen] - center
    away = np.sqrt(np.einsum("ij,ij->i", offset, offset))
    reach = np.partition(away, kept - 1)[kept - 1] + 2.0 * np.sqrt((half**2).sum())
    return chosen[away <= reach * (1.0 + 1e-9) + 1e-300]
