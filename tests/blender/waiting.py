"""Waiting for the results of threads."""

import time
from collections.abc import Callable
from typing import Any

from hairloom.addon.blender.base import latest_job
from hairloom.addon.blender.preview import previews

#: timeout [s] for work in a thread, however slow the machine
TIMEOUT_S = 120.0
#: sleep of the main thread [s]: Python runs one thread at a time, so others need it to sleep
POLL_S = 0.002


def wait_until(condition: Callable[[], Any]) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < end, "it does not come"
        time.sleep(POLL_S)


def wait_until_playing(session: Any, get_depsgraph: Callable[[], Any], duration: float) -> None:
    """Tick Play's clock until this hair, which waits for its colliders, starts to play."""
    wait_until(lambda: previews.advance(get_depsgraph(), duration) or session.is_playing)


def run_steps_until(condition: Callable[[], Any]) -> None:
    """Run steps as Blender's timer does, until a condition holds."""

    def holds_after_a_step() -> bool:
        if condition():
            return True
        latest_job.run_steps()
        return False

    wait_until(holds_after_a_step)
