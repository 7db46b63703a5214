"""Contestants that are timed under the same conditions."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping


def in_turns(plays: Mapping[str, Callable[[], float]], rounds: int) -> dict[str, list[float]]:
    """The times of each contestant, one for each round.

    All take turns, so that a busy moment of the machine meets all of them, and the least of as many
    times is compared.
    """
    times: dict[str, list[float]] = {name: [] for name in plays}
    for _ in range(rounds):
        for name, play in plays.items():
            times[name].append(play())
    return times


def milliseconds(work: Callable[[], object]) -> float:
    """By the clock on the wall."""
    begin = time.perf_counter()
    work()
    return (time.perf_counter() - begin) * 1000.0
