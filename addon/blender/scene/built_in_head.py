"""A head that is always available: the bust that ships, for drawing and for growing hair on it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import bpy
import numpy as np

from ...arrays import Floats, Ints
from ...render.snapshot import MeshPictures
from ...strands import Surface
from ..base.vertex_weights import read_weights
from .bust import bust_object
from .bust_data import EYES, HAIR_GROUPS, SKIN
from .bust_skin import EYE_IOR, EYE_ROUGHNESS, SKIN_IOR, SKIN_ROUGHNESS, TONES, skin_picture
from .mesh_materials import MeshMaterial
from .surfaces import read_material_slots, read_surface

#: the materials of a head, each with its triangles
type HeadLook = tuple[tuple[Ints, MeshMaterial], ...]


@dataclass(frozen=True, eq=False)
class BuiltInHead:
    """The bust, subdivided, facing -Y, with the origin in the middle of its skull, in metres.

    weights: (vertex_count,) of each of HAIR_GROUPS.
    material: (triangle_count,) SKIN or EYES.
    """

    surface: Surface
    weights: dict[str, Floats]
    material: Ints

    def look(self, tone: str) -> HeadLook:
        """Its materials, for a tone of bust_skin.TONES."""
        pictures = MeshPictures(color=skin_picture(tone))
        parts = ((SKIN, SKIN_IOR, SKIN_ROUGHNESS), (EYES, EYE_IOR, EYE_ROUGHNESS))
        return tuple(
            (
                np.flatnonzero(self.material == part),
                MeshMaterial(
                    color=TONES[tone].skin,
                    specular=((ior - 1.0) / (ior + 1.0)) ** 2,
                    roughness=roughness,
                    pictures=pictures,
                ),
            )
            for part, ior, roughness in parts
        )


@cache
def built_in_head() -> BuiltInHead:
    """The built-in head; cached, so it must not be changed."""
    head = bust_object("Hairloom head", None)
    mesh = head.data
    try:
        bpy.context.scene.collection.objects.link(head)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        surface = read_surface(head, depsgraph, need_uv=True, place="built-in head")
        weights = {name: read_weights(head, depsgraph, name) for name in HAIR_GROUPS}
        return BuiltInHead(surface, weights, read_material_slots(head, depsgraph))
    finally:
        bpy.data.objects.remove(head)
        bpy.data.meshes.remove(mesh)
