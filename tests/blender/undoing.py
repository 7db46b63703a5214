"""Undo as in a window: with what its timers do later."""

from __future__ import annotations

import bpy

from hairloom.addon.blender.preview import scene_events


def undo() -> None:
    """Undo a step, and let the timers run that this starts."""
    bpy.ops.ed.undo()
    _run_timers()


def redo() -> None:
    """Redo a step, and let the timers run that this starts."""
    bpy.ops.ed.redo()
    _run_timers()


def _run_timers() -> None:
    if bpy.app.timers.is_registered(scene_events.follow_undo):
        scene_events.follow_undo()
    scene_events.catch_up(bpy.context.evaluated_depsgraph_get())
