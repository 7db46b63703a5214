"""The sample scene: a head that turns, long hair, three lights and a camera."""

from __future__ import annotations

from functools import partial

import bpy
import numpy as np
from mathutils import Vector

from ...groom.face_hair import grow_with_face
from ...groom.settings import GrowSettings
from ...groom.widths import with_widths
from ..base.parts import Part, Parts, new_blocks_removed_on_error
from ..base.vertex_weights import read_weights
from ..scene.bust import bust_object, encoded_skin_picture
from ..scene.bust_data import HAIR_GROUPS
from ..scene.curves import write_curves
from ..scene.surfaces import read_surface
from ..viewport.overlay import ENGINE
from .starting import apply_presets, check_presets

NAME = "Hairloom Sample"
_FRAMES = 96
#: frame -> turn about the vertical axis and nod [degrees]; the last equals the first
_TURNS = ((1, 0.0, 0.0), (20, 35.0, -4.0), (34, 20.0, 8.0), (56, -35.0, -4.0), (76, -10.0, 6.0))
#: name -> position [m], power [W], side [m], colour
_LIGHTS = {
    "Key": ((-0.7, -0.9, 0.8), 24.0, 0.5, (1.0, 0.96, 0.9)),
    "Fill": ((0.9, -0.7, 0.2), 8.0, 0.9, (0.85, 0.92, 1.0)),
    "Rim": ((-0.8, 0.8, 0.3), 6.0, 0.4, (1.0, 1.0, 1.0)),
}
_CAMERA_PLACE, _LENS = (-0.34, -0.68, 0.02), 58.0
#: target of camera and lights; below the middle of the head, for hanging hair and shoulders
_TARGET = Vector((0.0, 0.0, -0.07))
_WORLD = (0.05, 0.058, 0.07, 1.0)
_FILM_LOOK = "AgX - Medium High Contrast"
#: long enough to swing
_HAIR = GrowSettings(strand_count=6000, length=0.26)


def add_sample_scene(
    presets: tuple[str, ...], skin: str = "light"
) -> Parts[tuple[bpy.types.Scene, bpy.types.Object]]:
    """A new scene, rendered by Hairloom, with its groom; existing scenes are not changed.

    Args:
        presets: of the groom, by name.
        skin: of the head, one of bust_skin.TONES.

    Raises:
        HairloomError: there is no such preset.
    """
    check_presets(presets)
    yield Part("Painting the skin", partial(encoded_skin_picture, skin))  # fills its cache
    with new_blocks_removed_on_error() as note:
        scene, head = _scene_with_head(skin)
        note()
        layer = scene.view_layers[0]
        layer.update()
        hair = yield from _grown(head, layer.depsgraph, scene.collection)
    apply_presets(hair, presets)
    hair.hairloom.bake.follows = True
    return scene, hair


def _scene_with_head(skin: str) -> tuple[bpy.types.Scene, bpy.types.Object]:
    scene = bpy.data.scenes.new(NAME)
    scene.frame_start, scene.frame_end, scene.frame_current = 1, _FRAMES, 1
    scene.render.engine = ENGINE
    scene.render.resolution_x, scene.render.resolution_y = 800, 800
    scene.world = _world()
    scene.view_settings.view_transform, scene.view_settings.look = "AgX", _FILM_LOOK
    scene.unit_settings.length_unit = "ADAPTIVE"  # hair has millimetres
    collection = scene.collection
    head = bust_object("Head", skin)
    head.rotation_mode = "XYZ"
    collection.objects.link(head)
    _animate(head)
    for name, (place, power, side, color) in _LIGHTS.items():
        collection.objects.link(_light(name, place, power, side, color))
    scene.camera = _camera()
    collection.objects.link(scene.camera)
    return scene, head


def _grown(
    head: bpy.types.Object, depsgraph: bpy.types.Depsgraph, collection: bpy.types.Collection
) -> Parts[bpy.types.Object]:
    """Hair grown by the vertex groups of the head."""
    surface = read_surface(head, depsgraph, need_uv=True, place=head.name)
    weights = {name: read_weights(head, depsgraph, name) for name in HAIR_GROUPS}
    strands = yield Part(
        f"Growing {_HAIR.strand_count:,} strands",
        lambda: with_widths(grow_with_face(surface, _HAIR, weights), "found")[0],
    )
    return write_curves(f"{head.name} Hair", strands, head, collection, are_widths_estimated=True)


def _animate(head: bpy.types.Object) -> None:
    """Let the head look to both sides, in a loop."""
    for frame, turn, nod in (*_TURNS, (_FRAMES + 1, *_TURNS[0][1:])):
        head.rotation_euler = np.radians((nod, 0.0, turn))
        head.keyframe_insert("rotation_euler", frame=frame)
    head.rotation_euler = (0.0, 0.0, 0.0)


def _light(
    name: str,
    place: tuple[float, ...],
    power: float,
    side: float,
    color: tuple[float, ...],
) -> bpy.types.Object:
    data = bpy.data.lights.new(name, "AREA")
    data.energy, data.size, data.color = power, side, color
    return _aimed_at_target(name, data, place)


def _camera() -> bpy.types.Object:
    data = bpy.data.cameras.new("Camera")
    data.lens, data.clip_start = _LENS, 0.01
    return _aimed_at_target("Camera", data, _CAMERA_PLACE)


def _aimed_at_target(name: str, data: bpy.types.ID, place: tuple[float, ...]) -> bpy.types.Object:
    obj = bpy.data.objects.new(name, data)
    obj.location = place
    obj.rotation_euler = (_TARGET - Vector(place)).to_track_quat("-Z", "Y").to_euler()
    return obj


def _world() -> bpy.types.World:
    world = bpy.data.worlds.new(NAME)
    background = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = _WORLD
    return world
