"""The grooms and fins that are previewed: which there are, and what is tried with them.

Hair and cards that are made beside the window's work arrive here.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from functools import partial

import bpy

from ...errors import HairloomError
from ...shading.volume.settings import VolumeSettings
from ..bakes.simulated import Simulated
from ..base.gpu_context import is_interrupted
from ..base.latest_job import ARRIVAL_TIME, unwatch, watch
from ..base.objects import is_elsewhere, is_on_screen
from ..base.originals import all_depsgraphs, refresh_views, show_originals
from ..base.redraw import redraw_panels, redraw_views, refresh_panels
from ..colliders import fields
from ..sessions.session import Session
from ..viewport import overlay
from ..viewport.drawings import drawing_of
from . import timeline

#: What is told of hair that is about to play, and of hair that is not there yet.
WAITING, MAKING = "plays as soon as its collider is made", "is being made"

_sessions: dict[int, Simulated] = {}
#: uids of what is to play once its hair and its colliders are made
_waiting: set[int] = set()
_notice = ""


def put(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    """It is previewed and shown from now on, in place of what was for the same object.

    Raises:
        HairloomError: it cannot be shown.
    """
    set_notice("")
    before = _sessions.get(session.uid)
    if isinstance(before, Session):
        before.forget()
    _sessions[session.uid] = session
    publish(session, depsgraph)
    redraw_panels()


def wait(session: Simulated, *, waits: bool) -> None:
    """It is to play once it can, or is not."""
    (_waiting.add if waits else _waiting.discard)(session.uid)


def waiting() -> tuple[Simulated, ...]:
    """What is to play once it can."""
    return tuple(each for each in simulated() if each.uid in _waiting)


def is_waiting(session: Simulated) -> bool:
    """Whether it is to play freely, and stands at rest until hair and colliders are made."""
    return session.uid in _waiting and not timeline.is_following(session)


def stop(session: Simulated) -> None:
    """Preview it no longer."""
    forget(session)
    redraw_panels()
    if not isinstance(session, Session):
        return
    hair = session.hair.handle.find()
    if hair is not None:
        for depsgraph in all_depsgraphs():
            show_originals(hair, depsgraph, show=True)
        refresh_views()


def stop_all() -> None:
    for session in simulated():
        stop(session)


def forget(session: Simulated) -> None:
    """As `stop` when its object is about to go: touches nothing of it."""
    _sessions.pop(session.uid, None)
    _waiting.discard(session.uid)
    unwatch((session.uid, "lines"))
    if isinstance(session, Session):
        session.forget()
    timeline.forget(session.uid)
    overlay.drop(session.uid)


def sessions() -> tuple[Session, ...]:
    """The grooms that are previewed."""
    return tuple(each for each in _sessions.values() if isinstance(each, Session))


def simulated() -> tuple[Simulated, ...]:
    """The grooms and fins that are previewed."""
    return tuple(_sessions.values())


def session_of(hair: bpy.types.Object | None) -> Session | None:
    found = simulated_of(hair)
    return found if isinstance(found, Session) else None


def simulated_of(obj: bpy.types.Object | None) -> Simulated | None:
    """The groom or fin of this object while it is previewed."""
    return None if obj is None else _sessions.get(obj.session_uid)


def notice() -> str:
    """Why a preview ended by itself, or why drawing failed; empty while all is well."""
    return overlay.failure() or _notice


def set_notice(text: str) -> None:
    """Tell this until the next preview begins."""
    global _notice
    _notice = text


def attempt[S: Simulated](
    session: S,
    depsgraph: bpy.types.Depsgraph,
    action: Callable[[S], object],
    *,
    waits: bool = True,
) -> None:
    """Do it and show the result; a groom that cannot go on is stopped, with a notice.

    A defect of ours ends it as well, told in full but once, not at every event from now on.

    Args:
        waits: where there is no GPU for a moment, do nothing but read it again later.
    """
    if is_elsewhere(session.uid, session.name, depsgraph.scene):
        if is_on_screen(session.uid, session.name):
            return  # in another window: what happens here is nothing to it
        session.is_stale = True  # until its scene is shown again, in which it is evaluated
        overlay.hide(session.uid)
        return
    if waits and is_interrupted():
        session.is_stale = True
        redraw_views()
        refresh_views()  # the update that follows has it read again
        return
    try:
        action(session)
        if _sessions.get(session.uid) is session:  # not begun anew
            publish(session, depsgraph)
    except Exception as error:
        if not isinstance(error, HairloomError):
            traceback.print_exc()
        set_notice(f"Preview of {session.name} ended. {error}")
        print(f"Hairloom: {_notice}")
        stop(session)


def publish(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    """Show a groom as it is; a fin shows itself.

    Raises:
        HairloomError: it is gone.
    """
    if not isinstance(session, Session):
        return
    hair = session.hair.found()
    note = _note(session)
    if note:
        note = f"{hair.name}: {note}"
    overlay.show(session.uid, drawing_of(session, hair, depsgraph, note))
    lacks_lines = session.obstacles is None and "colliders" in hair.hairloom.shown_aids
    if lacks_lines and not fields.are_made():
        watch((session.uid, "lines"), partial(_show_lines, session))
    refresh_panels()
    is_replaced = hair.mode == "OBJECT" and not overlay.failure()
    hides = is_replaced and hair.hairloom.hide_original and session.is_made
    volume = session.settings[VolumeSettings]
    has_own_shadow = volume.on_body and volume.shadows != "none"
    show_originals(hair, depsgraph, show=not hides, has_own_shadow=has_own_shadow)


def _note(session: Session) -> str:
    if not session.is_made:
        return MAKING
    return WAITING if is_waiting(session) else ""


def take_arrivals(session: Session) -> None:
    """Show hair and cards that were made beside the window's work."""
    if session.has_arrived:
        depsgraph = bpy.context.evaluated_depsgraph_get()
        attempt(session, depsgraph, partial(_take_made, depsgraph=depsgraph))
        refresh_views()  # Blender's own strands, which were shown until now
    elif session.cards.has_arrived:
        attempt(session, bpy.context.view_layer.depsgraph, Session.take_cards)
    redraw_panels()


def _show_lines(session: Session) -> float | None:
    """A step of `latest_job`: the lines of colliders, once they are made."""
    if not fields.are_made():
        return ARRIVAL_TIME
    attempt(session, bpy.context.evaluated_depsgraph_get(), lambda _: None)
    redraw_panels()
    return None


def finish(session: Session, depsgraph: bpy.types.Depsgraph) -> None:
    """Wait for hair that is being made; one that cannot be made ends its preview."""
    while session.is_pending and _sessions.get(session.uid) is session:
        take = partial(_take_made, depsgraph=depsgraph)
        attempt(session, depsgraph, take, waits=False)


def take_bake(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    """Find its bake, and show the scene's frame of it.

    Raises:
        HairloomError: it cannot go on.
    """
    timeline.check(session, depsgraph)
    timeline.show_frame(session, depsgraph)


def _take_made(session: Session, depsgraph: bpy.types.Depsgraph) -> None:
    was_made = session.is_made
    session.take_made(depsgraph)
    if was_made:
        timeline.check(session, depsgraph)
    else:
        take_bake(session, depsgraph)
