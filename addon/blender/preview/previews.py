"""All previewed grooms and fins: begun and ended by the artist, kept in step with Blender.

See `scene_events` for what follows from Blender's events, `phases` for what a preview does.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

import bpy

from ...errors import HairloomError
from ...shading.volume.settings import VolumeSettings
from ..bakes import playback
from ..bakes.bake_settings import folder_of
from ..bakes.simulated import Simulated
from ..base import latest_job
from ..base.gpu_context import free_soon, is_interrupted
from ..base.latest_job import ARRIVAL_TIME, unwatch, watch
from ..base.originals import (
    all_depsgraphs,
    refresh_views,
    show_originals,
    shown_depsgraphs,
)
from ..base.redraw import redraw_panels, redraw_views, refresh_panels
from ..cards.kept_cards import KeptCards
from ..colliders import fields
from ..colliders.rigs import MadeRig
from ..scene.fin_modifier import clear, is_shown
from ..sessions.session import Session
from ..sessions.together import Together
from ..viewport import overlay
from ..viewport.debug_lines import is_combed
from .phases import Event, Phase
from .preview import KnownBake, Preview, rig_for

#: What is reported of hair that is about to play, and of hair that is not there yet.
WAITING, BUILDING = "plays as soon as its collider is made", "is being made"


class Previews(dict[int, Preview]):
    """By session number of their objects.

    notice: why one ended by itself, until the next one begins.
    is_paused: whether all that plays freely is held where it is.
    last_edit: when one was edited [s], by the clock that never goes back.
    is_reacting: whether an event of Blender's is being followed.
    built_cards: as objects or files were made of them last, previewed or not.
    """

    def __init__(self) -> None:
        super().__init__()
        self.notice, self.is_paused = "", False
        self.last_edit, self.is_reacting = 0.0, False
        self.built_cards = KeptCards()


previews = Previews()


def start(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Session:
    """Preview this groom; where the scene's frame is baked, as it was baked.

    In a window its hair is made in a thread: see `latest_job`.

    Raises:
        HairloomError: it cannot be previewed; says why and what to do.
    """
    baked = rig_for(hair, depsgraph.scene)
    session = Session(
        hair, depsgraph, baked=baked, blocking=latest_job.is_blocking(), arrived=_take_arrivals
    )
    overlay.retry()
    add(session, depsgraph)
    if not any(each.phase is Phase.WAITING for each in previews.values()):
        fields.trim()
    if not bpy.app.background:
        session.make_fields(depsgraph)
    refresh_views()
    return session


def begin_over(preview: Preview, depsgraph: bpy.types.Depsgraph) -> None:
    """Preview a groom as it is now: in another size, or on another head. The timeline goes on.

    Raises:
        HairloomError: as `start`.
    """
    session = start(preview.found(), depsgraph)
    previews[session.uid].frame = preview.frame


def add(session: Simulated, depsgraph: bpy.types.Depsgraph) -> None:
    """Let the timeline and Play move it from now on, in place of what was there for its object.

    Raises:
        HairloomError: it cannot be shown.
    """
    preview = Preview(session)
    if preview.is_made:
        preview.take_bake(depsgraph)
    previews.notice = ""
    before = previews.get(session.uid)
    if before is not None:
        before.session.forget()
    previews[session.uid] = preview
    publish(preview, depsgraph)
    redraw_panels()


def end() -> None:
    """Leave nothing behind: no preview, no bake in memory, no notice."""
    stop_all()
    playback.forget()
    previews.built_cards.forget()
    fields.forget()
    previews.notice = ""


def forget_all() -> None:
    """As `stop_all` when the objects are about to go: touches none of them."""
    for uid in tuple(previews):
        _forget(uid)
    previews.notice, previews.is_paused = "", False
    playback.forget()
    previews.built_cards.forget()


def stop(session: Simulated) -> None:
    """Preview it no longer: hair is Blender's own again, cloth as it is without a preview."""
    _forget(session.uid)
    redraw_panels()
    obj = session.bodies[0].handle.find()
    if obj is not None:
        _show_without(obj)
        refresh_views()


def show_all_without() -> None:
    """All hair and cloth, as without a preview, whatever was previewed."""
    for obj in bpy.data.objects:
        _show_without(obj)
    refresh_views()


def _show_without(obj: bpy.types.Object) -> None:
    if obj.type == "CURVES":
        for depsgraph in all_depsgraphs():
            show_originals(obj, depsgraph, show=True)
    elif is_shown(obj):
        clear(obj.data)
        playback.show_fins(bpy.context.scene)  # its bake is shown without a preview too


def stop_all() -> None:
    for session in simulated():
        stop(session)


def _forget(uid: int) -> None:
    """As `stop` when its object is about to go: touches nothing of it."""
    preview = previews.pop(uid, None)
    previews.built_cards.forget()
    unwatch((uid, "lines"))
    if preview is not None:
        preview.session.forget()
    overlay.drop(uid)
    free_soon()


def sessions() -> tuple[Session, ...]:
    """The grooms that are previewed."""
    return tuple(each.groom for each in previews.values() if each.groom is not None)


def simulated() -> tuple[Simulated, ...]:
    """The grooms and fins that are previewed."""
    return tuple(each.session for each in previews.values())


def simulated_in(depsgraph: bpy.types.Depsgraph) -> tuple[Simulated, ...]:
    """Those of them that this evaluation does not leave out."""
    return tuple(each.session for each in previews.values() if not each.is_left_out(depsgraph))


def made_rigs() -> dict[int, MadeRig]:
    """Of the previewed grooms, by session number: each made ready, as it was read last."""
    made = {session.uid: session.made_rig for session in sessions()}
    return {uid: each for uid, each in made.items() if each is not None}


def session_of(hair: bpy.types.Object | None) -> Session | None:
    found = simulated_of(hair)
    return found if isinstance(found, Session) else None


def simulated_of(obj: bpy.types.Object | None) -> Simulated | None:
    """The groom or fin of this object while it is previewed."""
    found = None if obj is None else previews.get(obj.session_uid)
    return None if found is None else found.session


def bake_of(obj: bpy.types.Object) -> KnownBake | None:
    """What is known of the bake of a previewed object."""
    preview = previews.get(obj.session_uid)
    return None if preview is None else preview.bake


def notice() -> str:
    """Why a preview ended by itself, or why drawing failed; empty while all is well."""
    return overlay.failure() or previews.notice


def is_playing() -> bool:
    """Whether hair plays freely, by the clock, or is about to."""
    return any(each.is_playing for each in previews.values())


def windows_of_play() -> dict[int, bpy.types.Window]:
    """For each scene in which hair or cloth plays, by session number, a window that shows it."""
    playing = [each for each in previews.values() if each.is_playing]
    found: dict[int, bpy.types.Window] = {}
    for window in bpy.context.window_manager.windows:
        depsgraph = window.view_layer.depsgraph
        if depsgraph is not None and not all(each.is_left_out(depsgraph) for each in playing):
            found.setdefault(window.scene.session_uid, window)
    return found


def waiting() -> tuple[str, ...]:
    """The names of what plays as soon as all is made."""
    return tuple(each.session.name for each in previews.values() if each.phase is Phase.WAITING)


def is_paused() -> bool:
    return previews.is_paused and is_playing()


def pause(is_paused: bool) -> None:
    """Hold all hair that plays freely where it is, or let it go on."""
    previews.is_paused = is_paused
    redraw_panels()


def play(depsgraph: bpy.types.Depsgraph, *, blocking: bool = True) -> list[str]:
    """Let all that is previewed, and is in this evaluation, play freely, from rest; returns
    warnings.

    Args:
        blocking: False: what lacks hair or a collider that is being made begins later, in
            `advance`.
    """
    pause(False)
    fields.trim()
    warnings = []
    for session in simulated_in(depsgraph):
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
    preview = previews[session.uid]
    preview.release()
    preview.act(Event.PLAY, depsgraph, blocking=blocking)
    if preview.phase is Phase.WAITING:
        publish(preview, depsgraph)


def advance(depsgraph: bpy.types.Depsgraph, duration: float) -> None:
    """Simulate the time [s] that has passed since the last call."""
    with together(depsgraph):
        for preview in tuple(previews.values()):
            if preview.phase is Phase.WAITING and preview.may_begin:
                # its first frame is the next tick's, so that neither holds the window up for long
                attempt(preview, depsgraph, partial(_begin, preview, depsgraph))
            elif preview.phase is Phase.FREE and not previews.is_paused:
                attempt(preview, depsgraph, partial(preview.go, Event.TICK, depsgraph, duration))


@contextmanager
def together(depsgraph: bpy.types.Depsgraph) -> Iterator[None]:
    """A frame of all previewed grooms of the scene: those that feel each other go on at its end."""
    here = [each for each in simulated_in(depsgraph) if isinstance(each, Session)]
    with Together([] if is_interrupted() else here) as frame:
        yield
        for session in frame.go_on():
            preview = previews.get(session.uid)
            if preview is not None and preview.session is session:
                attempt(preview, depsgraph, partial(preview.finish_frame, depsgraph))


def _begin(preview: Preview, depsgraph: bpy.types.Depsgraph) -> None:
    preview.go(Event.PLAY, depsgraph, blocking=False)


def rest(depsgraph: bpy.types.Depsgraph, *, keep_playing: bool) -> None:
    """All hair back into its style; if it is to play no longer and is baked, to the baked frame."""
    for preview in tuple(previews.values()):
        if preview.is_playing and not keep_playing and preview.is_left_out(depsgraph):
            preview.halt(depsgraph)
            for each in shown_depsgraphs():
                each.scene.update_tag()  # another window that shows it reads it again
            continue
        back = partial(_put_back, preview, depsgraph, keep_playing)
        attempt(preview, depsgraph, back)


def _put_back(preview: Preview, depsgraph: bpy.types.Depsgraph, keep_playing: bool) -> None:
    if keep_playing:
        preview.act(Event.RESET, depsgraph)
    else:
        preview.stop(depsgraph)
        if preview.is_resized(depsgraph):
            begin_over(preview, depsgraph)


def bake_changed(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
    """A bake was made or deleted, or is to be shown or not."""
    folder = folder_of(obj)
    if folder is not None:
        playback.drop(folder)
    preview = previews.get(obj.session_uid)
    if preview is None:
        return
    attempt(preview, depsgraph, partial(_take_other_bake, preview, depsgraph))
    redraw_panels()


def _take_other_bake(preview: Preview, depsgraph: bpy.types.Depsgraph) -> None:
    preview.forget_bake()
    preview.release()
    preview.act(Event.STOP, depsgraph)
    groom = preview.groom
    baked = None if groom is None else rig_for(preview.found(), depsgraph.scene)
    is_other = groom is not None and baked is not None and not baked.rests.has_size_of(groom.rests)
    if is_other or preview.is_resized(depsgraph):
        begin_over(preview, depsgraph)
    else:
        preview.take_bake(depsgraph)


def attempt(
    preview: Preview,
    depsgraph: bpy.types.Depsgraph,
    action: Callable[[], object],
    *,
    needs_gpu: bool = True,
) -> None:
    """Do it and show the result; a groom that cannot go on is stopped, with a notice.

    A defect of ours ends it as well, reported in full but once, not at every event from now on.

    Args:
        needs_gpu: where there is no GPU for a moment, do nothing but read it again later.
    """
    session = preview.session
    if preview.is_left_out(depsgraph):
        if all(map(preview.is_left_out, shown_depsgraphs())):
            session.is_stale = True  # until it is evaluated again
            overlay.hide(session.uid)
        return  # if it is in another window, what happens here is nothing to it
    if needs_gpu and is_interrupted():
        session.is_stale = True
        redraw_views()
        refresh_views()  # the update that follows has it read again
        return
    try:
        action()
        if previews.get(session.uid) is preview:  # it was not begun again by the action
            publish(preview, depsgraph)
    except Exception as error:
        if not isinstance(error, HairloomError):
            traceback.print_exc()
        previews.notice = f"Preview of {session.name} ended. {error}"
        print(f"Hairloom: {previews.notice}")
        stop(session)


def publish(preview: Preview, depsgraph: bpy.types.Depsgraph) -> None:
    """Show a groom as it is; a fin shows itself.

    Raises:
        HairloomError: it is gone.
    """
    session = preview.groom
    if session is None:
        return
    hair = session.hair.found()
    note = "" if session.is_made else BUILDING
    if preview.phase is Phase.WAITING and not note:
        note = WAITING
    if note:
        note = f"{hair.name}: {note}"
    overlay.show(session.uid, overlay.read_drawing(session, hair, depsgraph, note))
    is_missing_lines = session.obstacles is None and "colliders" in hair.hairloom.shown_overlays
    if is_missing_lines and not fields.are_made():
        watch((session.uid, "lines"), partial(_show_lines, preview))
    refresh_panels()
    # our own strands come into the place of Blender's where nobody edits these or a brush combs
    # them, and not before they are made; an overlay that has failed shows nothing
    is_replaced = (hair.mode == "OBJECT" or is_combed(hair)) and not overlay.failure()
    hides = is_replaced and hair.hairloom.hide_original and session.is_made
    # without a head ours lies nowhere, and there are casters only where it has a shadow
    has_own_shadow = session.settings[VolumeSettings].on_body and bool(session.snapshot.casters)
    show_originals(hair, depsgraph, show=not hides, has_own_shadow=has_own_shadow)


def _show_lines(preview: Preview) -> float | None:
    """A step of `latest_job`: the lines of colliders, once they are made."""
    if not fields.are_made():
        return ARRIVAL_TIME
    attempt(preview, bpy.context.evaluated_depsgraph_get(), lambda: None)
    redraw_panels()
    return None


def _take_arrivals(session: Session) -> None:
    """Show hair and cards that were made beside the window's work."""
    preview = previews.get(session.uid)
    if preview is None or preview.session is not session:
        return
    depsgraph = _shown_depsgraph(preview)
    if depsgraph is None:
        return  # it is offered until it is shown again
    if session.has_arrived:
        attempt(preview, depsgraph, partial(_take_made, preview, session, depsgraph))
        refresh_views()  # Blender's own strands, which were shown until now
    elif session.cards.has_arrived:
        attempt(preview, depsgraph, session.take_cards)
    redraw_panels()


def _shown_depsgraph(preview: Preview) -> bpy.types.Depsgraph | None:
    """Of a window that shows it, evaluated; None where no window does."""
    for window in bpy.context.window_manager.windows:
        depsgraph = window.view_layer.depsgraph
        if depsgraph is not None and not preview.is_left_out(depsgraph):
            with bpy.context.temp_override(window=window):
                return bpy.context.evaluated_depsgraph_get()
    return None


def finish(session: Session, depsgraph: bpy.types.Depsgraph) -> None:
    """Wait for hair that is being made; one that cannot be made ends its preview.

    Raises:
        HairloomError: it is left out here, and made when it is shown again.
    """
    preview = previews[session.uid]
    if preview.is_left_out(depsgraph):
        raise HairloomError(
            "it is in another scene, or its collection is hidden",
            place=session.name,
            remedy="Show these, or select other hair",
        )
    while session.is_pending and previews.get(session.uid) is preview:
        take = partial(_take_made, preview, session, depsgraph)
        attempt(preview, depsgraph, take, needs_gpu=False)


def _take_made(preview: Preview, session: Session, depsgraph: bpy.types.Depsgraph) -> None:
    was_made, is_lit = session.is_made, session.is_lighting
    session.take_made(depsgraph)
    if is_lit:
        return
    if was_made:
        preview.check(depsgraph)
    else:
        preview.take_bake(depsgraph)
