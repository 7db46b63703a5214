"""Strands in the 3D viewport: one draw handler for all grooms, drawing from snapshots only.

It never reads a data-block: all it asks Blender for is which view is being drawn.
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


@dataclass(frozen=True)
class Drawing:
    """One groom as it is now.

    hidden_in: addresses of the 3D views that do not show it.
    """

    snapshot: Snapshot
    is_visible: bool = True
    hidden_in: frozenset[int] = frozenset()


_drawings: dict[int, Drawing] = {}
_passes: dict[int, StrandPass] = {}
_handle: Any = None
_failure = ""


def show(uid: int, drawing: Drawing) -> None:
    """Draw this groom from now on, in place of what was drawn for it before."""
    global _handle
    _drawings[uid] = drawing
    if _handle is None and not _failure and not bpy.app.background:
        _handle = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")
    redraw()


def drop(uid: int) -> None:
    """No longer draw this groom; with the last one the draw handler goes."""
    _drawings.pop(uid, None)
    _passes.pop(uid, None)
    if not _drawings:
        _remove_handler()
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


def _draw() -> None:
    """Called by Blender for each 3D view; an error is told once, not at every redraw."""
    if _failure:
        return
    try:
        _draw_all(bpy.context.space_data, bpy.context.region, bpy.context.region_data)
    except Exception as error:
        _fail(error)


def _draw_all(space: Any, region: Any, view: Any) -> None:
    camera = Camera(np.array(view.view_matrix), np.array(view.window_matrix))
    address, light = space.as_pointer(), _lighting(space, camera)
    _, _, width, height = gpu.state.viewport_get()
    for uid, drawing in _drawings.items():
        if drawing.is_visible and address not in drawing.hidden_in:
            strand_pass = _passes.setdefault(uid, StrandPass())
            strand_pass.draw(light(drawing.snapshot), camera, width, height, output="viewport")


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
    _remove_handler()
    bpy.context.workspace.status_text_set(_failure.splitlines()[0])
    bpy.context.scene.update_tag()  # Blender's own strands are to be seen again
    redraw_panels()


def _remove_handler() -> None:
    global _handle
    if _handle is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_handle, "WINDOW")
        _handle = None
