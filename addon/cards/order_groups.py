"""Which groups of hair hang away from the head, such as a ponytail, and are drawn on their own."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from ..arrays import Floats, Ints

#: A group dangles where its middle card is so many times as far from the head as nearly all cards
#: of the groups that lie nearer and do not dangle.
_FARTHER = 1.25
#: Nearly all, in percent.
_NEARLY_ALL = 90.0


def dangling_groups(group: Ints, distance: Floats) -> list[int]:
    """Groups that hang far from the head, the nearest of them first.

    Args:
        group, distance: (card_count,) of each card; distance from the head [m].
    """
    names = np.unique(group).tolist()
    middle = {name: float(np.median(distance[group == name])) for name in names}
    ordered = sorted(names, key=lambda name: middle[name])
    near, dangling = ordered[:1], ordered[:0]
    for name in ordered[1:]:
        usual = float(np.percentile(distance[np.isin(group, near)], _NEARLY_ALL))
        (dangling if middle[name] > _FARTHER * usual else near).append(name)
    return dangling


def sections(group: Ints, apart: Collection[int]) -> Ints:
    """What is drawn on its own, (len(group),): 0 for all groups but those of `apart`, which follow
    as 1, 2 ...
    """
    section = np.zeros(len(group), np.int64)
    for number, name in enumerate(apart, 1):
        section[group == name] = number
    return section
