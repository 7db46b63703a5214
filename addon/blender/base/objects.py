"""Finding objects again, and how far they have moved.

A Python reference to a data-block becomes invalid at undo, at loading, and when the data-block is
deleted. Its session number stays valid.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError

type LayerKey = tuple[int, str]

#: above this ratio of scales along two axes, an object counts as flat
_MAX_CONDITION_NUMBER = 1e6

#: remedy for a linked object whose settings must change
OVERRIDE = "Make a library override of it (Object > Library Override > Make)"


class ObjectGoneError(HairloomError):
    """An object no longer exists."""


@dataclass
class Handle:
    """An object by its session number; the name only speeds up the search."""

    uid: int
    name: str

    @classmethod
    def of(cls, obj: bpy.types.Object) -> Handle:
        return cls(obj.session_uid, obj.name)

    def find(self) -> bpy.types.Object | None:
        """The object, also after undo and renaming; None if it no longer exists."""
        obj = bpy.data.objects.get(self.name)
        if obj is None or obj.session_uid != self.uid:
            obj = next((each for each in bpy.data.objects if each.session_uid == self.uid), None)
        if obj is not None:
            self.name = obj.name
        return obj

    def resolve(self, remedy: str = "Press Preview again") -> bpy.types.Object:
        """The object.

        Raises:
            ObjectGoneError: it no longer exists.
        """
        obj = self.find()
        if obj is None:
            raise ObjectGoneError("this object is gone", place=self.name, remedy=remedy)
        return obj


@dataclass
class Body:
    """An object whose motion is tracked from a moment called rest.

    rest: (4, 4) its matrix_world at rest.
    """

    handle: Handle
    rest: Floats

    @classmethod
    def at_rest(cls, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Body:
        return cls(Handle.of(obj), matrix_of(obj, depsgraph))

    def resolve(self) -> bpy.types.Object:
        """The object.

        Raises:
            ObjectGoneError: it no longer exists.
        """
        return self.handle.resolve()

    def motion_from_rest(self, depsgraph: bpy.types.Depsgraph) -> Floats:
        """(4, 4), from where it was at rest to where it is now.

        Raises:
            ObjectGoneError: it no longer exists.
        """
        return matrix_of(self.resolve(), depsgraph) @ np.linalg.pinv(self.rest)


def objects_in(layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """The objects of a view layer, whose list holds None for one that was just removed."""
    return [obj for obj in layer.objects if obj is not None]


@contextmanager
def as_mesh(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> Iterator[bpy.types.Mesh | None]:
    """The mesh that an object is drawn as, even in Edit Mode, in its own space; None where it has
    none, such as an Empty. It is freed at the end of the block."""
    evaluated = obj.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        yield mesh
    finally:
        evaluated.to_mesh_clear()


def matrix_of(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Floats:
    """(4, 4) float64, from object to world space, as evaluated."""
    return np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)


def check_editable(obj: bpy.types.Object) -> None:
    """Raises:
    HairloomError: it cannot be changed in this file.
    """
    if not obj.is_editable or (obj.data is not None and not obj.data.is_editable):
        raise HairloomError(
            "it is linked from another file", place=obj.name, remedy="Make it local in Blender"
        )


def check_settings_editable(obj: bpy.types.Object) -> None:
    """As `check_editable`, for the settings of the object itself, which an override can change.

    Blender forgets changes of linked data with the file, and crashes on undo where linked data
    refers to what the undo removes.

    Raises:
        HairloomError: it cannot be changed in this file.
    """
    if not obj.is_editable:
        raise HairloomError("it is linked from another file", place=obj.name, remedy=OVERRIDE)


def is_shape_editable(obj: bpy.types.Object) -> bool:
    """Whether an object's points and weights can be changed in this file. A library override can
    change settings only: Blender ignores some other changes silently, and drops others when the
    file is saved."""
    data = obj.data
    if data is None:
        return bool(obj.is_editable)
    return bool(obj.is_editable and data.is_editable and data.override_library is None)


def check_shape_editable(obj: bpy.types.Object) -> None:
    """Raises:
    HairloomError: its points and weights cannot be changed in this file.
    """
    check_editable(obj)
    if not is_shape_editable(obj):
        kind = "curves" if obj.type == "CURVES" else "mesh"
        raise HairloomError(
            f"it is a library override, which cannot change the {kind} of the other file",
            place=obj.name,
            remedy="Make object and data local in Blender (Object > Relations > Make Local)",
        )


def check_curves_editable(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
    """As `check_shape_editable`, for edits that place points in world space.

    Raises:
        HairloomError: see there; or the object's matrix cannot be inverted.
    """
    check_shape_editable(hair)
    if not np.linalg.cond(matrix_of(hair, depsgraph)[:3, :3]) < _MAX_CONDITION_NUMBER:
        raise HairloomError(
            "it or one of its parents is scaled to 0 along an axis",
            place=hair.name,
            remedy="Correct Scale in the Object properties",
        )


def accepts_objects(collection: bpy.types.Collection) -> bool:
    """Whether objects can be added to a collection: it is neither linked nor overridden."""
    return bool(collection.is_editable and collection.override_library is None)


def link_into(
    obj: bpy.types.Object, collections: Iterable[bpy.types.Collection], scene: bpy.types.Scene
) -> None:
    """Put an object into these collections, or into the scene's if none of them takes objects."""
    for collection in list(filter(accepts_objects, collections)) or [scene.collection]:
        if obj.name not in collection.objects:
            collection.objects.link(obj)


def remove_hair(hair: bpy.types.Object) -> None:
    """Delete hair, and its curves if nothing else uses them."""
    curves = hair.data
    bpy.data.objects.remove(hair)
    if not curves.users:
        bpy.data.hair_curves.remove(curves)


def head_of(hair: bpy.types.Object) -> bpy.types.Object | None:
    """The mesh object that hair grows on: its surface, else its parent if that is a mesh.

    Linked duplicates of hair and head share the curves, whose surface is the first head. The head
    of such a duplicate is its parent, if that has the same mesh as the surface.
    """
    surface, parent = hair.data.surface, hair.parent
    carrier = parent if parent is not None and parent.type == "MESH" else None
    if surface is None or surface.type != "MESH":
        return carrier
    return carrier if carrier is not None and carrier.data == surface.data else surface


def objects_using(data: bpy.types.ID) -> list[bpy.types.Object]:
    """The objects that share this data, such as linked duplicates."""
    return [obj for obj in bpy.data.objects if obj.data == data]


def is_solid(obj: bpy.types.Object) -> bool:
    """Whether 3D views draw it as a solid object that hides what is behind it."""
    with _without_area():
        return bool(obj.visible_get() and obj.display_type in {"SOLID", "TEXTURED"})


def is_hidden(obj: bpy.types.Object, layer: bpy.types.ViewLayer) -> bool:
    """Whether neither the views nor the renders of a view layer show an object; hair counts as
    shown in renders if the copy that plays its bake is."""
    bake = obj.hairloom.bake
    is_hidden_in_renders = bake.was_hidden if bake.hides else obj.hide_render
    is_hidden_in_renders |= all(collection.hide_render for collection in obj.users_collection)
    with _without_area():
        return bool(is_hidden_in_renders and not obj.visible_get(view_layer=layer))


def without_hidden(
    objects: Iterable[bpy.types.Object], depsgraph: bpy.types.Depsgraph
) -> tuple[list[bpy.types.Object], tuple[str, ...]]:
    """The objects that are neither hidden in views and renders nor hair without curves; and why
    the others are left out. For jobs without objects chosen by the user."""
    visible, left_out = [], []
    for obj in objects:
        if is_hidden(obj, depsgraph.view_layer):
            left_out.append(f"{obj.name}: it is hidden in viewport and renders")
        elif obj.type == "CURVES" and not len(obj.evaluated_get(depsgraph).data.curves):
            left_out.append(f"{obj.name}: it has no curves")
        else:
            visible.append(obj)
    return visible, tuple(left_out)


def layers_showing(obj: bpy.types.Object) -> frozenset[LayerKey]:
    """The view layers of all scenes that show an object; local view is not considered."""
    with _without_area():
        return frozenset(
            layer_key(scene, layer)
            for scene in bpy.data.scenes
            for layer in scene.view_layers
            if obj.visible_get(view_layer=layer)
        )


def layer_key(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> LayerKey:
    """A key of a view layer, which stays the same after undo."""
    return scene.session_uid, layer.name


def spaces_hiding(obj: bpy.types.Object) -> frozenset[int]:
    """The addresses of 3D views in which an object is invisible, by local view or collections.
    Views of workspaces that no window shows count too, since nothing reports when one is shown."""
    return frozenset(
        space.as_pointer()
        for screen in bpy.data.screens
        for area in screen.areas
        for space in area.spaces
        if space.type == "VIEW_3D" and not obj.visible_in_viewport_get(space)
    )


def _without_area() -> Any:
    """An override without an area, since `visible_get` considers the local view of the area.

    Called on the type: while a file browser opens or closes, the context has no members, and its
    `temp_override` is None.
    """
    return bpy.types.Context.temp_override(bpy.context, area=None)
