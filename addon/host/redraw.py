"""Asking Blender to draw anew what of ours has changed."""

from __future__ import annotations

import bpy


def redraw_views() -> None:
    """Ask all 3D views to draw themselves again."""
    _redraw({("VIEW_3D", "WINDOW")})


def redraw_panels() -> None:
    """Ask all places that have a panel of ours to draw themselves again."""
    _redraw({("VIEW_3D", "UI"), ("PROPERTIES", "WINDOW")})


def _redraw(places: set[tuple[str, str]]) -> None:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if (area.type, region.type) in places:
                    region.tag_redraw()
