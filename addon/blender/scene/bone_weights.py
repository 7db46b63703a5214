"""The bones that move a head: vertex groups that belong to deforming bones of its armature."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

from ...arrays import Floats
from ...exchange.cards.glb_springs import HeadBone
from ...exchange.tfxbone import BoneWeights, bones_at_roots
from ...strands import StrandSet
from ..base.objects import head_of
from ..base.vertex_weights import VertexGroupWeights
from .surfaces import evaluated_mesh, read_surface


def bones_of(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, strands: StrandSet
) -> BoneWeights | None:
    """The bones of hair on a skinned head; None where no bone moves the head.

    Args:
        strands: of the hair; bound if it has a usable head.
    """
    skin = head_of(hair)
    names = () if skin is None else _bone_names(skin)
    if skin is None or not names or not strands.is_bound:
        return None
    weights = _vertex_weights(skin, depsgraph, names)
    if not weights.any():
        return None
    head = read_surface(skin, depsgraph, need_uv=False, place=skin.name)
    return bones_at_roots(strands, head.triangles, names, weights)


def head_bone_of(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, strands: StrandSet
) -> HeadBone | None:
    """The bone that carries most of the roots, at rest; None where no bone moves the head."""
    skin = head_of(hair)
    if skin is None:
        return None
    armature, name = skin.find_armature(), ""
    if skin.parent_type == "BONE" and skin.parent is not None:
        armature, name = skin.parent, skin.parent_bone
    else:
        weights = bones_of(hair, depsgraph, strands)
        if weights is not None:
            weight_sums = np.bincount(
                weights.bone.ravel(), weights.weight.ravel(), len(weights.names)
            )
            name = weights.names[int(weight_sums.argmax())]
    bone = None if armature is None else armature.data.bones.get(name)
    if armature is None or bone is None:
        return None
    location, rotation, _ = (armature.matrix_world @ bone.matrix_local).decompose()
    return HeadBone(name, np.array(Matrix.Translation(location) @ rotation.to_matrix().to_4x4()))


def has_bones(hair: bpy.types.Object) -> bool:
    """Whether deforming bones can move its head."""
    skin = head_of(hair)
    return skin is not None and bool(_bone_names(skin))


def unmoved_head_notes(hair: bpy.types.Object) -> list[str]:
    """A note if the head has an armature but no bone of it moves the head; else empty."""
    skin = head_of(hair)
    armature = None if skin is None else skin.find_armature()
    if skin is None or armature is None:
        return []
    return [
        f"{skin.name}: no bone of {armature.name} moves it, so no .tfxbone was written. Name "
        "vertex groups after their bones."
    ]


def _bone_names(skin: bpy.types.Object) -> tuple[str, ...]:
    """The deforming bones that have a vertex group, in the order of the groups."""
    armature = skin.find_armature()
    if armature is None:
        return ()
    deforming = {bone.name for bone in armature.data.bones if bone.use_deform}
    return tuple(group.name for group in skin.vertex_groups if group.name in deforming)


def _vertex_weights(
    skin: bpy.types.Object, depsgraph: bpy.types.Depsgraph, names: tuple[str, ...]
) -> Floats:
    """(vertex_count, bone_count) float32 of the mesh after its modifiers."""
    with evaluated_mesh(skin, depsgraph, skin.name) as mesh:
        members = VertexGroupWeights.of(mesh)
    weights = [members.weights(skin.vertex_groups[name].index) for name in names]
    return np.stack(weights, axis=1)
