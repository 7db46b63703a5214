"""Operators that take long: they work in steps, show progress, and Esc cancels them.

After a click, a timer runs the steps in short slices, so that the window stays responsive. Scripts,
background mode and Adjust Last Operation run the same steps at once.
"""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import closing
from functools import partial
from typing import Any, NamedTuple

import bpy
from bpy.app.handlers import persistent

from ..blender.base import event_handlers
from ..blender.base.outcome import report
from ..blender.base.parts import Part, Parts
from ..blender.base.redraw import redraw_panels, show_status
from ..blender.base.thread_work import ThreadWork
from .reports import reporting, wait_cursor

#: Length [s] of a slice of work between two checks of the keyboard.
_SLICE_SECONDS = 0.1
#: Time [s] between two slices, and between two checks of a thread if there is no window.
_PAUSE_SECONDS = 0.01


class Progress(NamedTuple):
    """Progress of the work.

    fraction: of all work, 0 to 1; None: unknown.
    is_idle: whether there is nothing to do here at the moment, as a thread works.
    is_committed: whether it is too late to cancel the work; it will end soon.
    """

    text: str
    fraction: float | None = None
    is_idle: bool = False
    is_committed: bool = False


type Steps[Result] = Generator[Progress, None, Result]


class LongWork:
    """Base of an operator, before bpy.types.Operator.

    `steps` does the work and reports it. An operator's poll starts with `can_start`.

    state_after_cancel: for the report after Esc.
    """

    state_after_cancel = "nothing has changed"

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        """The whole work, including its reports.

        The first step runs immediately and may raise errors of the input. Closing the generator
        leaves nothing half done.

        Raises:
            HairloomError: it cannot be done; becomes a report.
        """
        raise NotImplementedError

    def on_finished(self, context: bpy.types.Context) -> None:
        """Called in a window once the work has ended, for example to open a popup."""

    def is_interactive(self: Any) -> bool:
        """Whether a button or a menu of a window has started it. Adjust Last Operation does not
        count: Blender does not keep a repeated operator, so it cannot run modally."""
        options = self.options
        is_repeated = options.is_repeat or options.is_repeat_last
        return not bpy.app.background and options.is_invoke and not is_repeated

    @classmethod
    def can_start(cls: Any) -> bool:
        """For `poll`: whether no other long operator runs; the greyed-out button names it."""
        return can_start(cls)

    @reporting
    def execute(self: Any, context: bpy.types.Context) -> set[str]:
        global _running
        steps = self.steps(context)
        if not self.is_interactive():
            with wait_cursor(context):
                _run_blocking(steps)
            return {"FINISHED"}
        with wait_cursor(context):
            try:
                first = next(steps)
            except StopIteration:
                self.on_finished(context)
                return {"FINISHED"}
        _running = _Running(self, steps, context.window)
        _running.show_progress(first)
        return {"RUNNING_MODAL"}

    def modal(self: Any, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Block all other events: edits in between would affect only part of the work."""
        if _running is None:
            undone = f"{self.bl_label} was cancelled by Undo or Redo; {self.state_after_cancel}"
            report(self, "WARNING", undone)
            return {"CANCELLED"}
        if event.type == "ESC" and event.value == "PRESS" and _is_cancellable():
            cancel_running()
            report(self, "INFO", f"{self.bl_label} was cancelled; {self.state_after_cancel}")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        result = {"CANCELLED"}
        try:
            result = self._run_slice(context)
        finally:
            if result != {"RUNNING_MODAL"}:
                cancel_running()
        if result == {"FINISHED"}:
            self.on_finished(context)
        return result

    @reporting
    def _run_slice(self, _context: bpy.types.Context) -> set[str]:
        running, end = _running, time.perf_counter() + _SLICE_SECONDS
        assert running is not None
        try:
            step = next(running.steps)
            while not step.is_idle and time.perf_counter() < end:
                step = next(running.steps)
        except StopIteration:
            return {"FINISHED"}
        running.show_progress(step)
        return {"RUNNING_MODAL"}

    def cancel(self, _context: bpy.types.Context) -> None:
        """Called when Blender ends the operator: a file is loaded or its window closed."""
        cancel_running()


class _Running:
    """The work that runs in the window.

    Kept outside of the operator, as Blender does not notify an operator of being disabled.

    progress: as last reported.
    """

    def __init__(self, operator: Any, steps: Steps[None], window: bpy.types.Window) -> None:
        self.operator, self.label, self.steps = type(operator), operator.bl_label, steps
        self.progress, self._has_cursor = Progress(""), False
        manager = bpy.context.window_manager
        self._timer = manager.event_timer_add(_PAUSE_SECONDS, window=window)
        manager.modal_handler_add(operator)
        event_handlers.append(_HANDLERS)

    def show_progress(self, progress: Progress) -> None:
        """Show the progress in the status bar, at the mouse pointer and in panels."""
        if progress == self.progress:
            return
        self.progress = progress
        manager = bpy.context.window_manager
        if progress.fraction is not None:
            if not self._has_cursor:
                manager.progress_begin(0.0, 1.0)
                self._has_cursor = True
            manager.progress_update(progress.fraction)
        show_status(status(self.label, progress))
        redraw_panels()

    def end(self) -> None:
        """Remove the timer, the handlers and the text."""
        event_handlers.remove(_HANDLERS)
        manager = bpy.context.window_manager  # a new one after a file was loaded
        manager.event_timer_remove(self._timer)
        if self._has_cursor:
            manager.progress_end()
        show_status(None)
        redraw_panels()


def status(label: str, progress: Progress) -> str:
    """The text in the status bar."""
    return f"{label}: {progress.text}" + ("" if progress.is_committed else ". Esc: cancel")


@persistent  # removed when the work ends, which may be after a file is loaded
def _on_undo(*_: Any) -> None:
    """Keys cannot undo during the work, but scripts can; its references would then be invalid."""
    cancel_running()


_HANDLERS = (
    (bpy.app.handlers.undo_pre, _on_undo),
    (bpy.app.handlers.redo_pre, _on_undo),
)


_running: _Running | None = None


def running_label() -> str:
    """The label of the operator that runs in the window; "" if there is none."""
    return "" if _running is None else _running.label


def can_start(operator: Any) -> bool:
    """For the `poll` of any operator, see `LongWork.can_start`."""
    if _running is None:
        return True
    esc = "; Esc cancels it" if _is_cancellable() else ""
    operator.poll_message_set(f"{_running.label} is still running{esc}")
    return False


def _is_cancellable() -> bool:
    return _running is not None and not _running.progress.is_committed


def draw_esc(row: bpy.types.UILayout) -> None:
    """An icon of the key that cancels the work; a blank once it is too late."""
    row.label(text="", icon="EVENT_ESC" if _is_cancellable() else "BLANK1")


def draw_progress(layout: bpy.types.UILayout, operator: type[LongWork]) -> bool:
    """Draw the progress instead of the operator's button. Returns False if it does not run."""
    if _running is None or _running.operator is not operator:
        return False
    text, fraction, *_ = _running.progress
    row = layout.row(align=True)
    if fraction is None:
        row.label(text=text, icon="SORTTIME")
    else:
        row.progress(factor=fraction, text=text)
    draw_esc(row)
    return True


def counted(steps: Generator[int], total: int, unit: str) -> Steps[None]:
    """Work that yields how many units are done. unit: such as "frames"."""
    with closing(steps):
        for done in steps:
            yield Progress(f"{done:,} of {total:,} {unit}", done / total)


def as_progress[Result](steps: Generator[float, None, Result]) -> Steps[Result]:
    """Work that yields the fraction that is done."""
    with closing(steps):
        while True:
            try:
                fraction = next(steps)
            except StopIteration as end:
                result: Result = end.value
                return result
            yield Progress(f"{fraction:.0%}", fraction)


def threaded[Result](work: ThreadWork[Result]) -> Steps[Result]:
    """Work in a thread, which reports its progress; closing the generator cancels the work."""
    try:
        while not work.run_main_thread_steps():
            is_idle = not work.wants_main_thread
            yield Progress(work.stage, is_idle=is_idle, is_committed=work.is_committed)
        return work.result()
    finally:
        work.cancel()


def steps_of_parts[Result](parts: Parts[Result]) -> Steps[Result]:
    """Work whose parts run in threads; closing the generator closes the work and cancels the
    running part."""
    with closing(parts):
        step = partial(next, parts)
        while True:
            try:
                part = step()
            except StopIteration as end:
                result: Result = end.value
                return result
            yield Progress(part.title)  # at least once, even for a short part
            try:
                part_result = yield from threaded(_thread_work_of(part))
            except Exception as error:  # raised where the work waits for the part
                step = partial(parts.throw, error)
            else:
                step = partial(parts.send, part_result)


def _thread_work_of(part: Part) -> ThreadWork[Any]:
    work = ThreadWork(lambda _: part.work(), "Hairloom part")
    work.stage = part.title
    return work


def cancel_running() -> None:
    """Cancel the running work, if any: no timer, no text and no half-written file remains."""
    global _running
    if _running is None:
        return
    cancelled, _running = _running, None
    try:
        cancelled.steps.close()
    finally:
        cancelled.end()


def _run_blocking(steps: Steps[None]) -> None:
    for step in steps:
        if step.is_idle:
            time.sleep(_PAUSE_SECONDS)
