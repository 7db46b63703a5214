"""Background work in a thread; the main thread takes the steps that only it may take."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

#: Time [s] that the main thread spends on a thread's steps at once; at least one step is taken.
SERVING_TIME = 0.05


class GivenUpError(Exception):
    """The work was given up: its result is not needed."""


@dataclass
class _Request:
    """Steps for the main thread, and the future for their result."""

    steps: Generator[None, None, Any]
    answer: Future[Any] = field(default_factory=Future)


class ThreadWork[T]:
    """A piece of work that runs in a thread.

    Args:
        work: called in the thread with this object; returns the result.

    stage: the one last reported by the work.
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
        # a daemon, so that Blender can quit at any time
        self._thread = threading.Thread(target=self._run, daemon=True, name=name)
        self._thread.start()

    def report(self, stage: str) -> None:
        """In the thread: report the stage that begins.

        Raises:
            GivenUpError: the work was given up.
        """
        if self._is_given_up:
            raise GivenUpError
        self.stage = stage

    def on_main_thread[R](self, steps: Generator[None, None, R]) -> R:
        """In the thread: have the main thread take these steps, and return their result.

        Raises:
            GivenUpError: the work was given up. And whatever a step raises.
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
        """In the thread, for `exchange.files.file_moves.commit_context`: files are moved to their
        places, and `give_up` waits until all are.

        Raises:
            GivenUpError: the work was given up before.
        """
        with self._lock:
            if self._is_given_up:
                raise GivenUpError
            self._is_committed = True
            yield

    @contextmanager
    def ending(self, end: Callable[[], None]) -> Iterator[None]:
        """In the thread, for `exchange.files.child_process.kill_context`: `give_up` also ends the
        child process.

        Raises:
            GivenUpError: the work was given up.
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
        """Whether its files are being moved to their places, or have been."""
        return self._is_committed

    @property
    def wants_main_thread(self) -> bool:
        """Whether the thread waits for `run_main_thread_steps`."""
        return self._request is not None

    def run_main_thread_steps(self, duration: float = SERVING_TIME) -> bool:
        """In the main thread: take the thread's steps for about this long [s].

        Returns:
            whether the work is done.
        """
        request, end = self._request, time.perf_counter() + duration
        if request is not None:
            try:
                next(request.steps)
                while time.perf_counter() < end:
                    next(request.steps)
            except StopIteration as last:
                self._request = None
                request.answer.set_result(last.value)
            except Exception as error:  # raised again in the thread, which reports it
                self._request = None
                request.answer.set_exception(error)
        return not self._thread.is_alive()

    @property
    def is_done(self) -> bool:
        """Whether it has a result, or an error."""
        return not self._thread.is_alive()

    def wait(self) -> None:
        """Block until the work is done; only for work that needs no steps of the main thread."""
        self._thread.join()

    def result(self) -> T:
        """The result of the work, once it is done.

        Raises:
            GivenUpError: it was given up. And whatever the work has raised.
        """
        if self._error is not None:
            raise self._error
        assert self._result, "not done yet"
        return self._result[0]

    def give_up(self) -> None:
        """In the main thread: end the work as soon as possible and drop its result."""
        with self._lock:
            self._is_given_up = True
            request, self._request = self._request, None
            if self._end is not None:
                self._end()
        if request is not None:
            request.steps.close()  # here, as its locals may hold objects only this thread may free
            request.answer.set_exception(GivenUpError())

    def _run(self) -> None:
        try:
            self._result.append(self._work(self))
        except BaseException as error:  # raised by `result`
            self._error = error
