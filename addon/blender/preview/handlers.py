"""Handlers that pass Blender's events on to the previews."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..bakes import baked_copy, playback
from ..base import event_handlers, suspension
from ..base.latest_job import unschedule_all
from ..base.redraw import show_status
from ..cards.made_objects import store_object_names, store_session_uids
from ..properties import changed, library_overrides
from ..scene import mesh_materials
from ..viewport import views
from . import previews as registry
from . import scene_events
from .previews import previews


@persistent
def on_load_pre(*_: Any) -> None:
    registry.forget_all()
    mesh_materials.clear_cache()
    unschedule_all()  # Blender drops the timer itself
    show_status(None)  # Play's ticks, which would have removed it, are unscheduled too


@persistent
def on_load_post(*_: Any) -> None:
    registry.forget_all()
    store_session_uids()
    _restore_hair()


@persistent
def on_load_fail(*_: Any) -> None:
    """The scene that was open stays open, but nothing in it is previewed any longer."""
    registry.show_all_unpreviewed()


@persistent
def on_save_pre(*_: Any) -> None:
    library_overrides.access_all_groups()
    store_object_names()
    _restore_hair()


def _restore_hair() -> None:
    for name in baked_copy.restore_hair_without_copy():
        print(f"Hairloom: {name} is in renders again, since the copy that showed its bake is gone")


@persistent
def on_undo_post(*_: Any) -> None:
    scene_events.undone()


@persistent
def on_depsgraph_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    views.invalidate_pictures()
    previews.built_cards.forget_gone()
    _react(scene_events.updated, depsgraph)


@persistent
def on_frame_change(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    views.invalidate_pictures()
    _react(scene_events.frame_changed, depsgraph)


@persistent
def on_frame_change_begin(scene: bpy.types.Scene, *_: Any) -> None:
    """Runs in renders too, in the render's thread, and so writes only what is baked."""
    playback.show_fins(scene)  # also while suspended: baked and exported hair collides with them
    if suspension.is_suspended():
        return
    if playback.must_update_copies():
        playback.show_in_copies(scene)


@persistent
def on_render_begin(*_: Any) -> None:
    playback.set_rendering(True)
    baked_copy.follow_visibility()


@persistent
def on_render_end(*_: Any) -> None:
    playback.set_rendering(False)


def _react(reaction: Callable[[bpy.types.Depsgraph], None], depsgraph: bpy.types.Depsgraph) -> None:
    """React to one event at a time; never in renders, which have their own scene and thread."""
    if previews.is_reacting or suspension.is_suspended() or not previews:
        return
    if depsgraph.mode != "VIEWPORT":
        return
    previews.is_reacting = True
    try:
        reaction(depsgraph)
    finally:
        previews.is_reacting = False


HANDLERS = (
    (bpy.app.handlers.load_pre, on_load_pre),
    (bpy.app.handlers.load_post, on_load_post),
    (bpy.app.handlers.load_post_fail, on_load_fail),
    (bpy.app.handlers.save_pre, on_save_pre),
    (bpy.app.handlers.undo_post, on_undo_post),
    (bpy.app.handlers.redo_post, on_undo_post),
    (bpy.app.handlers.depsgraph_update_post, on_depsgraph_update),
    (bpy.app.handlers.frame_change_pre, on_frame_change_begin),
    (bpy.app.handlers.frame_change_post, on_frame_change),
    (bpy.app.handlers.render_init, on_render_begin),
    (bpy.app.handlers.render_complete, on_render_end),
    (bpy.app.handlers.render_cancel, on_render_end),
)


def on_bake_changed(owner: bpy.types.ID) -> None:
    if not suspension.is_suspended():
        registry.bake_changed(owner, bpy.context.evaluated_depsgraph_get())


#: kind of changed property -> the reaction
LISTENERS = (
    ("settings", scene_events.settings_changed),
    ("display", scene_events.display_changed),
    ("bake", on_bake_changed),
)


def register() -> None:
    event_handlers.append(HANDLERS)
    for kind, listener in LISTENERS:
        changed.subscribe(kind, listener)


def unregister() -> None:
    for kind, listener in reversed(LISTENERS):
        changed.unsubscribe(kind, listener)
    event_handlers.remove(HANDLERS)
