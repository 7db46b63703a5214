"""Background jobs: only the latest request is built, and nothing is built twice."""

from __future__ import annotations

import threading
from collections.abc import Generator, Iterator
from typing import Any

import pytest
from waiting import TIMEOUT_S, run_steps_until

bpy = pytest.importorskip("bpy", reason="its timer is Blender's")

from hairloom.addon.blender.base import latest_job  # noqa: E402
from hairloom.addon.blender.base.latest_job import LatestJob, Work  # noqa: E402
from hairloom.addon.blender.base.thread_work import ThreadWork  # noqa: E402
from hairloom.addon.errors import HairloomError  # noqa: E402


class Workshop:
    """Turns keys into upper case, each once its gate is open.

    begun: keys in the order in which work began. taken: results, None for work without one.
    """

    def __init__(self) -> None:
        self.gates: dict[str, threading.Event] = {}
        self.begun: list[str] = []
        self.taken: list[str | None] = []
        self.ended: list[str] = []
        self.errors: list[HairloomError] = []
        self.job = LatestJob[str, str]("test", self._take)

    def request(self, key: str, *, fails: bool = False, error: Exception | None = None) -> None:
        if fails:
            error = HairloomError("it cannot be", place=key, remedy="Undo")
        self.gates.setdefault(key, threading.Event())
        self.job.request(key, lambda: self._begin(key, error))

    def _begin(self, key: str, error: Exception | None) -> Work[str]:
        assert threading.current_thread() is threading.main_thread()
        self.begun.append(key)

        def work(thread: ThreadWork[str]) -> str:
            assert self.gates[key].wait(TIMEOUT_S)
            try:
                thread.report("last part")
            finally:
                self.ended.append(key)
            if error is not None:
                raise error
            return key.upper()

        return work

    def open(self, *keys: str) -> None:
        for key in keys:
            self.gates.setdefault(key, threading.Event()).set()

    def _take(self) -> None:
        try:
            self.taken.append(self.job.take())
        except HairloomError as error:
            self.errors.append(error)


@pytest.fixture
def shop() -> Iterator[Workshop]:
    shop = Workshop()
    yield shop
    shop.job.cancel()
    shop.open(*shop.gates)
    latest_job.unschedule_all()


def test_a_result_arrives_by_blenders_timer_and_is_not_computed_twice(shop: Workshop) -> None:
    shop.request("a")
    assert bpy.app.timers.is_registered(latest_job.run_steps)
    assert shop.job.is_pending and not shop.job.has_result
    assert latest_job.run_steps() == latest_job.POLL_INTERVAL and shop.taken == []
    shop.request("a")
    shop.open("a")
    run_steps_until(lambda: shop.taken == ["A"])
    shop.request("a")
    assert shop.begun == ["a"] and not shop.job.is_pending
    assert latest_job.run_steps() is None, "the timer ends with the last work"


def test_a_running_job_finishes_and_the_latest_request_follows(shop: Workshop) -> None:
    for key in "abcd":
        shop.request(key)
    assert shop.begun == ["a"]
    shop.open("a", "d")
    run_steps_until(lambda: shop.taken == ["A", "D"])
    assert shop.begun == ["a", "d"], "what is in between is left out"


def test_requesting_the_running_job_again_drops_later_requests(shop: Workshop) -> None:
    for key in "aba":
        shop.request(key)
    shop.open("a", "b")
    run_steps_until(lambda: shop.taken == ["A"])
    assert shop.begun == ["a"] and not shop.job.is_pending


def test_a_failure_is_reported_only_if_still_requested(shop: Workshop) -> None:
    shop.request("a", fails=True)
    shop.request("b", fails=True)
    shop.open("a", "b")
    run_steps_until(lambda: bool(shop.errors))
    assert shop.taken == [None] and [error.place for error in shop.errors] == ["b"]
    shop.request("b")
    assert not shop.job.is_pending, "it fails once"
    shop.request("c")
    shop.open("c")
    run_steps_until(lambda: shop.taken == [None, "C"])


def test_any_exception_is_reported_only_if_still_requested(
    shop: Workshop, capsys: pytest.CaptureFixture[str]
) -> None:
    shop.request("a", error=MemoryError("far too much"))
    shop.request("b")
    shop.open("a", "b")
    run_steps_until(lambda: shop.taken == [None, "B"])
    assert "MemoryError: far too much" in capsys.readouterr().err


def test_a_job_whose_step_is_dropped_can_be_wanted_again(shop: Workshop) -> None:
    shop.request("a")
    latest_job.unschedule_all()
    assert not shop.job.is_pending
    shop.request("a")
    shop.open("a")
    run_steps_until(lambda: shop.taken == ["A"])
    assert shop.begun == ["a", "a"]


def test_cancelled_work_ends_by_itself_and_is_not_wanted_any_more(shop: Workshop) -> None:
    shop.request("a")
    shop.request("b")
    shop.job.cancel()
    assert not shop.job.is_pending and latest_job.run_steps() is None
    shop.open("a", "b")
    run_steps_until(lambda: shop.ended == ["a"])
    assert shop.taken == [] and shop.begun == ["a"]
    shop.request("a")
    run_steps_until(lambda: shop.taken == ["A"])


def test_taking_a_result_early_waits_for_it(shop: Workshop) -> None:
    shop.request("a")
    threading.Timer(0.05, lambda: shop.open("a")).start()
    assert shop.job.take() == "A"


def test_a_result_stays_available_until_it_is_taken(shop: Workshop) -> None:
    offers: list[bool] = []
    job = LatestJob[str, str]("test", lambda: offers.append(job.has_result))
    job.request("a", lambda: lambda _: "A")
    run_steps_until(lambda: len(offers) >= 3)
    assert all(offers) and job.take() == "A"
    assert latest_job.run_steps() is None


def test_keys_can_be_compared_by_a_custom_function(shop: Workshop) -> None:
    job = LatestJob[str, str]("test", lambda: None, lambda one, other: one[0] == other[0])
    job.request("apple", lambda: lambda _: "A")
    assert job.is_latest("almond") and not job.is_latest("birch")
    job.cancel()


def test_main_thread_steps_are_run_by_the_timer(shop: Workshop) -> None:
    seen: list[Any] = []

    def steps() -> Generator[None, None, str]:
        for _ in range(3):
            seen.append(threading.current_thread())
            yield
        return "A"

    job = LatestJob[str, str]("test", lambda: shop.taken.append(job.take()))
    job.request("a", lambda: lambda work: work.on_main_thread(steps()))
    run_steps_until(lambda: shop.taken == ["A"])
    assert seen == 3 * [threading.main_thread()]


def test_a_step_that_fails_is_reported_and_the_others_go_on(
    shop: Workshop, capsys: pytest.CaptureFixture[str]
) -> None:
    taken: list[str] = []

    def fail() -> float | None:
        raise ValueError("a defect")

    def count() -> float | None:
        taken.append("step")
        return 0.5

    latest_job.schedule("bad", fail)
    latest_job.schedule("good", count)
    assert latest_job.run_steps() == 0.5 and latest_job.run_steps() == 0.5
    assert len(taken) == 2 and capsys.readouterr().err.count("ValueError: a defect") == 1
    latest_job.unschedule("good")
    assert latest_job.run_steps() is None


def test_a_step_may_end_others_and_begin_new_ones(shop: Workshop) -> None:
    taken: list[str] = []

    def last() -> float | None:
        taken.append("last")
        return None

    def first() -> float | None:
        taken.append("first")
        latest_job.unschedule("second")
        latest_job.schedule("third", last)
        return None

    latest_job.schedule("first", first)
    latest_job.schedule("second", lambda: taken.append("second"))
    assert latest_job.run_steps() == latest_job.POLL_INTERVAL, "the third is still to come"
    assert latest_job.run_steps() is None and taken == ["first", "last"]


def test_a_job_that_failed_to_start_can_be_requested_again(shop: Workshop) -> None:
    def begin() -> Work[str]:
        raise HairloomError("it cannot be read", place="a", remedy="Undo")

    with pytest.raises(HairloomError):
        shop.job.request("a", begin)
    shop.request("a")
    shop.open("a")
    run_steps_until(lambda: shop.taken == ["A"])
