"""Work in a thread that requests steps from the main thread."""

from __future__ import annotations

import threading
from collections.abc import Generator
from typing import Any

import pytest
from waiting import TIMEOUT_S, wait_until

pytest.importorskip("bpy", reason="what serves it runs inside Blender")

from hairloom.addon.blender.base.thread_work import ThreadWork, WorkCancelledError


def counting(seen: list[Any], last: int) -> Generator[None, None, int]:
    """Steps that record their threads, and that they were closed."""
    try:
        for _ in range(last):
            seen.append(threading.current_thread())
            yield
        return last
    finally:
        seen.append("closed")


def test_what_is_asked_is_done_by_who_serves_and_a_part_at_a_time() -> None:
    seen: list[Any] = []
    work = ThreadWork(lambda work: 10 * work.on_main_thread(counting(seen, 3)), "test")
    wait_until(lambda: work.wants_main_thread)
    assert not seen, "it did it by itself"
    for done in (1, 2, 3):
        assert not work.run_main_thread_steps(duration=0.0)
        assert seen == [threading.main_thread()] * done
    wait_until(lambda: work.run_main_thread_steps(duration=0.0))
    assert work.result() == 30 and not work.wants_main_thread
    assert seen[-1] == "closed"


def test_what_fails_is_raised_in_the_thread_and_reported_by_the_result() -> None:
    caught: list[Exception] = []

    def refusing() -> Generator[None]:
        yield
        raise OSError("no more memory")

    def try_it(work: ThreadWork[str]) -> str:
        try:
            work.on_main_thread(refusing())
        except OSError as error:
            caught.append(error)
        work.report("another try")
        raise ValueError("in vain")

    work = ThreadWork(try_it, "test")
    wait_until(work.run_main_thread_steps)
    assert [str(each) for each in caught] == ["no more memory"]
    assert work.stage == "another try"
    with pytest.raises(ValueError, match="in vain"):
        work.result()


def test_cancelling_closes_the_steps_and_ends_the_thread() -> None:
    seen: list[Any] = []
    work = ThreadWork(lambda work: work.on_main_thread(counting(seen, 1000)), "test")
    wait_until(lambda: work.wants_main_thread)
    work.run_main_thread_steps(duration=0.0)
    work.cancel()
    assert seen[-1] == "closed", "what it holds is freed by the thread"
    wait_until(work.run_main_thread_steps)
    with pytest.raises(WorkCancelledError):
        work.result()


def test_cancelled_work_cannot_report_nor_use_the_main_thread() -> None:
    cancelled, ended = threading.Event(), []

    def go_on(work: ThreadWork[None]) -> None:
        cancelled.wait(TIMEOUT_S)
        for goes_on in (lambda: work.report("next"), lambda: work.on_main_thread(counting([], 1))):
            try:
                goes_on()
            except WorkCancelledError:
                ended.append(True)

    work = ThreadWork(go_on, "test")
    work.cancel()
    cancelled.set()
    wait_until(work.run_main_thread_steps)
    assert ended == [True, True]


def test_cancelling_kills_the_child_process_that_is_waited_for() -> None:
    waiting, ended = threading.Event(), threading.Event()

    def wait_for_a_child(work: ThreadWork[None]) -> None:
        with work.kill_context(ended.set):
            waiting.set()
            assert ended.wait(TIMEOUT_S)

    work = ThreadWork(wait_for_a_child, "test")
    assert waiting.wait(TIMEOUT_S) and not ended.is_set()
    work.cancel()
    assert ended.is_set(), "it waits for the thread"
    wait_until(lambda: work.is_done)
    with pytest.raises(WorkCancelledError):
        work.result()


def test_cancelled_work_starts_no_child_process_and_one_that_has_ended_is_left_alone() -> None:
    cancelled, started, killed = threading.Event(), [], []

    def work_with_children(work: ThreadWork[None]) -> None:
        with work.kill_context(lambda: killed.append("the first")):
            started.append("the first")
        assert cancelled.wait(TIMEOUT_S)
        with work.kill_context(lambda: killed.append("the second")):
            started.append("the second")

    work = ThreadWork(work_with_children, "test")
    wait_until(lambda: started)
    work.cancel()
    cancelled.set()
    wait_until(lambda: work.is_done)
    assert started == ["the first"] and killed == []
