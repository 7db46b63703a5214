"""All previewed grooms: begun and ended by the artist, kept in step with what Blender changes.

Reactions to Blender's events only read; they write nothing into bpy.data. The one exception is
no data of the artist's: the evaluated copy of a previewed object is shown as a box, so that
Blender's own strands do not stand among ours. It is neither saved nor undone nor rendered, and
Blender makes a fresh copy when it evaluates the object again.
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from functools import partial

import bpy

from ..errors import HairloomError
from . import overlay
from .objects import spaces_without
from .overlay import Drawing
from .session import Session

#: Edits come in bursts, as brush strokes do: read again when this long [s] nothing came.
SETTLING_TIME = 0.2

_sessions: dict[int, Session] = {}
_notice = ""
_last_edit = 0.0


def start(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Session:
    """Preview this groom.

    Raises:
        HairloomError: it cannot be previewed; says why and what to do.
    """
    global _notice
    session = Session(hair, depsgraph)
    _notice = ""
    overlay.retry()
    _sessions[session.uid] = session
    _publish(session, depsgraph)
    _refresh_views()
    overlay.redraw_panels()
    return session


def stop(session: Session) -> None:
    """Preview this groom no longer."""
    _sessions.pop(session.uid, None)
    overlay.drop(session.uid)
    overlay.redraw_panels()
    hair = session.hair.handle.find()
    if hair is not None:
        _show_originals(hair, bpy.context.view_layer.depsgraph, show=True)
        _refresh_views()


def stop_all() -> None:
    for session in sessions():
        stop(session)


def forget_all() -> None:
    """As `stop_all` when the objects are about to go: touches none of them."""
    for session in sessions():
        _sessions.pop(session.uid, None)
        overlay.drop(session.uid)


def sessions() -> tuple[Session, ...]:
    return tuple(_sessions.values())


def session_of(hair: bpy.types.Object | None) -> Session | None:
    return None if hair is None else _sessions.get(hair.session_uid)


def notice() -> str:
    """Why a preview ended by itself, or why drawing failed; empty while all is well."""
    return overlay.failure() or _notice


def is_playing() -> bool:
    return any(session.is_playing for session in sessions())


def play(depsgraph: bpy.types.Depsgraph) -> list[str]:
    """Make all previewed grooms ready to be simulated; returns warnings."""
    warnings = []
    for session in sessions():
        try:
            session.play(depsgraph)
        except HairloomError as error:
            warnings.append(str(error))
    return warnings


def advance(depsgraph: bpy.types.Depsgraph, duration: float) -> None:
    """Simulate the time [s] that has passed since the last call."""
    for session in sessions():
        if session.is_playing:
            _attempt(session, depsgraph, lambda s: s.advance(depsgraph, duration))


def rest(depsgraph: bpy.types.Depsgraph, *, keep_playing: bool) -> None:
    """All hair back into its style."""
    back = Session.rest if keep_playing else Session.stop
    for session in sessions():
        _attempt(session, depsgraph, lambda s: back(s, depsgraph))


def settings_changed(owner: bpy.types.ID) -> None:
    """A slider was moved: what can act at once does."""
    depsgraph = bpy.context.view_layer.depsgraph
    for session in sessions():
        hair = session.hair.handle.find()
        if hair is not None and owner in (hair, hair.data):
            _attempt(session, depsgraph, Session.take_settings)
            if session.is_stale:
                _read_again_soon()


def display_changed(owner: bpy.types.ID) -> None:
    """Whether Blender's own strands are to be seen has been changed."""
    settings_changed(owner)
    _refresh_views()


def updated(depsgraph: bpy.types.Depsgraph) -> None:
    """Blender has evaluated the scene: follow what moved, read again what was edited."""
    moved, edited, is_lit_anew = _changes(depsgraph)
    for session in sessions():
        if _is_edited(session, edited):
            session.is_stale = True
            _read_again_soon()
        follows = not session.is_playing and _follows(session, moved)
        update = partial(_update, depsgraph=depsgraph, follows=follows, is_lit_anew=is_lit_anew)
        _attempt(session, depsgraph, update)


def frame_changed(depsgraph: bpy.types.Depsgraph) -> None:
    """Blender's own animation went on: follow it, and take over animated settings and lights.

    Curves that are animated themselves are not read again at every frame.
    """
    _, _, is_lit_anew = _changes(depsgraph)
    for session in sessions():
        _attempt(session, depsgraph, Session.take_settings)
        follows = not session.is_playing
        update = partial(_update, depsgraph=depsgraph, follows=follows, is_lit_anew=is_lit_anew)
        _attempt(session, depsgraph, update)


def undone() -> None:
    """Anything may be different after undo and redo: look again, once Blender has settled."""
    for session in sessions():
        session.is_stale = True
    if _sessions:
        _read_again_soon()


def _update(
    session: Session, depsgraph: bpy.types.Depsgraph, follows: bool, is_lit_anew: bool
) -> None:
    if is_lit_anew:
        session.light(depsgraph)
    if follows:
        session.rest(depsgraph)


def _changes(depsgraph: bpy.types.Depsgraph) -> tuple[set[int], set[int], bool]:
    """Session numbers of what has moved or changed shape, of changed shapes; if lights changed."""
    moved, edited, is_lit_anew = set(), set(), False
    for update in depsgraph.updates:
        changed = update.id.original  # the evaluated copy has no session number
        if update.is_updated_geometry or update.is_updated_transform:
            moved.add(changed.session_uid)
        if update.is_updated_geometry:
            edited.add(changed.session_uid)
        is_light = isinstance(changed, bpy.types.Object) and changed.type == "LIGHT"
        is_lit_anew |= is_light or isinstance(changed, bpy.types.Light | bpy.types.World)
    return moved, edited, is_lit_anew


def _is_edited(session: Session, edited: set[int]) -> bool:
    """Whether the curves changed by themselves, not because modifiers carry them with the head."""
    if session.uid not in edited:
        return False
    hair = session.hair.handle.find()
    is_carried = session.head is not None and session.head.handle.uid in edited
    return hair is not None and not (is_carried and len(hair.modifiers))


def _follows(session: Session, moved: set[int]) -> bool:
    bodies = (session.hair, session.head)
    return any(body is not None and body.handle.uid in moved for body in bodies)


def _attempt(
    session: Session, depsgraph: bpy.types.Depsgraph, action: Callable[[Session], object]
) -> None:
    """Do it and show the result; a groom that cannot go on is stopped, with a notice.

    A defect of ours ends it as well, told in full but once, not at every event from now on.
    """
    global _notice
    try:
        action(session)
        _publish(session, depsgraph)
    except Exception as error:
        if not isinstance(error, HairloomError):
            traceback.print_exc()
        _notice = f"Preview of {session.name} ended. {error}"
        print(f"Hairloom: {_notice}")
        stop(session)


def _publish(session: Session, depsgraph: bpy.types.Depsgraph) -> None:
    hair = session.hair.found()
    overlay.show(session.uid, Drawing(session.snapshot, hair.visible_get(), spaces_without(hair)))
    is_replaced = hair.mode == "OBJECT" and not overlay.failure()
    hides = is_replaced and hair.hairloom.hide_original
    _show_originals(hair, depsgraph, show=not hides)


def _show_originals(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, *, show: bool) -> None:
    """Solid view leaves out what is shown as its bounds, EEVEE what no camera can see."""
    evaluated = hair.evaluated_get(depsgraph)
    if not evaluated.is_evaluated:
        return
    display, is_seen = (hair.display_type, hair.visible_camera) if show else ("BOUNDS", False)
    if evaluated.display_type != display:
        evaluated.display_type = display
    if evaluated.visible_camera != is_seen:
        evaluated.visible_camera = is_seen


def _refresh_views() -> None:
    """Solid view shows the samples it has collected until it hears of an update."""
    bpy.context.scene.update_tag()


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
    for session in sessions():
        if session.is_stale and session.has_another_head():
            _attempt(session, depsgraph, lambda s: start(s.hair.found(), depsgraph))
        elif session.is_stale:
            _attempt(session, depsgraph, lambda s: s.read_again(depsgraph))
    overlay.redraw_panels()


def clear() -> None:
    """Leave nothing behind: no preview, no timer, no notice."""
    global _notice
    stop_all()
    if bpy.app.timers.is_registered(_read_again):
        bpy.app.timers.unregister(_read_again)
    _notice = ""
