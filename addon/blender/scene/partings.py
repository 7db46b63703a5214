"""Partings of one groom: curves that are drawn on its surface, the objects of a collection."""

from __future__ import annotations

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ..base.mesh_arrays import vertex_places
from .drawn_lines import pieces_of
from .own_collections import objects_in, put_into, take_out

_NONE = np.zeros((0, 2, 3), np.float32)


def partings_of(hair: bpy.types.Object) -> tuple[bpy.types.Object, ...]:
    """The objects that part this hair, each once."""
    return objects_in(hair, "parting_collection")


def parting_state(hair: bpy.types.Object) -> tuple[Floats | str, ...]:
    """Which lines part the hair, and where the artist has put them; what only carries them, such as
    a head that turns, is not in it."""
    state: list[Floats | str] = []
    for obj in partings_of(hair):
        state += [f"{obj.session_uid} {obj.type}", _line_points(obj)]
        state += [np.array(obj.matrix_parent_inverse), np.array(obj.matrix_basis)]
    return tuple(state)


def is_same_state(one: tuple[Floats | str, ...], other: tuple[Floats | str, ...]) -> bool:
    """Whether two `parting_state` are the same."""
    return len(one) == len(other) and all(map(np.array_equal, one, other))


def _line_points(obj: bpy.types.Object) -> Floats:
    """The control points of a curve, or the vertices of a mesh, before modifiers."""
    if obj.type == "MESH":
        return vertex_places(obj.data).ravel()
    splines = obj.data.splines if obj.type == "CURVE" else ()
    found = [
        coordinate
        for spline in splines
        for point in spline.bezier_points
        for place in (point.handle_left, point.co, point.handle_right)
        for coordinate in place
    ]
    found += [each for spline in splines for point in spline.points for each in point.co[:3]]
    return np.array(found, np.float32)


def read_partings(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> tuple[Floats, tuple[str, ...]]:
    """The straight pieces of all lines, (n, 2, 3) float32 [m] world space; and what cannot be used.

    Nothing else of the objects counts: neither their thickness nor whether they are shown.
    """
    found, unusable = [_NONE], []
    for obj in partings_of(hair):
        try:
            found.append(pieces_of(obj, depsgraph))
        except HairloomError as error:
            unusable.append(str(error))
    return np.concatenate(found), tuple(unusable)


def add_partings(
    hair: bpy.types.Object, lines: list[bpy.types.Object], scene: bpy.types.Scene
) -> None:
    """Put lines into the hair's collection of partings, which is made where there is none."""
    put_into(hair, "parting_collection", "Partings", lines, scene)


def remove_parting(hair: bpy.types.Object, name: str, scene: bpy.types.Scene) -> None:
    """Take an object out of the hair's collection of partings, but not out of the scene.

    Raises:
        HairloomError: it is not in that collection itself.
    """
    take_out(hair, "parting_collection", "Partings", name, scene)


def copy_partings(
    source: bpy.types.Object,
    hair: bpy.types.Object,
    head: bpy.types.Object,
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph,
) -> None:
    """Part hair along the partings of another groom where they are now, as a mesh that is a child
    of a head that stands at the origin."""
    lines, _ = read_partings(source, depsgraph)
    if not len(lines):
        return
    mesh = bpy.data.meshes.new("Partings")
    ends = np.arange(2 * len(lines)).reshape(-1, 2)
    mesh.from_pydata(lines.reshape(-1, 3).tolist(), ends.tolist(), [])
    line = bpy.data.objects.new("Partings", mesh)
    scene.collection.objects.link(line)
    line.parent = head
    hair.hairloom.parting_collection = bpy.data.collections.new("Partings")
    hair.hairloom.parting_collection.objects.link(line)
