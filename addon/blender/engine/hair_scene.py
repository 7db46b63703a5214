"""Hair over the pictures of EEVEE and Cycles, by a scene that draws the hair of another.

The hair scene is empty. Its engine is Hairloom, and the artist's scene is its background set, whose
objects it shows. The compositor of the artist's scene uses both: Blender renders each with its own
engine, with progress, cancel and the frames of an animation, and the node group *Hairloom Hair*
darkens Blender's picture by the shadow of the hair and lays the hair over it.

During a render, hair curves are hidden from Blender's own engine. A property keeps the artist's
visibility, from which it is restored, also in a file that was saved meanwhile.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..base import event_handlers
from ..properties import changed
from ..viewport.overlay import ENGINE
from . import hair_compositor

#: kinds of rays that an object can be hidden from, in the order of the bits in `hidden_rays`
RAYS = ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow")
#: bit that is set while hair is hidden
HIDDEN = 1 << len(RAYS)
_CAMERA = 1 << RAYS.index("camera")
#: render settings that the hair scene copies from the artist's scene
_RENDER = (
    *("resolution_x", "resolution_y", "resolution_percentage", "pixel_aspect_x", "pixel_aspect_y"),
    *("use_border", "use_crop_to_border", "border_min_x", "border_min_y"),
    *("border_max_x", "border_max_y", "filter_size", "fps", "fps_base"),
    *("frame_map_old", "frame_map_new"),
    *("use_motion_blur", "motion_blur_position", "motion_blur_shutter"),
    *("use_multiview", "views_format"),
)
#: settings that its view layer copies from that of the artist's scene
_LAYER = (
    *("use_pass_z", "use_pass_normal", "use_pass_vector", "use_pass_object_index"),
    *("use_pass_cryptomatte_object", "pass_cryptomatte_depth"),
)


def hair_scene_of(scene: bpy.types.Scene) -> bpy.types.Scene | None:
    """The scene that draws the hair of this one; None where there is none."""
    hair_scene = scene.hairloom.hair_scene
    # a copy of a scene still points to the hair scene of its original
    return hair_scene if hair_scene is not None and hair_scene.background_set == scene else None


def drawn_scene(scene: bpy.types.Scene) -> bpy.types.Scene | None:
    """The scene whose hair this one draws; None for a scene that is no hair scene."""
    shown = scene.background_set
    is_hair_scene = shown is not None and shown.hairloom.hair_scene == scene.original
    return shown if is_hair_scene else None


def drawn_layer(scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    """The view layer that a background set shows of a scene: the first one that is rendered."""
    return next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])


def is_needed(scene: bpy.types.Scene) -> bool:
    """Whether a scene's engine is not ours, so that the hair scene draws its hair."""
    return scene.render.engine != ENGINE


def is_visible_to_camera(hair: bpy.types.Object) -> bool:
    """Whether curves are visible to the camera by the artist's setting, also while hidden."""
    hidden = hair.hairloom.hidden_rays
    return bool(hidden & _CAMERA) if hidden else hair.visible_camera


def problem_of(scene: bpy.types.Scene) -> str:
    """Why Blender's engine draws the hair instead of Hairloom; empty if it does not."""
    hair = hair_scene_of(scene)
    if hair is None:
        return "The scene that draws the hair is gone. Turn Hairloom Hair off and on."
    if not scene.render.use_compositing:
        return "Compositing is off. Turn it on in Post Processing."
    if scene.render.use_sequencer and scene.sequence_editor and scene.sequence_editor.strips:
        return "The sequencer is rendered. Turn it off in Post Processing."
    if not hair_compositor.is_linked(scene, hair):
        return (
            "The compositor does not use the hair. Turn Hairloom Hair off and on, with Render "
            "Layers of this scene in the compositor."
        )
    return ""


def on_switched(scene: bpy.types.Scene) -> None:
    """Add or remove the hair scene after the artist has switched *Hairloom Hair*."""
    hair = hair_scene_of(scene)
    if scene.hairloom.use_hair_scene and hair is None:
        _add_hair_scene(scene)
    elif not scene.hairloom.use_hair_scene:
        scene.hairloom.hair_scene = None
        hair_compositor.unlink(scene, hair)
        if hair is not None:
            bpy.data.scenes.remove(hair)


def _add_hair_scene(scene: bpy.types.Scene) -> None:
    hair = bpy.data.scenes.new(f"{scene.name} Hair")
    hair.render.engine = ENGINE
    hair.render.film_transparent = True
    hair.background_set, hair.hairloom.is_hair_scene = scene, True
    scene.hairloom.hair_scene = hair
    # the window must not draw while a render's thread hides hair
    scene.render.use_lock_interface = True
    copy_settings(scene, hair)
    hair_compositor.link(scene, hair, drawn_layer(scene).name)


def copy_settings(scene: bpy.types.Scene, hair: bpy.types.Scene) -> None:
    """Copy camera, world, picture settings and passes of the artist's scene to the hair scene."""
    pairs = [(scene.render, hair.render, name) for name in _RENDER]
    pairs += [(scene, hair, name) for name in ("camera", "world", "frame_start", "frame_end")]
    for section in ("picture", "mesh_shadows"):
        source, target = getattr(scene.hairloom, section), getattr(hair.hairloom, section)
        pairs += [(source, target, name) for name in source.__annotations__]
    _copy_properties(pairs)
    _copy_passes(scene, hair)
    is_used = {view.name: view.use for view in scene.render.views}
    for view in hair.render.views:
        view.use = is_used.get(view.name, False)


def _copy_passes(scene: bpy.types.Scene, hair: bpy.types.Scene) -> None:
    """Copy the passes of the view layer whose hair is drawn to the hair scene."""
    source, target = drawn_layer(scene), hair.view_layers[0]
    names = source.hairloom.__annotations__
    of_hair = ((source.hairloom, target.hairloom, name) for name in names)
    _copy_properties([*((source, target, name) for name in _LAYER), *of_hair])


def _copy_properties(pairs: Iterable[tuple[Any, Any, str]]) -> None:
    """Copy properties by name from source to target, where they differ."""
    for source, target, name in pairs:
        value = getattr(source, name)
        if getattr(target, name) != value:
            setattr(target, name, value)


def on_passes_changed(scene: bpy.types.Scene) -> None:
    """Update the passes after the artist has switched one."""
    for layer in scene.view_layers:
        layer.update_render_passes()
    hair = hair_scene_of(scene)
    if hair is not None:
        _copy_passes(scene, hair)


def _hair_in(collection: bpy.types.Collection, visited: set[str]) -> Iterator[bpy.types.Object]:
    """All hair curves of a collection, also in collections that it instances."""
    for obj in collection.all_objects:
        if obj.type == "CURVES":
            yield obj
        inner = obj.instance_collection if obj.instance_type == "COLLECTION" else None
        if inner is not None and inner.name_full not in visited:
            visited.add(inner.name_full)
            yield from _hair_in(inner, visited)


def _is_drawn(hair: bpy.types.Object, layer: bpy.types.ViewLayer) -> bool:
    """Whether a picture shows the hair itself, not a hole in its place, or its shadows alone, which
    are left to Blender's own engine."""
    is_holdout = hair.is_holdout or hair.holdout_get(view_layer=layer)
    is_seen = hair.visible_camera and not hair.indirect_only_get(view_layer=layer)
    return bool(is_seen and not is_holdout)


def hide_hair(scene: bpy.types.Scene) -> None:
    """Hide the hair curves that the hair scene draws from Blender's own engine."""
    layer = drawn_layer(scene)
    for hair in _hair_in(scene.collection, set()):
        if hair.hairloom.hidden_rays or not _is_drawn(hair, layer):
            continue
        bits = (getattr(hair, f"visible_{ray}") << number for number, ray in enumerate(RAYS))
        hair.hairloom.hidden_rays = HIDDEN | sum(bits)
        for ray in RAYS:
            setattr(hair, f"visible_{ray}", False)


def show_hair() -> None:
    """Restore the artist's visibility of all hair curves."""
    for hair in bpy.data.objects:
        hidden = hair.hairloom.hidden_rays if hair.type == "CURVES" else 0
        if hidden:
            for number, ray in enumerate(RAYS):
                setattr(hair, f"visible_{ray}", bool(hidden & 1 << number))
            hair.hairloom.hidden_rays = 0


@persistent
def on_render_begin(scene: bpy.types.Scene, *_: object) -> None:
    """Prepare the hair scene; runs in the render's thread, and writes only what no other reads."""
    hair = hair_scene_of(scene)
    if hair is None:
        return
    copy_settings(scene, hair)
    if not is_needed(scene):
        return
    problem = problem_of(scene)
    if problem:
        print(f"Hairloom: {scene.name}: Blender draws the hair. {problem}")


@persistent
def on_frame_begin(scene: bpy.types.Scene, *_: object) -> None:
    """Update the camera, which may change at any frame, and hide hair, which a save shows again."""
    _copy_camera(scene)
    if hair_scene_of(scene) is not None and is_needed(scene) and not problem_of(scene):
        hide_hair(scene)


def _copy_camera(scene: bpy.types.Scene) -> None:
    hair = hair_scene_of(scene)
    if hair is not None and hair.camera != scene.camera:
        hair.camera = scene.camera


@persistent
def on_render_end(*_: object) -> None:
    show_hair()


@persistent
def on_undo(*_: object) -> None:
    """Restore hair after undo or redo to a step that was pushed during a render."""
    show_hair()


@persistent
def on_update(scene: bpy.types.Scene, *_: object) -> None:
    """Keep the hair scene up to date: before a render, Blender needs a camera in all scenes of a
    compositor, and nodes of the compositor show the passes of their scene."""
    _copy_camera(scene)
    hair = hair_scene_of(scene)
    if hair is not None:
        _copy_passes(scene, hair)


@persistent
def repair(*_: object) -> None:
    """Restore hair in files saved during a render, and remove hair scenes whose scene is gone."""
    show_hair()
    in_use = {scene.hairloom.hair_scene for scene in bpy.data.scenes}
    for scene in list(bpy.data.scenes):
        if scene.hairloom.is_hair_scene and scene not in in_use and len(bpy.data.scenes) > 1:
            bpy.data.scenes.remove(scene)


HANDLERS = (
    (bpy.app.handlers.render_init, on_render_begin),
    (bpy.app.handlers.render_pre, on_frame_begin),
    (bpy.app.handlers.render_complete, on_render_end),
    (bpy.app.handlers.render_cancel, on_render_end),
    (bpy.app.handlers.undo_post, on_undo),
    (bpy.app.handlers.redo_post, on_undo),
    (bpy.app.handlers.depsgraph_update_post, on_update),
    (bpy.app.handlers.load_post, repair),
    (bpy.app.handlers.save_pre, repair),
)


#: properties -> functions that are called when the artist has changed them
LISTENERS = (("hair_scene", on_switched), ("passes", on_passes_changed))


def register() -> None:
    event_handlers.append(HANDLERS)
    for listener in LISTENERS:
        changed.subscribe(*listener)


def unregister() -> None:
    for listener in LISTENERS:
        changed.unsubscribe(*listener)
    event_handlers.remove(HANDLERS)
