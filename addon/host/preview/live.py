"""All previewed grooms and fins: begun and ended by the artist, kept in step with Blender.

See `reactions` for what follows from Blender's events.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

import bpy

from ...errors import HairloomError
from ..bakes import playback
from ..colliders import fields
from ..colliders.fields import NotMadeYetError
from ..scene.objects import is_elsewhere
from ..scene.originals import refresh_views, show_originals
from . import overlay, timeline
from .drawings import drawing_of
from .redraw import redraw_panels, refresh_panels
from .session import Session
from .simulated import Simulated

#: What is told of hair that is about to play.
WAITING = "plays as soon as its collider is made"
#: Cards that are being built are looked for this often [s], or where they wait for this thread.
CARDS_TIME, ASKING_TIME = 0.1, 0.01

_sessions: dict[int, Simulated] = {}
#: uids of what is to play once its colliders are made
_waiting: set[int] = set()
_notice = ""
_is_paused = False
_is_suspended = False


def start(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Session:
    """Preview this groom; where the scene's frame is baked, as it was baked.

    Raises:
        HairloomError: it cannot be previewed; says why and what to do.
    """
    session = Session(hair, depsgraph, baked=timeline.rig_for(hair, depsgraph.scene))
    overlay.retry()
    add(session, depsgraph)
    if not bpy.app.background:
        session.make_fields(depsgraph)
    refresh_views()
    return session


def add(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    """Let the timeline and Play move it from now on.

    Raises:
        HairloomError: it cannot be shown.
    """
    global _notice
    _notice = ""
    timeline.forget(session.uid)
    _waiting.discard(session.uid)
    _take_bake(session, depsgraph)
    _sessions[session.uid] = session
    _publish(session, depsgraph)
    redraw_panels()


def stop(session: Simulated) -> None:
    """Preview it no longer."""
    _forget(session)
    redraw_panels()
    if not isinstance(session, Session):
        return
    hair = session.hair.handle.find()
    if hair is not None:
        show_originals(hair, bpy.context.view_layer.depsgraph, show=True)
        refresh_views()


def stop_all() -> None:
    for session in simulated():
        stop(session)


def end() -> None:
    """Leave nothing behind: no preview, no bake in memory, no notice."""
    global _notice
    stop_all()
    playback.forget()
    fields.forget()
    _notice = ""


def forget_all() -> None:
    """As `stop_all` when the objects are about to go: touches none of them."""
    for session in simulated():
        _forget(session)
    playback.forget()


def _forget(session: Simulated) -> None:
    _sessions.pop(session.uid, None)
    _waiting.discard(session.uid)
    if isinstance(session, Session):
        session.cards.forget()
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


def is_playing() -> bool:
    """Whether hair plays freely, by the clock, or is about to."""
    return any(is_free(session) or is_waiting(session) for session in simulated())


def is_paused() -> bool:
    return _is_paused and is_playing()


def pause(is_paused: bool) -> None:
    """Hold all hair that plays freely where it is, or let it go on."""
    global _is_paused
    _is_paused = is_paused
    redraw_panels()


def is_waiting(session: Simulated) -> bool:
    """Whether it is to play freely, and is shown at rest until its colliders are made."""
    return session.uid in _waiting and not timeline.is_following(session)


def play(depsgraph: bpy.types.Depsgraph, *, waits: bool = True) -> list[str]:
    """Let all previewed grooms and fins play freely, from rest; returns warnings.

    Args:
        waits: False: what lacks a collider that is being made begins later, in `advance`.
    """
    pause(False)
    fields.trim()
    warnings = []
    for session in simulated():
        timeline.release(session)
        try:
            begin(session, depsgraph, waits=waits)
        except HairloomError as error:
            warnings.append(str(error))
    return warnings


def begin(session: Simulated, depsgraph: bpy.types.Depsgraph, *, waits: bool) -> None:
    """Let one play freely, now or as soon as its colliders are made; see `play`.

    Raises:
        HairloomError: as `Simulated.play`.
    """
    _waiting.discard(session.uid)
    try:
        session.play(depsgraph, waits=waits)
    except NotMadeYetError:
        _waiting.add(session.uid)
        _publish(session, depsgraph)


def _begin_waiting(depsgraph: bpy.types.Depsgraph) -> None:
    """Let play what has all of its colliders by now."""
    if not fields.are_made():
        return
    for session in simulated():
        if is_waiting(session):
            attempt(session, depsgraph, partial(_begin, depsgraph=depsgraph))
        else:  # the timeline has taken it over
            _waiting.discard(session.uid)


def _begin(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    action = partial(begin, session, depsgraph, waits=False)
    timeline.attempt(session, depsgraph, action)


def advance(depsgraph: bpy.types.Depsgraph, duration: float) -> None:
    """Simulate the time [s] that has passed since the last call."""
    if _waiting:
        _begin_waiting(depsgraph)
    for session in simulated():
        if is_free(session) and not _is_paused:
            attempt(session, depsgraph, partial(_advance, depsgraph=depsgraph, duration=duration))


def _advance(session: Simulated, depsgraph: bpy.types.Depsgraph, duration: float) -> None:
    timeline.attempt(session, depsgraph, partial(session.advance, depsgraph, duration))


def rest(depsgraph: bpy.types.Depsgraph, *, keep_playing: bool) -> None:
    """All hair back into its style; if it is to play no longer and is baked, to the baked frame."""
    for session in simulated():
        back = partial(_put_back, depsgraph=depsgraph, keep_playing=keep_playing)
        attempt(session, depsgraph, back)


def _put_back(session: Simulated, depsgraph: bpy.types.Depsgraph, keep_playing: bool) -> None:
    if keep_playing:
        session.rest(depsgraph)
    else:
        _waiting.discard(session.uid)
        session.stop(depsgraph)
        timeline.show_frame(session, depsgraph)


@contextmanager
def suspended() -> Iterator[None]:
    """React to nothing: a bake goes through the frames."""
    global _is_suspended
    _is_suspended = True
    try:
        yield
    finally:
        _is_suspended = False


def is_suspended() -> bool:
    return _is_suspended


def bake_changed(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
    """A bake was made or deleted, or is to be shown or not."""
    timeline.bake_removed(obj)
    session = simulated_of(obj)
    if session is None:
        return

    def show(session: Simulated) -> None:
        timeline.release(session)
        session.stop(depsgraph)
        _take_bake(session, depsgraph)

    attempt(session, depsgraph, show)
    redraw_panels()


def is_free(session: Simulated) -> bool:
    return session.is_playing and not timeline.is_following(session)


def _take_bake(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    """Find its bake, and show the scene's frame of it."""
    timeline.check(session, depsgraph)
    timeline.show_frame(session, depsgraph)


def attempt[S: Simulated](
    session: S, depsgraph: bpy.types.Depsgraph, action: Callable[[S], object]
) -> None:
    """Do it and show the result; a groom that cannot go on is stopped, with a notice.

    A defect of ours ends it as well, told in full but once, not at every event from now on.
    """
    global _notice
    if is_elsewhere(session.uid, session.name, depsgraph.scene):
        session.is_stale = True  # until its scene is shown again, in which it is evaluated
        overlay.hide(session.uid)
        return
    try:
        action(session)
        if _sessions.get(session.uid) is session:  # not begun anew
            _publish(session, depsgraph)
    except Exception as error:
        if not isinstance(error, HairloomError):
            traceback.print_exc()
        _notice = f"Preview of {session.name} ended. {error}"
        print(f"Hairloom: {_notice}")
        stop(session)


def _publish(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    if not isinstance(session, Session):
        return
    hair = session.hair.found()
    if session.cards.is_pending:
        _await_cards()
    note = f"{hair.name}: {WAITING}" if is_waiting(session) else ""
    overlay.show(session.uid, drawing_of(session, hair, depsgraph, note))
    refresh_panels()
    is_replaced = hair.mode == "OBJECT" and not overlay.failure()
    hides = is_replaced and hair.hairloom.hide_original
    volume = session.choices.volume
    has_own_shadow = volume.on_body and volume.shadows != "none"
    show_originals(hair, depsgraph, show=not hides, has_own_shadow=has_own_shadow)


def _await_cards() -> None:
    """Show cards when they are built."""
    if not bpy.app.timers.is_registered(_take_cards):
        bpy.app.timers.register(_take_cards, first_interval=CARDS_TIME)


def _take_cards() -> float | None:
    """A timer of Blender's: cards that were built beside the window's work."""
    depsgraph = bpy.context.view_layer.depsgraph
    for session in sessions():
        if session.cards.is_pending and session.cards.serve():
            attempt(session, depsgraph, Session.take_cards)
            redraw_panels()
    if any(session.cards.asks for session in sessions()):
        return ASKING_TIME
    return CARDS_TIME if any(session.cards.is_pending for session in sessions()) else None
