"""Background jobs: one thing is made in a thread, always in the version requested last.

    first request                its work begins
    another request meanwhile    the running work is finished and taken; then the last one begins
    the same request again       nothing is made twice
    failure                      raised only if the request is still the last one
    cancelled                    the result is dropped; the thread ends by itself
    a file is opened             all are cancelled, as Blender drops the timer

All jobs share one timer of Blender's, which runs the steps added by `schedule` in the main thread.
"""

from __future__ import annotations

import operator
import traceback
from collections.abc import Callable, Hashable
from dataclasses import dataclass

import bpy

from ...errors import HairloomError
from .redraw import redraw_panels
from .thread_work import ThreadWork

#: [s] between checks of a running job, and of one that waits for the main thread.
POLL_INTERVAL, STEP_INTERVAL = 0.05, 0.01

type Step = Callable[[], float | None]
type Work[Result] = Callable[[ThreadWork[Result]], Result]

_steps: dict[Hashable, Step] = {}


def is_blocking() -> bool:
    """Whether to wait for work: in background mode there is no window that has to respond."""
    return bool(bpy.app.background)


def schedule(key: Hashable, step: Step) -> None:
    """Run this step repeatedly, instead of the one that has this key.

    Args:
        step: returns the seconds until its next run; None: this was the last one.
    """
    _steps[key] = step
    if not bpy.app.timers.is_registered(run_steps):
        bpy.app.timers.register(run_steps, first_interval=POLL_INTERVAL)


def is_scheduled(key: Hashable) -> bool:
    """Whether a step with this key is still run."""
    return key in _steps


def unschedule(key: Hashable) -> None:
    _steps.pop(key, None)


def unschedule_all() -> None:
    """Remove all steps and the timer, and cancel the jobs that rely on a step: without it, they
    could never begin again."""
    for key in tuple(_steps):
        if isinstance(key, LatestJob):
            key.cancel()
    _steps.clear()
    if bpy.app.timers.is_registered(run_steps):
        bpy.app.timers.unregister(run_steps)


def run_steps() -> float | None:
    """The function of the timer. A step that fails is reported and removed; the others go on."""
    pauses = []
    for key, step in tuple(_steps.items()):
        if _steps.get(key) is not step:  # an earlier step has removed it
            continue
        try:
            pause = step()
        except Exception:
            traceback.print_exc()
            pause = None
        if pause is not None:
            pauses.append(pause)
        elif _steps.get(key) is step:
            del _steps[key]
    # steps that were scheduled meanwhile rely on this timer, which was registered
    return min(pauses, default=POLL_INTERVAL) if _steps else None


@dataclass(frozen=True, eq=False)
class _Running[Key, Result]:
    key: Key
    work: ThreadWork[Result]


class LatestJob[Key, Result]:
    """One thing that is made in a thread.

    Args:
        name: of its threads.
        on_result: called in the main thread when the work is done, repeatedly until it is taken.
        is_same: whether two keys give the same result.
    """

    def __init__(
        self,
        name: str,
        on_result: Callable[[], None],
        is_same: Callable[[Key, Key], bool] = operator.eq,
    ) -> None:
        self._name, self._on_result, self._is_same = name, on_result, is_same
        self._latest: tuple[Key, Callable[[], Work[Result]]] | None = None
        self._running: _Running[Key, Result] | None = None
        self._shown_stage = ""

    def request(self, key: Key, prepare: Callable[[], Work[Result]]) -> None:
        """Request the result of this key.

        Args:
            prepare: called in the main thread when this request's turn has come, to read its
                inputs; returns the work.
        """
        if not self.is_latest(key):
            self._latest = key, prepare
            if self._running is None:
                self._begin()

    def is_latest(self, key: Key) -> bool:
        """Whether this was requested last."""
        return self._latest is not None and self._is_same(self._latest[0], key)

    @property
    def is_pending(self) -> bool:
        """Whether work runs, or is done and not yet taken."""
        return self._running is not None

    @property
    def stage(self) -> str:
        """The stage of the running work; "" where nothing runs, or before its first stage."""
        return "" if self._running is None else self._running.work.stage

    @property
    def has_result(self) -> bool:
        """Whether `take` need not wait."""
        return self._running is not None and self._running.work.is_done

    def take(self) -> Result | None:
        """The result of the running work, for which it waits.

        If something else was requested meanwhile, the result is of the older request, or None where
        that failed, and the last request begins now.

        Raises:
            HairloomError: the last request cannot be made; or whatever else its work raises.
        """
        running, self._running = self._running, None
        assert running is not None, "nothing is being made"
        is_latest = self.is_latest(running.key)
        try:
            running.work.wait()
            return running.work.result()
        except Exception as error:
            if is_latest:
                raise
            if not isinstance(error, HairloomError):
                traceback.print_exc()
            return None
        finally:
            if not is_latest:
                self._begin()

    def cancel(self) -> None:
        """Drop the request and the running work."""
        if self._running is not None:
            self._running.work.cancel()
        self._running = self._latest = None
        unschedule(self)

    def _begin(self) -> None:
        assert self._latest is not None
        key, prepare = self._latest
        try:
            self._running = _Running(key, ThreadWork(prepare(), self._name))
        except BaseException:
            self._latest = None  # so that the same can be requested again
            raise
        schedule(self, self._step)

    def _step(self) -> float | None:
        if self._running is not None and self._running.work.run_main_thread_steps():
            self._on_result()
        if self.stage != self._shown_stage:
            self._shown_stage = self.stage
            redraw_panels()
        if self._running is None:
            return None
        return STEP_INTERVAL if self._running.work.wants_main_thread else POLL_INTERVAL
