"""Meshes as surfaces in world space."""

import weakref

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix

from hairloom.addon.blender.scene.surfaces import read_positions, read_surface
from hairloom.addon.errors import HairloomError


def volume(surface):
    """The signed volume, positive where triangles face outwards."""
    a, b, c = np.moveaxis(surface.corners.astype(np.float64), 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


@pytest.fixture
def cube():
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    return bpy.context.object


def test_a_cube_has_its_volume(cube, get_depsgraph):
    surface = read_surface(cube, get_depsgraph(), need_uv=True, place="cube")
    assert surface.triangles.shape == (12, 3)
    assert volume(surface) == pytest.approx(8.0)


@pytest.mark.parametrize("scale", [(1, 2, 3), (-1, 2, 3), (-1, -2, -3)])
def test_faces_look_outwards_whatever_the_scale(scale, cube, get_depsgraph):
    cube.matrix_world = Matrix.LocRotScale((4, 5, 6), Euler((0.3, 0.7, -1.1)), scale)
    surface = read_surface(cube, get_depsgraph(), need_uv=False, place="cube")
    assert volume(surface) == pytest.approx(48.0, rel=1e-5)
    assert surface.positions.mean(axis=0) == pytest.approx([4, 5, 6], abs=1e-5)


def test_modifiers_are_applied(cube, get_depsgraph):
    cube.modifiers.new("Smooth", "SUBSURF").levels = 2
    surface = read_surface(cube, get_depsgraph(), need_uv=False, place="cube")
    assert len(surface.triangles) == 6 * 16 * 2
    assert 2.0 < volume(surface) < 8.0


def test_uvs_belong_to_their_corners(cube, get_depsgraph):
    """UVs are made from the positions, so that each corner's UV can be checked."""
    mesh = cube.data
    for loop, uv in zip(mesh.loops, mesh.uv_layers.active.uv, strict=True):
        position = mesh.vertices[loop.vertex_index].co
        uv.vector = (position.x + 10.0 * position.z, position.y)
    for scale in (1.0, -1.0):
        cube.scale.x = scale
        surface = read_surface(cube, get_depsgraph(), need_uv=True, place="cube")
        x, y, z = np.moveaxis(surface.corners, 2, 0)
        assert surface.corner_uv[..., 0] == pytest.approx(scale * x + 10.0 * z)
        assert surface.corner_uv[..., 1] == pytest.approx(y)


def test_positions_alone_are_those_of_the_surface(cube, get_depsgraph):
    cube.matrix_world = Matrix.LocRotScale((4, 5, 6), Euler((0.3, 0.7, -1.1)), (1, -2, 3))
    surface = read_surface(cube, get_depsgraph(), need_uv=False, place="cube")
    positions = read_positions(cube, get_depsgraph(), place="cube")
    assert positions.dtype == np.float32
    assert positions == pytest.approx(surface.positions, abs=2e-6)


def test_a_mesh_in_edit_mode_is_read(cube, get_depsgraph):
    bpy.ops.object.mode_set(mode="EDIT")
    surface = read_surface(cube, get_depsgraph(), need_uv=True, place="cube")
    assert volume(surface) == pytest.approx(8.0)


def test_what_cannot_be_used_is_named_with_a_remedy(cube, get_depsgraph):
    light = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    points = bpy.data.objects.new("Points", bpy.data.meshes.new("Points"))
    for obj in (light, points):
        bpy.context.collection.objects.link(obj)
    while cube.data.uv_layers:
        cube.data.uv_layers.remove(cube.data.uv_layers[0])
    cube.data.update()
    for obj, problem in ((light, "not a mesh"), (points, "no faces"), (cube, "Unwrap")):
        with pytest.raises(HairloomError, match=problem) as raised:
            read_surface(obj, get_depsgraph(), need_uv=True, place=f"place of {obj.name}")
        assert raised.value.place == f"place of {obj.name}"
    assert read_surface(cube, get_depsgraph(), need_uv=False, place="cube").corner_uv is None


def test_a_mesh_that_is_read_again_is_the_same_surface_until_it_changes(cube, get_depsgraph):
    first = read_surface(cube, get_depsgraph(), need_uv=False, place="cube")
    assert read_surface(cube, get_depsgraph(), need_uv=False, place="cube") is first
    cube.data.vertices[0].co.x += 0.001
    cube.data.update_tag()
    other = read_surface(cube, get_depsgraph(), need_uv=False, place="cube")
    assert other is not first and not np.array_equal(other.positions, first.positions)
    cube.data.vertices[0].co.x -= 0.001
    cube.data.uv_layers.active.uv[0].vector = (0.25, 0.75)
    cube.data.update_tag()
    again = read_surface(cube, get_depsgraph(), need_uv=False, place="cube")
    assert again is not first and not np.array_equal(again.corner_uv, first.corner_uv)


def test_a_surface_that_nobody_has_any_more_is_let_go(cube, get_depsgraph):
    first = weakref.ref(read_surface(cube, get_depsgraph(), need_uv=False, place="cube"))
    cube.scale.x = 2.0
    read_surface(cube, get_depsgraph(), need_uv=False, place="cube")
    assert first() is None
