"""What is written into a mesh of cards: the order of its faces, and values of its vertices."""

from __future__ import annotations

import bmesh
import bpy
import numpy as np

from ...arrays import Floats, Ints

OCCLUSION_LAYER = "Occlusion"
#: attributes of cards: how open each vertex is, and how far from the root
SHARES = ("occlusion", "along")


def face_order(polygon: Ints) -> Ints:
    """Faces by the first of their triangles that is drawn, (face_count,)."""
    faces, first = np.unique(polygon, return_index=True)
    order: Ints = faces[np.argsort(first, kind="stable")]
    return order


def reorder_faces(mesh: bpy.types.Mesh, order: Ints) -> int:
    """The faces of a mesh in another order, with all that they have; gives how many moved."""
    moved = int((order != np.arange(len(order))).sum())
    if not moved:
        return 0
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    edited = bmesh.new()
    try:
        edited.from_mesh(mesh)
        for face, index in zip(edited.faces, place.tolist(), strict=True):
            face.index = index
        edited.faces.sort()
        edited.to_mesh(mesh)
    finally:
        edited.free()
    mesh.update()
    return moved


def write_shares(
    mesh: bpy.types.Mesh, vertex: Ints, corner: Ints, openness: Floats, along: Floats
) -> list[str]:
    """Occlusion and way into attributes, where a vertex on a seam has the mean of its copies, and
    into a UV map; gives what could not be done.

    Args:
        vertex: (n,) the vertex of the mesh that each value belongs to.
        corner: (loop_count,) the value of each corner of a face.
        openness, along: (n,).
    """
    for name, values in zip(SHARES, (openness, along), strict=True):
        _set_attribute(mesh, name, _at_source(values, vertex, len(mesh.vertices)))
    layer = mesh.uv_layers.get(OCCLUSION_LAYER)
    if layer is None:
        layer = mesh.uv_layers.new(name=OCCLUSION_LAYER, do_init=False)
    if layer is None:
        return ["It has as many UV maps as a mesh can have, so occlusion is an attribute only"]
    uv = np.stack([openness, along], axis=1)[corner]
    layer.uv.foreach_set("vector", np.ascontiguousarray(uv, np.float32).ravel())
    mesh.update_tag()
    return []


def _at_source(values: Floats, vertex: Ints, count: int) -> Floats:
    """Means over the copies of each of `count` vertices; 1 for a vertex of no face."""
    copies = np.bincount(vertex, minlength=count)
    total = np.bincount(vertex, values, minlength=count)
    return np.divide(total, copies, out=np.ones(count), where=copies > 0).astype(np.float32)


def _set_attribute(mesh: bpy.types.Mesh, name: str, values: Floats) -> None:
    """A float of each vertex; what has this name and is another thing makes room."""
    found = mesh.attributes.get(name)
    if found is not None and (found.domain, found.data_type) != ("POINT", "FLOAT"):
        mesh.attributes.remove(found)
        found = None
    if found is None:
        found = mesh.attributes.new(name, "FLOAT", "POINT")
    found.data.foreach_set("value", values)
