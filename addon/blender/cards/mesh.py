"""Hair cards in a mesh of Blender: filling a mesh, and reordering its faces."""

from __future__ import annotations

from collections.abc import Mapping

import bmesh
import bpy
import numpy as np

from ...arrays import Floats, Ints
from ...cards.card_mesh import CardMesh
from ...strands.vectors import unit
from ..base.attributes import set_attribute

#: marks a mesh whose occlusion is ours, and so can be replaced
OCCLUSION_IS_OURS = "hairloom_occlusion"


def fill_mesh(
    mesh: bpy.types.Mesh,
    cards: CardMesh,
    *,
    uv_maps: Mapping[str, Floats],
    points: Mapping[str, Floats],
    faces: Mapping[str, Ints] | None = None,
    matrix: Floats | None = None,
) -> None:
    """Replace a mesh's geometry by cards with their normals, in the order of their triangles.

    Args:
        uv_maps: name -> (vertex_count, 2).
        points, faces: attributes, name -> a value for each vertex or triangle.
        matrix: (4, 4) of the object whose space the mesh is in; None: world space.
    """
    positions, normal = cards.positions, cards.normal
    triangles: Ints = cards.triangles
    if matrix is not None:
        inverse = np.linalg.inv(matrix)
        positions = (positions @ inverse[:3, :3].T + inverse[:3, 3]).astype(np.float32)
        normal = unit(normal @ matrix[:3, :3])
        if np.linalg.det(matrix[:3, :3]) < 0.0:  # a mirrored object flips faces
            triangles = triangles[:, ::-1]
    corners: Ints = np.ascontiguousarray(triangles).ravel()
    mesh.clear_geometry()
    mesh.vertices.add(len(positions))
    mesh.loops.add(len(corners))
    mesh.polygons.add(len(triangles))
    # `vertices` and `loops` convert each element, which takes a hundred times as long
    set_attribute(mesh, "position", "POINT", positions)
    set_attribute(mesh, ".corner_vert", "CORNER", corners)
    mesh.polygons.foreach_set("loop_start", np.arange(0, len(corners), 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    for name, uv in uv_maps.items():
        set_uv_map(mesh, name, uv[corners])
    for name, values in {"custom_normal": normal, **points}.items():
        set_attribute(mesh, name, "POINT", values)
    for name, numbers in (faces or {}).items():
        set_attribute(mesh, name, "FACE", numbers)


def set_uv_map(mesh: bpy.types.Mesh, name: str, uv: Floats) -> bool:
    """Write a UV map, (corner_count, 2); False if the mesh has no room for another one."""
    layer = mesh.uv_layers.get(name) or mesh.uv_layers.new(name=name, do_init=False)
    if layer is not None:
        layer.uv.foreach_set("vector", np.ascontiguousarray(uv, np.float32).ravel())
    return layer is not None


def reorder_faces(mesh: bpy.types.Mesh, order: Ints) -> int:
    """Reorder the faces of a mesh with all their data; returns how many moved.

    Args:
        order: (face_count,), the present index of each face in its new order.
    """
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
