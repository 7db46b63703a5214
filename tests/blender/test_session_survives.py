"""Previews survive artists' actions or end with a reason; the file's data are unchanged."""

import bpy
import numpy as np
import pytest
from grids import strand_grid
from undoing import redo, undo

from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.viewport import overlay
from hairloom.addon.errors import HairloomError


def update():
    bpy.context.view_layer.update()


def test_an_exception_ends_the_preview_and_is_reported_once(preview, monkeypatch, capfd):
    _, head, session = preview

    def fail(*_):
        raise ZeroDivisionError("a defect")

    monkeypatch.setattr(type(session), "rest", fail)
    for x in (1.0, 2.0):
        head.location.x = x
        update()
    assert previews.sessions() == ()
    assert "a defect" in previews.notice()
    assert capfd.readouterr().err.count("Traceback") == 1


def test_curves_may_become_fewer_and_none(preview, get_depsgraph):
    hair, _, session = preview
    hair.data.remove_curves(indices=list(range(50)))
    update()
    scene_events.catch_up(get_depsgraph())
    assert strand_grid(session).shape[0] == 10
    hair.data.remove_curves()
    update()
    scene_events.catch_up(get_depsgraph())
    assert previews.sessions() == ()
    assert "Hair" in previews.notice()
    assert overlay.drawing_of(session.uid) is None


def test_renaming_objects_changes_nothing(preview):
    hair, head, session = preview
    before = strand_grid(session)
    hair.name, head.name = "Wig", "Bust"
    head.location.x = 1.0
    update()
    assert strand_grid(session) == pytest.approx(before + np.array([1.0, 0.0, 0.0]), abs=1e-6)


@pytest.mark.parametrize("which", ["Hair", "Head"])
def test_a_deleted_object_ends_the_preview_with_a_notice(which, preview):
    bpy.data.objects.remove(bpy.data.objects[which])
    update()
    assert previews.sessions() == ()
    assert which in previews.notice() and "gone" in previews.notice()


def test_a_head_with_other_vertices_ends_the_preview_with_a_notice(preview):
    _, head, _ = preview
    head.modifiers.new("Smooth", "SUBSURF").levels = 1
    update()
    assert previews.sessions() == ()
    assert "vertices" in previews.notice()


def test_undo_and_redo_of_a_moved_head_and_edited_hair(new_hair, sphere, get_depsgraph):
    bpy.context.preferences.edit.use_global_undo = True
    hair = new_hair(sphere)
    bpy.ops.ed.undo_push(message="begin")
    session = previews.start(hair, get_depsgraph())
    begin = strand_grid(session)
    sphere.location.x = 1.0
    hair.data.position_data[7].vector = (0.0, 0.0, 0.5)
    hair.data.hairloom.shading.ambient = 0.125
    bpy.ops.ed.undo_push(message="change")

    bpy.ops.ed.undo()
    scene_events.catch_up(get_depsgraph())
    assert previews.sessions() == (session,)
    assert strand_grid(session) == pytest.approx(begin, abs=1e-6)
    assert overlay.drawing_of(session.uid).snapshot.shading.ambient == 1.0

    bpy.ops.ed.redo()
    scene_events.catch_up(get_depsgraph())
    assert strand_grid(session)[0, -1] == pytest.approx([1.0, 0.0, 0.5], abs=1e-5)
    assert overlay.drawing_of(session.uid).snapshot.shading.ambient == 0.125


def delete(name):
    bpy.data.objects.remove(bpy.data.objects[name])
    update()


def add_vertices(name):
    bpy.data.objects[name].modifiers.new("Smooth", "SUBSURF").levels = 1
    update()


@pytest.mark.parametrize(
    ("change", "name"), [(delete, "Hair"), (delete, "Head"), (add_vertices, "Head")]
)
def test_undoing_what_ended_a_preview_brings_it_back(change, name, new_hair, sphere, get_depsgraph):
    hair = new_hair(sphere)
    bpy.ops.ed.undo_push(message="begin")
    before = strand_grid(previews.start(hair, get_depsgraph()))
    change(name)
    assert previews.sessions() == () and "ended" in previews.notice()
    bpy.ops.ed.undo_push(message="changed")

    undo()
    (session,) = previews.sessions()
    assert strand_grid(session) == pytest.approx(before, abs=1e-6)
    assert overlay.drawing_of(session.uid).is_visible and previews.notice() == ""
    redo()
    assert previews.sessions() == ()
    undo()
    assert len(previews.sessions()) == 1
    previews.stop_all()
    redo()
    undo()
    assert previews.sessions() == (), "the artist has stopped it"


def test_redo_of_a_new_groom_previews_it_again(extension, sphere):
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.hairloom.add_groom("EXEC_DEFAULT", True, strand_count=60)
    undo()
    assert previews.sessions() == () and previews.notice() == ""
    redo()
    assert [each.name for each in previews.sessions()] == [bpy.context.object.name]


def test_cloth_that_an_undo_unmakes_is_no_fault(extension, sphere):
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.hairloom.fin_add("EXEC_DEFAULT", True)
    bpy.ops.hairloom.fin_preview()
    undo()
    assert previews.simulations() == () and previews.notice() == ""
    redo()
    assert [each.name for each in previews.simulations()] == ["Head"]


def test_loading_a_file_drops_all_previews_and_keeps_the_settings(preview, tmp_path):
    hair, _, session = preview
    hair.data.hairloom.shading.ambient = 0.125
    file = str(tmp_path / "hair.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    assert previews.sessions() == (session,)
    bpy.ops.wm.open_mainfile(filepath=file)
    assert previews.sessions() == ()
    assert overlay.drawing_of(session.uid) is None
    assert bpy.data.objects["Hair"].data.hairloom.shading.ambient == 0.125


def test_a_new_file_keeps_no_state_of_the_previous_one(preview, get_depsgraph):
    _, head, _ = preview
    previews.play(get_depsgraph())
    previews.pause(True)
    bpy.data.objects.remove(head)
    previews.advance(get_depsgraph(), 1.0)
    previews.previews.notice = "Preview of Hair ended"
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert previews.notice() == "" and not previews.previews.is_paused


def test_another_scene_in_the_window_does_not_end_the_preview(preview):
    _, head, session = preview
    before, window, scene = strand_grid(session), bpy.context.window, bpy.context.scene
    window.scene = bpy.data.scenes.new("Elsewhere")
    window.scene.collection.objects.link(bpy.data.objects.new("Thing", None))
    update()
    bpy.context.scene.objects["Thing"].location.x = 1.0
    update()
    assert previews.sessions() == (session,)
    assert not overlay.drawing_of(session.uid).is_visible
    window.scene = scene
    head.location.x = 1.0
    update()
    assert overlay.drawing_of(session.uid).is_visible
    assert strand_grid(session) == pytest.approx(before + np.array([1.0, 0.0, 0.0]), abs=1e-6)


def test_sculpting_hides_blenders_own_strands(preview, get_depsgraph):
    hair, _, session = preview
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    hair.data.position_data[7].vector = (0.0, 0.0, 0.5)
    update()
    assert hair.evaluated_get(get_depsgraph()).display_type == "WIRE"
    scene_events.catch_up(get_depsgraph())
    assert strand_grid(session)[0, -1] == pytest.approx([0.0, 0.0, 0.5], abs=1e-5)
    bpy.ops.object.mode_set(mode="OBJECT")
    update()
    assert hair.evaluated_get(get_depsgraph()).display_type == "WIRE"


@pytest.mark.slow
def test_a_final_render_does_not_disturb_the_preview(preview):
    _, _, session = preview
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera, scene.render.engine = camera, "BLENDER_WORKBENCH"
    scene.render.resolution_x = scene.render.resolution_y = 16
    before = strand_grid(session)
    bpy.ops.render.render()
    assert strand_grid(session) == pytest.approx(before, abs=1e-7)
    assert previews.sessions() == (session,)


@pytest.mark.parametrize("groom", ["none", "one point each"])
def test_hair_that_cannot_be_used_is_refused_with_a_remedy(groom, new_hair, get_depsgraph):
    hair = new_hair()
    hair.data.remove_curves()
    if groom != "none":
        hair.data.add_curves([1, 1, 1])
    with pytest.raises(HairloomError) as raised:
        previews.start(hair, get_depsgraph())
    assert raised.value.place == "Hair" and raised.value.remedy
    assert previews.sessions() == ()


def test_a_groom_of_another_scale_is_refused(new_hair, sphere, get_depsgraph):
    hair = new_hair(sphere)
    hair.scale = (100.0, 100.0, 100.0)
    with pytest.raises(HairloomError, match="scale"):
        previews.start(hair, get_depsgraph())


def test_a_head_without_faces_or_uvs_is_a_warning(new_hair, sphere, get_depsgraph):
    hair = new_hair(sphere)
    while sphere.data.uv_layers:
        sphere.data.uv_layers.remove(sphere.data.uv_layers[0])
    sphere.data.update()
    session = previews.start(hair, get_depsgraph())
    assert "Unwrap" in session.source.warnings[0]
    previews.stop(session)
    sphere.data.clear_geometry()
    session = previews.start(hair, get_depsgraph())
    assert "no faces" in session.source.warnings[0]
    assert session.rig.head is None


def test_a_temporarily_missing_gpu_is_waited_for(preview, get_depsgraph, monkeypatch):
    """Blender has no GPU context between a window's closing and the next redraw."""
    _, _, session = preview
    done = []
    monkeypatch.setattr(previews, "is_context_missing", lambda: True)
    previews.attempt(previews.previews[session.uid], get_depsgraph(), lambda: done.append(session))
    assert done == [] and previews.sessions() == (session,) and session.is_stale
    monkeypatch.setattr(previews, "is_context_missing", lambda: False)
    assert not bpy.app.timers.is_registered(scene_events._read_again)
    update()
    assert bpy.app.timers.is_registered(scene_events._read_again), "nobody looks again"
    scene_events.catch_up(get_depsgraph())
    assert not session.is_stale and previews.notice() == ""
