"""How tests wait for what a thread makes."""

import time
from collections.abc import Callable
from typing import Any

from hairloom.addon.blender.base import latest_job

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


def take_steps_until(is_so: Callable[[], Any]) -> None:
    """Take steps as Blender's timer does, until this is so."""

    def is_so_after_a_step() -> bool:
        if is_so():
            return True
        latest_job.take_steps()
        return False

    until(is_so_after_a_step)
