"""The border of the hair, where the roots around a root all lie to one side of it."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..strands.result_cache import NO_CACHE, ResultCache

#: Number of neighbours that are examined; the mean of fewer strays as far by chance.
NEIGHBOURS = 24
#: Distance from a root to the mean of its neighbours, over that to the farthest of them: by chance
#: among evenly spread roots, and on a straight border, where it is the centroid of a half disk.
_BY_CHANCE, _ON_BORDER = 0.2, 4.0 / (3.0 * np.pi)


def nearness_to_border(
    places: Floats, among: Floats, cache: ResultCache = NO_CACHE, name: str = ""
) -> Floats:
    """How near places among roots are to the roots' border, (n,): 0 inside, and 1 on the border.

    Args:
        places: (n, 3) [m]. among: (root_count, 3) [m]. cache: see `ResultCache.nearest`, under this
            name.
    """
    if len(among) < NEIGHBOURS:  # too few to have an inside
        return np.zeros(len(places))
    return nearness_from_neighbours(places, among, *cache.nearest(name, places, among, NEIGHBOURS))


def nearness_from_neighbours(
    places: Floats, among: Floats, index: Ints, distance: Floats
) -> Floats:
    """`nearness_to_border` from the nearest roots of each place, at least NEIGHBOURS of them, as
    given by `nearest_points`; 0 with fewer."""
    if index.shape[1] < NEIGHBOURS:
        return np.zeros(len(places))
    aside = np.linalg.norm(among[index[:, :NEIGHBOURS]].mean(axis=1) - places, axis=1)
    reach = distance[:, NEIGHBOURS - 1]
    one_sided = np.divide(aside, reach, out=np.zeros(len(places)), where=reach > 0.0)
    nearness: Floats = np.clip((one_sided - _BY_CHANCE) / (_ON_BORDER - _BY_CHANCE), 0.0, 1.0)
    return nearness
