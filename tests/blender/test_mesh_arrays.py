"""The arrays of a mesh are those that Blender shows, however they are stored."""

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.base.mesh_arrays import (
    corner_vertices,
    edge_vertices,
    triangle_corners,
    triangle_materials,
    triangle_polygons,
    triangle_vertices,
    vertex_positions,
)


@pytest.fixture
def mesh():
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    return bpy.context.object.data


def check(mesh):
    """Compare all arrays with the elements of the mesh, one by one."""
    triangles = list(mesh.loop_triangles)
    for found, expected, width in (
        (vertex_positions(mesh), [each.co for each in mesh.vertices], 3),
        (edge_vertices(mesh), [each.vertices for each in mesh.edges], 2),
        (corner_vertices(mesh), [each.vertex_index for each in mesh.loops], 1),
        (triangle_vertices(mesh), [each.vertices for each in triangles], 3),
        (triangle_corners(mesh), [each.loops for each in triangles], 3),
        (triangle_polygons(mesh), [each.polygon_index for each in triangles], 1),
        (triangle_materials(mesh), [each.material_index for each in triangles], 1),
    ):
        shape = (len(expected),) if width == 1 else (len(expected), width)
        np.testing.assert_array_equal(found, np.reshape(expected, shape).astype(found.dtype))
        assert found.dtype in (np.float32, np.int32)


def test_arrays_are_those_of_the_elements(mesh):
    check(mesh)
    assert ".edge_verts" in mesh.attributes


def test_triangles_of_larger_faces_are_found(mesh):
    mesh.clear_geometry()
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    mesh.from_pydata([*square, (2, 0, 0)], [], [(1, 4, 2), (0, 1, 2, 3)])
    check(mesh)
    assert triangle_polygons(mesh).tolist() == [0, 1, 1]
    mesh.polygons[1].material_index = 2
    check(mesh)
    assert triangle_materials(mesh).tolist() == [0, 2, 2]


def test_meshes_in_edit_mode_and_empty_ones_are_read(mesh):
    """They have no attributes to copy."""
    bpy.ops.object.mode_set(mode="EDIT")
    assert "position" not in mesh.attributes and len(mesh.vertices) == 42
    check(mesh)
    bpy.ops.object.mode_set(mode="OBJECT")
    check(bpy.data.meshes.new("Empty"))
