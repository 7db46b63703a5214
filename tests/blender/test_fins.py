"""Fins in Blender: a mesh moves as cloth, and is the same bit for bit afterwards."""

from pathlib import Path

import bpy
import numpy as np
import pytest
from fin_motion import (
    FRAME_S,
    evaluated_vertices,
    play_frames,
    rest_vertices,
    start_fin,
    update_view_layer,
)
from mathutils import Matrix

from hairloom.addon.blender.preview import fins, previews
from hairloom.addon.blender.scene.fin_modifier import POSITION, fin_modifier
from hairloom.addon.errors import HairloomError


def test_the_operator_adds_one_modifier_and_takes_the_active_group(flag_object):
    assert fin_modifier(flag_object) == flag_object.modifiers[-1]
    assert flag_object.hairloom.fin.pin_group == "Pins"
    bpy.ops.hairloom.fin_add()
    assert len(flag_object.modifiers) == 1
    other = bpy.data.objects.new("Other", bpy.data.meshes.new("Other"))
    bpy.context.collection.objects.link(other)
    bpy.context.view_layer.objects.active = other
    other.select_set(True)
    bpy.ops.hairloom.fin_add()
    assert other.modifiers[0].node_group == flag_object.modifiers[0].node_group
    assert len(bpy.data.node_groups) == 1


def test_new_cloth_collides_with_nothing_as_the_page_says(flag_object, get_depsgraph):
    """Not even with the colliders of the scene's hair."""
    assert (
        flag_object.hairloom.collider is None and flag_object.hairloom.collider_collection is None
    )
    assert start_fin(flag_object, get_depsgraph).scene_colliders.parts == []
    page = (Path(__file__).parents[2] / "docs" / "dynamics.md").read_text(encoding="utf-8")
    cloth = " ".join(page.partition("\n## Cloth\n")[2].partition("\n## ")[0].split())
    assert "until you set one it collides with nothing" in cloth


def test_removing_it_leaves_nothing(flag_object, get_depsgraph):
    rest = rest_vertices(flag_object)
    session = start_fin(flag_object, get_depsgraph)
    play_frames(session, get_depsgraph, 3)
    assert bpy.ops.hairloom.fin_remove() == {"FINISHED"}
    assert previews.simulations() == ()
    assert len(flag_object.modifiers) == len(bpy.data.node_groups) == 0
    assert POSITION not in flag_object.data.attributes
    assert np.array_equal(rest_vertices(flag_object), rest)


def test_cloth_falls_from_its_pins_and_blender_shows_it(flag_object, get_depsgraph):
    rest = rest_vertices(flag_object)
    session = start_fin(flag_object, get_depsgraph)
    before = evaluated_vertices(flag_object, get_depsgraph)
    play_frames(session, get_depsgraph, 20)
    now = evaluated_vertices(flag_object, get_depsgraph)
    pinned = rest[:, 0] < -0.19
    assert now[pinned] == pytest.approx(before[pinned], abs=1e-6)
    assert now[~pinned, 2].min() < -0.1
    assert now == pytest.approx(session.state.position.T, abs=1e-5)
    there = flag_object.evaluated_get(get_depsgraph()).data
    normals = np.empty((121, 3), np.float32)
    there.vertex_normals.foreach_get("vector", normals.ravel())
    cosine = (normals * session.normals()).sum(axis=1)
    assert cosine.min() > 0.99, "normals are those of the cloth"
    session.stop(get_depsgraph())
    assert np.array_equal(rest_vertices(flag_object), rest)
    assert POSITION not in flag_object.data.attributes
    update_view_layer()
    assert np.array_equal(evaluated_vertices(flag_object, get_depsgraph), before)


def test_pins_follow_an_animated_parent(flag_object, get_depsgraph):
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.collection.objects.link(parent)
    flag_object.parent = parent
    flag_object.scale = (1.5, 1.0, 0.5)
    for frame, x in ((1, 0.0), (13, 0.3)):
        parent.location.x = x
        parent.rotation_euler.z = x
        parent.keyframe_insert("location", frame=frame)
        parent.keyframe_insert("rotation_euler", frame=frame)
    bpy.context.scene.frame_set(1)
    session = start_fin(flag_object, get_depsgraph)
    rest = rest_vertices(flag_object)
    pinned = rest[:, 0] < -0.19
    for frame in range(2, 14):
        bpy.context.scene.frame_set(frame)
        session.advance(get_depsgraph(), 1.0 / 24.0)
    update_view_layer()
    matrix = np.array(flag_object.matrix_world)
    carried = rest @ matrix[:3, :3].T + matrix[:3, 3]
    now = evaluated_vertices(flag_object, get_depsgraph)
    assert now[pinned] == pytest.approx(carried[pinned], abs=1e-5)
    assert np.abs(now - carried)[~pinned].max() > 0.02


def test_pins_follow_an_armature_and_shape_keys(flag_object, get_depsgraph):
    data = bpy.data.armatures.new("Rig")
    rig = bpy.data.objects.new("Rig", data)
    bpy.context.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    data.edit_bones.new("Bone").tail = (0.0, 0.0, 0.1)
    bpy.ops.object.mode_set(mode="OBJECT")
    flag_object.vertex_groups.new(name="Bone").add(range(121), 1.0, "REPLACE")
    flag_object.modifiers.new("Armature", "ARMATURE").object = rig
    flag_object.modifiers.move(1, 0)
    flag_object.shape_key_add(name="Basis")
    key = flag_object.shape_key_add(name="Up")
    for point in key.data:
        point.co.z += 0.05
    session = start_fin(flag_object, get_depsgraph)
    rest = rest_vertices(flag_object)
    pinned = rest[:, 0] < -0.19

    def pose(frame):
        rig.pose.bones["Bone"].matrix_basis = Matrix.Translation((0.0, 0.02 * (frame + 1), 0.0))
        key.value = (frame + 1) / 10.0

    play_frames(session, get_depsgraph, 10, pose)
    moved = rig.pose.bones["Bone"].matrix.translation
    assert np.abs(np.array(moved)).max() > 0.1
    expected = rest[pinned] + np.array(moved) + np.array([0.0, 0.0, 0.05])
    assert evaluated_vertices(flag_object, get_depsgraph)[pinned] == pytest.approx(
        expected, abs=1e-5
    )


def test_a_frame_that_was_recorded_is_shown_again_exactly(flag_object, get_depsgraph):
    flag_object.rotation_euler = (0.3, 0.2, 0.1)
    session = start_fin(flag_object, get_depsgraph)
    play_frames(session, get_depsgraph, 8)
    frame, drawn = session.bake_arrays(), evaluated_vertices(flag_object, get_depsgraph)
    play_frames(session, get_depsgraph, 4)
    assert not np.array_equal(evaluated_vertices(flag_object, get_depsgraph), drawn)
    session.show_recorded(frame)
    update_view_layer()
    assert np.array_equal(evaluated_vertices(flag_object, get_depsgraph), drawn)
    assert np.array_equal(session.bake_arrays()["position"], frame["position"])
    assert all(array.dtype != object for array in (session.constants() | frame).values())
    with pytest.raises(HairloomError, match="Bake again"):
        session.show_recorded({"position": frame["position"][:-1]})


def test_two_runs_are_alike(flag_object, get_depsgraph):
    ends = []
    for _ in range(2):
        session = start_fin(flag_object, get_depsgraph)
        play_frames(session, get_depsgraph, 10)
        ends.append(session.bake_arrays()["position"])
        session.stop(get_depsgraph())
        previews.stop(session)
    assert np.array_equal(*ends)


def test_hashes_show_which_frames_have_changed(flag_object, get_depsgraph):
    session = start_fin(flag_object, get_depsgraph)
    rig_hash, frame_hash = session.rig_hash(get_depsgraph()), session.frame_hash(get_depsgraph())
    assert session.rig_hash(get_depsgraph()) == rig_hash
    assert session.frame_hash(get_depsgraph()) == frame_hash
    flag_object.location.x = 1.0
    update_view_layer()
    assert session.rig_hash(get_depsgraph()) == rig_hash
    assert session.frame_hash(get_depsgraph()) != frame_hash
    flag_object.vertex_groups["Pins"].add([60], 0.5, "REPLACE")
    update_view_layer()
    assert session.rig_hash(get_depsgraph()) != rig_hash


def test_it_stays_out_of_a_collider(flag_object, get_depsgraph):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1, location=(0.0, 0.0, -0.12))
    ball = bpy.context.object
    ball.hairloom.collider_shape = "sphere"
    flag_object.hairloom.collider = ball
    session = start_fin(flag_object, get_depsgraph)
    play_frames(session, get_depsgraph, 40)
    assert session.scene_colliders.warnings == ()
    away = np.linalg.norm(
        evaluated_vertices(flag_object, get_depsgraph) - np.array(ball.location), axis=1
    )
    assert away.min() > 0.1
    assert away.min() < 0.105, "it lies on the ball"


def test_the_wind_of_the_scene_blows(flag_object, get_depsgraph):
    bpy.ops.object.effector_add(type="WIND", rotation=(0.0, 0.0, 0.0))
    bpy.context.object.field.strength = 20.0
    flag_object.hairloom.fin.gravity = 0.0
    session = start_fin(flag_object, get_depsgraph)
    play_frames(session, get_depsgraph, 20)
    assert evaluated_vertices(flag_object, get_depsgraph)[:, 2].max() > 0.05


def test_modifiers_below_go_on_from_the_cloth(flag_object, get_depsgraph):
    flag_object.modifiers.new("Smooth", "SUBSURF").levels = 1
    flag_object.modifiers.new("Thick", "SOLIDIFY").thickness = 0.01
    session = start_fin(flag_object, get_depsgraph)
    play_frames(session, get_depsgraph, 10)
    assert len(evaluated_vertices(flag_object, get_depsgraph)) > 400
    assert evaluated_vertices(flag_object, get_depsgraph)[:, 2].min() < -0.02
    assert len(session.bake_arrays()["position"]) == 121


@pytest.mark.parametrize(("kind", "place"), [("SUBSURF", 0), ("MIRROR", 0)])
def test_a_modifier_above_that_adds_vertices_is_reported(flag_object, get_depsgraph, kind, place):
    flag_object.modifiers.new("Culprit", kind)
    flag_object.modifiers.move(1, place)
    update_view_layer()
    with pytest.raises(HairloomError, match=r"Culprit.*below Hairloom Cloth"):
        fins.start(flag_object, get_depsgraph())


def test_a_modifier_below_that_reorders_vertices_is_reported(flag_object, get_depsgraph):
    flag_object.modifiers.new("Fewer", "DECIMATE").ratio = 0.5
    update_view_layer()
    with pytest.raises(HairloomError, match="Fewer"):
        fins.start(flag_object, get_depsgraph())


def test_a_disabled_modifier_is_reported(flag_object, get_depsgraph):
    fin_modifier(flag_object).show_viewport = False
    update_view_layer()
    with pytest.raises(HairloomError, match="turned off"):
        fins.start(flag_object, get_depsgraph())


def change_topology(flag_object):
    flag_object.data.clear_geometry()
    flag_object.data.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (change_topology, "Play again"),
        (lambda flag_object: bpy.ops.object.mode_set(mode="EDIT"), "Edit Mode"),
        (lambda flag_object: flag_object.modifiers.clear(), "not cloth"),
        (lambda flag_object: setattr(flag_object, "scale", (1.0, 0.0, 1.0)), "scale"),
        (lambda flag_object: bpy.data.objects.remove(flag_object), "gone"),
    ],
)
def test_changes_that_break_cloth_during_play_end_it_with_a_notice(
    flag_object, get_depsgraph, change, says
):
    session = start_fin(flag_object, get_depsgraph)
    previews.play(get_depsgraph())
    play_frames(session, get_depsgraph, 2)
    bpy.context.view_layer.objects.active = flag_object
    change(flag_object)
    update_view_layer()
    previews.advance(get_depsgraph(), FRAME_S)
    assert previews.simulations() == ()
    assert says in previews.notice()
    if bpy.context.object is not None and bpy.context.object.mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")


def test_a_missing_pin_group_is_reported_and_no_vertex_falls(flag_object, get_depsgraph):
    flag_object.hairloom.fin.pin_group = "Nowhere"
    update_view_layer()
    with pytest.raises(HairloomError, match="Nowhere"):
        fins.start(flag_object, get_depsgraph())
    flag_object.hairloom.fin.pin_group = ""
    session = start_fin(flag_object, get_depsgraph)
    assert "no vertex is pinned" in session.warnings[0]
    before = evaluated_vertices(flag_object, get_depsgraph)
    play_frames(session, get_depsgraph, 5)
    assert (evaluated_vertices(flag_object, get_depsgraph) - before)[:, 2].max() < -0.01


def test_a_mesh_shared_by_two_fins_is_reported(flag_object, get_depsgraph):
    twin = flag_object.copy()
    bpy.context.collection.objects.link(twin)
    update_view_layer()
    with pytest.raises(HairloomError, match="Single User"):
        fins.start(flag_object, get_depsgraph())
