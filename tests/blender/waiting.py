"""How tests wait for what a thread makes."""

import time
from collections.abc import Callable
from typing import Any

from hairloom.addon.blender.base import latest_job
from hairloom.addon.blender.preview import previews

#: What a thread has to do is done by then [s], however slow the machine.
PATIENCE_S = 120.0
#: A thread gets on only while the main one sleeps: Python runs one of them at a time.
PAUSE_S = 0.002


def until(is_so: Callable[[], Any]) -> None:
    """Wait until this is so."""
    end = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < end, "it does not come"
        time.sleep(PAUSE_S)


def until_it_plays(session: Any, evaluated: Callable[[], Any], duration: float) -> None:
    """Ticks of Play's clock until this hair begins, which waits for its colliders."""
    until(lambda: previews.advance(evaluated(), duration) or session.is_playing)


def take_steps_until(is_so: Callable[[], Any]) -> None:
    """Take steps as Blender's timer does, until this is so."""

    def is_so_after_a_step() -> bool:
        if is_so():
            return True
        latest_job.take_steps()
        return False

    until(is_so_after_a_step)
