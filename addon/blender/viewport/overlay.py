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

from ...render.body_shadow import BodyShadow
from ...render.camera import Camera
from ...render.card_pass import CardPass
from ...render.display import Display
from ...render.scene_pass import ONE_AT_A_TIME
from ...render.snapshot import Snapshot
from ...render.strand_pass import Statistics, StrandPass
from ...shading.lights import Light, three_point_lights
from ..base.lines import Lines, draw_lines
from ..base.objects import LayerKey, layer_key
from ..base.redraw import redraw_panels, redraw_views
from ..scene.lights import uses_scene_light
from ..sessions.measures import forget, frame_line, measured
from ..sessions.shown import with_all_strands
from . import layers_shown, view_transform
from .overlay_text import card_counts_line, counts_line, write_lines


@dataclass(frozen=True)
class Drawing:
    """One groom as it is now.

    is_made: whether there is hair yet.
    seen_in: the view layers that show it; None is all.
    hidden_in: addresses of the 3D views that do not show it.
    bare_in: of those that do not show its head, which hides nothing there.
    card_counts: cards, triangles and vertices where it is shown as cards.
    counts_of: the name under which its counts are written; empty: they are not.
    note: what else is written, with overlays or without.
    aids: lines of what acts on it.
    """

    snapshot: Snapshot
    is_visible: bool = True
    is_made: bool = True
    seen_in: frozenset[LayerKey] | None = None
    hidden_in: frozenset[int] = frozenset()
    bare_in: frozenset[int] = frozenset()
    guide_count: int = 0
    card_counts: tuple[int, ...] = ()
    counts_of: str = ""
    note: str = ""
    aids: tuple[Lines, ...] = ()


#: by which Blender knows our render engine
ENGINE = "HAIRLOOM"
_drawings: dict[int, Drawing] = {}
_passes: dict[int, StrandPass] = {}
_card_passes: dict[int, CardPass] = {}
_shadows: dict[int, BodyShadow] = {}
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
            for draw, kind in (
                (_draw_strands, "POST_VIEW"),
                (_draw_aids, "POST_VIEW"),
                (_draw_counts, "POST_PIXEL"),
            )
        )
        view_transform.prepare()
    redraw_views()


def hide(uid: int) -> None:
    """Not to be seen until it is shown again."""
    drawing = _drawings.get(uid)
    if drawing is not None and drawing.is_visible:
        show(uid, replace(drawing, is_visible=False))


def drop(uid: int) -> None:
    """No longer draw this groom; with the last one the draw handlers go."""
    _drawings.pop(uid, None)
    _passes.pop(uid, None)
    _card_passes.pop(uid, None)
    _shadows.pop(uid, None)
    forget(uid)
    if not _drawings:
        _remove_handlers()
    redraw_views()


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


def _draw(what: Callable[[Any], None]) -> None:
    """Called by Blender for each 3D view; an error is told once, not at every redraw."""
    if _failure or is_rendered_by_us(bpy.context):
        return
    try:
        what(bpy.context)
    except Exception as error:
        _fail(error)


def _draw_strands(context: Any) -> None:
    layers_shown.look()
    space, view = context.space_data, context.region_data
    camera = Camera(np.array(view.view_matrix), np.array(view.window_matrix))
    address, studio = space.as_pointer(), three_point_lights(camera.view)
    display = view_transform.display_of(space.shading, context.scene)
    for uid, drawing in shown_in(context):
        snapshot = drawing.snapshot
        if is_seen_through(space.shading) or address in drawing.bare_in:
            snapshot = with_all_strands(snapshot)
        snapshot = lit(snapshot, space.shading, studio)
        shades_body = _shades_body(snapshot, space) and address not in drawing.bare_in
        # colours that stand for numbers are no light
        shown_by = display if snapshot.debug_view == "none" else None
        with ONE_AT_A_TIME, measured(uid, "drawing"):
            _draw_groom(uid, snapshot, camera, shown_by, shades_body=shades_body)


def _draw_groom(
    uid: int, snapshot: Snapshot, camera: Camera, display: Display | None, *, shades_body: bool
) -> None:
    """Into the view that is being drawn."""
    _, _, width, height = gpu.state.viewport_get()
    strand_pass = _passes.setdefault(uid, StrandPass())
    card_pass = _card_passes.setdefault(uid, CardPass())
    maps = None
    if snapshot.cards is not None:
        maps = card_pass.opacity(snapshot)
    if shades_body:
        maps = maps or strand_pass.opacity(snapshot)
        if maps is not None:
            shadow = _shadows.setdefault(uid, BodyShadow())
            shadow.draw(snapshot, maps, camera, width, height, display=display)
    strand_pass.draw(snapshot, camera, width, height, output="viewport", display=display)
    card_pass.draw(
        snapshot,
        camera,
        width,
        height,
        opacity=maps,
        output="viewport",
        display=display,
    )


def _draw_aids(context: Any) -> None:
    """Through all that is in front of them, as Blender's own gizmos are."""
    if context.space_data.overlay.show_overlays:
        for _, drawing in shown_in(context):
            for lines in drawing.aids:
                draw_lines(lines.points, lines.color)


def _draw_counts(context: Any) -> None:
    """What was drawn of each groom just before, into the same view."""
    notes = [drawing.note for _, drawing in shown_in(context) if drawing.note]
    if not context.space_data.overlay.show_overlays:
        write_lines(context, notes)
        return
    lines = [
        "   ".join(filter(None, (_counts_of(drawing, strand_pass), frame_line(uid))))
        for uid, drawing in shown_in(context)
        if drawing.counts_of and (strand_pass := _passes.get(uid)) is not None
    ]
    write_lines(context, lines + notes)


def _counts_of(drawing: Drawing, strand_pass: StrandPass) -> str:
    if drawing.card_counts:
        return card_counts_line(drawing.counts_of, drawing.guide_count, drawing.card_counts)
    strand_count, drawn_now = drawing.snapshot.strand_count, strand_pass.statistics
    return counts_line(drawing.counts_of, drawing.guide_count, strand_count, drawn_now)


def statistics_of(uid: int) -> Statistics:
    """What was drawn of a groom in the last view; nothing before the first."""
    strand_pass = _passes.get(uid)
    return Statistics() if strand_pass is None else strand_pass.statistics


def drawn() -> frozenset[int]:
    """Session numbers of the grooms that are drawn here, not by Blender."""
    return frozenset(uid for uid, drawing in _drawings.items() if drawing.is_made)


def expected() -> frozenset[int]:
    """Session numbers of the grooms that are drawn here as soon as they are made."""
    return frozenset(_drawings) - drawn()


def is_rendered_by_us(context: Any) -> bool:
    """Whether our render engine draws this 3D view, and the hair with it."""
    is_ours = context.scene.render.engine == ENGINE
    return is_ours and context.space_data.shading.type == "RENDERED"


def shown_in(context: Any) -> list[tuple[int, Drawing]]:
    """The grooms that the 3D view of this context shows."""
    address = context.space_data.as_pointer()
    layer = layer_key(context.scene, context.view_layer)
    return [
        (uid, drawing)
        for uid, drawing in _drawings.items()
        if drawing.is_visible
        and address not in drawing.hidden_in
        and (drawing.seen_in is None or layer in drawing.seen_in)
    ]


def is_seen_through(shading: Any) -> bool:
    """Whether a view shows what is behind heads."""
    return shading.type == "WIREFRAME" or (shading.type == "SOLID" and shading.show_xray)


def _shades_body(snapshot: Snapshot, space: Any) -> bool:
    """Whether hair's shadow lies on the head, which Blender has drawn in the same light."""
    uses_lights, _ = uses_scene_light(space.shading)
    is_shown = bool(snapshot.casters) and not is_seen_through(space.shading)
    return snapshot.volume.on_body and uses_lights and bool(snapshot.lights) and is_shown


def lit(snapshot: Snapshot, shading: Any, studio: tuple[Light, ...]) -> Snapshot:
    """By the scene's lights and world where Blender itself uses them; elsewhere, as there, by a
    studio's. A scene that has no light and a black world has the studio's too, not black hair.
    """
    uses_lights, uses_world = uses_scene_light(shading)
    lights = snapshot.lights if uses_lights else ()
    ambient = snapshot.ambient if uses_world else Snapshot.ambient
    if not lights and not (uses_world and any(ambient)):
        return replace(snapshot, lights=studio, ambient=Snapshot.ambient)
    return replace(snapshot, lights=lights, ambient=ambient)


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
    layers_shown.forget()
