"""Fins through undo, saving, playback and bakes, and what stays as it was afterwards."""

import bpy
import numpy as np
import pytest
from fin_motion import evaluated_vertices, play_frames, rest_vertices, start_fin, update_view_layer
from swinging import key_x
from undoing import redo, undo

from hairloom.addon.blender.preview import fins, previews, scene_events
from hairloom.addon.blender.preview.bake import Bake
from hairloom.addon.blender.scene.fin_modifier import INDEX, POSITION, fin_modifier, is_shown


def test_undo_and_redo_of_the_operator(extension, get_depsgraph):
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=3, y_subdivisions=3)
    name = bpy.context.object.name
    bpy.ops.ed.undo_push(message="begin")
    bpy.ops.hairloom.fin_add()
    bpy.ops.ed.undo_push(message="fin")
    bpy.ops.ed.undo()
    assert fin_modifier(bpy.data.objects[name]) is None
    bpy.ops.ed.redo()
    assert fin_modifier(bpy.data.objects[name]) is not None


def test_undo_in_mid_play_goes_on_or_rests(flag_object, get_depsgraph):
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="begin")
    session = start_fin(flag_object, get_depsgraph)
    play_frames(session, get_depsgraph, 5)
    flag_object.location.x = 0.1
    bpy.ops.ed.undo_push(message="move")
    bpy.ops.ed.undo()
    scene_events.catch_up(get_depsgraph())
    flag_object = bpy.data.objects["Flag"]
    play_frames(session, get_depsgraph, 2)
    assert previews.simulations() == (session,)
    session.stop(get_depsgraph())
    assert POSITION not in flag_object.data.attributes


def test_a_saved_file_keeps_fin_and_settings(flag_object, get_depsgraph, tmp_path):
    rest = rest_vertices(flag_object)
    flag_object.hairloom.fin.stretch = 0.25
    session = start_fin(flag_object, get_depsgraph)
    play_frames(session, get_depsgraph, 5)
    drawn = evaluated_vertices(flag_object, get_depsgraph)
    file = str(tmp_path / "fin.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.open_mainfile(filepath=file)
    flag_object = bpy.data.objects["Flag"]
    assert previews.simulations() == ()
    assert flag_object.hairloom.fin.stretch == 0.25 and flag_object.hairloom.fin.pin_group == "Pins"
    update_view_layer()
    assert evaluated_vertices(flag_object, get_depsgraph) == pytest.approx(drawn, abs=1e-6), (
        "the moment that was saved"
    )
    assert is_shown(flag_object)
    bpy.context.view_layer.objects.active = flag_object
    assert bpy.ops.hairloom.fin_reset() == {"FINISHED"}
    assert not is_shown(flag_object)
    assert np.array_equal(rest_vertices(flag_object), rest)
    start_fin(flag_object, get_depsgraph)


def play_away_from(before, flag_object, get_depsgraph):
    """Preview and play until the cloth is more than 5 cm away from `before`."""
    fins.start(flag_object, get_depsgraph())
    previews.play(get_depsgraph())
    previews.advance(get_depsgraph(), 0.5)
    update_view_layer()
    assert np.abs(evaluated_vertices(flag_object, get_depsgraph) - before).max() > 0.05


@pytest.mark.parametrize("end", ["stop", "by itself", "a file that cannot be opened"])
def test_however_its_preview_ends_it_is_at_rest(end, flag_object, get_depsgraph, tmp_path):
    before = evaluated_vertices(flag_object, get_depsgraph)
    play_away_from(before, flag_object, get_depsgraph)
    if end == "stop":
        previews.stop_all()
    elif end == "by itself":
        flag_object.modifiers.new("Array", "ARRAY")
        flag_object.modifiers.move(1, 0)
        update_view_layer()
        previews.advance(get_depsgraph(), 0.5)
        assert "Preview of Flag ended" in previews.notice()
    else:
        (tmp_path / "bad.blend").write_bytes(b"no file of Blender's")
        with pytest.raises(RuntimeError):
            bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "bad.blend"))
    assert previews.simulations() == () and not is_shown(flag_object)


@pytest.mark.parametrize("is_baked", [False, True])
def test_undo_puts_no_cloth_back_into_motion_after_its_preview(
    is_baked, flag_object, get_depsgraph, tmp_path
):
    bake = Bake.of([flag_object], bpy.context.scene, frames=range(1, 4), folder=tmp_path)
    for _ in bake.steps() if is_baked else ():
        pass
    bpy.context.scene.frame_set(3)
    before = evaluated_vertices(flag_object, get_depsgraph)
    play_away_from(before, flag_object, get_depsgraph)
    bpy.ops.ed.undo_push(message="in motion")
    previews.stop_all()
    bpy.ops.ed.undo_push(message="stopped")
    for step in (undo, redo, undo):
        step()
        update_view_layer()
        flag = bpy.data.objects["Flag"]
        assert is_shown(flag) == is_baked
        np.testing.assert_array_equal(evaluated_vertices(flag, get_depsgraph), before)


def test_a_bake_is_shown_after_the_preview_too(flag_object, get_depsgraph, tmp_path):
    for _ in Bake.of([flag_object], bpy.context.scene, frames=range(1, 4), folder=tmp_path).steps():
        pass
    bpy.context.scene.frame_set(3)
    baked = evaluated_vertices(flag_object, get_depsgraph)
    play_away_from(baked, flag_object, get_depsgraph)
    previews.stop_all()
    update_view_layer()
    assert np.array_equal(evaluated_vertices(flag_object, get_depsgraph), baked)


def test_buttons_say_why_they_are_grey(extension):
    for operator in ("fin_add", "fin_remove", "fin_preview", "fin_reset"):
        assert not getattr(bpy.ops.hairloom, operator).poll()
    bpy.ops.mesh.primitive_grid_add()
    assert bpy.ops.hairloom.fin_add.poll() and not bpy.ops.hairloom.fin_preview.poll()
    bpy.ops.hairloom.fin_add()
    assert bpy.ops.hairloom.fin_preview.poll() and not bpy.ops.hairloom.fin_reset.poll()
    bpy.ops.object.mode_set(mode="EDIT")
    assert not bpy.ops.hairloom.fin_remove.poll()
    bpy.ops.object.mode_set(mode="OBJECT")


def test_enabled_fins_start_together(flag_object, get_depsgraph):
    update_view_layer()
    assert fins.start_enabled(get_depsgraph()) == []
    assert [each.name for each in previews.simulations()] == ["Flag"]
    assert bpy.ops.hairloom.fin_preview() == {"FINISHED"}
    assert previews.simulations() == ()
    flag_object.hairloom.fin.enabled = False
    assert fins.start_enabled(get_depsgraph()) == [] and previews.simulations() == ()


def test_attributes_of_the_modifier_stay_out_of_the_mesh(flag_object, get_depsgraph):
    start_fin(flag_object, get_depsgraph)
    assert INDEX not in flag_object.data.attributes
    assert INDEX in flag_object.evaluated_get(get_depsgraph()).data.attributes


def frames_of(obj, frames):
    """The vertices that Blender shows in each frame, stepping through the frames; object space."""
    found = {}
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        there = obj.evaluated_get(bpy.context.view_layer.depsgraph).data
        points = np.empty((len(there.vertices), 3), np.float32)
        there.vertices.foreach_get("co", points.ravel())
        found[frame] = points
    return found


def test_playback_simulates_it_and_a_bake_shows_exactly_that(flag_object, get_depsgraph, tmp_path):
    key_x(flag_object, {1: 0.0, 10: 0.2})
    bpy.context.scene.frame_set(1)
    session = fins.start(flag_object, get_depsgraph())
    simulated = frames_of(flag_object, range(1, 9))
    assert np.array_equal(simulated[1], rest_vertices(flag_object))
    assert simulated[8][:, 2].min() < -0.1
    previews.stop(session)
    for _ in Bake.of([flag_object], bpy.context.scene, frames=range(1, 9), folder=tmp_path).steps():
        pass
    for preview in (False, True):
        if preview:
            fins.start(flag_object, get_depsgraph())
        for frame, points in frames_of(flag_object, (8, 3, 1, 5)).items():
            assert np.array_equal(points, simulated[frame])


def test_other_attributes_stay_as_they_are(flag_object, get_depsgraph):
    mesh = flag_object.data
    for name, kind in (("A", "FLOAT"), ("B", "FLOAT_COLOR")):
        mesh.attributes.new(name, kind, "POINT")
    mesh.attributes.active = mesh.attributes["A"]

    def known():
        active = mesh.attributes.active.name, mesh.color_attributes.active_color_index
        return active, [each.name for each in mesh.attributes], mesh.uv_layers.active_index

    before = known()
    session = start_fin(flag_object, get_depsgraph)
    play_frames(session, get_depsgraph, 2)
    assert known() != before
    session.stop(get_depsgraph())
    assert known() == before
