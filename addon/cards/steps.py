"""Work in steps, so that its progress can be shown and it can be cancelled."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any


def result_of[Result](steps: Generator[Any, None, Result]) -> Result:
    """Run all steps at once, and return their result."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            result: Result = end.value
            return result


def map_progress[Step, Progress, Result](
    steps: Generator[Step, None, Result], convert: Callable[[Step], Progress]
) -> Generator[Progress, None, Result]:
    """The same work, with each step's progress converted by `convert`."""
    try:
        while True:
            yield convert(next(steps))
    except StopIteration as end:
        result: Result = end.value
        return result
    finally:
        steps.close()
