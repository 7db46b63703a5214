"""Objects of the scene that hold the cards of a groom, as opposed to copies of these objects."""

from __future__ import annotations

import bpy


def card_objects(hair: bpy.types.Object) -> list[bpy.types.Object]:
    """The objects that hold the cards of a groom, finest first; without copies of them."""
    of_groom = [obj for obj in _all_cards() if obj.hairloom.card_object.groom == hair]
    made = {obj.hairloom.card_object.level: obj for obj in of_groom if _has_made_name(obj)}
    made |= {obj.hairloom.card_object.level: obj for obj in of_groom if _has_made_uid(obj)}
    return [made[level] for level in sorted(made)]


def store_object_names() -> None:
    """Store the names of made objects before a file is saved: session numbers are not saved."""
    cards = _all_cards()
    made = {_groom_and_level(obj) for obj in cards if _has_made_uid(obj)}
    for obj in cards:
        if _has_made_uid(obj):
            obj.hairloom.card_object.made_name = obj.name
        elif _groom_and_level(obj) in made:  # a copy may have the made object's earlier name
            obj.hairloom.card_object.made_name = ""


def store_session_uids() -> None:
    """Store session numbers of made objects after a file was opened, before any is renamed."""
    for obj in _all_cards():
        is_made = _has_made_name(obj) and obj.library is None
        obj.hairloom.card_object.made_uid = obj.session_uid if is_made else 0


def _all_cards() -> list[bpy.types.Object]:
    meshes = (obj for obj in bpy.data.objects if obj.type == "MESH")
    return [obj for obj in meshes if obj.hairloom.card_object.groom is not None]


def _groom_and_level(obj: bpy.types.Object) -> tuple[bpy.types.Object, int]:
    """The groom and the level of the cards in an object."""
    return obj.hairloom.card_object.groom, obj.hairloom.card_object.level


def _has_made_uid(obj: bpy.types.Object) -> bool:
    return bool(obj.hairloom.card_object.made_uid == obj.session_uid)


def _has_made_name(obj: bpy.types.Object) -> bool:
    return bool(obj.hairloom.card_object.made_name == obj.name)
