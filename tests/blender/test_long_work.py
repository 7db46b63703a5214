"""Operators with long work run all steps at once where there is no window."""

from __future__ import annotations

import threading
from collections.abc import Generator
from types import SimpleNamespace
from typing import Any

import bpy
import pytest
from waiting import wait_until

from hairloom.addon.blender.base.thread_work import ThreadWork, WorkCancelledError
from hairloom.addon.cards.steps import result_of
from hairloom.addon.errors import HairloomError
from hairloom.addon.ui import long_work, operators_preview
from hairloom.addon.ui.long_work import (
    LongWork,
    Progress,
    Steps,
    as_progress,
    counted,
    draw_progress,
    status,
    threaded,
)

seen: list[Any] = []


class HAIRLOOM_OT_test_work(LongWork, bpy.types.Operator):
    bl_idname = "hairloom.test_work"
    bl_label = "Test Work"

    count: bpy.props.IntProperty(default=3)

    @classmethod
    def poll(cls, _context: Any) -> bool:
        return cls.can_start()

    def steps(self: Any, _context: Any) -> Steps[None]:
        if self.count > 5:
            raise HairloomError("too many", place="test", remedy="Take fewer")
        yield from counted(counting(self.count), self.count, "things")
        seen.append("done")
        self.report({"INFO"}, "All is done")


def counting(count: int) -> Generator[int]:
    try:
        for done in range(1, count + 1):
            seen.append(done)
            yield done
    finally:
        seen.append("closed")


@pytest.fixture(autouse=True)
def registered() -> Generator[None]:
    seen.clear()
    bpy.utils.register_class(HAIRLOOM_OT_test_work)
    yield
    bpy.utils.unregister_class(HAIRLOOM_OT_test_work)


@pytest.mark.parametrize("how", ["EXEC_DEFAULT", "INVOKE_DEFAULT"])
def test_without_a_window_all_steps_come_at_once(how: str) -> None:
    assert bpy.ops.hairloom.test_work(how) == {"FINISHED"}
    assert seen == [1, 2, 3, "closed", "done"]


def test_bad_input_is_an_error_of_the_operator() -> None:
    with pytest.raises(RuntimeError, match="too many"):
        bpy.ops.hairloom.test_work(count=6)
    assert seen == []


def test_work_that_a_script_has_undone_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    operator = SimpleNamespace(
        bl_label="Test Work",
        state_after_cancel="nothing has changed",
        report=lambda _, text: said.append(text),
    )
    steps, ended = counted(counting(3), 3, "things"), []
    next(steps)
    running = SimpleNamespace(steps=steps, end=lambda: ended.append(True))
    monkeypatch.setattr(long_work, "_running", running)
    long_work._on_undo()
    assert seen == [1, "closed"] and ended
    event = SimpleNamespace(type="TIMER", value="NOTHING")
    assert LongWork.modal(operator, bpy.context, event) == {"CANCELLED"}
    assert said == ["Test Work was cancelled by Undo or Redo; nothing has changed"]


def test_progress_counts_done_of_total() -> None:
    progress = list(counted(counting(2), 2000, "frames"))
    assert progress == [Progress("1 of 2,000 frames", 0.0005), Progress("2 of 2,000 frames", 0.001)]


def test_closing_the_progress_closes_the_work() -> None:
    steps = counted(counting(3), 3, "frames")
    next(steps)
    steps.close()
    assert seen == [1, "closed"]


def test_fractions_are_reported_and_the_result_is_kept() -> None:
    def work() -> Generator[float, None, str]:
        yield 0.25
        return "sorted"

    assert list(as_progress(work())) == [Progress("25%", 0.25)]
    assert result_of(as_progress(work())) == "sorted"


def test_a_thread_is_waited_for_and_its_stages_are_reported() -> None:
    may_end = threading.Event()

    def work(thread: ThreadWork[str]) -> str:
        thread.report("Sorting")
        assert may_end.wait(30.0)
        return "sorted"

    steps = threaded(ThreadWork(work, "test"))
    while next(steps).text != "Sorting":
        pass
    assert next(steps) == Progress("Sorting", is_idle=True)
    may_end.set()
    assert result_of(steps) == "sorted"


def test_closing_cancels_the_thread() -> None:
    begun, may_go_on = threading.Event(), threading.Event()

    def work(thread: ThreadWork[None]) -> None:
        begun.set()
        assert may_go_on.wait(30.0)
        thread.report("More")

    thread = ThreadWork(work, "test")
    steps = threaded(thread)
    assert begun.wait(30.0)
    next(steps)
    steps.close()
    may_go_on.set()
    wait_until(thread.run_main_thread_steps)
    with pytest.raises(WorkCancelledError):
        thread.result()


def test_the_status_bar_offers_esc_as_long_as_it_cancels() -> None:
    assert status("Bake", Progress("3 frames")) == "Bake: 3 frames. Esc: cancel"
    assert status("Bake", Progress("Writing", is_committed=True)) == "Bake: Writing"


@pytest.mark.parametrize("is_committed", [False, True])
def test_esc_is_offered_as_long_as_it_cancels(
    is_committed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The Esc icon beside the progress, and Esc in the message of the greyed-out button."""
    work, progress = HAIRLOOM_OT_test_work, Progress("3 of 4", 0.75, is_committed=is_committed)
    running = SimpleNamespace(operator=work, label=work.bl_label, progress=progress)
    monkeypatch.setattr(long_work, "_running", running)
    icons: list[str] = []
    row = SimpleNamespace(progress=lambda **_: None, label=lambda icon="", **_: icons.append(icon))
    assert draw_progress(SimpleNamespace(row=lambda **_: row), work)
    assert icons == ["BLANK1" if is_committed else "EVENT_ESC"]
    with pytest.raises(RuntimeError, match="Test Work is still running") as refused:
        bpy.ops.hairloom.test_work()
    assert ("Esc" in str(refused.value)) is not is_committed


@pytest.mark.usefixtures("extension")
def test_a_bake_is_not_deleted_while_other_work_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """The button reports the other work as the reason, not that there is no bake."""
    running = SimpleNamespace(label="Make Cards", progress=Progress("3 of 4"))
    monkeypatch.setattr(long_work, "_running", running)
    with pytest.raises(RuntimeError, match="Make Cards is still running; Esc cancels it"):
        bpy.ops.hairloom.bake_free()


def test_play_restores_its_status_text_after_other_work(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str | None] = []
    monkeypatch.setattr(operators_preview, "show_status", shown.append)
    ticks = operators_preview._Ticks()
    for label in ("", "", "Settle", "Settle", ""):
        monkeypatch.setattr(operators_preview, "running_label", lambda label=label: label)
        ticks.update_status()
    assert shown == [operators_preview.STATUS] * 2
