"""Partings of one groom: curves that are drawn on its surface, the objects in a collection."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ..base.mesh_arrays import edge_vertices, vertex_positions
from ..base.objects import head_of
from .drawn_lines import pieces_of
from .hair_collections import add_to_collection, objects_in, remove_from_collection

_NO_LINES = np.zeros((0, 2, 3), np.float32)


def partings_of(hair: bpy.types.Object) -> tuple[bpy.types.Object, ...]:
    """The objects that part this hair, each once."""
    return objects_in(hair, "parting_collection")


def parting_state(hair: bpy.types.Object) -> tuple[Floats | str, ...]:
    """A state that changes if the artist changes or moves a parting, but not if the surface or an
    animation carries it."""
    state: list[Floats | str] = []
    for obj in partings_of(hair):
        state += [f"{obj.session_uid} {obj.type}", _line_points(obj)]
        for each in (obj, *_positioning_parents(obj, head_of(hair))):
            state += [np.array(each.matrix_parent_inverse), np.array(each.matrix_basis)]
    return tuple(state)


def _positioning_parents(
    line: bpy.types.Object, head: bpy.types.Object | None
) -> Iterator[bpy.types.Object]:
    """The parents by which an artist moves a line over a head: not the head, and not what carries
    both."""
    head_parents = [] if head is None else [head, *_parents(head)]
    for each in _parents(line):
        if each in head_parents:
            return
        if each.animation_data is None and not len(each.constraints):
            yield each


def _parents(obj: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """The parent, its parent, and so on."""
    while obj.parent is not None:
        obj = obj.parent
        yield obj


def _line_points(obj: bpy.types.Object) -> Floats:
    """The control points of a curve and how they are joined, or the vertices and edges of a mesh,
    before modifiers."""
    if obj.type == "MESH":
        places, edges = vertex_positions(obj.data), edge_vertices(obj.data)
        return np.concatenate([places.ravel(), edges.ravel()]).astype(np.float64)
    values: list[float] = []
    for spline in obj.data.splines if obj.type == "CURVE" else ():
        for point in spline.bezier_points:
            for place in (point.handle_left, point.co, point.handle_right):
                values.extend(place)
        for point in spline.points:
            values.extend(point.co)
        values += (len(spline.points), len(spline.bezier_points), spline.type == "NURBS")
        values += (spline.use_cyclic_u, spline.resolution_u, spline.order_u, spline.use_endpoint_u)
    return np.array(values, np.float64)


def read_partings(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph
) -> tuple[Floats, tuple[str, ...]]:
    """The straight pieces of all lines, (n, 2, 3) float32 [m] world space; and notes on unusable
    ones.

    The thickness of the lines, and whether they are hidden, do not matter.
    """
    lines, unusable = [_NO_LINES], []
    for obj in partings_of(hair):
        try:
            lines.append(pieces_of(obj, depsgraph))
        except HairloomError as error:
            unusable.append(str(error))
    return np.concatenate(lines), tuple(unusable)


def add_partings(
    hair: bpy.types.Object, lines: list[bpy.types.Object], scene: bpy.types.Scene
) -> None:
    """Put lines into the hair's collection of partings, which is made if there is none."""
    add_to_collection(hair, "parting_collection", "Partings", lines, scene)


def remove_parting(hair: bpy.types.Object, name: str, context: bpy.types.Context) -> None:
    """Take an object out of the hair's collection of partings, but not out of the scene; see
    `remove_from_collection`."""
    remove_from_collection(hair, "parting_collection", "Partings", name, context)


def copy_partings(
    source: bpy.types.Object,
    hair: bpy.types.Object,
    head: bpy.types.Object,
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph,
) -> None:
    """Give hair the partings of another groom where they are now, as a mesh that is a child of a
    head at the origin."""
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
