"""How long the parts of a frame take and how much memory a groom has, for panel and viewport."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from statistics import median
from typing import Any

import numpy as np

from ...dynamics.figures import CardFigures, Figures, blank_table

#: The median of this many frames is reported, and only of those not older than this [s].
_REPORTED, _LATEST = 15, 10.0
#: Frames of which the times are kept, for a graph.
_KEPT = 60

#: of a frame
PARTS = ("simulation", "drawing")


class FrameTimes:
    """How long the parts of the last frames of one groom took."""

    def __init__(self) -> None:
        self._times = {part: deque[tuple[float, float]](maxlen=_KEPT) for part in PARTS}

    @contextmanager
    def measured(self, part: str, *, goes_on: bool = False) -> Iterator[None]:
        """Time what runs inside, as a part of a frame; of a GPU's work only its handing over
        counts.

        Args:
            goes_on: more of what was measured last.
        """
        begin = time.perf_counter()
        yield
        end, known = time.perf_counter(), self._times[part]
        before = known.pop()[1] if goes_on else 0.0
        known.append((end, end - begin + before))

    def milliseconds(self, part: str) -> float | None:
        """The median of the last frames; None where there were none lately."""
        # a frame that takes long does not make its own parts old
        frame = sum(times[-1][1] for times in self._times.values() if times)
        oldest = time.perf_counter() - _LATEST - frame
        last = list(self._times[part])[-_REPORTED:]
        recent = [spent for when, spent in last if when > oldest]
        return 1000.0 * median(recent) if recent else None

    def history(self, part: str) -> list[float]:
        """Of the last frames, however old, the latest last [ms]."""
        return [1000.0 * spent for _, spent in self._times[part]]

    @property
    def line(self) -> str:
        """Such as "simulation 4.1 ms   drawing 12.3 ms"; empty where nothing was measured
        lately."""
        parts = ((part, self.milliseconds(part)) for part in PARTS)
        return "   ".join(f"{part} {spent:.1f} ms" for part, spent in parts if spent is not None)


def array_bytes(*things: Any) -> int:
    """Bytes of all arrays in these dataclasses, tuples and dicts, each array once."""
    seen: dict[int, int] = {}
    _collect(things, seen)
    return sum(seen.values())


def _collect(thing: Any, seen: dict[int, int]) -> None:
    if isinstance(thing, np.ndarray):
        base = thing if thing.base is None or not isinstance(thing.base, np.ndarray) else thing.base
        seen[id(base)] = base.nbytes
    elif isinstance(thing, dict):
        _collect(tuple(thing.values()), seen)
    elif isinstance(thing, tuple | list):
        for each in thing:
            _collect(each, seen)
    elif is_dataclass(thing) and not isinstance(thing, type):
        _collect(tuple(getattr(thing, field.name) for field in fields(thing)), seen)


def table_of(figures: Figures | None) -> tuple[tuple[str, ...], ...]:
    """For a panel, as large where nothing was measured."""
    return blank_table(Figures) if figures is None else figures.table


def card_table_of(figures: CardFigures | None) -> tuple[tuple[str, ...], ...]:
    """The same of cards."""
    return blank_table(CardFigures) if figures is None else figures.table
