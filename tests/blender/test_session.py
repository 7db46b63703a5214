"""The live session of a groom: it follows, moves, takes edits over, and survives what artists do.

The window's part (drawing, the modal Play) is tested in tests/window.
"""

import math

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hairloom.addon.errors import HairloomError
from hairloom.addon.host import live, overlay
from hairloom.addon.strands import StrandSet

FRAME = 1.0 / 60.0


@pytest.fixture
def preview(new_hair, sphere, evaluated):
    """Hair on a head, previewed: (hair, head, session)."""
    hair = new_hair(sphere)
    return hair, sphere, live.start(hair, evaluated())


def update():
    bpy.context.view_layer.update()


def drawn(session):
    """The strands as they are handed to the overlay."""
    return overlay.drawing_of(session.uid).snapshot.strands


def test_the_preview_begins_with_the_hair_as_it_is(preview):
    hair, _, session = preview
    positions = np.array([point.position for point in hair.data.points])
    assert drawn(session).shape == (60, session.choices.guides.cv_count, 3)
    # roots and tips stay where they are when strands are resampled
    assert drawn(session)[:, 0] == pytest.approx(positions[0::8], abs=1e-6)
    assert drawn(session)[:, -1] == pytest.approx(positions[7::8], abs=1e-6)


def test_hair_follows_the_moved_and_turned_head_rigidly(preview):
    _, head, session = preview
    before = drawn(session)
    matrix = Matrix.LocRotScale((0.5, -1.0, 2.0), Matrix.Rotation(1.2, 3, (1, 2, 3)), None)
    head.matrix_world = matrix
    update()
    linear, moved = np.array(matrix)[:3, :3], np.array(matrix)[:3, 3]
    assert drawn(session) == pytest.approx(before @ linear.T + moved, abs=2e-5)


def test_hair_follows_a_deformed_head(preview):
    _, head, session = preview
    before = drawn(session)
    swell = head.modifiers.new("Swell", "DISPLACE")
    swell.mid_level, swell.strength = 0.0, 0.01
    update()
    outward = drawn(session)[:, 0] - before[:, 0]
    length = np.linalg.norm(outward, axis=1)
    assert length == pytest.approx(np.full(60, 0.01), rel=0.1)


def test_without_a_surface_hair_follows_its_own_object(new_hair, evaluated):
    hair = new_hair()
    session = live.start(hair, evaluated())
    assert "no surface" in session.source.warnings[0]
    before = drawn(session)
    hair.location = (1.0, 2.0, 3.0)
    update()
    assert drawn(session) == pytest.approx(before + np.array([1.0, 2.0, 3.0]), abs=1e-6)


def play(evaluated, frames, each=lambda frame: None):
    for frame in range(frames):
        each(frame)
        update()
        live.advance(evaluated(), FRAME)


def test_playing_hair_lags_behind_and_returns_when_stopped(preview, evaluated):
    _, head, session = preview
    at_rest = drawn(session)
    assert live.play(evaluated()) == []

    def push(frame):
        head.location.x = 0.02 * (frame + 1)

    play(evaluated, 6, push)
    carried = at_rest + np.array([head.location.x, 0.0, 0.0])
    offset = drawn(session) - carried
    assert np.abs(offset[:, 0]).max() < 1e-5, "roots go with the head"
    assert offset[:, -1, 0].mean() < -0.005, "tips stay behind"
    live.rest(evaluated(), keep_playing=False)
    assert not live.is_playing()
    assert drawn(session) == pytest.approx(carried, abs=2e-6)


def test_without_motion_gravity_alone_pulls_unheld_hair_down(preview, evaluated):
    hair, _, session = preview
    at_rest = drawn(session)
    hair.hairloom.dynamics.weight_held = 0.0
    live.play(evaluated())
    play(evaluated, 12)
    assert (drawn(session) - at_rest)[:, -1, 2].mean() < -0.001
    live.rest(evaluated(), keep_playing=False)
    bpy.context.scene.use_gravity = False
    live.play(evaluated())
    play(evaluated, 12)
    assert np.abs(drawn(session) - at_rest).max() < 1e-3


def test_hair_stays_out_of_the_head_that_moves_into_it(preview, evaluated):
    _, head, session = preview
    live.play(evaluated())
    play(evaluated, 10, lambda frame: setattr(head.location, "z", 0.01 * (frame + 1)))
    distance = np.linalg.norm(drawn(session) - np.array(head.location), axis=2)
    assert distance[:, 2:].min() > 0.098


def test_a_chosen_collider_is_used_in_place_of_the_head(preview, evaluated):
    hair, _, session = preview
    bpy.ops.mesh.primitive_cube_add(size=0.05, location=(0.0, 0.0, 1.0))
    cube = bpy.context.object
    hair.hairloom.collider = cube
    assert live.play(evaluated()) == []
    assert session.obstacle.body.handle.name == cube.name
    play(evaluated, 2, lambda frame: setattr(cube.location, "x", 0.1 * frame))
    assert session.obstacle.matrix[:3, 3] == pytest.approx([0.1, 0.0, 0.0], abs=1e-6)


def test_a_collider_is_made_once_and_again_only_when_it_differs(preview, evaluated):
    hair, head, session = preview
    hair.hairloom.dynamics.collider_resolution = 8
    live.play(evaluated())
    field = session.obstacle.field
    head.location.x = 1.0
    live.play(evaluated())
    assert session.obstacle.field is field
    hair.hairloom.dynamics.collider_resolution = 9
    live.play(evaluated())
    assert session.obstacle.field is not field

    bpy.ops.mesh.primitive_cube_add(size=0.05, location=(0.0, 0.0, 1.0))
    cube = hair.hairloom.collider = bpy.context.object
    live.play(evaluated())
    field = session.obstacle.field
    cube.rotation_euler.x = 1.0
    live.play(evaluated())
    assert session.obstacle.field is field
    cube.data.vertices[0].co.x += 0.1
    live.play(evaluated())
    assert session.obstacle.field is not field


def test_a_collider_that_cannot_be_used_is_a_warning_and_play_goes_on(preview, evaluated):
    hair, _, session = preview
    points = bpy.data.objects.new("Points", bpy.data.meshes.new("Points"))
    bpy.context.collection.objects.link(points)
    hair.hairloom.collider = points
    warnings = live.play(evaluated())
    assert len(warnings) == 1 and "Points" in warnings[0]
    assert live.is_playing()
    play(evaluated, 2)
    assert live.session_of(hair) is session


def test_sliders_act_at_once(preview):
    hair, _, session = preview
    strands = drawn(session)
    hair.data.hairloom.shading.base_color = (1.0, 0.5, 0.25)
    hair.data.hairloom.strands.width_scale = 3.0
    snapshot = overlay.drawing_of(session.uid).snapshot
    assert snapshot.shading.base_color == (1.0, 0.5, 0.25)
    assert snapshot.strand_settings.width_scale == 3.0
    assert snapshot.strands is strands, "nothing else is made anew"


def test_guide_settings_act_once_edits_have_settled(preview, evaluated):
    hair, _, session = preview
    hair.data.hairloom.guides.guide_count = 7
    assert session.is_stale
    live.catch_up(evaluated())
    assert len(session.rig.guides) == 7


def test_animated_settings_and_heads_are_followed_frame_by_frame(preview):
    hair, head, session = preview
    before = drawn(session)
    shading = hair.data.hairloom.shading
    for frame, value in ((1, 0.0), (11, 1.0)):
        shading.ambient = value
        hair.data.keyframe_insert("hairloom.shading.ambient", frame=frame)
        head.location.x = value
        head.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(11)
    assert overlay.drawing_of(session.uid).snapshot.shading.ambient == 1.0
    assert drawn(session) == pytest.approx(before + np.array([1.0, 0.0, 0.0]), abs=1e-5)


def test_edited_curves_are_read_again_and_others_left_alone(preview, evaluated):
    hair, head, session = preview
    head.location.y = 0.25
    update()
    live.catch_up(evaluated())
    rig = session.rig
    hair.data.update_tag()
    update()
    live.catch_up(evaluated())
    assert session.rig is rig, "tagged but not changed"
    hair.data.position_data[7].vector = (0.0, 0.0, 0.5)
    update()
    live.catch_up(evaluated())
    assert session.rig is not rig
    assert drawn(session)[0, -1] == pytest.approx([0.0, 0.25, 0.5], abs=1e-5)
    assert drawn(session)[1, 0] == pytest.approx(
        rig.strands.roots[1] + np.array([0, 0.25, 0]), abs=1e-5
    )


def test_another_surface_begins_the_preview_anew(preview, evaluated):
    hair, head, _ = preview
    other = head.copy()
    other.data, other.name = head.data.copy(), "Other"
    bpy.context.collection.objects.link(other)
    hair.data.surface = other
    update()
    live.catch_up(evaluated())
    (session,) = live.sessions()
    assert session.head.handle.name == "Other"
    other.location.x = 1.0
    update()
    assert drawn(session)[:, 0, 0].mean() == pytest.approx(1.0, abs=0.05)


def test_a_defect_ends_the_preview_and_is_told_once(preview, monkeypatch, capfd):
    _, head, session = preview

    def fail(*_):
        raise ZeroDivisionError("a defect")

    monkeypatch.setattr(type(session), "rest", fail)
    for x in (1.0, 2.0):
        head.location.x = x
        update()
    assert live.sessions() == ()
    assert "a defect" in live.notice()
    assert capfd.readouterr().err.count("Traceback") == 1


def test_curves_may_become_fewer_and_none(preview, evaluated):
    hair, _, session = preview
    hair.data.remove_curves(indices=list(range(50)))
    update()
    live.catch_up(evaluated())
    assert drawn(session).shape[0] == 10
    hair.data.remove_curves()
    update()
    live.catch_up(evaluated())
    assert live.sessions() == ()
    assert "Hair" in live.notice()
    assert overlay.drawing_of(session.uid) is None


def test_renaming_is_no_matter(preview):
    hair, head, session = preview
    before = drawn(session)
    hair.name, head.name = "Wig", "Bust"
    head.location.x = 1.0
    update()
    assert drawn(session) == pytest.approx(before + np.array([1.0, 0.0, 0.0]), abs=1e-6)


@pytest.mark.parametrize("which", ["Hair", "Head"])
def test_a_deleted_object_ends_the_preview_with_a_notice(which, preview):
    bpy.data.objects.remove(bpy.data.objects[which])
    update()
    assert live.sessions() == ()
    assert which in live.notice() and "gone" in live.notice()


def test_a_head_with_other_vertices_ends_the_preview_with_a_notice(preview):
    _, head, _ = preview
    head.modifiers.new("Smooth", "SUBSURF").levels = 1
    update()
    assert live.sessions() == ()
    assert "vertices" in live.notice()


def test_undo_and_redo_of_a_moved_head_and_edited_hair(new_hair, sphere, evaluated):
    bpy.context.preferences.edit.use_global_undo = True
    hair = new_hair(sphere)
    bpy.ops.ed.undo_push(message="begin")
    session = live.start(hair, evaluated())
    begin = drawn(session)
    sphere.location.x = 1.0
    hair.data.position_data[7].vector = (0.0, 0.0, 0.5)
    hair.data.hairloom.shading.ambient = 0.125
    bpy.ops.ed.undo_push(message="change")

    bpy.ops.ed.undo()
    live.catch_up(evaluated())
    assert live.sessions() == (session,)
    assert drawn(session) == pytest.approx(begin, abs=1e-6)
    assert overlay.drawing_of(session.uid).snapshot.shading.ambient == 1.0

    bpy.ops.ed.redo()
    live.catch_up(evaluated())
    assert drawn(session)[0, -1] == pytest.approx([1.0, 0.0, 0.5], abs=1e-5)
    assert overlay.drawing_of(session.uid).snapshot.shading.ambient == 0.125


def test_loading_a_file_drops_all_previews_and_keeps_the_settings(preview, tmp_path):
    hair, _, session = preview
    hair.data.hairloom.shading.ambient = 0.125
    file = str(tmp_path / "hair.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    assert live.sessions() == (session,)
    bpy.ops.wm.open_mainfile(filepath=file)
    assert live.sessions() == ()
    assert overlay.drawing_of(session.uid) is None
    assert bpy.data.objects["Hair"].data.hairloom.shading.ambient == 0.125


def test_blenders_own_strands_are_hidden_in_the_evaluated_copy_only(preview, evaluated):
    hair, head, session = preview
    shown, hidden = ("TEXTURED", True), ("BOUNDS", False)

    def display(obj):
        return obj.display_type, obj.visible_camera

    assert display(hair.evaluated_get(evaluated())) == hidden
    assert display(hair) == shown
    head.location.x = 1.0
    update()
    assert display(hair.evaluated_get(evaluated())) == hidden
    hair.hairloom.hide_original = False
    assert display(hair.evaluated_get(evaluated())) == shown
    hair.hairloom.hide_original = True
    assert display(hair.evaluated_get(evaluated())) == hidden
    live.stop(session)
    assert display(hair.evaluated_get(evaluated())) == shown
    assert display(hair) == shown


def test_a_preview_adds_and_changes_no_data(new_hair, sphere, evaluated):
    new_hair(sphere)
    before = {data.name_full for data in bpy.data.user_map()}
    hair = bpy.data.objects["Hair"]
    session = live.start(hair, evaluated())
    live.play(evaluated())
    play(evaluated, 2)
    live.stop(session)
    assert {data.name_full for data in bpy.data.user_map()} == before


def test_hidden_hair_is_not_drawn(preview):
    hair, _, session = preview
    assert overlay.drawing_of(session.uid).is_visible
    hair.hide_set(True)
    update()
    assert not overlay.drawing_of(session.uid).is_visible


def test_another_scene_in_the_window_does_not_end_the_preview(preview):
    _, head, session = preview
    before, window, scene = drawn(session), bpy.context.window, bpy.context.scene
    window.scene = bpy.data.scenes.new("Elsewhere")
    window.scene.collection.objects.link(bpy.data.objects.new("Thing", None))
    update()
    bpy.context.scene.objects["Thing"].location.x = 1.0
    update()
    assert live.sessions() == (session,)
    assert not overlay.drawing_of(session.uid).is_visible
    window.scene = scene
    head.location.x = 1.0
    update()
    assert overlay.drawing_of(session.uid).is_visible
    assert drawn(session) == pytest.approx(before + np.array([1.0, 0.0, 0.0]), abs=1e-6)


def test_sculpting_shows_blenders_own_strands(preview, evaluated):
    hair, _, session = preview
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    hair.data.position_data[7].vector = (0.0, 0.0, 0.5)
    update()
    assert hair.evaluated_get(evaluated()).display_type == "TEXTURED"
    live.catch_up(evaluated())
    assert drawn(session)[0, -1] == pytest.approx([0.0, 0.0, 0.5], abs=1e-5)
    bpy.ops.object.mode_set(mode="OBJECT")
    update()
    assert hair.evaluated_get(evaluated()).display_type == "BOUNDS"


def test_two_objects_that_share_their_curves(preview, evaluated):
    hair, _, session = preview
    twin = bpy.data.objects.new("Twin", hair.data)
    bpy.context.collection.objects.link(twin)
    second = live.start(twin, evaluated())
    hair.data.hairloom.shading.ambient = 0.5
    assert [overlay.drawing_of(s.uid).snapshot.shading.ambient for s in (session, second)] == [
        0.5,
        0.5,
    ]


def test_a_final_render_does_not_disturb_the_preview(preview):
    _, _, session = preview
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera, scene.render.engine = camera, "BLENDER_WORKBENCH"
    scene.render.resolution_x = scene.render.resolution_y = 16
    before = drawn(session)
    bpy.ops.render.render()
    assert drawn(session) == pytest.approx(before, abs=1e-7)
    assert live.sessions() == (session,)


def test_scene_lights_are_followed(preview):
    _, _, session = preview
    assert overlay.drawing_of(session.uid).snapshot.lights == ()
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy = 3.0
    bpy.context.collection.objects.link(sun)
    update()
    (light,) = overlay.drawing_of(session.uid).snapshot.lights
    assert (light.kind, light.power) == ("sun", (3.0, 3.0, 3.0))
    assert light.vector == pytest.approx((0.0, 0.0, 1.0))
    sun.rotation_euler.x = math.radians(90.0)
    update()
    (light,) = overlay.drawing_of(session.uid).snapshot.lights
    assert light.vector == pytest.approx((0.0, -1.0, 0.0), abs=1e-6)
    sun.data.energy = 1.0
    update()
    assert overlay.drawing_of(session.uid).snapshot.lights[0].power == (1.0, 1.0, 1.0)
    for frame, energy in ((1, 1.0), (11, 2.0)):
        sun.data.energy = energy
        sun.data.keyframe_insert("energy", frame=frame)
    bpy.context.scene.frame_set(11)
    assert overlay.drawing_of(session.uid).snapshot.lights[0].power == (2.0, 2.0, 2.0)


@pytest.mark.parametrize("groom", ["none", "one point each"])
def test_hair_that_cannot_be_used_is_refused_with_a_remedy(groom, new_hair, evaluated):
    hair = new_hair()
    hair.data.remove_curves()
    if groom != "none":
        hair.data.add_curves([1, 1, 1])
    with pytest.raises(HairloomError) as raised:
        live.start(hair, evaluated())
    assert raised.value.place == "Hair" and raised.value.remedy
    assert live.sessions() == ()


def test_a_groom_of_another_scale_is_refused(new_hair, sphere, evaluated):
    hair = new_hair(sphere)
    hair.scale = (100.0, 100.0, 100.0)
    with pytest.raises(HairloomError, match="scale"):
        live.start(hair, evaluated())


def test_a_head_without_faces_or_uvs_is_a_warning(new_hair, sphere, evaluated):
    hair = new_hair(sphere)
    while sphere.data.uv_layers:
        sphere.data.uv_layers.remove(sphere.data.uv_layers[0])
    sphere.data.update()
    session = live.start(hair, evaluated())
    assert "Unwrap" in session.source.warnings[0]
    live.stop(session)
    sphere.data.clear_geometry()
    session = live.start(hair, evaluated())
    assert "no faces" in session.source.warnings[0]
    assert session.rig.head is None


def test_blenders_own_hair_dynamics_are_a_warning(new_hair, sphere, evaluated):
    hair = new_hair(sphere)
    modifier = hair.modifiers.new("Swing", "NODES")
    modifier.node_group = bpy.data.node_groups.new("Hair Dynamics", "GeometryNodeTree")
    modifier.show_viewport = False
    assert live.start(hair, evaluated()).source.warnings == ()
    modifier.show_viewport = True
    tree = modifier.node_group
    for in_out in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    source, result = (tree.nodes.new(f"NodeGroup{kind}") for kind in ("Input", "Output"))
    tree.links.new(source.outputs[0], result.inputs[0])
    (warning,) = live.start(hair, evaluated()).source.warnings
    assert "Swing" in warning and "Turn it off" in warning


def test_two_grooms_on_one_head_go_separate_ways(new_hair, sphere, evaluated):
    one, two = new_hair(sphere), new_hair(sphere)
    first, second = live.start(one, evaluated()), live.start(two, evaluated())
    two.data.hairloom.shading.ambient = 0.5
    assert overlay.drawing_of(first.uid).snapshot.shading.ambient == 1.0
    live.stop(first)
    assert live.sessions() == (second,)
    sphere.location.x = 1.0
    update()
    assert drawn(second)[:, 0].mean(axis=0)[0] == pytest.approx(1.0, abs=0.05)


def test_the_buttons_say_why_they_do_not_work(extension, sphere):
    assert not bpy.ops.hairloom.preview.poll()
    assert not bpy.ops.hairloom.play.poll()
    assert not bpy.ops.hairloom.reset.poll()
    with pytest.raises(RuntimeError, match="Select hair curves"):
        bpy.ops.hairloom.preview()


def test_the_preview_button_toggles_and_reports_counts(new_hair, sphere, capfd):
    hair = new_hair(sphere)
    hair.data.add_curves([1, 1])
    assert bpy.ops.hairloom.preview() == {"FINISHED"}
    told = capfd.readouterr().out
    assert "60 strands, 60 guides; dropped 2 (fewer than two points)" in told
    assert live.session_of(hair) is not None
    assert bpy.ops.hairloom.preview() == {"FINISHED"}
    assert live.session_of(hair) is None


def test_the_preview_button_reports_bad_input_without_a_traceback(new_hair, capfd):
    hair = new_hair(strands=StrandSet(np.zeros((0, 3)), [0], [], []))
    with pytest.raises(RuntimeError, match="Hair: "):
        bpy.ops.hairloom.preview()
    assert "Traceback" not in capfd.readouterr().err
    assert live.session_of(hair) is None
