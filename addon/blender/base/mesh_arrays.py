"""The arrays of a mesh: its vertices, its edges, the corners of its faces, its triangles.

Attributes are copied whole. The collections `vertices`, `edges` and `loops` convert each element,
which takes a hundred times as long; they are read where the attribute is missing: in Edit Mode, and
where a mesh has no elements.
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


def triangle_corners(mesh: bpy.types.Mesh, property_name: str = "vertices") -> Ints:
    """The mesh's triangles, (triangle_count, 3) int32.

    Args:
        property_name: "vertices", or "loops": the corners of faces.
    """
    mesh.calc_loop_triangles()
    numbers = np.empty((len(mesh.loop_triangles), 3), np.int32)
    mesh.loop_triangles.foreach_get(property_name, numbers.ravel())
    return numbers


def triangle_indices(mesh: bpy.types.Mesh, property_name: str) -> Ints:
    """An index that each triangle has, (triangle_count,) int32.

    Args:
        property_name: "polygon_index" or "material_index".
    """
    mesh.calc_loop_triangles()
    numbers = np.empty(len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get(property_name, numbers)
    return numbers
