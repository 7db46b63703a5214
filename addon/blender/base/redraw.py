"""Redraws of views, panels and the status bar, and calls delayed until events pause."""

from __future__ import annotations

import time
from collections.abc import Callable

import bpy

#: Panels with times and counts are redrawn at this interval [s] while hair moves.
_REFRESH_INTERVAL = 0.5

_last_refresh = 0.0


def redraw_views() -> None:
    """Tag all 3D views for a redraw."""
    _redraw({("VIEW_3D", "WINDOW")})


def redraw_view(address: int) -> bool:
    """Tag one 3D view for a redraw.

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
    """Tag all regions that have panels of ours for a redraw."""
    _redraw({("VIEW_3D", "UI"), ("PROPERTIES", "WINDOW")})


def redraw_file_browsers() -> None:
    """Tag the options in all file browsers for a redraw."""
    _redraw({("FILE_BROWSER", "TOOL_PROPS")})


def refresh_panels() -> None:
    """As `redraw_panels`, but at most every half second."""
    global _last_refresh
    now = time.monotonic()
    if now - _last_refresh >= _REFRESH_INTERVAL:
        _last_refresh = now
        redraw_panels()


def show_status(text: str | None) -> None:
    """Write into the status bars of all windows, whatever workspace they show now or later; None:
    restore Blender's own text.

    `status_text_set` writes to the workspace of the context, not to the one that it is called on,
    and an overridden window brings its own workspace. Hence two overrides, the workspace last.
    """
    override = bpy.context.temp_override
    for window in bpy.context.window_manager.windows:
        for workspace in bpy.data.workspaces:
            with override(window=window), override(workspace=workspace):
                workspace.status_text_set(text)


def debounce(callback: Callable[[], None], pause: float) -> None:
    """Call a function once, this long [s] after the last call of `debounce` with it."""
    if bpy.app.timers.is_registered(callback):
        bpy.app.timers.unregister(callback)
    bpy.app.timers.register(callback, first_interval=pause)


def _redraw(places: set[tuple[str, str]]) -> None:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if (area.type, region.type) in places:
                    region.tag_redraw()
