"""Timing of variants under the same conditions."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping


def in_turns(plays: Mapping[str, Callable[[], float]], rounds: int) -> dict[str, list[float]]:
    """The times of each variant, one per round.

    All take turns, so that load on the machine affects all of them, and minima over as many times
    are compared.
    """
    times: dict[str, list[float]] = {name: [] for name in plays}
    for _ in range(rounds):
        for name, play in plays.items():
            times[name].append(play())
    return times


def milliseconds(work: Callable[[], object]) -> float:
    """Wall-clock time of `work`."""
    begin = time.perf_counter()
    work()
    return (time.perf_counter() - begin) * 1000.0
