"""Colliders that are unusable, or are hidden, deleted or changed during play."""

import math

import bpy
import numpy as np
import pytest
from collider_scene import COARSE_SETTINGS, ColliderScene, depsgraph, distance_now, move_colliders

from hairloom.addon.blender.base.objects import Body
from hairloom.addon.blender.colliders.scene_colliders import SceneColliders, collider_objects
from hairloom.addon.blender.scene.surfaces import read_surface
from hairloom.addon.errors import HairloomError


@pytest.fixture
def scene(extension):
    return ColliderScene()


def plane(scene):
    bpy.ops.mesh.primitive_plane_add(size=0.2)
    return scene.add(bpy.context.object)


def flat(scene):
    cube = scene.cube(name="Flat")
    cube.scale = (1, 1, 0)
    return cube


def curve(scene):
    bpy.ops.curve.primitive_bezier_circle_add()
    return scene.add(bpy.context.object)


def empty_as_mesh(scene):
    ball = scene.ball(name="NoMesh")
    ball.hairloom.collider_shape = "mesh"
    return ball


def disabled(scene):
    cube = scene.cube(name="Disabled")
    cube.hide_viewport = True
    return cube


def not_finite(scene):
    cube = scene.cube(name="NotFinite")
    cube.data.vertices[0].co.x = math.nan
    return cube


@pytest.mark.parametrize("make", [plane, flat, curve, empty_as_mesh, disabled, not_finite])
def test_unusable_colliders_are_named_and_others_still_act(scene, make):
    bad = make(scene)
    scene.ball()
    colliders = scene.read_colliders()
    assert len(move_colliders(colliders)) == 1
    (warning,) = colliders.warnings
    assert warning.startswith(bad.name + ":") and warning.count(".") >= 2


def test_an_open_mesh_collides_and_is_reported(scene):
    """A box without its first face, with a face that is turned inwards, and with a wall inside."""
    cube = scene.cube()
    assert scene.read_colliders().warnings == ()
    corners = [vertex.co[:] for vertex in cube.data.vertices]
    faces = [tuple(polygon.vertices) for polygon in cube.data.polygons]
    quad = faces[0]
    opposite = next(face for face in faces if not set(face) & set(quad))
    near = [min(opposite, key=lambda v: math.dist(corners[v], corners[at])) for at in quad]
    faults = {
        "4 edges with only one face": faces[1:],
        "at 4 edges the faces point to opposite sides": [quad[::-1], *faces[1:]],
        "edges with more than two faces": [*faces, (quad[0], quad[2], near[2], near[0])],
    }
    for words, wrong in faults.items():
        cube.data = bpy.data.meshes.new("Wrong")
        cube.data.from_pydata(corners, [], wrong)
        colliders = scene.read_colliders()
        assert len(move_colliders(colliders)) == 1
        (warning,) = [text for text in colliders.warnings if words in text]
        assert warning.startswith("Cube: ")


def test_a_collider_excluded_from_the_view_layer_does_not_collide(scene):
    away = bpy.data.collections.new("Away")
    scene.colliders.children.link(away)
    cube = scene.cube(name="Away")
    scene.colliders.objects.unlink(cube)
    away.objects.link(cube)
    colliders = scene.read_colliders()
    assert len(move_colliders(colliders)) == 1 and colliders.warnings == ()
    layer = bpy.context.view_layer.layer_collection.children["Colliders"]
    layer.children["Away"].exclude = True
    assert move_colliders(colliders) == ()
    assert "Away" in colliders.warnings[0]
    layer.children["Away"].exclude = False
    cube.location.x = 3.0
    (posed,) = move_colliders(colliders)
    assert colliders.warnings == ()
    np.testing.assert_allclose(posed.matrix_before, posed.matrix_now)  # it returns without a jump


def test_a_collider_hidden_in_the_viewport_still_collides(scene):
    ball = scene.ball()
    ball.hide_set(True)
    colliders = scene.read_colliders()
    assert len(move_colliders(colliders)) == 1 and colliders.warnings == ()
    ball.location.x = 1.0
    assert move_colliders(colliders)[0].matrix_now[0, 3] == pytest.approx(1.0, abs=1e-6)


def test_deleted_in_mid_play(scene):
    cube, ball, other = scene.cube(), scene.ball(name="A"), scene.ball(0.1, (1, 0, 0), "B")
    colliders = scene.read_colliders()
    assert len(move_colliders(colliders)) == 2
    bpy.data.objects.remove(cube)
    bpy.data.objects.remove(ball)
    (posed,) = move_colliders(colliders)
    assert len(posed.collider.radii) == 1
    assert distance_now(posed, (1.3, 0, 0)) == pytest.approx(0.2, abs=1e-6)
    assert ["Cube" in text or "A:" in text for text in colliders.warnings] == [True, True]
    bpy.data.objects.remove(other)
    assert move_colliders(colliders) == ()


def test_scaled_to_nothing_and_back_in_mid_play(scene):
    cube, ball, stretched = scene.cube(), scene.ball(), scene.ball(name="Stretched")
    stretched.scale = (1, 1, 2)
    colliders = scene.read_colliders()
    assert len(move_colliders(colliders)) == 3
    for obj in (cube, ball, stretched):
        obj.scale = (0, 0, 0)
    assert move_colliders(colliders) == ()
    assert len(colliders.warnings) >= 3
    for obj in (cube, ball, stretched):
        obj.scale = (1, 1, 1)
    assert len(move_colliders(colliders)) == 3 and colliders.warnings == ()


def test_another_mesh_in_mid_play(scene):
    cube = scene.cube()
    colliders = scene.read_colliders()
    cube.modifiers.new("Subdivision", "SUBSURF").levels = 2
    assert move_colliders(colliders) == ()
    assert "vertices" in colliders.warnings[0]
    cube.modifiers.clear()
    assert len(move_colliders(colliders)) == 1 and colliders.warnings == ()


def test_a_deleted_head_is_an_error(scene, sphere):
    head = Body.at_rest(sphere, depsgraph())
    at_rest = read_surface(sphere, depsgraph(), need_uv=False, place="Head")
    scene.ball()
    colliders = SceneColliders.of(scene.owner, head, at_rest, COARSE_SETTINGS, depsgraph(), None)
    assert len(move_colliders(colliders)) == 2
    bpy.data.objects.remove(sphere)
    with pytest.raises(HairloomError, match="gone"):
        move_colliders(colliders)


def test_a_head_without_volume_is_reported_and_others_still_act(scene):
    bpy.ops.mesh.primitive_grid_add(size=0.2)
    cap = bpy.context.object
    at_rest = read_surface(cap, depsgraph(), need_uv=False, place="Cap")
    scene.ball()
    head = Body.at_rest(cap, depsgraph())
    colliders = SceneColliders.of(scene.owner, head, at_rest, COARSE_SETTINGS, depsgraph(), None)
    assert len(move_colliders(colliders)) == 1
    assert "Grid" in colliders.warnings[0]


def test_a_chosen_collider_replaces_the_head(scene, sphere):
    at_rest = read_surface(sphere, depsgraph(), need_uv=False, place="Head")
    head = Body.at_rest(sphere, depsgraph())
    scene.owner.hairloom.collider_collection = None
    bpy.ops.mesh.primitive_cube_add(size=0.1, location=(0, 0, 1))
    scene.owner.hairloom.collider = bpy.context.object
    colliders = SceneColliders.of(scene.owner, head, at_rest, COARSE_SETTINGS, depsgraph(), None)
    (posed,) = move_colliders(colliders)
    assert distance_now(posed, (0, 0, 1.1)) == pytest.approx(0.05, abs=2e-3)
    sphere.hairloom.collider_shape = "none"
    scene.owner.hairloom.collider = None
    assert (
        move_colliders(
            SceneColliders.of(scene.owner, head, at_rest, COARSE_SETTINGS, depsgraph(), None)
        )
        == ()
    )


def test_a_collection_in_which_nothing_collides_is_named(scene):
    """A deleted collection leaves only the surface, without a warning."""
    plain = bpy.data.objects.new("Plain", None)
    scene.add(plain)
    assert "nothing in the collection Colliders collides" in scene.read_colliders().warnings[0]
    ball = scene.ball()
    assert scene.read_colliders().warnings == ()
    ball.hairloom.collider_shape = "none"
    assert len(scene.read_colliders().warnings) == 1
    bpy.data.collections.remove(scene.colliders)
    colliders = scene.read_colliders()
    assert scene.owner.hairloom.collider_collection is None
    assert (colliders.parts, colliders.warnings) == ([], ())


def test_two_grooms_have_their_own_colliders(scene):
    other = bpy.data.objects.new("Other", bpy.data.meshes.new("Other"))
    group = bpy.data.collections.new("Hands")
    bpy.context.scene.collection.children.link(group)
    bpy.context.scene.collection.objects.link(other)
    other.hairloom.collider_collection = group
    scene.ball(0.1, name="Own")
    scene.cube(name="Both")
    group.objects.link(bpy.data.objects["Both"])
    names = [{obj.name for obj in collider_objects(owner, None)} for owner in (scene.owner, other)]
    assert names == [{"Own", "Both"}, {"Both"}]
    assert len(scene.read_colliders().parts) == 2
    assert len(SceneColliders.of(other, None, None, COARSE_SETTINGS, depsgraph(), None).parts) == 1


def test_a_mesh_that_bends_scaled_to_nothing_and_back(scene):
    cube, ball = scene.cube(), scene.ball()
    cube.shape_key_add(name="Basis")
    cube.shape_key_add(name="Wide").data[0].co *= 1.2
    colliders = scene.read_colliders()
    assert len(move_colliders(colliders)) == 2
    cube.scale = (0, 0, 0)
    assert len(move_colliders(colliders)) == 1
    assert [text for text in colliders.warnings if "Cube: its scale is zero" in text]
    cube.scale = (1, 1, 1)
    assert len(move_colliders(colliders)) == 2 and colliders.warnings == ()
    assert ball.name == "Ball"
