"""Asking Blender to redraw what has changed of ours, now or once all is quiet."""

from __future__ import annotations

import time
from collections.abc import Callable

import bpy

#: Panels that tell times and counts are drawn again this often [s] while hair moves.
_PAUSE = 0.5

_last = 0.0


def redraw_views() -> None:
    """Ask all 3D views to draw themselves again."""
    _redraw({("VIEW_3D", "WINDOW")})


def redraw_view(address: int) -> bool:
    """Ask one 3D view to draw itself again.

    Args:
        address: of its region's data.

    Returns:
        Whether a window shows it.
    """
    areas = [area for window in bpy.context.window_manager.windows for area in window.screen.areas]
    for region in (each for area in areas if area.type == "VIEW_3D" for each in area.regions):
        is_view = region.type == "WINDOW" and region.data is not None
        if is_view and region.data.as_pointer() == address:
            region.tag_redraw()
            return True
    return False


def redraw_panels() -> None:
    """Ask all places that have a panel of ours to draw themselves again."""
    _redraw({("VIEW_3D", "UI"), ("PROPERTIES", "WINDOW")})


def refresh_panels() -> None:
    """As `redraw_panels`, but not at every frame."""
    global _last
    now = time.monotonic()
    if now - _last >= _PAUSE:
        _last = now
        redraw_panels()


def show_status(text: str | None) -> None:
    """Write it into the status bar, whatever workspace its window shows now or later; None: what
    Blender itself says there.

    Blender writes into the workspace of its context, not into the one that it is asked for; and
    where a window is overridden, it takes that one's.
    """
    override = bpy.context.temp_override
    for window in bpy.context.window_manager.windows:
        for workspace in bpy.data.workspaces:
            with override(window=window), override(workspace=workspace):
                workspace.status_text_set(text)


def soon(timer: Callable[[], None], pause: float) -> None:
    """Once, this long [s] after the last call."""
    if bpy.app.timers.is_registered(timer):
        bpy.app.timers.unregister(timer)
    bpy.app.timers.register(timer, first_interval=pause)


def _redraw(places: set[tuple[str, str]]) -> None:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if (area.type, region.type) in places:
                    region.tag_redraw()
