"""The order that violates the least weight of many preferences "this before that": linear ordering
by insertion.

Each preference has a weight, and preferences may contradict each other. The problem is NP-hard;
moving one thing after the other to where it violates the least, until nothing moves, comes near the
optimum in practice (Marti and Reinelt, "The Linear Ordering Problem", 2011, section 2: insertion
neighbourhood).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints


@dataclass(frozen=True)
class Preferences:
    """Net preferences, after contradictory ones have cancelled out.

    lower, higher: (pair_count,) two of `count` things, each pair once.
    weight: (pair_count,) above 0 where the lower number should come first, else below 0.
    """

    count: int
    lower: Ints
    higher: Ints
    weight: Ints

    def for_groups(self, group_of: Ints, count: int) -> Preferences:
        """The same preferences for `count` larger things; `group_of`, (self.count,), maps each
        thing to its own."""
        is_lower_first = self.weight > 0
        before = np.where(is_lower_first, self.lower, self.higher)
        after = np.where(is_lower_first, self.higher, self.lower)
        return net_preferences(count, group_of[before], group_of[after], np.abs(self.weight))


def net_preferences(count: int, before: Ints, after: Ints, weight: Ints) -> Preferences:
    """Net preferences that `before` comes before `after`, each (pair_count,) of `count` things.

    Args:
        weight: (pair_count,), not negative. Pairs of a thing with itself are ignored.
    """
    is_pair = before != after
    before, after, weight = before[is_pair], after[is_pair], weight[is_pair]
    key = np.minimum(before, after).astype(np.int64) * count + np.maximum(before, after)
    order = np.argsort(key)
    key = key[order]
    starts = np.flatnonzero(np.diff(key, prepend=-1))
    signed = np.where(before < after, weight, -weight).astype(np.int64)[order]
    total = np.add.reduceat(signed, starts) if len(starts) else signed
    lower, higher = np.divmod(key[starts][total != 0], max(count, 1))
    return Preferences(count, lower, higher, total[total != 0])


def minimize_violations(preferences: Preferences, start: Ints, max_moves: int = 20) -> Ints:
    """The rank of each thing, (count,), in an order that no single move improves.

    A thing is tested again when one that it is compared with has moved. Things without preferences
    stay beside their neighbours in `start`.

    Args:
        start: (count,) the things in the order that is improved.
        max_moves: maximum number of tests of a thing, on average.
    """
    place = np.empty(preferences.count)
    place[start] = np.arange(preferences.count)
    firsts, others, weights = _by_item(preferences)
    random = np.random.default_rng(0)
    waiting, looks = np.ones(preferences.count, bool), max_moves * preferences.count
    while looks > 0 and waiting.any():
        todo = random.permutation(np.flatnonzero(waiting))
        waiting[:] = False
        for item in todo[:looks].tolist():
            mine = slice(firsts[item], firsts[item + 1])
            better = _better_place(place[item], place[others[mine]], weights[mine])
            if better is not None:
                place[item] = better
                waiting[others[mine]] = True
        looks -= len(todo)
        place[np.argsort(place, kind="stable")] = np.arange(preferences.count)
    return place.astype(np.int64)


def _better_place(own: float, places: Floats, weights: Ints) -> float | None:
    """The place between others at which a thing violates the least; None if its own is as good.

    Args:
        weights: above 0 where the thing should come before the other.
    """
    order = places.argsort()
    places = places[order]
    violated = np.zeros(len(places) + 1, np.int64)
    weights[order].cumsum(out=violated[1:])
    best = int(violated.argmin())
    if violated[best] >= violated[places.searchsorted(own)]:
        return None
    low = places[best - 1] if best > 0 else places[0] - 1.0
    high = places[best] if best < len(places) else places[-1] + 1.0
    return float(low + high) / 2.0


def _by_item(preferences: Preferences) -> tuple[list[int], Ints, Ints]:
    """Preferences by thing: where each one's begin, the other things, and the weights."""
    one = np.concatenate([preferences.lower, preferences.higher])
    other = np.concatenate([preferences.higher, preferences.lower])
    weight = np.concatenate([preferences.weight, -preferences.weight])
    order = np.argsort(one, kind="stable")
    firsts = np.searchsorted(one[order], np.arange(preferences.count + 1))
    return firsts.tolist(), other[order], weight[order]
