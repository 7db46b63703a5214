"""Work beside the window: of one thing, the version that is wanted last, made in a thread.

    wanted for the first time    it begins
    another is wanted meanwhile  what runs is finished and taken; then the last one wanted begins
    the same is wanted again     nothing is made twice
    it fails                     that counts only if it is still wanted
    it is cancelled              nobody waits; its thread ends by itself
    a file is opened             all are cancelled, as Blender drops the timer

One timer of Blender's looks after all of it: `watch` has a step taken in the main thread.
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

#: What is on its way is looked for this often [s], or where it waits for this thread.
ARRIVAL_TIME, SERVING_PAUSE = 0.05, 0.01

type Step = Callable[[], float | None]
type Work[Result] = Callable[[ThreadWork[Result]], Result]

_steps: dict[Hashable, Step] = {}


def is_blocking() -> bool:
    """Whether to wait for work: in the background there is no window that has to respond."""
    return bool(bpy.app.background)


def watch(key: Hashable, step: Step) -> None:
    """Have this step taken again and again, instead of the one known by this key.

    Args:
        step: gives the seconds until it is to be taken again; None: it was the last one.
    """
    _steps[key] = step
    if not bpy.app.timers.is_registered(take_steps):
        bpy.app.timers.register(take_steps, first_interval=ARRIVAL_TIME)


def is_watched(key: Hashable) -> bool:
    """Whether there is such a step to be taken again."""
    return key in _steps


def unwatch(key: Hashable) -> None:
    _steps.pop(key, None)


def unwatch_all() -> None:
    """Leave no step and no timer behind, and no job that waits for its step: it could never be
    begun again."""
    for key in tuple(_steps):
        if isinstance(key, LatestJob):
            key.cancel()
    _steps.clear()
    if bpy.app.timers.is_registered(take_steps):
        bpy.app.timers.unregister(take_steps)


def take_steps() -> float | None:
    """The timer. A step that fails is reported and not taken again; the others go on."""
    pauses = []
    for key, step in tuple(_steps.items()):
        if _steps.get(key) is not step:  # a step before has ended it
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
    # steps that were added meanwhile found this timer registered, and rely on it
    return min(pauses, default=ARRIVAL_TIME) if _steps else None


@dataclass(frozen=True, eq=False)
class _Running[Key, Result]:
    key: Key
    work: ThreadWork[Result]


class LatestJob[Key, Result]:
    """One thing that is made in a thread.

    Args:
        name: of its threads.
        arrived: is called in the main thread when it is done, again and again until it is taken.
        is_same: whether two keys stand for the same result.
    """

    def __init__(
        self,
        name: str,
        arrived: Callable[[], None],
        is_same: Callable[[Key, Key], bool] = operator.eq,
    ) -> None:
        self._name, self._arrived, self._is_same = name, arrived, is_same
        self._wanted: tuple[Key, Callable[[], Work[Result]]] | None = None
        self._running: _Running[Key, Result] | None = None
        self._shown_stage = ""

    def want(self, key: Key, begin: Callable[[], Work[Result]]) -> None:
        """Have this made.

        Args:
            begin: is called in the main thread when its turn has come, so that it can read what is
                needed then; gives the work.
        """
        if not self.wants(key):
            self._wanted = key, begin
            if self._running is None:
                self._begin()

    def wants(self, key: Key) -> bool:
        """Whether this is what was wanted last."""
        return self._wanted is not None and self._is_same(self._wanted[0], key)

    @property
    def is_pending(self) -> bool:
        """Whether something is on its way."""
        return self._running is not None

    @property
    def stage(self) -> str:
        """What is done now of what is on its way; "" when nothing is, or before the first stage."""
        return "" if self._running is None else self._running.work.stage

    @property
    def has_arrived(self) -> bool:
        """Whether `take` need not wait."""
        return self._running is not None and self._running.work.is_done

    def take(self) -> Result | None:
        """What was being made, maybe not what is wanted last; that begins now. Waits for it.

        None where it failed and something else is wanted.

        Raises:
            HairloomError: it is wanted, and cannot be made; or whatever else its work raises.
        """
        running, self._running = self._running, None
        assert running is not None, "nothing is being made"
        is_latest = self.wants(running.key)
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
        """Nobody waits for it any more."""
        if self._running is not None:
            self._running.work.give_up()
        self._running = self._wanted = None
        unwatch(self)

    def _begin(self) -> None:
        assert self._wanted is not None
        key, begin = self._wanted
        try:
            self._running = _Running(key, ThreadWork(begin(), self._name))
        except BaseException:
            self._wanted = None  # so that the same can be wanted again
            raise
        watch(self, self._step)

    def _step(self) -> float | None:
        if self._running is not None and self._running.work.run_main_thread_steps():
            self._arrived()
        if self.stage != self._shown_stage:
            self._shown_stage = self.stage
            redraw_panels()
        if self._running is None:
            return None
        return SERVING_PAUSE if self._running.work.wants_main_thread else ARRIVAL_TIME
