"""What acts on a groom of the scene, copied for hair in a scene of its own, on a head that stands
at the origin: each object as it is now, as a child of that head."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy

from .carriers import is_left_out
from .obstacles import sources_of
from .ties import ties_of


@dataclass
class StillCopies:
    """Copies of objects, one each.

    head: their parent. scene: they are in its collection.
    """

    head: bpy.types.Object
    scene: bpy.types.Scene
    depsgraph: bpy.types.Depsgraph
    made: dict[bpy.types.Object, bpy.types.Object] = field(default_factory=dict)

    def of(self, obj: bpy.types.Object) -> bpy.types.Object:
        """The copy of an object: no animation, constraint or modifier acts on it any more."""
        if obj not in self.made:
            self.made[obj] = self._copied(obj)
        return self.made[obj]

    def collection(self, name: str, objects: list[bpy.types.Object]) -> bpy.types.Collection | None:
        """A collection of their copies; None of no objects."""
        if not objects:
            return None
        collection = bpy.data.collections.new(name)
        for obj in objects:
            collection.objects.link(self.of(obj))
        return collection

    def _copied(self, obj: bpy.types.Object) -> bpy.types.Object:
        evaluated = obj.evaluated_get(self.depsgraph)
        copy, matrix = obj.copy(), evaluated.matrix_world.copy()
        copy.hide_viewport = is_left_out(obj, self.depsgraph)
        for attached in (copy.constraints, copy.modifiers):
            attached.clear()
        copy.animation_data_clear()
        if obj.type == "MESH":
            copy.data = bpy.data.meshes.new_from_object(evaluated)
        copy.parent, copy.parent_type, copy.matrix_basis = self.head, "OBJECT", matrix
        copy.matrix_parent_inverse.identity()
        self.scene.collection.objects.link(copy)
        return copy


def copy_holders(source: bpy.types.Object, hair: bpy.types.Object, copies: StillCopies) -> None:
    """Hold hair by what holds another groom: its ties, and what its tips are held by."""
    hair.hairloom.tie_collection = copies.collection("Ties", list(ties_of(source)))
    surface = source.hairloom.tip_surface
    hair.hairloom.tip_surface = None if surface is None else copies.of(surface)
    hair.hairloom.tip_group = source.hairloom.tip_group


def copy_colliders(
    source: bpy.types.Object,
    head: bpy.types.Object | None,
    hair: bpy.types.Object,
    copies: StillCopies,
) -> None:
    """Keep hair out of what another groom stays out of.

    Args:
        head: the object of that groom's scene that stands at the origin as `copies.head`.
    """
    if head is not None:
        copies.head.hairloom.collider_shape = head.hairloom.collider_shape
    chosen = source.hairloom.collider
    hair.hairloom.collider = None if chosen in (None, head) else copies.of(chosen)
    others = [obj for obj in sources_of(source, head) if obj not in (head, chosen)]
    hair.hairloom.collider_collection = copies.collection("Colliders", others)
