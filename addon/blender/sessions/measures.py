"""Times of the parts of a frame, and memory of a groom, for panel and viewport."""

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

#: The median of at most this many frames is reported, none older than this [s].
_REPORTED, _LATEST = 15, 10.0
#: Number of frames whose times are kept, for a graph.
_KEPT = 60

#: timed parts of a frame
PARTS = ("simulation", "drawing")


class FrameTimes:
    """Times of the parts of the last frames of one groom."""

    def __init__(self) -> None:
        self._times = {part: deque[tuple[float, float]](maxlen=_KEPT) for part in PARTS}

    @contextmanager
    def measured(self, part: str, *, goes_on: bool = False) -> Iterator[None]:
        """Time what runs inside, as a part of a frame; of GPU work only its submission counts.

        Args:
            goes_on: add the time to the last measurement.
        """
        begin = time.perf_counter()
        yield
        end, known = time.perf_counter(), self._times[part]
        before = known.pop()[1] if goes_on else 0.0
        known.append((end, end - begin + before))

    def milliseconds(self, part: str) -> float | None:
        """The median of the last frames; None: there were none lately."""
        # the duration of the frame itself does not count as age
        frame = sum(times[-1][1] for times in self._times.values() if times)
        oldest = time.perf_counter() - _LATEST - frame
        last = list(self._times[part])[-_REPORTED:]
        recent = [spent for when, spent in last if when > oldest]
        return 1000.0 * median(recent) if recent else None

    def history(self, part: str) -> list[float]:
        """The times [ms] of the last frames, however old, the latest last."""
        return [1000.0 * spent for _, spent in self._times[part]]

    @property
    def text(self) -> str:
        """The times as text, such as "simulation 4.1 ms   drawing 12.3 ms"; empty if nothing was
        measured lately."""
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
    """The figures as rows of a panel; blank rows of the same number if nothing was measured."""
    return blank_table(Figures) if figures is None else figures.table


def card_table_of(figures: CardFigures | None) -> tuple[tuple[str, ...], ...]:
    """As `table_of`, for cards."""
    return blank_table(CardFigures) if figures is None else figures.table
