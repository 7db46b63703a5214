"""All previewed grooms and fins: begun and ended by the artist, kept in step with Blender.

See `reactions` for what follows from Blender's events.
"""

from __future__ import annotations

from functools import partial

import bpy

from ...errors import HairloomError
from ..bakes import playback
from ..bakes.simulated import Simulated
from ..base import latest_job
from ..base.originals import refresh_views
from ..base.redraw import redraw_panels
from ..colliders import fields
from ..colliders.fields import NotMadeYetError
from ..sessions.session import Session
from ..viewport import overlay
from . import timeline
from .previewed import (
    MAKING,
    WAITING,
    attempt,
    finish,
    forget,
    is_waiting,
    notice,
    publish,
    put,
    session_of,
    sessions,
    set_notice,
    simulated,
    simulated_of,
    stop,
    stop_all,
    take_arrivals,
    take_bake,
    wait,
    waiting,
)

_is_paused = False


def start(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Session:
    """Preview this groom; where the scene's frame is baked, as it was baked.

    In a window its hair is made in a thread: see `latest_job`.

    Raises:
        HairloomError: it cannot be previewed; says why and what to do.
    """
    baked = timeline.rig_for(hair, depsgraph.scene)
    session = Session(
        hair, depsgraph, baked=baked, blocking=latest_job.is_blocking(), arrived=take_arrivals
    )
    overlay.retry()
    add(session, depsgraph)
    if not waiting():
        fields.trim()
    if not bpy.app.background:
        session.make_fields(depsgraph)
    refresh_views()
    return session


def add(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    """Let the timeline and Play move it from now on.

    Raises:
        HairloomError: it cannot be shown.
    """
    timeline.forget(session.uid)
    wait(session, waits=False)
    if not isinstance(session, Session) or session.is_made:
        take_bake(session, depsgraph)
    put(session, depsgraph)


def end() -> None:
    """Leave nothing behind: no preview, no bake in memory, no notice."""
    stop_all()
    playback.forget()
    fields.forget()
    set_notice("")


def forget_all() -> None:
    """As `stop_all` when the objects are about to go: touches none of them."""
    for session in simulated():
        forget(session)
    playback.forget()


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


def play(depsgraph: bpy.types.Depsgraph, *, blocking: bool = True) -> list[str]:
    """Let all previewed grooms and fins play freely, from rest; returns warnings.

    Args:
        blocking: False: what lacks hair or a collider that is being made begins later, in
            `advance`.
    """
    pause(False)
    fields.trim()
    warnings = []
    for session in simulated():
        timeline.release(session)
        try:
            begin(session, depsgraph, blocking=blocking)
        except HairloomError as error:
            warnings.append(str(error))
    return warnings


def begin(session: Simulated, depsgraph: bpy.types.Depsgraph, *, blocking: bool) -> None:
    """Let one play freely, now or as soon as its hair and its colliders are made; see `play`.

    Raises:
        HairloomError: as `Simulated.play`.
    """
    wait(session, waits=False)
    try:
        session.play(depsgraph, blocking=blocking)
    except NotMadeYetError:
        wait(session, waits=True)
        publish(session, depsgraph)


def _begin_waiting(depsgraph: bpy.types.Depsgraph) -> None:
    """Let play what has its hair and all of its colliders by now."""
    if not fields.are_made():
        return
    for session in waiting():
        if not is_waiting(session):  # the timeline has taken it over
            wait(session, waits=False)
        elif not isinstance(session, Session) or session.is_made:
            attempt(session, depsgraph, partial(_begin, depsgraph=depsgraph))


def _begin(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    action = partial(begin, session, depsgraph, blocking=False)
    timeline.attempt(session, depsgraph, action)


def advance(depsgraph: bpy.types.Depsgraph, duration: float) -> None:
    """Simulate the time [s] that has passed since the last call."""
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
        wait(session, waits=False)
        session.stop(depsgraph)
        timeline.show_frame(session, depsgraph)


def bake_changed(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
    """A bake was made or deleted, or is to be shown or not."""
    timeline.bake_removed(obj)
    session = simulated_of(obj)
    if session is None:
        return

    def show(session: Simulated) -> None:
        timeline.release(session)
        session.stop(depsgraph)
        take_bake(session, depsgraph)

    attempt(session, depsgraph, show)
    redraw_panels()


def is_free(session: Simulated) -> bool:
    return session.is_playing and not timeline.is_following(session)


__all__ = [
    "MAKING",
    "WAITING",
    "attempt",
    "finish",
    "is_waiting",
    "notice",
    "session_of",
    "sessions",
    "simulated",
    "simulated_of",
    "stop",
    "stop_all",
]
