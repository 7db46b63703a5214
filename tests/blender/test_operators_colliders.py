"""The operator that fits spheres: its result, and how it is followed, undone and removed."""

import math

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from tiers import few_in_commits

from hairloom.addon.blender.colliders import spheres
from hairloom.addon.blender.colliders.scene_colliders import SceneColliders
from hairloom.addon.dynamics.colliders import SphereSetCollider
from hairloom.addon.dynamics.fitting.settings import SphereFitSettings
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.measure import deepest_penetration
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import start
from hairloom.addon.dynamics.step import advance

TURN = Matrix.Translation((0.1, -0.2, 0.3)) @ Matrix.Rotation(0.7, 4, (1, 2, 3))


@pytest.fixture
def monkey(extension):
    """Suzanne, 0.3 m wide."""
    bpy.ops.mesh.primitive_monkey_add(size=0.22)
    return bpy.context.object


def fit(count=20, **options):
    assert bpy.ops.hairloom.fit_spheres(sphere_count=count, **options) == {"FINISHED"}


def empties(mesh):
    (collection,) = spheres.fitted_collections(mesh)
    return list(collection.objects)


def balls(mesh):
    """World-space centers (n, 3) and radii (n,) as Blender displays them."""
    bpy.context.view_layer.update()
    found = empties(mesh)
    centers = np.array([empty.matrix_world.translation for empty in found])
    scale = [np.cbrt(abs(empty.matrix_world.to_3x3().determinant())) for empty in found]
    return centers, np.array([e.empty_display_size for e in found]) * scale


def moved(matrix, points):
    matrix = np.array(matrix)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def rig(mesh):
    """Bind a mesh to a bone of a still armature; returns a function that poses the bone."""
    armature = bpy.data.armatures.new("Rig")
    obj = bpy.data.objects.new("Rig", armature)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    bone = armature.edit_bones.new("Bone")
    bone.head, bone.tail = (0, 0, 0), (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    mesh.vertex_groups.new(name="Bone").add(range(len(mesh.data.vertices)), 1.0, "REPLACE")
    mesh.modifiers.new("Armature", "ARMATURE").object = obj
    bpy.context.view_layer.objects.active = mesh
    mesh.select_set(True)

    def pose(matrix):
        obj.pose.bones["Bone"].matrix = matrix @ armature.bones["Bone"].matrix_local
        bpy.context.view_layer.update()

    return pose


def test_spheres_are_empties_in_a_collection_of_their_own(monkey):
    fit(20)
    (collection,) = spheres.fitted_collections(monkey)
    assert collection.name == "Suzanne Spheres"
    assert bpy.context.scene.collection.children.get(collection.name) == collection
    assert len(collection.objects) == 20
    assert all(
        empty.type == "EMPTY" and empty.empty_display_type == "SPHERE" and empty.visible_get()
        for empty in collection.objects
    )
    assert monkey.hairloom.collider_shape == "none"


def test_fitted_spheres_cover_suzanne_within_the_stated_error(monkey):
    """Measured at her vertices, after Blender has placed the empties."""
    fit(60)
    centers, radii = balls(monkey)
    vertices = np.array([monkey.matrix_world @ vertex.co for vertex in monkey.data.vertices])
    gap = (np.linalg.norm(vertices[:, None] - centers, axis=2) - radii).min(axis=1)
    size = np.ptp(vertices, axis=0).max()
    assert np.maximum(gap, 0.0).mean() < 0.008 * size
    assert gap.max() < 0.05 * size


@pytest.mark.alike
@pytest.mark.parametrize("scale", [(2, 2, 2), (1, 3, 0.5), (-1, 1, 1)])
def test_radii_are_metres_whatever_the_scale_of_the_mesh(monkey, scale):
    monkey.scale, monkey.location, monkey.rotation_euler.z = scale, (1, 2, 3), 0.4
    fit(12)
    centers, radii = balls(monkey)
    found = [np.array(empty.matrix_world)[:3, :3] for empty in empties(monkey)]
    np.testing.assert_allclose(found, np.broadcast_to(np.eye(3), (12, 3, 3)), atol=1e-5)
    corners = np.array([monkey.matrix_world @ vertex.co for vertex in monkey.data.vertices])
    allowed = 0.01 * np.ptp(corners, axis=0).max() + 1e-4
    assert (centers + radii[:, None] <= corners.max(axis=0) + allowed).all()
    assert (centers - radii[:, None] >= corners.min(axis=0) - allowed).all()


@pytest.mark.parametrize("modifier", few_in_commits(["SUBSURF", None, "TRIANGULATE"]))
def test_fitted_spheres_follow_an_armature(monkey, modifier):
    """The object stands still. Spheres, fitted in a pose, follow to 0.1 mm."""
    pose = rig(monkey)
    if modifier:
        monkey.modifiers.new(modifier, modifier)
    pose(Matrix.Rotation(0.4, 4, "X"))
    fit(15)
    centers, radii = balls(monkey)
    pose(TURN @ Matrix.Rotation(0.4, 4, "X"))
    there, sizes = balls(monkey)
    np.testing.assert_allclose(there, moved(TURN, centers), atol=1e-4)
    np.testing.assert_allclose(sizes, radii, rtol=1e-4)
    assert {empty.parent_type for empty in empties(monkey)} == {"VERTEX_3"}


def test_fitted_spheres_follow_the_object(monkey):
    fit(10)
    centers, radii = balls(monkey)
    monkey.matrix_world = TURN @ Matrix.Scale(2.0, 4)
    there, sizes = balls(monkey)
    np.testing.assert_allclose(there, moved(TURN, centers * 2.0), atol=1e-5)
    np.testing.assert_allclose(sizes, radii * 2.0, rtol=1e-4)


@pytest.mark.slow(instead="test_fitted_spheres_follow_the_object")
def test_spheres_that_vertices_cannot_carry_follow_the_object_with_a_warning(monkey, capfd):
    monkey.modifiers.new("Mirror", "MIRROR").use_axis[1] = True
    fit(10)
    assert {empty.parent_type for empty in empties(monkey)} == {"OBJECT"}
    centers, _ = balls(monkey)
    monkey.matrix_world = TURN
    np.testing.assert_allclose(balls(monkey)[0], moved(TURN, centers), atol=1e-5)
    assert "10 of 10 spheres" in capfd.readouterr().out


def test_the_report_has_count_and_error_of_the_spheres(monkey, capfd):
    fit(10)
    output = capfd.readouterr().out
    assert "10 spheres in Suzanne Spheres" in output and output.count("mm") == 4


def test_the_hair_of_the_mesh_uses_them(new_hair, sphere):
    hair = new_hair(sphere)
    fit(8)  # the hair is active, and its head gets the spheres
    (collection,) = spheres.fitted_collections(sphere)
    assert hair.hairloom.collider_collection == collection
    depsgraph = bpy.context.evaluated_depsgraph_get()
    found = SceneColliders.of(hair, None, None, DynamicsSettings(), depsgraph, None)
    (posed,) = found.move(depsgraph, 1.0 / 60.0)
    assert isinstance(posed.collider, SphereSetCollider) and found.warnings == ()
    np.testing.assert_allclose(np.sort(posed.collider.radii), np.sort(balls(sphere)[1]), rtol=1e-5)


def test_spheres_of_another_mesh_that_the_artist_has_chosen_stay(new_hair, sphere):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1, location=(0.0, 0.0, -0.3))
    body = bpy.context.object
    fit(4)
    hair = new_hair(sphere)
    (of_body,) = spheres.fitted_collections(body)
    hair.hairloom.collider_collection = of_body
    fit(8)
    fit(8)  # again: nothing is added twice
    (of_head,) = spheres.fitted_collections(sphere)
    used = hair.hairloom.collider_collection
    assert (
        list(used.children) == [of_body, of_head]
        and used.name in bpy.context.scene.collection.children
    )
    assert not of_body.children and not of_head.children


@pytest.mark.slow(instead="test_the_hair_of_the_mesh_uses_them")
def test_colliders_that_the_artist_has_chosen_stay(new_hair, sphere):
    sphere.scale.z = 3.0  # a sphere would get one ball only
    hair = new_hair(sphere)
    own = bpy.data.collections.new("Own")
    hair.hairloom.collider_collection = own
    fit(8)
    fit(6)
    assert hair.hairloom.collider_collection == own
    assert len([obj for obj in own.all_objects if obj.type == "EMPTY"]) == 6


@pytest.mark.slow(instead="test_removing_and_deleting")
def test_fitting_again_replaces_the_last_spheres_and_leaves_other_objects(monkey):
    fit(10)
    (collection,) = spheres.fitted_collections(monkey)
    mine = bpy.data.objects.new("Mine", None)
    collection.objects.link(mine)
    fit(5, replace_mesh=False)
    assert spheres.fitted_collections(monkey) == [collection]
    assert len(collection.objects) == 6 and mine.name in collection.objects
    assert len(bpy.data.objects) == 7


def test_removing_and_deleting(new_hair, sphere):
    hair = new_hair(sphere)
    fit(8)
    assert bpy.ops.hairloom.remove_spheres() == {"FINISHED"}
    assert spheres.fitted_collections(sphere) == []
    assert hair.hairloom.collider_collection is None
    assert sphere.hairloom.collider_shape == "automatic"
    assert not bpy.ops.hairloom.remove_spheres.poll()
    fit(8)
    (collection,) = spheres.fitted_collections(sphere)
    bpy.data.collections.remove(collection)
    assert hair.hairloom.collider_collection is None
    fit(8)
    bpy.data.objects.remove(sphere)
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    SceneColliders.of(hair, None, None, DynamicsSettings(), depsgraph, None).move(depsgraph, 0.1)


@pytest.mark.parametrize("shape", few_in_commits(["automatic", "capsule", "none"]))
def test_a_mesh_collides_again_as_it_did_before_its_spheres(monkey, shape):
    monkey.hairloom.collider_shape = shape
    fit(4)
    fit(5)
    assert monkey.hairloom.collider_shape == "none"
    assert bpy.ops.hairloom.remove_spheres() == {"FINISHED"}
    assert monkey.hairloom.collider_shape == shape


def test_undo(monkey):
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="begin")
    bpy.ops.hairloom.fit_spheres("EXEC_DEFAULT", True, sphere_count=6)
    assert len(bpy.data.objects) == 7
    bpy.ops.ed.undo()
    assert len(bpy.data.objects) == 1 and not bpy.data.collections
    assert bpy.data.objects["Suzanne"].hairloom.collider_shape == "automatic"
    bpy.ops.ed.redo()
    assert len(spheres.fitted_collections(bpy.data.objects["Suzanne"])[0].objects) == 6


def test_saved_and_loaded_again(monkey, tmp_path):
    fit(6)
    centers, _ = balls(monkey)
    file = str(tmp_path / "spheres.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.open_mainfile(filepath=file)
    np.testing.assert_allclose(balls(bpy.data.objects["Suzanne"])[0], centers, atol=1e-6)


def test_a_mesh_without_volume_is_reported(extension):
    assert not bpy.ops.hairloom.fit_spheres.poll()
    bpy.ops.mesh.primitive_plane_add()
    with pytest.raises(RuntimeError, match="Plane: it encloses no volume"):
        bpy.ops.hairloom.fit_spheres()
    bpy.ops.object.mode_set(mode="EDIT")
    assert not bpy.ops.hairloom.fit_spheres.poll()


def test_the_operator_takes_all_settings_of_the_fit(monkey):
    names = {parameter.name for parameter in SphereFitSettings.parameters()}
    assert names <= set(bpy.ops.hairloom.fit_spheres.get_rna_type().properties.keys())


def test_hair_stays_out_of_fitted_spheres_that_an_armature_swings(monkey):
    """Long hair all around, on a head that a bone shakes: penetration stays below 0.1 mm."""
    pose = rig(monkey)
    fit(30)
    owner = bpy.data.objects.new("Owner", None)
    bpy.context.collection.objects.link(owner)
    owner.hairloom.collider_collection = spheres.fitted_collections(monkey)[0]
    depsgraph = bpy.context.evaluated_depsgraph_get()
    settings = DynamicsSettings(style_root=0.3, style_tip=0.1, bend=0.2, sag_compensation=0.0)
    found = SceneColliders.of(owner, None, None, settings, depsgraph, None)
    outward = np.random.default_rng(0).normal(size=(200, 1, 3))
    outward /= np.linalg.norm(outward, axis=2, keepdims=True)
    rest = (outward * (0.19 + np.linspace(0.0, 0.2, 12))[:, None]).astype(np.float32)
    state, before, depth = start(rest), rest, []
    for frame in range(1, 60):
        ease = math.sin(math.pi * min(frame / 30, 0.5)) ** 2
        turn = Matrix.Rotation(0.5 * ease * math.sin(frame / 60 * 2.0 * math.pi), 4, "Z")
        pose(turn)
        colliders = found.move(bpy.context.evaluated_depsgraph_get(), 1.0 / 60.0)
        now = moved(turn, rest).astype(np.float32)
        drive = Drive(before, now, colliders, np.array([0.0, 0.0, -9.81]))
        state, before = advance(state, drive, settings, 1.0 / 60.0), now
        depth.append(deepest_penetration(state, colliders))
    assert max(depth) < 1e-4
    assert np.linalg.norm(state.position, axis=0).min() < 0.17, "some of it has fallen onto her"
