"""Reports of operators, and the wait cursor."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import bpy

from ..blender.base.gpu_context import converted_gpu_errors
from ..blender.base.outcome import Outcome, dropped_phrase, report
from ..errors import HairloomError


def reporting(execute: Callable[..., set[str]]) -> Callable[..., set[str]]:
    """Decorator of an operator's `execute`: bad input becomes an error report, not a traceback."""

    @functools.wraps(execute)
    def wrapper(self: Any, context: bpy.types.Context) -> set[str]:
        try:
            with converted_gpu_errors():
                return execute(self, context)
        except HairloomError as error:
            report(self, "ERROR", error)
            return {"CANCELLED"}

    return wrapper


def report_outcome(operator: bpy.types.Operator, outcome: Outcome) -> None:
    """Report the warnings, then the result with what was dropped."""
    for warning in outcome.warnings:
        report(operator, "WARNING", warning)
    parts = filter(None, (outcome.result, dropped_phrase(outcome.dropped)))
    report(operator, "WARNING" if outcome.dropped else "INFO", "; ".join(parts))


@contextmanager
def wait_cursor(context: bpy.types.Context) -> Iterator[None]:
    """Show the wait cursor, for work that takes a second or more."""
    window = context.window
    if window is None or bpy.app.background:
        yield
        return
    window.cursor_modal_set("WAIT")
    try:
        yield
    finally:
        window.cursor_modal_restore()
