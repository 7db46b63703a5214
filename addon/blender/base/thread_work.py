"""Work in a thread beside the window, which asks the main thread for what only that one may do."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

#: The main thread works for a thread this long at a time [s], but one step at least.
SERVING_TIME = 0.05


class GivenUpError(Exception):
    """Nobody waits for this work."""


@dataclass
class _Request:
    """What the main thread is asked for, a step at a time."""

    steps: Generator[None, None, Any]
    answer: Future[Any] = field(default_factory=Future)


class ThreadWork[T]:
    """A piece of work on its way.

    Args:
        work: is called in the thread with this very object; its result is this one's.

    stage: what the work says that it does now.
    """

    def __init__(self, work: Callable[[ThreadWork[T]], T], name: str) -> None:
        self.stage = ""
        self._work = work
        self._lock = threading.Lock()
        self._request: _Request | None = None
        self._is_given_up = self._is_committed = False
        self._end: Callable[[], None] | None = None
        self._result: list[T] = []
        self._error: BaseException | None = None
        # a daemon, so that Blender may quit whatever is being done
        self._thread = threading.Thread(target=self._run, daemon=True, name=name)
        self._thread.start()

    def report(self, stage: str) -> None:
        """In the thread: say what is done next.

        Raises:
            GivenUpError: it need not be done.
        """
        if self._is_given_up:
            raise GivenUpError
        self.stage = stage

    def on_main_thread[R](self, steps: Generator[None, None, R]) -> R:
        """In the thread: the result of steps that the main thread does.

        Raises:
            GivenUpError: they are not done any more. And whatever a step raises.
        """
        request = _Request(steps)
        with self._lock:
            if self._is_given_up:
                raise GivenUpError
            self._request = request
        result: R = request.answer.result()
        return result

    @contextmanager
    def committing(self) -> Iterator[None]:
        """In the thread, for `exchange.files.moving.committing`: from here on it is not given up.

        Raises:
            GivenUpError: it was before.
        """
        with self._lock:
            if self._is_given_up:
                raise GivenUpError
            self._is_committed = True
            yield

    @contextmanager
    def ending(self, end: Callable[[], None]) -> Iterator[None]:
        """In the thread, for `exchange.files.child_process.ending`: whoever gives up the work
        ends the child.

        Raises:
            GivenUpError: it is given up.
        """
        with self._lock:
            if self._is_given_up:
                raise GivenUpError
            self._end = end
        try:
            yield
        finally:
            with self._lock:
                self._end = None
        if self._is_given_up:
            raise GivenUpError

    @property
    def is_committed(self) -> bool:
        """Whether its files take their places, or have."""
        return self._is_committed

    @property
    def wants_main_thread(self) -> bool:
        """Whether the thread waits for `run_main_thread_steps`."""
        return self._request is not None

    def run_main_thread_steps(self, duration: float = SERVING_TIME) -> bool:
        """In the main thread: do what is asked for, for about this long [s]; whether the work is
        done."""
        request, end = self._request, time.perf_counter() + duration
        if request is not None:
            try:
                next(request.steps)
                while time.perf_counter() < end:
                    next(request.steps)
            except StopIteration as last:
                self._request = None
                request.answer.set_result(last.value)
            except Exception as error:  # it is raised where the thread waits, which reports it
                self._request = None
                request.answer.set_exception(error)
        return not self._thread.is_alive()

    @property
    def is_done(self) -> bool:
        """Whether it has a result, or an error."""
        return not self._thread.is_alive()

    def wait(self) -> None:
        """Until it is done; only for work that asks the main thread for nothing."""
        self._thread.join()

    def result(self) -> T:
        """What the work has made, once it is done.

        Raises:
            GivenUpError: it was given up. And whatever the work has raised.
        """
        if self._error is not None:
            raise self._error
        assert self._result, "not done yet"
        return self._result[0]

    def give_up(self) -> None:
        """In the main thread: nobody waits for it any more."""
        with self._lock:
            self._is_given_up = True
            request, self._request = self._request, None
            if self._end is not None:
                self._end()
        if request is not None:
            request.steps.close()  # here, since it may hold what only this thread may free
            request.answer.set_exception(GivenUpError())

    def _run(self) -> None:
        try:
            self._result.append(self._work(self))
        except BaseException as error:  # kept for whoever asks for the result
            self._error = error
