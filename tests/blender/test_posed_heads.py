"""Hair without an attaching modifier, on a posed head, is the same whatever frame it is read in."""

import bpy
import numpy as np
import pytest
from hedgehogs import hedgehog
from node_modifiers import add_nodes_modifier, hair_dynamics_mode
from selecting import select

from hairloom.addon.blender.base.parts import run_parts
from hairloom.addon.blender.cards.build import read_inputs
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.preview.bake import Bake
from hairloom.addon.blender.scene.curves import curve_points, fill_curves, read_curves
from hairloom.addon.blender.scene.source import hair_dynamics_modifiers, posed_curves, read_source
from hairloom.addon.blender.sessions.groom_source import GroomSource
from hairloom.addon.blender.strands.groom_motion import moving_hair
from hairloom.addon.blender.strands.make_real import make_real
from hairloom.addon.blender.strands.read_hair import ExportRequest
from hairloom.addon.groom.roots import bind_roots
from hairloom.addon.strands import closest_point

REST, POSED = 1, 4
#: tolerance [m]: frames turn strands in float32
SAME = 1e-5


@pytest.fixture
def hair(new_hair, sphere):
    """Hair on a ball that a bone turns by 40 degrees and moves by 0.3 m, over four frames."""
    made = new_hair(sphere, hedgehog(80, seed=3))
    made.hairloom.dynamics.collider_resolution = 8
    attach_roots(made)
    bpy.ops.object.armature_add(location=(0.0, 0.0, -0.3))
    armature = bpy.context.object
    group = sphere.vertex_groups.new(name=armature.data.bones[0].name)
    group.add(range(len(sphere.data.vertices)), 1.0, "REPLACE")
    sphere.modifiers.new("Armature", "ARMATURE").object = armature
    bone = armature.pose.bones[0]
    bone.rotation_mode = "XYZ"
    for frame, angle, place in ((REST, 0.0, 0.0), (POSED, 0.7, 0.3)):
        bone.rotation_euler.y, bone.location.x = angle, place
        bone.keyframe_insert("rotation_euler", frame=frame)
        bone.keyframe_insert("location", frame=frame)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = REST, POSED
    scene.frame_set(REST)
    select(made)
    return made


def attach_roots(hair):
    """Give curves root UVs, as all hair has that Hairloom or Blender puts on a mesh."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    source = read_source(hair, depsgraph)
    bound = bind_roots(source.strands, source.head, place="").strands
    uv = hair.data.attributes.new("surface_uv_coordinate", "FLOAT2", "CURVE")
    uv.data.foreach_set("vector", bound.root_uv.astype(np.float32).ravel())


def go_to(frame):
    bpy.context.scene.frame_set(frame)
    return bpy.context.evaluated_depsgraph_get()


def expected(hair):
    """Strands as the bone carries them to the posed frame."""
    depsgraph = go_to(REST)
    rest = read_curves(hair, depsgraph).strands.points
    bone = bpy.data.objects["Armature"].pose.bones[0]
    place = bpy.data.objects["Armature"].matrix_world
    before = place @ bone.matrix
    go_to(POSED)
    moved = np.array(place @ bone.matrix @ before.inverted())
    return rest @ moved[:3, :3].T + moved[:3, 3]


def started(hair, frame):
    previews.stop_all()
    previews.start(hair, go_to(frame))
    return previews.session_of(hair)


def test_a_preview_that_starts_in_a_pose_shows_the_hair_there(hair):
    there = expected(hair)
    session = started(hair, REST)
    go_to(POSED)
    followed = np.array(session.strands)
    session = started(hair, POSED)
    assert session.source.strands.points == pytest.approx(there, abs=SAME)
    assert not any("root" in each for each in session.warnings)
    previews.rest(bpy.context.evaluated_depsgraph_get(), keep_playing=False)
    away = np.linalg.norm(session.strands - session.rig.strands.points, axis=1)
    assert away.max() < SAME and followed.shape == session.strands.shape


def test_hair_that_blender_deforms_stays_in_place(hair):
    attached(hair)
    depsgraph = go_to(POSED)
    source = read_source(hair, depsgraph)
    assert source.rest is None
    assert np.array_equal(source.strands.points, read_curves(hair, depsgraph).strands.points)
    assert source.strands.points == pytest.approx(expected(hair), abs=0.02), "it is posed"


def attached(hair):
    """Attach hair with Blender's own node, in a modifier as an artist adds it."""
    hair.data.surface.add_rest_position_attribute = True
    hair.data.surface_uv_map = hair.data.surface.data.uv_layers.active.name
    add_nodes_modifier(hair, ("GeometryNodeDeformCurvesOnSurface", {}))
    bpy.context.view_layer.update()


def test_attached_hair_that_is_read_again_in_a_pose_is_the_same(hair):
    attached(hair)
    source = GroomSource(hair, go_to(REST))
    depsgraph = go_to(POSED)
    assert (
        np.abs(read_curves(hair, depsgraph).strands.points - source.source.strands.points).max()
        > 0.1
    )
    assert source.read_again(depsgraph) is None and source.moved_curves(depsgraph) is None
    points = curve_points(hair.data).copy()
    points[-1] += (0.0, 0.0, 0.02)
    hair.data.position_data.foreach_set("vector", points.ravel())
    hair.data.update_tag()
    bpy.context.view_layer.update()
    combed = source.read_again(bpy.context.evaluated_depsgraph_get()).source.strands.points
    away = np.linalg.norm(combed - source.source.strands.points, axis=1)
    assert away[-1] == pytest.approx(0.02, rel=0.01) and away[:-24].max() < SAME


def test_muted_hair_dynamics_leave_hair_on_its_skin(hair, sphere):
    """Tested with the modifier of Blender's own Empty Hair."""
    select(sphere)
    bpy.ops.object.curves_empty_hair_add()
    empty = bpy.context.object
    stored = read_curves(hair, go_to(REST)).strands
    fill_curves(
        empty.data, bind_roots(stored, read_source(hair, go_to(REST)).head, place="").strands
    )
    empty.data.surface_uv_map = sphere.data.uv_layers.active.name
    (modifier,) = empty.modifiers
    mode = hair_dynamics_mode(modifier)
    assert not hair_dynamics_modifiers(empty), "as it is added it simulates nothing"
    mode.value = "Physics (Experimental)"
    empty.update_tag()
    assert hair_dynamics_modifiers(empty) == [modifier]
    select(empty)
    assert bpy.ops.hairloom.mute_hair_dynamics() == {"FINISHED"}
    assert (
        not hair_dynamics_modifiers(empty) and modifier.show_viewport and mode.value == "Animation"
    )
    there, depsgraph = expected(hair), go_to(POSED)
    assert read_curves(empty, depsgraph).strands.points == pytest.approx(there, abs=1e-4)
    assert started(empty, POSED).source.strands.points == pytest.approx(there, abs=1e-4)


def test_a_head_that_is_subdivided_but_not_posed_moves_no_hair(hair, sphere):
    sphere.modifiers.new("Subdivision", "SUBSURF").levels = 1
    depsgraph = go_to(REST)
    source = read_source(hair, depsgraph)
    assert source.rest is None
    assert np.array_equal(source.strands.points, read_curves(hair, depsgraph).strands.points)
    # in a pose, hair is as far from the smooth skin as at rest
    assert read_source(hair, go_to(POSED)).strands.points == pytest.approx(expected(hair), abs=1e-2)


def test_hair_that_is_read_again_searches_its_head_as_before(hair, sphere, monkeypatch):
    """A search of a large head takes long to prepare, and hair is read after each edit."""
    sphere.modifiers.new("Subdivision", "SUBSURF").levels = 1
    depsgraph, prepared = go_to(POSED), []
    prepare = closest_point.build_tree
    monkeypatch.setattr(
        closest_point, "build_tree", lambda corners: prepared.append(1) or prepare(corners)
    )
    first = read_source(hair, depsgraph)
    assert len(prepared) == 2  # the head as posed, and at rest
    assert read_source(hair, depsgraph).rest.surface is first.rest.surface
    assert len(prepared) == 2


def test_a_shape_key_is_a_pose_too(new_hair, sphere):
    hair = new_hair(sphere, hedgehog(80, seed=3))
    attach_roots(hair)
    rest = posed_curves(hair, go_to(REST)).strands.points
    sphere.shape_key_add(name="Basis")
    wide = sphere.shape_key_add(name="Wide")
    for point in wide.data:
        point.co.y += 0.3
    wide.value = 1.0
    bpy.context.view_layer.update()
    shown = posed_curves(hair, bpy.context.evaluated_depsgraph_get()).strands.points
    assert shown == pytest.approx(rest + [0.0, 0.3, 0.0], abs=SAME)


def test_hair_on_a_shape_key_is_distinguished_from_hair_on_the_basis(hair, sphere):
    """As in MPFB: hair has grown on the formed face, before an armature poses it."""
    sphere.shape_key_add(name="Basis")
    for name, factor in (("Wide", 1.3), ("Muted", 5.0)):
        key = sphere.shape_key_add(name=name)
        for point in key.data:
            point.co.x *= factor
        key.value, key.mute = 1.0, name == "Muted"
    points = curve_points(hair.data)
    hair.data.position_data.foreach_set("vector", (points * np.float32([1.3, 1, 1])).ravel())
    hair.data.update_tag()
    bpy.context.view_layer.update()
    assert read_source(hair, go_to(REST)).rest is None
    there = expected(hair)
    assert posed_curves(hair, go_to(POSED)).strands.points == pytest.approx(there, abs=SAME)


def test_the_bakes_of_both_frames_are_one(hair, tmp_path):
    baked = []
    for frame in (REST, POSED):
        hair.hairloom.bake.folder = str(tmp_path / str(frame))
        started(hair, frame)
        list(Bake.of([hair], bpy.context.scene).steps())
        session = previews.session_of(hair)
        go_to(3)
        baked.append(np.array(session.strands).reshape(-1, 3))
    assert np.abs(baked[0] - baked[1]).max() < 2e-3


def test_combing_in_a_pose_moves_what_is_shown(hair):
    there = expected(hair)
    source = GroomSource(hair, go_to(POSED))
    assert source.moved_curves(bpy.context.evaluated_depsgraph_get()) is None
    assert source.read_again(bpy.context.evaluated_depsgraph_get()) is None
    points = curve_points(hair.data).copy()
    points[-1] += (0.0, 0.0, 0.02)
    hair.data.position_data.foreach_set("vector", points.ravel())
    hair.data.update_tag()
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    (combed, number) = source.moved_curves(depsgraph)
    assert number.tolist() == [79]
    assert np.linalg.norm(combed.points[-1] - there[-1]) == pytest.approx(0.02, rel=1e-3)
    request = source.read_again(depsgraph)
    assert request.source.strands.points[:-1] == pytest.approx(there[:-1], abs=SAME)
    stored = read_curves(hair, depsgraph).strands.points
    assert np.array_equal(request.source.at_rest.strands.points, stored)


def test_hair_of_a_bake_is_in_the_pose_of_the_bake_wherever_it_is_read(hair, tmp_path):
    hair.hairloom.bake.folder = str(tmp_path)
    session = started(hair, POSED)
    list(Bake.of([hair], bpy.context.scene).steps())
    in_pose = session.source.strands.points
    again = started(hair, REST)
    assert again.source.strands.points == pytest.approx(in_pose, abs=SAME)
    made = again.rig
    again.read_again(go_to(REST))
    assert again.rig is made, "nothing has been combed"


def test_files_hold_the_hair_as_it_is_shown(hair):
    there = expected(hair)
    moving, _ = moving_hair(
        hair, go_to(POSED), range(REST, POSED + 1), ExportRequest(), use_bake=False
    )
    assert moving.positions_at(POSED, go_to(POSED)) == pytest.approx(there, abs=SAME)
    stored = read_curves(hair, go_to(REST)).strands.points
    assert np.array_equal(moving.positions_at(REST, go_to(REST)), stored)


def test_cards_are_made_in_the_rest_pose_with_a_note(hair):
    inputs, notes, _ = read_inputs(hair, go_to(REST))
    posed, posed_notes, _ = read_inputs(hair, go_to(POSED))
    for name in ("strands", "head"):
        one, other = (getattr(each.rig, name) for each in (inputs, posed))
        points = ("points" if name == "strands" else "positions",)
        assert getattr(one, *points) == pytest.approx(getattr(other, *points), abs=1e-6)
    assert not any("posed" in note for note in notes)
    assert any("Head is posed in frame 4" in note for note in posed_notes)


def test_made_real_it_is_stored_as_it_was(hair):
    found = []
    for frame in (REST, POSED):
        (made,) = run_parts(make_real([hair], go_to(frame)))
        found.append(curve_points(made.hair.data))
        bpy.data.objects.remove(made.hair)
        hair.hide_set(False)
    assert found[1] == pytest.approx(found[0], abs=SAME)


def test_a_preview_far_from_the_rest_pose_starts(hair):
    """In a pose where all roots are farther from the head at rest than it is large."""
    bone = bpy.data.objects["Armature"].pose.bones[0]
    bone.location.x = 5.0
    bone.keyframe_insert("location", frame=POSED)
    there = expected(hair)
    assert started(hair, POSED).source.strands.points == pytest.approx(there, abs=1e-4)


def test_settled_in_a_pose_it_is_stored_at_rest(hair):
    there, stored = expected(hair), read_curves(hair, go_to(REST)).strands
    go_to(POSED)
    select(hair)
    assert bpy.ops.hairloom.settle() == {"FINISHED"}
    settled = read_curves(hair, go_to(REST)).strands
    assert settled.roots == pytest.approx(stored.roots, abs=SAME)
    posed = posed_curves(hair, go_to(POSED)).strands
    fallen = (posed.points - there)[stored.offsets[1:] - 1]
    assert np.median(fallen[:, 2]) < -0.01, "straight down, in the pose"
    assert np.abs(np.median(fallen[:, :2], axis=0)).max() < 0.3 * -np.median(fallen[:, 2])
