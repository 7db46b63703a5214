"""Work in steps, so that its progress can be shown and it can be cancelled."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any, NamedTuple


class Step(NamedTuple):
    """A step of named work. fraction: of it that is done; None: unknown."""

    name: str
    fraction: float | None = None

    @property
    def text(self) -> str:
        """The step for display, such as "Ambient occlusion, 20 %"."""
        return self.name if self.fraction is None else f"{self.name}, {100 * self.fraction:.0f} %"


#: Work that yields the step that begins or has advanced.
type NamedSteps[Result] = Generator[Step, None, Result]


def result_of[Result](steps: Generator[Any, None, Result]) -> Result:
    """Run all steps at once, and return their result."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            result: Result = end.value
            return result


def named[Result](name: str, steps: Generator[float, None, Result]) -> NamedSteps[Result]:
    """Work that yields the fraction that is done, as a step of this name."""
    yield Step(name)
    return (yield from map_progress(steps, lambda fraction: Step(name, fraction)))


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
