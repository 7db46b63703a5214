"""The border of the hair, where the roots around a root all lie to one side of it."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..strands.kept import NOTHING_KEPT, Kept

#: Number of neighbours that are examined; the mean of fewer strays as far by chance.
AROUND = 24
#: Distance from a root to the mean of its neighbours, over that to the farthest of them: by chance
#: among evenly spread roots, and on a straight border, where it is the centroid of a half disk.
_BY_CHANCE, _ON_BORDER = 0.2, 4.0 / (3.0 * np.pi)


def nearness_to_border(
    places: Floats, among: Floats, kept: Kept = NOTHING_KEPT, name: str = ""
) -> Floats:
    """How near places among roots are to the roots' border, (n,): 0 inside, and 1 on the border.

    Args:
        places: (n, 3) [m]. among: (root_count, 3) [m]. kept: see `Kept.nearest`, under this name.
    """
    if len(among) < AROUND:  # too few to have an inside
        return np.zeros(len(places))
    return nearness_by(places, among, *kept.nearest(name, places, among, AROUND))


def nearness_by(places: Floats, among: Floats, index: Ints, distance: Floats) -> Floats:
    """`nearness_to_border` from the nearest roots of each place, at least AROUND of them, as given
    by `nearest_points`; 0 with fewer."""
    if index.shape[1] < AROUND:
        return np.zeros(len(places))
    aside = np.linalg.norm(among[index[:, :AROUND]].mean(axis=1) - places, axis=1)
    reach = distance[:, AROUND - 1]
    one_sided = np.divide(aside, reach, out=np.zeros(len(places)), where=reach > 0.0)
    nearness: Floats = np.clip((one_sided - _BY_CHANCE) / (_ON_BORDER - _BY_CHANCE), 0.0, 1.0)
    return nearness
