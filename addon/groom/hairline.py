"""Where hair ends: at its border the roots around a root all lie to one side of it."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..strands.kept import NOTHING_KEPT, Kept

#: Roots around one that are looked at. Of fewer, the mean strays as far by chance.
AROUND = 24
#: How far the mean of what lies around a root is from it, in terms of how far that reaches: among
#: evenly spread roots by chance, and on a straight border 4 / (3 pi), as the middle of a half disk.
_BY_CHANCE, _ON_BORDER = 0.2, 4.0 / (3.0 * np.pi)


def nearness_to_border(
    places: Floats, among: Floats, kept: Kept = NOTHING_KEPT, name: str = ""
) -> Floats:
    """How near places among roots are to where these end, (n,): 0 inside, and 1 on the border.

    Args:
        places: (n, 3) [m]. among: (root_count, 3) [m]. kept: see `Kept.nearest`, under this name.
    """
    if len(among) < AROUND:  # too few to have an inside
        return np.zeros(len(places))
    return nearness_by(places, among, *kept.nearest(name, places, among, AROUND))


def nearness_by(places: Floats, among: Floats, index: Ints, distance: Floats) -> Floats:
    """The same by the AROUND nearest roots or more of each place, see `nearest_points`."""
    if index.shape[1] < AROUND:
        return np.zeros(len(places))
    aside = np.linalg.norm(among[index[:, :AROUND]].mean(axis=1) - places, axis=1)
    reach = distance[:, AROUND - 1]
    one_sided = np.divide(aside, reach, out=np.zeros(len(places)), where=reach > 0.0)
    nearness: Floats = np.clip((one_sided - _BY_CHANCE) / (_ON_BORDER - _BY_CHANCE), 0.0, 1.0)
    return nearness
