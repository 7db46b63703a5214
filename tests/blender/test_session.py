"""The live session of a groom follows its head and the artist's edits.

The window's part (drawing, the modal Play) is tested in tests/window.
"""

import math
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from grids import strand_grid
from mathutils import Matrix
from swinging import play_frames

from hairloom.addon.blender.base.objects import layer_key
from hairloom.addon.blender.engine import engine_hair
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.preview.diagnostics import size_note
from hairloom.addon.blender.viewport import overlay
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.arc_length import strand_lengths
from hairloom.addon.ui.state import problems_of


def update():
    bpy.context.view_layer.update()


def test_the_preview_begins_with_the_hair_as_it_is(preview):
    hair, _, session = preview
    positions = np.array([point.position for point in hair.data.points])
    assert strand_grid(session).shape == (60, session.settings[GuideSettings].cv_count, 3)
    # resampling keeps roots and tips in place
    assert strand_grid(session)[:, 0] == pytest.approx(positions[0::8], abs=1e-6)
    assert strand_grid(session)[:, -1] == pytest.approx(positions[7::8], abs=1e-6)


def test_hair_follows_the_moved_and_turned_head_rigidly(preview):
    _, head, session = preview
    before = strand_grid(session)
    matrix = Matrix.LocRotScale((0.5, -1.0, 2.0), Matrix.Rotation(1.2, 3, (1, 2, 3)), None)
    head.matrix_world = matrix
    update()
    linear, moved = np.array(matrix)[:3, :3], np.array(matrix)[:3, 3]
    assert strand_grid(session) == pytest.approx(before @ linear.T + moved, abs=2e-5)


def test_hair_follows_a_deformed_head(preview):
    _, head, session = preview
    before = strand_grid(session)
    swell = head.modifiers.new("Swell", "DISPLACE")
    swell.mid_level, swell.strength = 0.0, 0.01
    update()
    outward = strand_grid(session)[:, 0] - before[:, 0]
    length = np.linalg.norm(outward, axis=1)
    assert length == pytest.approx(np.full(60, 0.01), rel=0.1)


def test_without_a_surface_hair_follows_its_own_object(new_hair, get_depsgraph):
    hair = new_hair()
    session = previews.start(hair, get_depsgraph())
    assert "no surface" in session.source.warnings[0]
    before = strand_grid(session)
    hair.location = (1.0, 2.0, 3.0)
    update()
    assert strand_grid(session) == pytest.approx(before + np.array([1.0, 2.0, 3.0]), abs=1e-6)


def test_sliders_act_at_once(preview):
    hair, _, session = preview
    before = overlay.drawing_of(session.uid).snapshot
    hair.data.hairloom.shading.base_color = (1.0, 0.5, 0.25)
    hair.data.hairloom.strands.fullness = 3.0
    snapshot = overlay.drawing_of(session.uid).snapshot
    assert snapshot.shading.base_color == (1.0, 0.5, 0.25)
    assert snapshot.strand_settings.fullness == 3.0
    assert snapshot.points is before.points, "nothing else is made again"
    assert snapshot.device_points is before.device_points


def test_guide_settings_act_once_edits_have_settled(preview, get_depsgraph):
    hair, _, session = preview
    hair.data.hairloom.guides.guide_count = 7
    assert session.is_stale
    scene_events.catch_up(get_depsgraph())
    assert len(session.rig.guides) == 7


def test_animated_settings_and_heads_are_followed_frame_by_frame(preview):
    hair, head, session = preview
    before = strand_grid(session)
    shading = hair.data.hairloom.shading
    for frame, value in ((1, 0.0), (11, 1.0)):
        shading.ambient = value
        hair.data.keyframe_insert("hairloom.shading.ambient", frame=frame)
        head.location.x = value
        head.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(11)
    assert overlay.drawing_of(session.uid).snapshot.shading.ambient == 1.0
    assert strand_grid(session) == pytest.approx(before + np.array([1.0, 0.0, 0.0]), abs=1e-5)


def test_edited_curves_are_read_again_and_others_left_alone(preview, get_depsgraph):
    hair, head, session = preview
    head.location.y = 0.25
    update()
    scene_events.catch_up(get_depsgraph())
    rig = session.rig
    hair.data.update_tag()
    update()
    scene_events.catch_up(get_depsgraph())
    assert session.rig is rig, "tagged but not changed"
    attributes, uv = hair.data.attributes, np.full(120, 0.25, np.float32)
    attributes.new("strand_seed", "INT", "CURVE").data.foreach_set("value", [7] * 60)
    hair.data.update_tag()
    update()
    scene_events.catch_up(get_depsgraph())
    assert (session.snapshot.seed == 7).all()
    attributes.new("surface_uv_coordinate", "FLOAT2", "CURVE").data.foreach_set("vector", uv)
    hair.data.update_tag()
    update()
    scene_events.catch_up(get_depsgraph())
    assert (session.rig.strands.root_uv == 0.25).all()
    rig = session.rig
    hair.data.position_data[7].vector = (0.0, 0.0, 0.5)
    update()
    scene_events.catch_up(get_depsgraph())
    assert session.rig is not rig
    assert strand_grid(session)[0, -1] == pytest.approx([0.0, 0.25, 0.5], abs=1e-5)
    assert strand_grid(session)[1, 0] == pytest.approx(
        rig.strands.roots[1] + np.array([0, 0.25, 0]), abs=1e-5
    )


def test_rounding_far_from_the_origin_is_no_edit(preview, get_depsgraph):
    hair, head, session = preview
    rig = session.rig
    for place in ((3.0, -2.0, 1.5), (-40.0, 7.0, 0.3)):
        head.location, head.rotation_euler = place, (0.3, 0.2, 1.0)
        update()
        hair.data.update_tag()
        update()
        scene_events.catch_up(get_depsgraph())
        assert session.rig is rig
    hair.data.position_data[7].vector.x += 0.001
    hair.data.update_tag()
    update()
    scene_events.catch_up(get_depsgraph())
    assert session.rig is not rig


def test_another_surface_restarts_the_preview(preview, get_depsgraph):
    hair, head, _ = preview
    other = head.copy()
    other.data, other.name = head.data.copy(), "Other"
    bpy.context.collection.objects.link(other)
    hair.data.surface = other
    update()
    scene_events.catch_up(get_depsgraph())
    (session,) = previews.sessions()
    assert session.head.handle.name == "Other"
    other.location.x = 1.0
    update()
    assert strand_grid(session)[:, 0, 0].mean() == pytest.approx(1.0, abs=0.05)


def test_blenders_own_strands_are_hidden_in_the_evaluated_copy_only(preview, get_depsgraph):
    hair, head, session = preview
    shown, hidden = ("TEXTURED", True), ("WIRE", False)

    def display(obj):
        return obj.display_type, obj.visible_camera

    assert display(hair.evaluated_get(get_depsgraph())) == hidden
    assert display(hair) == shown
    head.location.x = 1.0
    update()
    assert display(hair.evaluated_get(get_depsgraph())) == hidden
    hair.hairloom.hide_original = False
    assert display(hair.evaluated_get(get_depsgraph())) == shown
    hair.hairloom.hide_original = True
    assert display(hair.evaluated_get(get_depsgraph())) == hidden
    previews.stop(session)
    assert display(hair.evaluated_get(get_depsgraph())) == shown
    assert display(hair) == shown


def test_blenders_own_strands_throw_no_shadow_where_ours_lies_on_the_head(preview, get_depsgraph):
    hair, _, session = preview
    assert not hair.evaluated_get(get_depsgraph()).visible_shadow, "from the start"
    for shadows, on_body, throws in (
        ("deep", True, False),
        ("deep", False, True),
        ("none", True, True),
        ("slices", True, False),
    ):
        hair.data.hairloom.volume.shadows = shadows
        hair.data.hairloom.volume.on_body = on_body
        assert hair.evaluated_get(get_depsgraph()).visible_shadow is throws
    assert hair.visible_shadow
    previews.stop(session)
    assert hair.evaluated_get(get_depsgraph()).visible_shadow


def test_hair_on_no_head_keeps_the_shadow_of_blenders_own_strands(new_hair, get_depsgraph):
    hair = new_hair()
    previews.start(hair, get_depsgraph())
    assert hair.data.hairloom.volume.on_body
    assert hair.evaluated_get(get_depsgraph()).visible_shadow


def test_a_preview_adds_and_changes_no_data(new_hair, sphere, get_depsgraph):
    new_hair(sphere)
    before = {data.name_full for data in bpy.data.user_map()}
    hair = bpy.data.objects["Hair"]
    session = previews.start(hair, get_depsgraph())
    previews.play(get_depsgraph())
    play_frames(get_depsgraph, 2)
    previews.stop(session)
    assert {data.name_full for data in bpy.data.user_map()} == before


def test_hidden_hair_is_not_drawn(preview):
    hair, _, session = preview
    assert overlay.drawing_of(session.uid).is_visible
    hair.hide_set(True)
    update()
    assert not overlay.drawing_of(session.uid).is_visible


def test_each_view_layer_draws_what_it_shows(preview):
    """Two windows may show different view layers."""
    hair, _, session = preview
    scene = bpy.context.scene
    first, other = bpy.context.view_layer, scene.view_layers.new("Other")
    update()
    keys = {layer_key(scene, layer) for layer in (first, other)}
    assert overlay.drawing_of(session.uid).visible_layers == keys
    assert is_drawn_in(session, scene, first) and is_drawn_in(session, scene, other)
    hair.hide_set(True, view_layer=other)
    update()
    assert overlay.drawing_of(session.uid).visible_layers == {layer_key(scene, first)}
    assert overlay.drawing_of(session.uid).is_visible
    assert is_drawn_in(session, scene, first) and not is_drawn_in(session, scene, other)


def is_drawn_in(session, scene, layer):
    """Whether the 3D view of a window that shows this view layer draws the session."""
    space = SimpleNamespace(as_pointer=lambda: 1)
    context = SimpleNamespace(space_data=space, scene=scene, view_layer=layer)
    return session.uid in dict(overlay.shown_in(context))


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


def test_two_grooms_on_one_head_move_independently(new_hair, sphere, get_depsgraph):
    one, two = new_hair(sphere), new_hair(sphere)
    first, second = previews.start(one, get_depsgraph()), previews.start(two, get_depsgraph())
    two.data.hairloom.shading.ambient = 0.5
    assert overlay.drawing_of(first.uid).snapshot.shading.ambient == 1.0
    previews.stop(first)
    assert previews.sessions() == (second,)
    sphere.location.x = 1.0
    update()
    assert strand_grid(second)[:, 0].mean(axis=0)[0] == pytest.approx(1.0, abs=0.05)


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
    output = capfd.readouterr().out
    assert "60 strands, 60 guides; dropped 2 (fewer than two points)" in output
    assert previews.session_of(hair) is not None
    assert bpy.ops.hairloom.preview() == {"FINISHED"}
    assert previews.session_of(hair) is None


def test_the_preview_button_reports_bad_input_without_a_traceback(new_hair, capfd):
    hair = new_hair(strands=StrandSet(np.zeros((0, 3)), [0], [], []))
    with pytest.raises(RuntimeError, match="Hair: "):
        bpy.ops.hairloom.preview()
    assert "Traceback" not in capfd.readouterr().err
    assert previews.session_of(hair) is None


@pytest.mark.alike
@pytest.mark.parametrize("scale", [(2.0, 2.0, 2.0), (1.0, 3.0, 0.5), (-1.0, 1.0, 1.0)])
@pytest.mark.parametrize("is_headless", [False, True])
def test_scaled_or_mirrored_hair_is_as_the_engine_renders_it(
    new_hair, sphere, get_depsgraph, is_headless, scale
):
    """Once edits have settled, lengths, radii and spacing equal those of the render engine."""
    hair = new_hair(None if is_headless else sphere)
    hair.data.hairloom.widths.method = "own"
    first = previews.start(hair, get_depsgraph())
    carrier = hair if is_headless else sphere
    carrier.matrix_world = Matrix.LocRotScale((0.3, 0, 0), Matrix.Rotation(0.5, 3, "X"), scale)
    update()
    scene_events.catch_up(get_depsgraph())
    session, rendered = previews.session_of(hair), engine_hair.read_groom(hair, get_depsgraph())
    assert session is not first
    shown = session.snapshot
    np.testing.assert_allclose(session.strands, rendered.points, atol=1e-6)
    np.testing.assert_allclose(shown.radius, rendered.radius, rtol=1e-5)
    assert shown.spacing == pytest.approx(rendered.spacing)
    assert shown.extinction == pytest.approx(rendered.extinction)
    carrier.location.y = 1.0
    carrier.rotation_euler.z = 1.0
    update()
    scene_events.catch_up(get_depsgraph())
    assert previews.session_of(hair) is session, "moved and turned it is carried"


def test_hair_that_plays_keeps_its_size_until_it_is_at_rest(preview, get_depsgraph):
    hair, head, session = preview
    length = session.rig.rest_lengths
    previews.play(get_depsgraph())
    head.scale = (2.0, 2.0, 2.0)
    update()
    scene_events.catch_up(get_depsgraph())
    previews.advance(get_depsgraph(), 1.0 / 24.0)
    assert previews.session_of(hair) is session and previews.is_playing()
    previews.rest(get_depsgraph(), keep_playing=False)
    again = previews.session_of(hair)
    assert again.rig.rest_lengths == pytest.approx(2.0 * length, rel=1e-5)
    assert not previews.is_playing()


def test_hair_without_a_surface_that_plays_keeps_its_size_until_it_is_at_rest(
    new_hair, get_depsgraph
):
    """Its length and its thickness are those of one size."""
    hair = new_hair()
    session = previews.start(hair, get_depsgraph())
    hair.hairloom.dynamics.influence = 0.0
    update()
    previews.play(get_depsgraph())
    hair.scale, hair.location.x = (2.0, 2.0, 2.0), 1.0
    update()
    scene_events.catch_up(get_depsgraph())
    previews.advance(get_depsgraph(), 1.0 / 24.0)
    assert previews.session_of(hair) is session and session.is_playing
    small = strand_lengths(session.strands, session.rig.strands.offsets)
    np.testing.assert_allclose(small, session.rig.rest_lengths, rtol=1e-3)
    assert session.strands[:, 0].mean() > 0.5, "it goes along"
    assert "keeps its size" in size_note(session)
    previews.rest(get_depsgraph(), keep_playing=False)
    again = previews.session_of(hair)
    np.testing.assert_allclose(again.rig.rest_lengths, 2.0 * small, rtol=1e-3)
    np.testing.assert_allclose(again.snapshot.radius, 2.0 * session.snapshot.radius, rtol=1e-3)
    assert size_note(again) == ""


def test_a_keyframed_scale_is_reported_where_it_is_not_followed(preview, get_depsgraph):
    hair, head, _ = preview
    for frame, size in ((1, 1.0), (3, 2.0)):
        head.scale = (size, size, size)
        head.keyframe_insert("scale", frame=frame)
    bpy.context.scene.frame_set(1)
    scene_events.catch_up(get_depsgraph())
    session = previews.session_of(hair)
    assert size_note(session) == ""
    for frame in (2, 3):
        bpy.context.scene.frame_set(frame)
    assert previews.session_of(hair).is_playing
    (note,) = [each.text for each in problems_of(hair, session) if "size" in each.text]
    assert "maybe by keyframes" in note


def test_hair_scaled_to_zero_is_not_rebuilt(new_hair, get_depsgraph):
    hair = new_hair()
    session = previews.start(hair, get_depsgraph())
    update()
    hair.scale = (0.0, 0.0, 0.0)
    update()
    scene_events.catch_up(get_depsgraph())
    assert previews.session_of(hair) is session, previews.notice()
    hair.scale = (1.0, 1.0, 1.0)
    update()
    scene_events.catch_up(get_depsgraph())
    assert previews.session_of(hair) is session


def test_hair_that_was_scaled_goes_on_with_the_timeline(preview, get_depsgraph):
    hair, head, _ = preview
    bpy.context.scene.frame_set(1)
    head.scale = (2.0, 2.0, 2.0)
    update()
    scene_events.catch_up(get_depsgraph())
    bpy.context.scene.frame_set(2)
    assert previews.session_of(hair).is_playing, "from this frame on"
