"""Ending a job cleanly on Ctrl-C or a farm's signal: nothing is left half-written."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

#: SIGBREAK is what a farm sends on Windows.
_SIGNAL_NAMES = ("SIGINT", "SIGTERM", "SIGBREAK")

_received: list[int] = []


class Interrupted(KeyboardInterrupt):
    """The job must end now. args[0]: the signal's number."""

    @property
    def number(self) -> int:
        return int(self.args[0])

    @property
    def name(self) -> str:
        return signal.Signals(self.number).name

    @property
    def exit_code(self) -> int:
        """128 plus the signal's number, as in shells: 130 for Ctrl-C."""
        return 128 + self.number


@contextmanager
def interruptible() -> Iterator[None]:
    """Let signals raise Interrupted inside; Blender's own handlers set a flag, or exit at once.

    Has no effect in a thread, where signals never arrive.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _received.clear()
    signals = [getattr(signal, name) for name in _SIGNAL_NAMES if hasattr(signal, name)]
    previous_handlers = {number: signal.signal(number, _on_signal) for number in signals}
    try:
        yield
    except Exception:
        raise_if_interrupted()  # Blender raises another error for an interrupted operator
        raise
    finally:
        for number, handler in previous_handlers.items():
            # None: set by C code, which Python cannot set again
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


def raise_if_interrupted() -> None:
    """Call between the steps of long work: Blender swallows exceptions inside its own handlers.

    Raises:
        Interrupted: a signal was received.
    """
    if _received:
        raise Interrupted(_received[0])


def _on_signal(number: int, _frame: FrameType | None) -> None:
    _received.append(number)
    raise Interrupted(number)
