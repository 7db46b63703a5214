"""The materials that a head is drawn with: its own, those of our bust, or plain skin."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ...arrays import Ints
from ...render.snapshot import SKIN, SKIN_ROUGHNESS, SKIN_SPECULAR
from ...strands import Surface
from ..base.objects import head_of
from .built_in_head import HeadLook, built_in_head
from .mesh_files import meshes_of_file
from .mesh_materials import MeshMaterial, material_of
from .surfaces import read_material_slots

#: for faces without a material
PLAIN_SKIN = MeshMaterial(SKIN, SKIN_SPECULAR, SKIN_ROUGHNESS)
#: tone of our bust in a scene, if it has lost its materials
_TONE = "light"


def head_look(name: str | None, head: Surface | None, tone: str) -> HeadLook | None:
    """The materials of a head: its own, if it has any; else, if its mesh is our bust, the skin and
    eyes of the bust; else None, for plain skin.

    Args:
        name: of the head's object or file; None for the built-in one.
        head: as it is drawn; own materials are used only if their meshes have as many triangles.
        tone: of our bust, one of bust_skin.TONES.
    """
    if head is None:
        return None
    stored = _stored_look(name)
    if stored is not None and sum(len(each) for each, _ in stored) == len(head.triangles):
        return stored
    return built_in_head().look(tone) if is_bust_surface(head) else None


def is_bust_surface(head: Surface) -> bool:
    """Whether it has the mesh of the built-in head, from wherever it was loaded."""
    bust_triangles = built_in_head().surface.triangles
    return head.corner_uv is not None and np.array_equal(head.triangles, bust_triangles)


def look_of_head(hair: bpy.types.Object, head: Surface | None) -> HeadLook | None:
    """`head_look` of the head that this hair grows on."""
    obj = head_of(hair)
    return head_look(None if obj is None else obj.name, head, _TONE)


def _stored_look(name: str | None) -> HeadLook | None:
    """The materials of an object in the scene or of a file; None: there are none."""
    if name is None:
        return None
    obj = bpy.data.objects.get(name)
    if obj is not None:
        return _look_of([obj])
    path = Path(name)
    if not (path.suffix and path.is_file()):
        return None
    with meshes_of_file(path) as meshes:
        return _look_of(meshes)


def _look_of(meshes: list[bpy.types.Object]) -> HeadLook | None:
    """The materials of evaluated meshes, one after the other; None: no mesh has any."""
    if not any(slot.material for mesh in meshes for slot in mesh.material_slots):
        return None
    depsgraph = bpy.context.evaluated_depsgraph_get()
    parts, start = list[tuple[Ints, MeshMaterial]](), 0
    for mesh in meshes:
        materials = [slot.material for slot in mesh.material_slots] or [None]
        slots = np.minimum(read_material_slots(mesh, depsgraph), len(materials) - 1)
        for slot in np.unique(slots).tolist():
            material = materials[slot]
            mesh_material = PLAIN_SKIN if material is None else material_of(material)
            parts.append((start + np.flatnonzero(slots == slot), mesh_material))
        start += len(slots)
    return tuple(parts)
