"""All previewed grooms and fins: started and ended by the artist, kept in step with Blender.

See `scene_events` for the reactions to Blender's events, and `phases` for what a preview does.
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
from ..bakes.simulation import Simulation
from ..base import latest_job
from ..base.gpu_context import is_context_missing, schedule_free_unused
from ..base.latest_job import POLL_INTERVAL, schedule, unschedule
from ..base.originals import (
    all_depsgraphs,
    refresh_views,
    show_originals,
    shown_depsgraphs,
)
from ..base.redraw import redraw_panels, redraw_views, refresh_panels
from ..cards.build_cache import CardBuildCache
from ..colliders import fields
from ..colliders.rigs import CachedRig
from ..scene.fin_modifier import clear, is_shown
from ..sessions.coupled_frame import CoupledFrame
from ..sessions.session import Session
from ..viewport import overlay
from ..viewport.debug_lines import is_in_sculpt_mode
from .phases import Event, Phase
from .preview import BakeStatus, Preview, baked_rig_for

#: Notes on hair that is about to play, and on hair that is not made yet.
WAITING, BUILDING = "plays as soon as its collider is ready", "is being made"


class Previews(dict[int, Preview]):
    """The previews, by session number of their objects.

    notice: why one ended by itself; kept until the next one begins.
    ended: session numbers of the objects whose previews ended by themselves; an undo may bring back
        what they lacked. ended_before_undo: those that had ended before the last undo.
    cloth: session numbers of the cloth that has been previewed in this file; an undo may bring
        back a frame of its motion after its preview.
    is_paused: whether everything that plays freely is paused.
    last_edit: time of the last edit [s], by the monotonic clock.
    is_reacting: whether a reaction to one of Blender's events is running.
    built_cards: cards as they were last made into objects or files, of previewed grooms or not.
    """

    def __init__(self) -> None:
        super().__init__()
        self.notice, self.is_paused = "", False
        self.ended: set[int] = set()
        self.ended_before_undo: set[int] = set()
        self.cloth: set[int] = set()
        self.last_edit, self.is_reacting = 0.0, False
        self.built_cards = CardBuildCache()


previews = Previews()


def start(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Session:
    """Preview this groom; if the scene's frame is baked, show it from the bake.

    In a window its hair is made in a thread: see `latest_job`.

    Raises:
        HairloomError: it cannot be previewed.
    """
    baked = baked_rig_for(hair, depsgraph.scene)
    session = Session(
        hair,
        depsgraph,
        baked=baked,
        blocking=latest_job.is_blocking(),
        on_result=_take_finished_work,
    )
    overlay.retry()
    add(session, depsgraph)
    if not any(each.phase is Phase.WAITING for each in previews.values()):
        fields.trim()
    if not bpy.app.background:
        session.make_fields(depsgraph)
    refresh_views()
    return session


def restart(preview: Preview, depsgraph: bpy.types.Depsgraph) -> None:
    """Preview a groom again, in another size or on another head; the timeline goes on.

    Raises:
        HairloomError: as `start`.
    """
    session = start(preview.resolve(), depsgraph)
    previews[session.uid].frame = preview.frame


def add(session: Simulation, depsgraph: bpy.types.Depsgraph) -> None:
    """Let the timeline and Play move it from now on; replaces an earlier preview of its object.

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
    previews.ended.discard(session.uid)
    if preview.groom is None:
        previews.cloth.add(session.uid)
    publish(preview, depsgraph)
    redraw_panels()


def end() -> None:
    """Leave nothing behind: no preview, no bake in memory, no notice."""
    stop_all()
    playback.forget()
    previews.built_cards.forget()
    fields.forget()
    previews.ended.clear()
    previews.cloth.clear()
    previews.notice = ""


def forget_all() -> None:
    """`stop_all` for objects that are about to be freed: touches none of them."""
    for uid in tuple(previews):
        _forget(uid)
    previews.ended.clear()
    previews.cloth.clear()
    previews.notice, previews.is_paused = "", False
    playback.forget()
    previews.built_cards.forget()


def stop(session: Simulation) -> None:
    """End its preview: Blender draws the hair again, and cloth is as without a preview."""
    _forget(session.uid)
    redraw_panels()
    obj = session.bodies[0].handle.find()
    if obj is not None:
        _show_unpreviewed(obj)
        refresh_views()


def show_all_unpreviewed() -> None:
    """Show all hair and cloth as without a preview, whatever was previewed."""
    for obj in bpy.data.objects:
        _show_unpreviewed(obj)
    refresh_views()


def rest_ended_cloth() -> None:
    """Show cloth whose preview has ended as without one, after an undo that may have put it back
    into its motion."""
    for obj in bpy.data.objects if previews.cloth else ():
        if obj.session_uid in previews.cloth and obj.session_uid not in previews and is_shown(obj):
            _show_unpreviewed(obj)


def _show_unpreviewed(obj: bpy.types.Object) -> None:
    if obj.type == "CURVES":
        for depsgraph in all_depsgraphs():
            show_originals(obj, depsgraph, show=True)
    elif is_shown(obj):
        clear(obj.data)
        playback.show_fins(bpy.context.scene)  # its bake is shown without a preview too


def stop_all() -> None:
    for session in simulations():
        stop(session)


def _forget(uid: int) -> None:
    """`stop` for an object that is about to be freed: does not touch it."""
    preview = previews.pop(uid, None)
    previews.built_cards.forget()
    unschedule((uid, "lines"))
    if preview is not None:
        preview.session.forget()
    overlay.stop_drawing(uid)
    schedule_free_unused()


def sessions() -> tuple[Session, ...]:
    """The grooms that are previewed."""
    return tuple(each.groom for each in previews.values() if each.groom is not None)


def simulations() -> tuple[Simulation, ...]:
    """The grooms and fins that are previewed."""
    return tuple(each.session for each in previews.values())


def simulations_in(depsgraph: bpy.types.Depsgraph) -> tuple[Simulation, ...]:
    """The previewed grooms and fins that this depsgraph does not leave out."""
    return tuple(each.session for each in previews.values() if not each.is_disabled(depsgraph))


def previewed_rigs() -> dict[int, CachedRig]:
    """The rigs of the previewed grooms that are made, by session number, as they were last read."""
    made = {session.uid: session.cached_rig for session in sessions()}
    return {uid: each for uid, each in made.items() if each is not None}


def session_of(hair: bpy.types.Object | None) -> Session | None:
    found = simulation_of(hair)
    return found if isinstance(found, Session) else None


def simulation_of(obj: bpy.types.Object | None) -> Simulation | None:
    """The groom or fin of this object, if it is previewed."""
    found = None if obj is None else previews.get(obj.session_uid)
    return None if found is None else found.session


def bake_of(obj: bpy.types.Object) -> BakeStatus | None:
    """What is known of the bake of a previewed object."""
    preview = previews.get(obj.session_uid)
    return None if preview is None else preview.bake


def notice() -> str:
    """Why a preview ended by itself, or why drawing failed; empty while all is well."""
    return overlay.failure() or previews.notice


def is_playing() -> bool:
    """Whether hair plays freely, by the clock, or is about to."""
    return any(each.is_playing for each in previews.values())


def playing_windows() -> dict[int, bpy.types.Window]:
    """A window for each scene in which hair or cloth plays, by session number of the scene."""
    playing = [each for each in previews.values() if each.is_playing]
    found: dict[int, bpy.types.Window] = {}
    for window in bpy.context.window_manager.windows:
        depsgraph = window.view_layer.depsgraph
        if depsgraph is not None and not all(each.is_disabled(depsgraph) for each in playing):
            found.setdefault(window.scene.session_uid, window)
    return found


def waiting_names() -> tuple[str, ...]:
    """The names of previews that play as soon as everything is made."""
    return tuple(each.session.name for each in previews.values() if each.phase is Phase.WAITING)


def is_paused() -> bool:
    return previews.is_paused and is_playing()


def pause(is_paused: bool) -> None:
    """Pause all hair that plays freely, or let it go on."""
    previews.is_paused = is_paused
    redraw_panels()


def play(depsgraph: bpy.types.Depsgraph, *, blocking: bool = True) -> list[str]:
    """Play all previews in this depsgraph freely, from rest; returns warnings.

    Args:
        blocking: False: a preview whose hair or collider is still being made begins later, in
            `advance`.
    """
    pause(False)
    fields.trim()
    warnings = []
    for session in simulations_in(depsgraph):
        try:
            begin(session, depsgraph, blocking=blocking)
        except HairloomError as error:
            warnings.append(str(error))
    return warnings


def begin(session: Simulation, depsgraph: bpy.types.Depsgraph, *, blocking: bool) -> None:
    """Play one preview freely, now or as soon as its hair and its colliders are made; see `play`.

    Raises:
        HairloomError: as `Simulation.play`.
    """
    preview = previews[session.uid]
    preview.detach_from_timeline()
    preview.handle_or_raise(Event.PLAY, depsgraph, blocking=blocking)
    if preview.phase is Phase.WAITING:
        publish(preview, depsgraph)


def advance(depsgraph: bpy.types.Depsgraph, duration: float) -> None:
    """Simulate the time [s] that has passed since the last call."""
    with coupled_frame(depsgraph):
        for preview in tuple(previews.values()):
            if preview.phase is Phase.WAITING and preview.can_begin:
                # its first frame waits for the next tick, so that neither blocks the window long
                attempt(preview, depsgraph, partial(_begin, preview, depsgraph))
            elif preview.phase is Phase.FREE and not previews.is_paused:
                attempt(
                    preview, depsgraph, partial(preview.handle, Event.TICK, depsgraph, duration)
                )


@contextmanager
def coupled_frame(depsgraph: bpy.types.Depsgraph) -> Iterator[None]:
    """A frame of all previewed grooms of the scene; those that feel each other move at its end."""
    here = [each for each in simulations_in(depsgraph) if isinstance(each, Session)]
    with CoupledFrame([] if is_context_missing() else here) as frame:
        yield
        for session in frame.simulate_coupled():
            preview = previews.get(session.uid)
            if preview is not None and preview.session is session:
                attempt(preview, depsgraph, partial(preview.finish_frame, depsgraph))


def _begin(preview: Preview, depsgraph: bpy.types.Depsgraph) -> None:
    preview.handle(Event.PLAY, depsgraph, blocking=False)


def rest(depsgraph: bpy.types.Depsgraph, *, keep_playing: bool) -> None:
    """Put all hair back into its style; or, unless it keeps playing, into its baked frame."""
    for preview in tuple(previews.values()):
        if preview.is_playing and not keep_playing and preview.is_disabled(depsgraph):
            preview.stop_disabled(depsgraph)
            for each in shown_depsgraphs():
                each.scene.update_tag()  # has it read again in another window that shows it
            continue
        back = partial(_put_back, preview, depsgraph, keep_playing)
        attempt(preview, depsgraph, back)


def _put_back(preview: Preview, depsgraph: bpy.types.Depsgraph, keep_playing: bool) -> None:
    if keep_playing:
        preview.handle_or_raise(Event.RESET, depsgraph)
    else:
        preview.stop(depsgraph)
        if preview.is_resized(depsgraph):
            restart(preview, depsgraph)


def bake_changed(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
    """React to a bake that was made, deleted, shown or hidden."""
    folder = folder_of(obj)
    if folder is not None:
        playback.forget_bake(folder)
    preview = previews.get(obj.session_uid)
    if preview is None:
        return
    attempt(preview, depsgraph, partial(take_changed_bake, preview, depsgraph))
    redraw_panels()


def take_changed_bake(preview: Preview, depsgraph: bpy.types.Depsgraph) -> None:
    """Show a groom or fin by the bake that it has now, or at rest.

    Raises:
        HairloomError: an object that it is made of is gone or broken.
    """
    preview.forget_bake()
    preview.detach_from_timeline()
    preview.handle_or_raise(Event.STOP, depsgraph)
    groom = preview.groom
    baked = None if groom is None else baked_rig_for(preview.resolve(), depsgraph.scene)
    is_other = (
        groom is not None
        and baked is not None
        and not baked.rest_matrices.has_same_size(groom.rest_matrices)
    )
    if is_other or preview.is_resized(depsgraph):
        restart(preview, depsgraph)
    else:
        preview.take_bake(depsgraph)


def attempt(
    preview: Preview,
    depsgraph: bpy.types.Depsgraph,
    action: Callable[[], object],
    *,
    needs_gpu: bool = True,
) -> None:
    """Run an action and show the result; a preview that fails is stopped, with a notice.

    A bug of ours stops it too: the traceback is printed once, not at every later event.

    Args:
        needs_gpu: whether to only mark it to be read again later while there is no GPU.
    """
    session = preview.session
    if preview.is_disabled(depsgraph):
        if all(map(preview.is_disabled, shown_depsgraphs())):
            session.is_stale = True  # until it is evaluated again
            overlay.hide(session.uid)
        return  # if another window shows it, it must not be changed from here
    if needs_gpu and is_context_missing():
        session.is_stale = True
        redraw_views()
        refresh_views()  # triggers the update in which it is read again
        return
    try:
        action()
        if previews.get(session.uid) is preview:  # the action has not replaced it
            publish(preview, depsgraph)
    except Exception as error:
        if not isinstance(error, HairloomError):
            traceback.print_exc()
        previews.notice = f"Preview of {session.name} ended. {error}"
        print(f"Hairloom: {previews.notice}")
        stop(session)
        if isinstance(error, HairloomError):
            previews.ended.add(session.uid)


def publish(preview: Preview, depsgraph: bpy.types.Depsgraph) -> None:
    """Show a groom as it is; a fin shows itself.

    Raises:
        HairloomError: it is gone.
    """
    session = preview.groom
    if session is None:
        return
    hair = session.hair.resolve()
    note = "" if session.is_made else BUILDING
    if preview.phase is Phase.WAITING and not note:
        note = WAITING
    if note:
        note = f"{hair.name}: {note}"
    overlay.show(session.uid, overlay.read_drawing(session, hair, depsgraph, note))
    is_missing_lines = (
        session.scene_colliders is None and "colliders" in hair.hairloom.shown_overlays
    )
    if is_missing_lines and not fields.are_ready():
        schedule((session.uid, "lines"), partial(_show_lines, preview))
    refresh_panels()
    # our strands replace Blender's once they are made, in object mode and under a combing brush;
    # an overlay that has failed shows nothing
    is_replaced = (hair.mode == "OBJECT" or is_in_sculpt_mode(hair)) and not overlay.failure()
    hides = is_replaced and hair.hairloom.hide_original and session.is_made
    # without a head our shadow has nothing to fall on; there are casters only if shadows are on
    has_hairloom_shadow = session.settings[VolumeSettings].on_body and bool(
        session.snapshot.casters
    )
    show_originals(hair, depsgraph, show=not hides, has_hairloom_shadow=has_hairloom_shadow)


def _show_lines(preview: Preview) -> float | None:
    """A step of `latest_job`: show the lines of colliders once they are made."""
    if not fields.are_ready():
        return POLL_INTERVAL
    attempt(preview, bpy.context.evaluated_depsgraph_get(), lambda: None)
    redraw_panels()
    return None


def _take_finished_work(session: Session) -> None:
    """Show hair and cards that were made in the background."""
    preview = previews.get(session.uid)
    if preview is None or preview.session is not session:
        return
    depsgraph = _shown_depsgraph(preview)
    if depsgraph is None:
        return  # called again until some window shows it
    if session.has_result:
        attempt(preview, depsgraph, partial(_take_built, preview, session, depsgraph))
        refresh_views()  # to hide Blender's own strands, shown until now
    elif session.cards.has_result:
        attempt(preview, depsgraph, session.take_cards)
    redraw_panels()


def _shown_depsgraph(preview: Preview) -> bpy.types.Depsgraph | None:
    """The evaluated depsgraph of a window that shows it; None: no window does."""
    for window in bpy.context.window_manager.windows:
        depsgraph = window.view_layer.depsgraph
        if depsgraph is not None and not preview.is_disabled(depsgraph):
            with bpy.context.temp_override(window=window):
                return bpy.context.evaluated_depsgraph_get()
    return None


def finish(session: Session, depsgraph: bpy.types.Depsgraph) -> None:
    """Wait for hair that is being made; if it cannot be made, its preview ends.

    Raises:
        HairloomError: it is left out here, and will only be made when it is shown again.
    """
    preview = previews[session.uid]
    if preview.is_disabled(depsgraph):
        raise HairloomError(
            "it is in another scene, or its collection is hidden",
            place=session.name,
            remedy="Show it, or select other hair",
        )
    while session.is_pending and previews.get(session.uid) is preview:
        take = partial(_take_built, preview, session, depsgraph)
        attempt(preview, depsgraph, take, needs_gpu=False)


def _take_built(preview: Preview, session: Session, depsgraph: bpy.types.Depsgraph) -> None:
    was_made, is_lit = session.is_made, session.is_lighting
    session.take_made(depsgraph)
    if is_lit:
        return
    if was_made:
        preview.take_read_hair(depsgraph)
    else:
        preview.take_bake(depsgraph)
