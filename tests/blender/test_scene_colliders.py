"""Everything that hair collides with: kinds of objects, their motion and deformation."""

import math

import bpy
import numpy as np
import pytest
from collider_scene import COARSE_SETTINGS, ColliderScene, depsgraph, distance_now, move_colliders
from mathutils import Matrix, Vector

from hairloom.addon.blender.base.objects import Body
from hairloom.addon.blender.colliders.scene_colliders import SceneColliders
from hairloom.addon.blender.scene.surfaces import read_surface
from hairloom.addon.dynamics.colliders import (
    CapsuleCollider,
    DistanceField,
    SphereCollider,
    SphereSetCollider,
    signed_distance,
)
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.strands import Surface


@pytest.fixture
def scene(extension):
    return ColliderScene()


def rig(mesh, name="Rig"):
    """Bind a mesh to a bone of a still armature; returns a function that poses the bone."""
    armature = bpy.data.armatures.new(name)
    obj = bpy.data.objects.new(name, armature)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    bone = armature.edit_bones.new("Bone")
    bone.head, bone.tail = (0, 0, 0), (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    mesh.vertex_groups.new(name="Bone").add(range(len(mesh.data.vertices)), 1.0, "REPLACE")
    mesh.modifiers.new("Armature", "ARMATURE").object = obj

    def pose(matrix):
        obj.pose.bones["Bone"].matrix = matrix @ armature.bones["Bone"].matrix_local
        bpy.context.view_layer.update()

    return pose


TURN = Matrix.Translation((0.1, -0.2, 0.3)) @ Matrix.Rotation(0.7, 4, (1, 2, 3))


# --- kinds


def test_nothing_to_collide_with(scene):
    scene.owner.hairloom.collider_collection = None
    assert move_colliders(scene.read_colliders()) == ()
    assert scene.read_colliders().warnings == ()


def test_each_object_collides_as_its_kind(scene):
    scene.ball()
    scene.cube(name="A")
    scene.cube(shape="sphere", name="B", place=(1, 0, 0))
    scene.cube(shape="capsule", name="C")
    scene.cube(shape="none", name="D")
    colliders = scene.read_colliders()
    kinds = sorted(type(posed.collider).__name__ for posed in move_colliders(colliders))
    assert kinds == ["CapsuleCollider", "DistanceField", "SphereSetCollider"]
    assert colliders.warnings == ()
    (balls,) = [p for p in move_colliders(colliders) if isinstance(p.collider, SphereSetCollider)]
    assert len(balls.collider.radii) == 2


def test_an_empty_that_is_no_sphere_a_lamp_and_the_owner_are_left_alone(scene):
    axes = bpy.data.objects.new("Axes", None)
    light = bpy.data.objects.new("Light", bpy.data.lights.new("Light", "POINT"))
    for obj in (axes, light):
        bpy.context.collection.objects.link(obj)
        scene.add(obj)
    scene.add(scene.owner)
    colliders = scene.read_colliders()
    assert move_colliders(colliders) == () and len(colliders.warnings) == 1
    assert "nothing in the collection" in colliders.warnings[0]


def test_a_ball_is_as_large_as_blender_shows_it(scene):
    ball = scene.ball(0.1, (1, 0, 0))
    ball.scale = (2, 2, 2)
    (posed,) = move_colliders(scene.read_colliders())
    assert distance_now(posed, (1.0, 0.0, 0.5)) == pytest.approx(0.3, abs=1e-6)


def test_a_mesh_as_sphere_holds_its_longest_side(scene):
    cube = scene.cube(0.2, "sphere", place=(0, 0, 1))
    for vertex in cube.data.vertices:
        vertex.co.x *= 2.0
    (posed,) = move_colliders(scene.read_colliders())
    assert distance_now(posed, (0.0, 0.0, 1.5)) == pytest.approx(0.3, abs=1e-6)


def test_a_stretched_ball_is_an_ellipsoid(scene):
    scene.ball(0.1).scale = (3, 1, 1)
    (posed,) = move_colliders(scene.read_colliders())
    assert isinstance(posed.collider, SphereCollider)
    assert distance_now(posed, (0.4, 0, 0)) == pytest.approx(0.1, abs=1e-6)
    assert distance_now(posed, (0, 0.4, 0)) == pytest.approx(0.3, abs=1e-6)


def test_a_capsule_lies_along_the_longest_side_with_round_ends(scene):
    """A box of 0.2, scaled to a length of 0.8: its capsule ends at 0.4 and has a radius of 0.1."""
    cube = scene.cube(0.2, "capsule")
    cube.scale = (1, 4, 1)
    cube.rotation_euler.z = math.pi / 2  # its y axis becomes the world's x axis
    (posed,) = move_colliders(scene.read_colliders())
    assert isinstance(posed.collider, CapsuleCollider)
    assert distance_now(posed, (0.5, 0, 0)) == pytest.approx(0.1, abs=1e-6)
    assert distance_now(posed, (0.2, 0, 0.25)) == pytest.approx(0.15, abs=1e-6)
    corner = 0.3 + 0.1 / math.sqrt(2.0)  # on the rounded end
    assert distance_now(posed, (corner, corner - 0.3, 0)) == pytest.approx(0.0, abs=1e-6)


def test_an_empty_as_capsule_stands_along_z(scene):
    empty = scene.ball(0.2)
    empty.hairloom.collider_shape = "capsule"
    (posed,) = move_colliders(scene.read_colliders())
    assert distance_now(posed, (0, 0, 0.3)) == pytest.approx(0.1, abs=1e-6)
    assert distance_now(posed, (0.3, 0, 0)) == pytest.approx(0.2, abs=1e-6)


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (2, 2, -2)])
def test_a_mesh_that_is_mirrored_or_scaled(scene, scale):
    cube = scene.cube(0.2, place=(1, 0, 0))
    cube.scale, cube.rotation_euler.z = scale, 0.4
    (posed,) = move_colliders(scene.read_colliders())
    assert isinstance(posed.collider, DistanceField)
    half = 0.1 * abs(scale[2])
    assert distance_now(posed, (1, 0, half + 0.02)) == pytest.approx(0.02, abs=2e-3)
    assert distance_now(posed, (1, 0, half - 0.02)) == pytest.approx(-0.02, abs=2e-3)


# --- motion


def test_colliders_follow_a_curved_trajectory_between_frames(scene):
    ball, cube = scene.ball(), scene.cube()
    colliders = scene.read_colliders()
    for posed in move_colliders(colliders):
        np.testing.assert_allclose(posed.matrix_before, posed.matrix_now)
    for place in (0.1, 0.3, 0.6):  # it accelerates
        ball.location.x = cube.location.x = place
        last = move_colliders(colliders)
    assert len(last) == 2
    for posed in last:
        went = posed.matrix_now[0, 3] - posed.matrix_before[0, 3]
        assert went == pytest.approx(0.3, abs=1e-5)
        # 0.1, 0.3, 0.6 lie on x = 0.3 + 0.25 s + 0.05 s^2 in this frame; its middle is at 0.4375
        assert posed.matrix_at(0.5)[0, 3] - posed.matrix_before[0, 3] == pytest.approx(
            0.1375, abs=1e-5
        )


def test_after_rest_colliders_have_no_speed_and_no_curvature(scene):
    ball = scene.ball()
    colliders = scene.read_colliders()
    ball.location.x = 0.5
    move_colliders(colliders)
    ball.location.x = 2.0
    colliders.rest(depsgraph())
    (posed,) = move_colliders(colliders)
    assert posed.matrix_before[0, 3] == posed.matrix_now[0, 3] == pytest.approx(2.0, abs=1e-6)
    assert posed.matrix_earlier is None


def test_balls_that_move_apart_become_another_set(scene):
    parent = scene.ball(0.1, name="A")
    other = scene.ball(0.2, (0.5, 0, 0), name="B")
    other.parent = None
    colliders = scene.read_colliders()
    (before,) = move_colliders(colliders)
    (still,) = move_colliders(colliders)
    assert still.collider is before.collider, "its grid is made once"
    other.location.x = 0.9
    parent.scale = (2, 2, 2)
    (posed,) = move_colliders(colliders)
    assert distance_now(posed, (1.2, 0, 0)) == pytest.approx(0.1, abs=1e-5)
    assert distance_now(posed, (-0.3, 0, 0)) == pytest.approx(0.1, abs=1e-5)


def test_balls_that_move_together_stay_one_set(scene):
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.collection.objects.link(parent)
    for number in range(5):
        scene.ball(0.05, (0.1 * number, 0, 0), name=f"B{number}").parent = parent
    colliders = scene.read_colliders()
    (before,) = move_colliders(colliders)
    parent.matrix_world = TURN @ Matrix.Scale(2.0, 4)
    (posed,) = move_colliders(colliders)
    assert posed.collider is before.collider
    place = TURN @ Vector((0.8, 0, 0))
    outward = TURN.to_3x3() @ Vector((1, 0, 0))
    assert distance_now(posed, place + outward * 0.2) == pytest.approx(0.1, abs=1e-5)


def test_one_ball_that_turns_turns_its_collider(scene):
    ball = scene.ball()
    colliders = scene.read_colliders()
    ball.rotation_euler.z = 0.5
    (posed,) = move_colliders(colliders)
    np.testing.assert_allclose(posed.matrix_now[:2, 0], [math.cos(0.5), math.sin(0.5)], atol=1e-6)


@pytest.mark.parametrize("subdivided", [False, True])
def test_a_mesh_that_an_armature_turns_is_followed(scene, subdivided):
    """The object stands still and its vertices move; within 0.1 mm."""
    bpy.ops.mesh.primitive_monkey_add(size=0.2)
    head = scene.add(bpy.context.object)
    pose = rig(head)
    if subdivided:
        head.modifiers.new("Subdivision", "SUBSURF").levels = 1
    colliders = scene.read_colliders()
    pose(TURN)
    (posed,) = move_colliders(colliders)
    np.testing.assert_allclose(posed.matrix_now, TURN, atol=1e-4)
    (warning,) = colliders.warnings
    assert "only one face" in warning, "the monkey's eyes are loose parts without backs"


def test_a_mesh_that_an_armature_turns_and_its_object_carries(scene):
    cube = scene.cube()
    pose = rig(cube)
    colliders = scene.read_colliders()
    pose(Matrix.Rotation(0.5, 4, "Z"))
    bpy.data.objects["Rig"].matrix_world = TURN
    cube.parent = bpy.data.objects["Rig"]
    (posed,) = move_colliders(colliders)
    np.testing.assert_allclose(posed.matrix_now, TURN @ Matrix.Rotation(0.5, 4, "Z"), atol=1e-5)


def long_body():
    """A mesh whose upper half follows a bone, and the function that poses the bone."""
    bpy.ops.mesh.primitive_cylinder_add(radius=0.1, depth=2.0, vertices=16)
    body = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(number_cuts=15)
    bpy.ops.object.mode_set(mode="OBJECT")
    pose = rig(body)
    for vertex in body.data.vertices:
        body.vertex_groups["Bone"].add([vertex.index], float(vertex.co.z > 0.0), "REPLACE")
    return body, pose


@pytest.mark.slow
def test_the_head_is_followed_at_its_roots_where_the_body_bends(scene):
    """A long body whose upper half turns: its collider follows the vertices at the roots and has
    the body's bent shape."""
    body, pose = long_body()
    at_rest = read_surface(body, depsgraph(), need_uv=False, place="Body")
    roots = np.flatnonzero(at_rest.positions[:, 2] > 0.9)
    head = Body.at_rest(body, depsgraph())
    scene.owner.hairloom.collider_collection = None
    turn, fine = Matrix.Rotation(0.8, 4, "X"), DynamicsSettings(collider_resolution=64)

    def place(chosen):
        pose(Matrix.Identity(4))
        colliders = SceneColliders.of(scene.owner, head, at_rest, fine, depsgraph(), None, chosen)
        pose(turn)
        (posed,) = move_colliders(colliders)
        assert colliders.warnings == ()
        assert posed.collider is not colliders.parts[0].distance
        now = read_surface(body, depsgraph(), need_uv=False, place="Body").positions
        now = now[np.abs(now[:, 2]) > 0.2]  # without the middle, which folds
        distance, _ = signed_distance(now, [posed])
        cell = posed.collider.cell
        assert np.median(np.abs(distance)) < 0.05 * cell
        assert np.abs(distance).max() < 0.75 * cell  # at the rims of its ends
        return posed

    by_roots = place(roots)
    np.testing.assert_allclose(by_roots.matrix_now, turn, atol=1e-5)
    assert by_roots.deformation < 1e-5, "what is near the roots has kept its shape"
    by_all = place(None)
    assert np.abs(by_all.matrix_now - np.array(turn)).max() > 0.05
    assert by_all.deformation > 0.05


def test_a_look_at_colliders_between_two_frames_changes_no_motion(scene):
    """Such as the look of an overlay, after the body has bent."""
    body, pose = long_body()
    scene.add(body)
    both = [scene.read_colliders(), scene.read_colliders()]
    deformations = []
    for angle in (0.2, 0.4, 0.4):
        pose(Matrix.Rotation(angle, 4, "X"))
        both[0].static_colliders(depsgraph())
        (looked,), (alone,) = map(move_colliders, both)
        np.testing.assert_array_equal(looked.matrix_now, alone.matrix_now)
        assert looked.deformation == alone.deformation
        deformations.append(alone.deformation)
    assert min(deformations[:2]) > 0.01 and deformations[2] == 0.0


# --- reuse


def test_a_head_bent_back_reuses_its_field(scene):
    body, pose = long_body()
    at_rest = read_surface(body, depsgraph(), need_uv=False, place="Body")
    head = Body.at_rest(body, depsgraph())
    scene.owner.hairloom.collider_collection = None

    def of(known):
        return SceneColliders.of(scene.owner, head, at_rest, COARSE_SETTINGS, depsgraph(), known)

    straight = of(None)
    pose(Matrix.Rotation(0.3, 4, "X"))
    (bent,) = move_colliders(straight)
    again = of(straight)
    assert move_colliders(again)[0].collider is bent.collider
    assert bent.collider is not again.parts[0].distance
    pose(Matrix.Rotation(0.4, 4, "X"))
    assert move_colliders(of(again))[0].collider is not bent.collider


def test_fields_are_made_once_and_again_when_the_mesh_or_resolution_differs(scene):
    cube = scene.cube()
    pose = rig(cube)
    colliders = scene.read_colliders()
    first = move_colliders(colliders)[0].collider
    pose(TURN)
    cube.location.y = 2.0
    again = scene.read_colliders(colliders)
    assert move_colliders(again)[0].collider is first
    cube.data.vertices[0].co.x += 0.1
    other = scene.read_colliders(again)
    assert move_colliders(other)[0].collider is not first
    finer = SceneColliders.of(
        scene.owner, None, None, DynamicsSettings(collider_resolution=20), depsgraph(), other
    )
    assert move_colliders(finer)[0].collider is not move_colliders(other)[0].collider


def test_a_mesh_with_another_vertex_count_is_rebuilt_when_play_restarts(scene):
    cube = scene.cube()
    colliders = scene.read_colliders()
    cube.modifiers.new("Subdivision", "SUBSURF").levels = 2
    again = scene.read_colliders(colliders)
    (posed,) = move_colliders(again)
    assert again.warnings == ()
    assert posed.collider is not colliders.parts[0].distance


def test_one_root_or_none_is_enough_to_follow_a_head(scene, sphere):
    pose = rig(sphere)
    at_rest = read_surface(sphere, depsgraph(), need_uv=False, place="Head")
    head = Body.at_rest(sphere, depsgraph())
    alone = Surface(at_rest.positions, at_rest.triangles[:0])
    for surface, roots in ((at_rest, np.array([5])), (at_rest, np.zeros(0, int))):
        colliders = SceneColliders.of(
            scene.owner, head, surface, COARSE_SETTINGS, depsgraph(), None, roots
        )
        pose(TURN)
        np.testing.assert_allclose(move_colliders(colliders)[0].matrix_now, TURN, atol=1e-5)
        pose(Matrix.Identity(4))
    colliders = SceneColliders.of(scene.owner, head, alone, COARSE_SETTINGS, depsgraph(), None)
    assert move_colliders(colliders) == () and "no faces" in colliders.warnings[0]
