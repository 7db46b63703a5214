"""Reactions of all previewed grooms and fins to Blender's events.

Reactions only read; they write nothing into bpy.data, with two exceptions. The evaluated copy of a
previewed object is shown as wires, so that Blender's own strands do not show among ours: the copy
is not saved, undone or rendered, and Blender makes a new one when it evaluates the object again.
And a fin is shown by an attribute of its own mesh.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial

import bpy

from ...dynamics.settings import DynamicsSettings
from ...errors import HairloomError
from ...groom.children_settings import ChildrenSettings
from ...groom.masks import mask_names
from ...shading.settings import ShadingSettings
from ..bakes import playback
from ..bakes.simulation import Simulation
from ..base import latest_job
from ..base.gpu_context import is_context_missing
from ..base.originals import refresh_views
from ..base.redraw import debounce, redraw_panels
from ..cards.made_objects import card_objects
from ..cards.occluders import occluder_objects
from ..scene.fin_modifier import fin_modifier
from ..sessions.session import Session
from ..viewport import view_transform
from . import fins
from . import previews as registry
from .phases import Event, Phase
from .preview import Preview
from .previews import attempt, previews

type _Brush = Callable[[bpy.types.Depsgraph], None]

#: Edits come in bursts, as brush strokes do: hair is read again after this time [s] without one.
SETTLING_TIME = 0.1

#: Shading uses coarse tables while a slider moves, full ones once it has rested this long [s].
REFINING_TIME = 0.3

#: types whose update may change the light on hair; hiding or deleting a light updates its scene
_LIGHTING = (bpy.types.Light, bpy.types.World, bpy.types.Collection, bpy.types.Scene)


def settings_changed(owner: bpy.types.ID) -> None:
    """Apply a changed setting; settings that act at once do."""
    depsgraph = bpy.context.view_layer.depsgraph
    for preview, session in _grooms():
        hair = session.hair.handle.find()
        if hair is not None and owner in (hair, hair.data):
            attempt(preview, depsgraph, partial(_take_settings, preview, session, depsgraph))
            session.is_stale |= session.has_changed_holders(set()) or session.has_changed_partings()
            if session.is_stale:
                _read_again_soon()
        elif occluders_changed(session, {owner.session_uid}, depsgraph.view_layer):
            _refresh_cards_soon(preview)


def _grooms() -> list[tuple[Preview, Session]]:
    """The previewed grooms; a list, since `attempt` may end one."""
    return [(each, each.groom) for each in previews.values() if each.groom is not None]


def _refresh_cards_soon(preview: Preview) -> None:
    preview.cards_are_stale = True
    _read_again_soon()


def _take_settings(preview: Preview, session: Session, depsgraph: bpy.types.Depsgraph) -> None:
    session.take_settings()
    _refine_soon(session)
    preview.compare_bake(depsgraph)


def display_changed(owner: bpy.types.ID) -> None:
    """React to showing or hiding Blender's own strands."""
    settings_changed(owner)
    refresh_views()


def updated(depsgraph: bpy.types.Depsgraph) -> None:
    """After an evaluation of the scene, follow what moved and read again what was edited."""
    moved, edited, light_changed = changes_in(depsgraph)
    for preview, session in _grooms():
        is_combed, is_painted = is_edited(session, edited), weights_changed(session, edited)
        if (
            is_combed
            or is_painted
            or session.has_changed_holders(edited)
            or session.has_changed_partings()
        ):
            session.is_stale = True
            session.forget_shown_map()
            _read_again_soon()
        elif session.is_stale and not bpy.app.timers.is_registered(_read_again):
            _read_again_soon()  # it was left out and is shown again
        if occluders_changed(session, moved, depsgraph.view_layer) or cards_edited(session, edited):
            _refresh_cards_soon(preview)
        follows = preview.phase is not Phase.FREE and has_moved(session, moved)
        brushes = [session.follow_combing] * is_combed + [session.follow_painted_masks] * is_painted
        colors = [session.follow_painted_colors] * is_painted
        update = partial(
            _update, preview, session, depsgraph, follows, light_changed, brushes, colors
        )
        attempt(preview, depsgraph, update)


def _update(
    preview: Preview,
    session: Session,
    depsgraph: bpy.types.Depsgraph,
    follows: bool,
    light_changed: bool,
    brushes: Sequence[_Brush],
    colors: Sequence[_Brush],
) -> None:
    """Follow lights, brushes and the body; brushes that change shape only where hair is at rest."""
    if light_changed:
        session.take_lights(depsgraph)
    for brush in (*colors, *(brushes if preview.phase is Phase.REST else ())):
        brush(depsgraph)
    if follows and preview.rest_if_moved(depsgraph) and preview.is_resized(depsgraph):
        session.is_stale = True
        _read_again_soon()


def frame_changed(depsgraph: bpy.types.Depsgraph) -> None:
    """After a frame change, simulate the hair, show it from its bake, or let it follow its body.

    Animated settings and lights apply. Curves that are animated themselves are not read again in
    every frame.
    """
    _, _, light_changed = changes_in(depsgraph)
    with registry.coupled_frame(depsgraph):
        for preview in tuple(previews.values()):
            attempt(preview, depsgraph, partial(_follow_frame, preview, depsgraph, light_changed))


def _follow_frame(preview: Preview, depsgraph: bpy.types.Depsgraph, light_changed: bool) -> None:
    session = preview.groom
    if session is not None:
        session.take_settings()
        _refine_soon(session)
        if light_changed:
            session.take_lights(depsgraph)
    is_free = preview.phase is Phase.FREE
    if preview.resolve().hairloom.bake.follows:
        # freely playing hair goes on swinging while the playhead is dragged; playback takes it over
        if not is_free or playback.is_animation_playing():
            preview.follow_frame(depsgraph)
    elif preview.phase is Phase.WAITING or not (is_free or preview.show_frame(depsgraph)):
        preview.handle_or_raise(Event.RESET, depsgraph)


def _refine_soon(session: Session) -> None:
    """Refine the shading once the slider rests; every move delays that."""
    if session.is_coarse:
        debounce(_refine, REFINING_TIME)


def _refine() -> None:
    """A timer for Blender: full shading tables once a slider is no longer moved."""
    depsgraph = bpy.context.view_layer.depsgraph
    for preview, session in _grooms():
        if session.is_coarse:
            attempt(preview, depsgraph, session.refine)


def undone() -> None:
    """After undo or redo, which may have changed anything, read everything again soon.

    What was made by an undone step is gone; that needs no report.
    """
    previews.ended_before_undo = set(previews.ended)
    for session in registry.simulations():
        if not _is_there(session):
            registry.stop(session)
            previews.ended.add(session.uid)
    for preview in previews.values():
        preview.session.is_stale = preview.cards_are_stale = True
        if not is_context_missing():
            preview.keep_moment()
    if previews:
        _read_again_soon()
    can_follow = previews or previews.ended or previews.cloth
    if can_follow and not bpy.app.timers.is_registered(follow_undo):
        bpy.app.timers.register(follow_undo, first_interval=0.0)


def follow_undo() -> None:
    """A timer for Blender: preview again what undo or redo brought back, put cloth without preview
    to rest, and follow curves that were put back, like curves under a brush."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    _resume_ended(depsgraph)
    registry.rest_ended_cloth()
    for preview, session in _grooms():
        if preview.phase is Phase.REST:
            attempt(preview, depsgraph, partial(session.follow_combing, depsgraph))
            attempt(preview, depsgraph, partial(session.follow_painted_masks, depsgraph))
        attempt(preview, depsgraph, partial(session.follow_painted_colors, depsgraph))


def _resume_ended(depsgraph: bpy.types.Depsgraph) -> None:
    """Preview objects again whose previews had ended before the undo, if they can be previewed.

    Evaluating what an undo took away, such as a head, ends previews, too: those stay ended.
    """
    ended = previews.ended_before_undo & previews.ended
    for obj in [each for each in bpy.data.objects if each.session_uid in ended]:
        if not obj.evaluated_get(depsgraph).is_evaluated:
            continue
        start = registry.start if obj.type == "CURVES" else fins.start
        with suppress(HairloomError):  # what ended it is still so
            start(obj, depsgraph)


def _is_there(session: Simulation) -> bool:
    """Whether its object exists, and is cloth if it was."""
    obj = session.bodies[0].handle.find()
    return obj is not None and (isinstance(session, Session) or fin_modifier(obj) is not None)


def _read_again_soon() -> None:
    previews.last_edit = time.monotonic()
    if not bpy.app.timers.is_registered(_read_again):
        bpy.app.timers.register(_read_again, first_interval=SETTLING_TIME)


def _read_again() -> float | None:
    """A timer for Blender: read what was edited once the edits have settled."""
    pause = time.monotonic() - previews.last_edit
    if pause < SETTLING_TIME:
        return SETTLING_TIME - pause
    catch_up(bpy.context.evaluated_depsgraph_get())
    return None


def catch_up(depsgraph: bpy.types.Depsgraph) -> None:
    """Read what was edited; hair in another size or on another head is previewed again."""
    for preview in tuple(previews.values()):
        if preview.session.is_stale:
            attempt(preview, depsgraph, partial(_read_preview, preview, depsgraph))
    for preview, session in _grooms():
        if preview.cards_are_stale:
            preview.cards_are_stale = False
            attempt(preview, depsgraph, session.refresh_cards)
    redraw_panels()


def _read_preview(preview: Preview, depsgraph: bpy.types.Depsgraph) -> None:
    session = preview.groom
    if session is None:
        preview.handle_or_raise(Event.RESET, depsgraph)
        preview.show_frame(depsgraph)
    elif session.has_changed_head() or preview.is_resized(depsgraph):
        registry.restart(preview, depsgraph)
        return
    else:
        session.read_again(depsgraph, blocking=latest_job.is_blocking())
        if preview.must_rest:
            preview.stop(depsgraph)
        if preview.has_other_bake():
            registry.take_changed_bake(preview, depsgraph)
        else:
            preview.take_read_hair(depsgraph)
    if preview.frame not in (None, depsgraph.scene.frame_current):
        # Blender does not report frames that undo and redo change
        _follow_frame(preview, depsgraph, light_changed=False)
    preview.return_to_kept_moment(depsgraph)


def clear() -> None:
    """Leave nothing behind: no preview, no timer, no notice."""
    registry.end()
    view_transform.clear_tables()
    latest_job.unschedule_all()
    for timer in (_read_again, _refine, follow_undo):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)


def changes_in(depsgraph: bpy.types.Depsgraph) -> tuple[set[int], set[int], bool]:
    """Session numbers of what moved or changed shape, and of what changed shape or is an image; and
    whether lights changed."""
    moved, edited, light_changed = set(), set(), False
    for update in depsgraph.updates:
        changed = update.id.original  # the evaluated copy has no session number
        if update.is_updated_geometry or update.is_updated_transform:
            moved.add(changed.session_uid)
        if update.is_updated_geometry or isinstance(changed, bpy.types.Image):
            edited.add(changed.session_uid)
        is_light = isinstance(changed, bpy.types.Object) and changed.type == "LIGHT"
        light_changed |= is_light or isinstance(changed, _LIGHTING)
    return moved, edited, light_changed


def is_edited(session: Session, edited: set[int]) -> bool:
    """Whether the curves themselves changed, not only modifiers that carry them with the head."""
    if session.uid not in edited:
        return False
    hair = session.hair.handle.find()
    is_carried = session.head is not None and session.head.handle.uid in edited
    return hair is not None and not (is_carried and len(hair.modifiers))


def weights_changed(session: Session, edited: set[int]) -> bool:
    """Whether the head's own mesh or an image changed, which may hold what is painted."""
    settings, hair = session.settings, session.hair.handle.find()
    if hair is None:
        return False
    names = {
        settings.children_density,
        *mask_names(settings[ChildrenSettings]).values(),
        *mask_names(settings[DynamicsSettings]).values(),
        settings[ShadingSettings].color_map,
        hair.hairloom.shown_map,
    } - {""}
    if session.head is None or not names:
        return False
    head, images = session.head.handle.find(), (bpy.data.images.get(name) for name in names)
    painted = {image.session_uid for image in images if image is not None}
    return head is not None and not edited.isdisjoint(painted | {head.data.session_uid})


def occluders_changed(session: Session, changed: set[int], layer: bpy.types.ViewLayer) -> bool:
    """Whether other hair that shades this groom's cards may have changed, appeared or vanished."""
    if not session.cards.is_shaded_by_others:
        return False
    others = occluder_objects(session.hair.handle.find(), layer)
    uids = {each.session_uid for each in others}
    data = {each.data.session_uid for each in others}
    return uids != session.cards.shaded_by or not changed.isdisjoint(uids | data)


def cards_edited(session: Session, edited: set[int]) -> bool:
    """Whether the artist may have changed the cards of this groom in the scene."""
    hair = session.hair.handle.find()
    if not edited or hair is None or not session.settings.shows_cards:
        return False
    cards = {uid for obj in card_objects(hair) for uid in (obj.session_uid, obj.data.session_uid)}
    return not edited.isdisjoint(cards)


def has_moved(session: Session, moved: set[int]) -> bool:
    """Whether the groom, its head, or what holds its hair has moved."""
    uids = {body.handle.uid for body in session.bodies}
    return not moved.isdisjoint(uids | session.holder_uids)
