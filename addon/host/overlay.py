"""Strands in the 3D viewport, and their counts: drawn for all grooms, from snapshots only.

Drawing never reads a data-block: all it asks Blender for is which view is being drawn.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import bpy
import gpu
import numpy as np

from ..render.camera import Camera
from ..render.snapshot import Snapshot
from ..render.strand_pass import StrandPass
from ..shading.lights import three_point_lights
from .overlay_text import counts_line, write_lines
from .shown import with_all_strands


@dataclass(frozen=True)
class Drawing:
    """One groom as it is now.

    hidden_in: addresses of the 3D views that do not show it.
    bare_in: of those that do not show its head, which hides nothing there.
    counts_of: the name under which its counts are written; empty: they are not.
    """

    snapshot: Snapshot
    is_visible: bool = True
    hidden_in: frozenset[int] = frozenset()
    bare_in: frozenset[int] = frozenset()
    guide_count: int = 0
    counts_of: str = ""


_drawings: dict[int, Drawing] = {}
_passes: dict[int, StrandPass] = {}
_handles: tuple[Any, ...] = ()
_failure = ""


def show(uid: int, drawing: Drawing) -> None:
    """Draw this groom from now on, in place of what was drawn for it before."""
    global _handles
    _drawings[uid] = drawing
    if not _handles and not _failure and not bpy.app.background:
        add = bpy.types.SpaceView3D.draw_handler_add
        _handles = tuple(
            add(_draw, (draw,), "WINDOW", kind)
            for draw, kind in ((_draw_strands, "POST_VIEW"), (_draw_counts, "POST_PIXEL"))
        )
    redraw()


def drop(uid: int) -> None:
    """No longer draw this groom; with the last one the draw handlers go."""
    _drawings.pop(uid, None)
    _passes.pop(uid, None)
    if not _drawings:
        _remove_handlers()
    redraw()


def drawing_of(uid: int) -> Drawing | None:
    return _drawings.get(uid)


def failure() -> str:
    """Why the overlay has stopped drawing; empty while all is well."""
    return _failure


def retry() -> None:
    """Draw again after a failure."""
    global _failure
    if _failure:
        _failure = ""
        bpy.context.workspace.status_text_set(None)


def redraw() -> None:
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


def _draw(what: Callable[[Any], None]) -> None:
    """Called by Blender for each 3D view; an error is told once, not at every redraw."""
    if _failure:
        return
    try:
        what(bpy.context)
    except Exception as error:
        _fail(error)


def _draw_strands(context: Any) -> None:
    space, view = context.space_data, context.region_data
    camera = Camera(np.array(view.view_matrix), np.array(view.window_matrix))
    address, light = space.as_pointer(), _lighting(space, camera)
    _, _, width, height = gpu.state.viewport_get()
    for uid, drawing in _shown_in(space):
        snapshot = drawing.snapshot
        if is_seen_through(space.shading) or address in drawing.bare_in:
            snapshot = with_all_strands(snapshot)
        strand_pass = _passes.setdefault(uid, StrandPass())
        strand_pass.draw(light(snapshot), camera, width, height, output="viewport")


def _draw_counts(context: Any) -> None:
    """What was drawn of each groom just before, into the same view."""
    if not context.space_data.overlay.show_overlays:
        return
    lines = [
        counts_line(
            drawing.counts_of,
            drawing.guide_count,
            drawing.snapshot.strand_count,
            strand_pass.statistics,
        )
        for uid, drawing in _shown_in(context.space_data)
        if drawing.counts_of and (strand_pass := _passes.get(uid)) is not None
    ]
    write_lines(context, lines)


def _shown_in(space: Any) -> list[tuple[int, Drawing]]:
    address = space.as_pointer()
    return [
        (uid, drawing)
        for uid, drawing in _drawings.items()
        if drawing.is_visible and address not in drawing.hidden_in
    ]


def is_seen_through(shading: Any) -> bool:
    """Whether a view shows what is behind heads."""
    return shading.type == "WIREFRAME" or (shading.type == "SOLID" and shading.show_xray)


def _lighting(space: Any, camera: Camera) -> Callable[[Snapshot], Snapshot]:
    """The scene's lights where Blender itself uses them; elsewhere, as there, a studio's."""
    shading = space.shading
    uses_scene = {
        "RENDERED": shading.use_scene_lights_render,
        "MATERIAL": shading.use_scene_lights,
    }
    studio = three_point_lights(camera.view)

    def lit(snapshot: Snapshot) -> Snapshot:
        if uses_scene.get(shading.type, False) and snapshot.lights:
            return snapshot
        return replace(snapshot, lights=studio, ambient=Snapshot.ambient)

    return lit


def _fail(error: Exception) -> None:
    global _failure
    _failure = f"Hairloom cannot draw here: {error}"
    print(_failure)
    traceback.print_exc()
    bpy.app.timers.register(_tell_failure, first_interval=0.0)


def _tell_failure() -> None:
    """Outside of drawing, where the handler may be removed and the window be told."""
    _remove_handlers()
    bpy.context.workspace.status_text_set(_failure.splitlines()[0])
    bpy.context.scene.update_tag()  # Blender's own strands are to be seen again
    redraw_panels()


def _remove_handlers() -> None:
    global _handles
    for handle in _handles:
        bpy.types.SpaceView3D.draw_handler_remove(handle, "WINDOW")
    _handles = ()
