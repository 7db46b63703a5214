"""Work that goes on step by step, so that it can be shown and cancelled."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any


def result_of[Result](steps: Generator[Any, None, Result]) -> Result:
    """All steps at once: what they return."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            result: Result = end.value
            return result


def map_progress[Step, Progress, Result](
    steps: Generator[Step, None, Result], tell: Callable[[Step], Progress]
) -> Generator[Progress, None, Result]:
    """The same work, each step reported in another form."""
    try:
        while True:
            yield tell(next(steps))
    except StopIteration as end:
        result: Result = end.value
        return result
    finally:
        steps.close()
