"""Trim shapes of a groom: the closed meshes, flat meshes and Empties (planes) in a collection."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...arrays import Bools, Floats
from ...dynamics.colliders.winding import winding_number
from ...errors import HairloomError
from ...groom.trim import Plane, Shape, plane_of_flat_mesh
from ...strands import Surface
from ...strands.crossings import first_crossings
from ...strands.mesh_faults import edges_of
from ..base.objects import head_of, matrix_of
from .hair_collections import objects_in
from .surfaces import read_surface

#: setting of the hair that names the collection, and the name for what it holds
COLLECTION_PROPERTY, COLLECTION_LABEL = "trim_collection", "Trim Shapes"


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed mesh, in world space."""

    surface: Surface

    def has_inside(self, roots: Floats) -> Bools:
        return np.asarray(np.abs(winding_number(roots, self.surface)) > 0.5)

    def exit_positions(self, lines: Floats) -> Floats:
        return first_crossings(lines, self.surface)


def trim_shapes_of(hair: bpy.types.Object) -> tuple[bpy.types.Object, ...]:
    """The objects that trim this hair, each once."""
    return objects_in(hair, COLLECTION_PROPERTY)


def may_trim(obj: bpy.types.Object, hair: bpy.types.Object) -> bool:
    """Whether an object that is selected together with the hair is meant to trim it."""
    return obj.type in {"MESH", "EMPTY"} and obj != head_of(hair)


def read_shapes(
    objects: tuple[bpy.types.Object, ...], depsgraph: bpy.types.Depsgraph
) -> tuple[tuple[Shape, ...], tuple[str, ...]]:
    """The shapes in world space, and notes on unusable objects."""
    shapes: list[Shape] = []
    unusable: list[str] = []
    for obj in objects:
        try:
            shapes.append(read_shape(obj, depsgraph))
        except HairloomError as error:
            unusable.append(str(error))
    return tuple(shapes), tuple(unusable)


def read_shape(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Shape:
    """A shape in world space; for an Empty, the plane across its Z axis.

    Raises:
        HairloomError: it is neither an Empty nor a mesh, has no size, or is open and not flat.
    """
    if obj.type == "EMPTY":
        return _plane_of(obj, depsgraph)
    surface = read_surface(obj, depsgraph, need_uv=False, place=obj.name)
    shape = plane_of_flat_mesh(surface)
    if shape is not None:
        return shape
    if not edges_of(surface).are_closed:
        raise HairloomError(
            "it is neither closed nor flat, so it has no inside",
            place=obj.name,
            remedy="Fill its holes (Mesh > Clean Up > Fill Holes), or use a flat mesh or an Empty",
        )
    return Solid(surface)


def _plane_of(empty: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Plane:
    matrix = matrix_of(empty, depsgraph)
    # perpendicular to X and Y; Z may not be, under a sheared parent
    normal = np.cross(matrix[:3, 0], matrix[:3, 1])
    size = float(np.linalg.norm(normal))
    if not (np.isfinite(matrix).all() and size > 0.0):
        raise HairloomError(
            "it has no size, so its plane has no direction",
            place=empty.name,
            remedy="Set its scale to 1 (Object > Clear > Scale)",
        )
    return Plane(matrix[:3, 3], normal / size)
