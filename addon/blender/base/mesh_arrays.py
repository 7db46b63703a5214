"""The arrays of a mesh: its vertices, its edges, the corners of its faces, its triangles.

Attributes are copied whole. The collections `vertices`, `edges`, `loops` and `loop_triangles`
convert each element, which takes a hundred times as long; they are read where there is no
attribute: in Edit Mode, where a mesh has no elements, and for triangles of larger faces.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...arrays import Floats, Ints
from .attributes import read_attribute


def vertex_positions(mesh: bpy.types.Mesh) -> Floats:
    """Vertex positions, (vertex_count, 3) float32, in the mesh's own space."""
    positions: Floats | None = read_attribute(mesh, "position", "POINT", 3)
    if positions is None:
        positions = np.empty((len(mesh.vertices), 3), np.float32)
        mesh.vertices.foreach_get("co", positions.ravel())
    return positions


def edge_vertices(mesh: bpy.types.Mesh) -> Ints:
    """The vertices of each edge, (edge_count, 2) int32."""
    vertices: Ints | None = read_attribute(mesh, ".edge_verts", "EDGE", 2)
    if vertices is None:
        vertices = np.empty((len(mesh.edges), 2), np.int32)
        mesh.edges.foreach_get("vertices", vertices.ravel())
    return vertices


def corner_vertices(mesh: bpy.types.Mesh) -> Ints:
    """The vertex of each corner of a face, (corner_count,) int32; Blender calls corners loops."""
    vertices: Ints | None = read_attribute(mesh, ".corner_vert", "CORNER")
    if vertices is None:
        vertices = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", vertices)
    return vertices


def triangle_polygons(mesh: bpy.types.Mesh) -> Ints:
    """The face that each triangle is a part of, (triangle_count,) int32."""
    faces = np.empty(len(mesh.loop_triangle_polygons), np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", faces)
    return faces


def triangle_corners(mesh: bpy.types.Mesh) -> Ints:
    """The corners of faces at which each triangle lies, (triangle_count, 3) int32."""
    faces = triangle_polygons(mesh)
    if np.array_equal(faces, np.arange(len(mesh.polygons))):  # all faces are triangles
        return np.arange(3 * len(faces), dtype=np.int32).reshape(-1, 3)
    corners = np.empty((len(faces), 3), np.int32)
    mesh.loop_triangles.foreach_get("loops", corners.ravel())
    return corners


def triangle_vertices(mesh: bpy.types.Mesh) -> Ints:
    """The vertices of each triangle, (triangle_count, 3) int32."""
    return corner_vertices(mesh)[triangle_corners(mesh)]


def triangle_materials(mesh: bpy.types.Mesh) -> Ints:
    """The material slot of each triangle, (triangle_count,) int32."""
    slots: Ints | None = read_attribute(mesh, "material_index", "FACE")
    if slots is None:
        slots = np.empty(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("material_index", slots)
    return slots[triangle_polygons(mesh)]
