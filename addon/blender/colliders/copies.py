"""Copies of the objects that act on a groom, as they are now, for hair in another scene. They are
children of that hair's head, which is at the origin."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy

from .carriers import is_disabled
from .scene_colliders import collider_objects
from .ties import ties_of


@dataclass
class StaticCopies:
    """Static copies of objects, each copied once.

    head: their parent. scene: the one whose collection they are in.
    """

    head: bpy.types.Object
    scene: bpy.types.Scene
    depsgraph: bpy.types.Depsgraph
    _copies: dict[bpy.types.Object, bpy.types.Object] = field(default_factory=dict)

    def of(self, obj: bpy.types.Object) -> bpy.types.Object:
        """The copy of an object, without animation, constraints and modifiers."""
        if obj not in self._copies:
            self._copies[obj] = self._copy(obj)
        return self._copies[obj]

    def collection(self, name: str, objects: list[bpy.types.Object]) -> bpy.types.Collection | None:
        """A collection of copies of these objects; None if there are no objects."""
        if not objects:
            return None
        collection = bpy.data.collections.new(name)
        for obj in objects:
            collection.objects.link(self.of(obj))
        return collection

    def _copy(self, obj: bpy.types.Object) -> bpy.types.Object:
        evaluated = obj.evaluated_get(self.depsgraph)
        copy, matrix = obj.copy(), evaluated.matrix_world.copy()
        copy.hide_viewport = is_disabled(obj, self.depsgraph)
        for attached in (copy.constraints, copy.modifiers):
            attached.clear()
        copy.animation_data_clear()
        if obj.type == "MESH":
            copy.data = bpy.data.meshes.new_from_object(evaluated)
        copy.parent, copy.parent_type, copy.matrix_basis = self.head, "OBJECT", matrix
        copy.matrix_parent_inverse.identity()
        self.scene.collection.objects.link(copy)
        return copy


def copy_holders(source: bpy.types.Object, hair: bpy.types.Object, copies: StaticCopies) -> None:
    """Hold hair by copies of another groom's ties and tip surface."""
    hair.hairloom.tie_collection = copies.collection("Ties", list(ties_of(source)))
    surface = source.hairloom.tip_surface
    hair.hairloom.tip_surface = None if surface is None else copies.of(surface)
    hair.hairloom.tip_group = source.hairloom.tip_group


def copy_colliders(
    source: bpy.types.Object,
    head: bpy.types.Object | None,
    hair: bpy.types.Object,
    copies: StaticCopies,
) -> None:
    """Give hair copies of another groom's colliders.

    Args:
        head: the head of that groom, which `copies.head` replaces.
    """
    if head is not None:
        copies.head.hairloom.collider_shape = head.hairloom.collider_shape
    chosen = source.hairloom.collider
    hair.hairloom.collider = None if chosen in (None, head) else copies.of(chosen)
    others = [obj for obj in collider_objects(source, head) if obj not in (head, chosen)]
    hair.hairloom.collider_collection = copies.collection("Colliders", others)
