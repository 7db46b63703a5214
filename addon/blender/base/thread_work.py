"""Background work in a thread; the main thread runs the steps that only it may run."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

#: Time [s] that the main thread spends on a thread's steps at once; it runs at least one.
MAIN_THREAD_TIME = 0.05


class WorkCancelledError(Exception):
    """The work was cancelled: its result is not needed."""


@dataclass
class _Request:
    """Steps for the main thread, and the future for their result."""

    steps: Generator[None, None, Any]
    future: Future[Any] = field(default_factory=Future)


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
        self._is_cancelled = self._is_committed = False
        self._kill: Callable[[], None] | None = None
        self._result: list[T] = []
        self._error: BaseException | None = None
        # a daemon, so that Blender can quit at any time
        self._thread = threading.Thread(target=self._run, daemon=True, name=name)
        self._thread.start()

    def report(self, stage: str) -> None:
        """In the thread: report the stage that begins.

        Raises:
            WorkCancelledError: the work was cancelled.
        """
        if self._is_cancelled:
            raise WorkCancelledError
        self.stage = stage

    def on_main_thread[R](self, steps: Generator[None, None, R]) -> R:
        """In the thread: have the main thread run these steps, and return their result.

        Raises:
            WorkCancelledError: the work was cancelled. And whatever a step raises.
        """
        request = _Request(steps)
        with self._lock:
            if self._is_cancelled:
                raise WorkCancelledError
            self._request = request
        result: R = request.future.result()
        return result

    @contextmanager
    def commit_context(self) -> Iterator[None]:
        """In the thread, for `exchange.files.file_moves.commit_context`: files are moved to their
        places, and `cancel` waits until all are.

        Raises:
            WorkCancelledError: the work was cancelled before.
        """
        with self._lock:
            if self._is_cancelled:
                raise WorkCancelledError
            self._is_committed = True
            yield

    @contextmanager
    def kill_context(self, kill: Callable[[], None]) -> Iterator[None]:
        """In the thread, for `exchange.files.child_process.kill_context`: `cancel` also kills the
        child process.

        Raises:
            WorkCancelledError: the work was cancelled.
        """
        with self._lock:
            if self._is_cancelled:
                raise WorkCancelledError
            self._kill = kill
        try:
            yield
        finally:
            with self._lock:
                self._kill = None
        if self._is_cancelled:
            raise WorkCancelledError

    @property
    def is_committed(self) -> bool:
        """Whether its files are being moved to their places, or have been."""
        return self._is_committed

    @property
    def wants_main_thread(self) -> bool:
        """Whether the thread waits for `run_main_thread_steps`."""
        return self._request is not None

    def run_main_thread_steps(self, duration: float = MAIN_THREAD_TIME) -> bool:
        """In the main thread: run the thread's steps for about this long [s].

        Returns:
            whether the work is done.
        """
        request, deadline = self._request, time.perf_counter() + duration
        if request is not None:
            try:
                next(request.steps)
                while time.perf_counter() < deadline:
                    next(request.steps)
            except StopIteration as last:
                self._request = None
                request.future.set_result(last.value)
            except Exception as error:  # raised again in the thread, which reports it
                self._request = None
                request.future.set_exception(error)
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
            WorkCancelledError: it was cancelled. And whatever the work has raised.
        """
        if self._error is not None:
            raise self._error
        assert self._result, "not done yet"
        return self._result[0]

    def cancel(self) -> None:
        """In the main thread: end the work as soon as possible and drop its result."""
        with self._lock:
            self._is_cancelled = True
            request, self._request = self._request, None
            if self._kill is not None:
                self._kill()
        if request is not None:
            request.steps.close()  # here, as its locals may hold objects only this thread may free
            request.future.set_exception(WorkCancelledError())

    def _run(self) -> None:
        try:
            self._result.append(self._work(self))
        except BaseException as error:  # raised by `result`
            self._error = error
