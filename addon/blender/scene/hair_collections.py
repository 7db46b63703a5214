"""Collections named in the settings of hair, with the objects that act on it, such as its ties."""

from __future__ import annotations

import bpy

from ...errors import HairloomError
from ..base.objects import accepts_objects


def objects_in(hair: bpy.types.Object, setting: str) -> tuple[bpy.types.Object, ...]:
    """The objects in a collection of the hair, each once."""
    collection = getattr(hair.hairloom, setting)
    objects = () if collection is None else collection.all_objects
    return tuple(obj for obj in dict.fromkeys(objects) if obj is not None and obj != hair)


def add_to_collection(
    hair: bpy.types.Object,
    setting: str,
    kind: str,
    objects: list[bpy.types.Object],
    scene: bpy.types.Scene,
) -> None:
    """Put objects into a collection of the hair.

    The collection is made if there is none. A linked or overridden one becomes the child of a new
    one.

    Args:
        setting: the property of the hair that names it.
        kind: what it holds, such as "Ties".
    """
    collection = getattr(hair.hairloom, setting)
    if collection is None or not accepts_objects(collection):
        inner, collection = collection, bpy.data.collections.new(f"{hair.name} {kind}")
        scene.collection.children.link(collection)
        if inner is not None:
            collection.children.link(inner)
    for obj in objects:
        if obj not in collection.all_objects.values():
            collection.objects.link(obj)
    setattr(hair.hairloom, setting, collection)


def remove_from_collection(
    hair: bpy.types.Object, setting: str, kind: str, name: str, scene: bpy.types.Scene
) -> None:
    """Take an object out of a collection of the hair, but not out of the scene.

    Raises:
        HairloomError: it is not in that collection itself.
    """
    collection = getattr(hair.hairloom, setting)
    obj = None if collection is None else collection.objects.get(name)
    if obj is None or not accepts_objects(collection):
        raise HairloomError(
            f"it is not in a local collection of {kind.lower()}",
            place=name or hair.name,
            remedy="Name an object of that collection, or remove it from the collection that it "
            "is in",
        )
    if len(obj.users_collection) == 1:
        scene.collection.objects.link(obj)
    collection.objects.unlink(obj)
    setattr(hair.hairloom, setting, collection)
