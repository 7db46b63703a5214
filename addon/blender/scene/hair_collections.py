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
    hair: bpy.types.Object, setting: str, kind: str, name: str, context: bpy.types.Context
) -> None:
    """Take an object out of a collection of the hair, but not out of the scene.

    Args:
        name: of the object; "": the active or selected one, or the only one.

    Raises:
        HairloomError: it is not in that collection itself, or there are several and none is named.
    """
    collection = getattr(hair.hairloom, setting)
    obj = None if collection is None else collection.objects.get(name)
    if not name:
        obj = _unnamed_object(hair, collection, kind.lower(), context)
    if obj is None or not accepts_objects(collection):
        raise HairloomError(
            f"it is not in a local collection of {kind.lower()}",
            place=name or hair.name,
            remedy="Name an object of that collection, or remove it from the collection that it "
            "is in",
        )
    if len(obj.users_collection) == 1:
        context.scene.collection.objects.link(obj)
    collection.objects.unlink(obj)
    setattr(hair.hairloom, setting, collection)


def _unnamed_object(
    hair: bpy.types.Object,
    collection: bpy.types.Collection | None,
    kind: str,
    context: bpy.types.Context,
) -> bpy.types.Object:
    """The object of a collection that is meant where none is named.

    Raises:
        HairloomError: there is none, or there are several.
    """
    objects = [] if collection is None else list(collection.objects)
    if not objects:
        raise HairloomError(f"it has no {kind} of its own", place=hair.name, remedy="Add one first")
    if context.active_object in objects:
        return context.active_object
    chosen = [obj for obj in objects if obj in context.selected_objects] or objects
    if len(chosen) > 1:
        names = ", ".join(sorted(obj.name for obj in chosen))
        raise HairloomError(
            f"it has several {kind}, and none is named",
            place=hair.name,
            remedy=f"Select or name one of {names}",
        )
    return chosen[0]
