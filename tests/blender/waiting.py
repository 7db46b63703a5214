"""Waiting for the results of threads."""

import time
from collections.abc import Callable
from typing import Any

from hairloom.addon.blender.base import latest_job
from hairloom.addon.blender.preview import previews

#: timeout [s] for work in a thread, however slow the machine
PATIENCE_S = 120.0
#: sleep of the main thread [s]: Python runs one thread at a time, so others need it to sleep
PAUSE_S = 0.002


def until(is_so: Callable[[], Any]) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < end, "it does not come"
        time.sleep(PAUSE_S)


def until_it_plays(session: Any, evaluated: Callable[[], Any], duration: float) -> None:
    """Tick Play's clock until this hair, which waits for its colliders, starts to play."""
    until(lambda: previews.advance(evaluated(), duration) or session.is_playing)


def take_steps_until(is_so: Callable[[], Any]) -> None:
    """Run steps as Blender's timer does, until a condition holds."""

    def is_so_after_a_step() -> bool:
        if is_so():
            return True
        latest_job.take_steps()
        return False

    until(is_so_after_a_step)
