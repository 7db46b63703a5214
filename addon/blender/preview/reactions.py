"""What follows from Blender's events for all previewed grooms and fins.

Reactions only read; they write nothing into bpy.data. There are two exceptions. The evaluated copy
of a previewed object is shown as a box, so that Blender's own strands do not stand among ours: that
is no data of the artist's, neither saved nor undone nor rendered, and Blender makes a fresh copy
when it evaluates the object again. And a fin shows itself by an attribute of its own mesh.
"""

from __future__ import annotations

import time
from functools import partial

import bpy

from ..bakes import playback
from ..bakes.simulated import Simulated
from ..base import latest_job
from ..base.originals import refresh_views
from ..base.redraw import redraw_panels
from ..sessions.session import Session
from ..viewport import view_transform
from . import live, timeline
from .changes import changes, is_among, is_edited, is_shaded_anew, is_weighted_anew

#: Edits come in bursts, as brush strokes do: read again when this long [s] nothing came.
SETTLING_TIME = 0.2

#: Shading is drawn by quick tables while a slider moves, by full ones when it rests this long [s].
REFINING_TIME = 0.3

_last_edit = 0.0
#: session numbers of the hair whose cards are to be shaded again once edits have settled
_shaded_anew: set[int] = set()


def settings_changed(owner: bpy.types.ID) -> None:
    """A slider was moved: what can act at once does."""
    depsgraph = bpy.context.view_layer.depsgraph
    for session in live.sessions():
        hair = session.hair.handle.find()
        if hair is not None and owner in (hair, hair.data):
            live.attempt(session, depsgraph, partial(_take_settings, depsgraph=depsgraph))
            if session.is_stale:
                _read_again_soon()
        elif is_shaded_anew(session, {owner.session_uid}, depsgraph.view_layer):
            _shade_again_soon(session)


def _shade_again_soon(session: Session) -> None:
    _shaded_anew.add(session.uid)
    _read_again_soon()


def _take_settings(session: Session, depsgraph: bpy.types.Depsgraph) -> None:
    session.take_settings()
    _refine_soon(session)
    timeline.look_again(session, depsgraph)


def display_changed(owner: bpy.types.ID) -> None:
    """Whether Blender's own strands are to be seen has been changed."""
    settings_changed(owner)
    refresh_views()


def updated(depsgraph: bpy.types.Depsgraph) -> None:
    """Blender has evaluated the scene: follow what moved, read again what was edited."""
    moved, edited, is_lit_anew = changes(depsgraph)
    for session in live.sessions():
        if is_edited(session, edited) or is_weighted_anew(session, edited):
            session.is_stale = True
            _read_again_soon()
        elif session.is_stale and not bpy.app.timers.is_registered(_read_again):
            _read_again_soon()  # its scene is shown again
        if is_shaded_anew(session, moved, depsgraph.view_layer):
            _shade_again_soon(session)
        follows = not live.is_free(session) and is_among(session, moved)
        update = partial(_update, depsgraph=depsgraph, follows=follows, is_lit_anew=is_lit_anew)
        live.attempt(session, depsgraph, update)


def _update(
    session: Session, depsgraph: bpy.types.Depsgraph, follows: bool, is_lit_anew: bool
) -> None:
    if is_lit_anew:
        session.light(depsgraph)
    if follows:
        timeline.keep_or_rest(session, depsgraph)


def frame_changed(depsgraph: bpy.types.Depsgraph) -> None:
    """The scene has gone to a frame: simulate it, show it as it was baked, or follow the body.

    Animated settings and lights are taken over. Curves that are animated themselves are not read
    again at every frame.
    """
    _, _, is_lit_anew = changes(depsgraph)
    for session in live.simulated():
        live.attempt(session, depsgraph, partial(_go, depsgraph=depsgraph, is_lit_anew=is_lit_anew))


def _go(session: Simulated, depsgraph: bpy.types.Depsgraph, is_lit_anew: bool) -> None:
    if isinstance(session, Session):
        session.take_settings()
        _refine_soon(session)
        if is_lit_anew:
            session.light(depsgraph)
    if timeline.follows_playback(session):
        # hair that plays freely swings when the playhead is dragged, and goes over to playback
        if not live.is_free(session) or playback.is_played():
            timeline.follow(session, depsgraph)
    elif not live.is_free(session) and not timeline.show_frame(session, depsgraph):
        session.rest(depsgraph)


def _refine_soon(session: Session) -> None:
    """Once the slider rests; every move puts it off."""
    if not session.is_coarse:
        return
    if bpy.app.timers.is_registered(_refine):
        bpy.app.timers.unregister(_refine)
    bpy.app.timers.register(_refine, first_interval=REFINING_TIME)


def _refine() -> None:
    """A timer of Blender's: the shading of a slider that is no longer moved, at its best."""
    depsgraph = bpy.context.view_layer.depsgraph
    for session in live.sessions():
        if session.is_coarse:
            live.attempt(session, depsgraph, Session.refine)


def undone() -> None:
    """Anything may be different after undo and redo: look again, once Blender has settled.

    Hair whose making was undone is simply gone; nobody needs to be told.
    """
    for groom in live.sessions():
        if groom.hair.handle.find() is None:
            live.stop(groom)
    for session in live.simulated():
        session.is_stale = True
    _shaded_anew.update(each.uid for each in live.sessions())
    if live.simulated():
        _read_again_soon()


def _read_again_soon() -> None:
    global _last_edit
    _last_edit = time.monotonic()
    if not bpy.app.timers.is_registered(_read_again):
        bpy.app.timers.register(_read_again, first_interval=SETTLING_TIME)


def _read_again() -> float | None:
    """A timer of Blender's: reads what was edited once the edits have settled."""
    pause = time.monotonic() - _last_edit
    if pause < SETTLING_TIME:
        return SETTLING_TIME - pause
    catch_up(bpy.context.evaluated_depsgraph_get())
    return None


def catch_up(depsgraph: bpy.types.Depsgraph) -> None:
    """Read what was edited now; hair on another head is begun anew."""
    for session in live.simulated():
        if session.is_stale:
            live.attempt(session, depsgraph, partial(_read, depsgraph=depsgraph))
    for session in live.sessions():
        if session.uid in _shaded_anew:
            live.attempt(session, depsgraph, Session.shade_cards_again)
    _shaded_anew.clear()
    redraw_panels()


def _read(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    if not isinstance(session, Session):
        session.rest(depsgraph)
    elif session.has_another_head():
        live.start(session.hair.found(), depsgraph)
        return
    else:
        session.read_again(depsgraph, blocking=latest_job.is_blocking())
        timeline.check(session, depsgraph)


def clear() -> None:
    """Leave nothing behind: no preview, no timer, no notice."""
    live.end()
    _shaded_anew.clear()
    view_transform.forget()
    latest_job.unwatch_all()
    for timer in (_read_again, _refine):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
