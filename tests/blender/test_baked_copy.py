"""A bake adds a copy of the hair to the scene; no hair is lost when the bake or the copy goes."""

import bpy
import pytest
from bake_files import frames_in

from hairloom.addon.blender.bakes import baked_copy, playback
from hairloom.addon.blender.preview import handlers, previews
from hairloom.addon.blender.preview.bake import Bake, show_in_renders
from hairloom.addon.blender.preview.diagnostics import issues_of
from hairloom.addon.exchange.files.file_names import name_key, safe_folder_name


@pytest.fixture
def hair(new_hair, sphere, tmp_path):
    made = new_hair(sphere)
    made.hairloom.dynamics.collider_resolution = 8
    made.hairloom.dynamics.device = "numpy"
    made.hairloom.bake.folder = str(tmp_path / "bake")
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 2
    return made


def bake(*hair):
    plan = Bake.of(list(hair), bpy.context.scene)
    list(plan.steps())
    show_in_renders(list(hair), bpy.context.evaluated_depsgraph_get())


def test_hair_is_rendered_again_after_its_render_copy_is_deleted(hair, get_depsgraph):
    bake(hair)
    assert hair.hide_render
    for collection in hair.hairloom.bake.copy.users_collection:
        collection.objects.unlink(hair.hairloom.bake.copy)  # as Delete does
    assert "hairloom.show_in_renders" in [each.operator for each in issues_of(hair, None)]
    assert bpy.ops.hairloom.show_in_renders() == {"FINISHED"}
    assert not hair.hide_render and hair.hairloom.bake.copy is None
    assert not bpy.ops.hairloom.show_in_renders.poll()


def test_a_copy_that_the_artist_converts_stays_and_the_next_bake_makes_another(hair):
    bake(hair)
    copy = hair.hairloom.bake.copy
    copy.hide_viewport = copy.hide_select = False
    bpy.ops.object.select_all(action="DESELECT")
    copy.select_set(True)
    bpy.context.view_layer.objects.active = copy
    bpy.ops.object.convert(target="MESH")
    assert copy.type == "MESH"
    assert "the copy that showed its bake was deleted" in issues_of(hair, None)[-1].text
    bake(hair)
    assert hair.hairloom.bake.copy.type == "CURVES" and copy.name in bpy.data.objects


def test_undoing_the_deletion_of_a_bake_offers_to_render_the_hair_itself(hair):
    """The files stay deleted, but the copy that showed them is back, and stands still."""
    bake(hair)
    bpy.ops.ed.undo_push(message="baked")
    assert not any(each.operator == "hairloom.show_in_renders" for each in issues_of(hair, None))
    bpy.ops.hairloom.bake_free("EXEC_DEFAULT", True)
    bpy.ops.ed.undo()
    hair = bpy.data.objects["Hair"]
    assert hair.hide_render and not hair.hairloom.bake.copy.hide_render
    assert "without motion" in issues_of(hair, None)[-1].text
    assert bpy.ops.hairloom.show_in_renders() == {"FINISHED"}
    assert not hair.hide_render and hair.hairloom.bake.copy is None
    assert not bpy.ops.hairloom.show_in_renders.poll()


@pytest.mark.parametrize("handler", [handlers.on_save_pre, handlers.on_load_post])
def test_a_file_is_never_left_without_hair_in_renders(hair, handler, capsys):
    bake(hair)
    bpy.data.objects.remove(hair.hairloom.bake.copy)
    handler()
    assert not hair.hide_render and "Hair is in renders again" in capsys.readouterr().out


def test_hair_that_was_hidden_stays_hidden_when_its_copy_goes(hair):
    hair.hide_render = True
    bake(hair)
    bpy.data.objects.remove(hair.hairloom.bake.copy)
    assert baked_copy.restore_hair_without_copy() == ["Hair"] and hair.hide_render


def test_a_copy_shows_no_bake_of_other_strands(hair, new_hair, sphere, tmp_path, capsys):
    """Another file bakes other hair with the same number of points into the folder."""
    bake(hair)
    copy = hair.hairloom.bake.copy
    shown = [tuple(point.vector) for point in copy.data.position_data]
    hair.hairloom.bake.folder = ""
    other = new_hair(sphere)
    other.data.position_data[5].vector.x += 0.01
    other.hairloom.dynamics.collider_resolution = 8
    list(Bake.of([other], bpy.context.scene, folder=tmp_path / "bake").steps())
    playback.forget()
    bpy.context.scene.frame_set(2)
    assert "do not match the bake" in capsys.readouterr().out
    assert [tuple(point.vector) for point in copy.data.position_data] == shown


def test_hair_stays_visible_after_a_file_fails_to_open(hair, get_depsgraph, tmp_path):
    session = previews.start(hair, get_depsgraph())
    assert session is not None
    assert hair.evaluated_get(get_depsgraph()).display_type == "WIRE"
    (tmp_path / "broken.blend").write_bytes(b"no file of Blender's")
    with pytest.raises(RuntimeError):
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "broken.blend"))
    hair = bpy.data.objects["Hair"]
    assert previews.session_of(hair) is None
    assert hair.evaluated_get(get_depsgraph()).display_type == hair.display_type != "WIRE"


@pytest.mark.parametrize(
    ("name", "folder"),
    [
        ("Hair", "Hair"),
        ("../../outside", "_.._outside"),
        ("/x", "_x"),
        ("rig:hair", "rig_hair"),
        ("A/B", "A_B"),
        ("C:\\x", "C_x"),
        ("CON", "_CON"),
        ("nul.tfx", "_nul.tfx"),
        ("Com1", "_Com1"),
        ("...", "hair"),
        ("", "hair"),
        ("Zoë's hair ", "Zoë_s hair"),
        ("头发", "头发"),
        ("x" * 500, "x" * 41 + "_c38c2bf3"),
    ],
)
def test_a_name_cannot_lead_out_of_its_bake_folder(name, folder, tmp_path):
    assert safe_folder_name(name) == folder
    inside = tmp_path / "cache" / safe_folder_name(name)
    assert inside.resolve().parent == (tmp_path / "cache").resolve()


def test_names_that_are_equal_on_some_file_systems_get_two_folders():
    taken = {name_key(safe_folder_name("Hair"))}
    assert safe_folder_name("hair", taken) == "hair_2"
    assert safe_folder_name("Cafe\u0301") == safe_folder_name("Caf\u00e9")


def test_versions_of_a_file_with_a_long_name_get_two_folders():
    """Studios put the version at the end of long names."""
    stems = [f"show_episode_12_sequence_0400_shot_0130_lighting_final_v{n:03}" for n in range(3)]
    folders = {safe_folder_name(stem) for stem in stems}
    assert len(folders) == 3 and max(map(len, folders)) <= 50


def test_hair_with_a_path_for_a_name_is_baked_below_the_folder(hair, tmp_path):
    twin = hair.copy()
    bpy.context.collection.objects.link(twin)
    hair.name, twin.name = "../outside", "..\\outside"
    list(Bake.of([hair, twin], bpy.context.scene, folder=tmp_path / "farm").steps())
    assert {path.name for path in tmp_path.iterdir()} == {"farm"}
    folders = [path for path in (tmp_path / "farm").iterdir() if frames_in(path).is_dir()]
    assert len(folders) == 2
