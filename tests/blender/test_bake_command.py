"""The verb `bake`: bakes and a report from a scene; one line and exit code 1 for bad input."""

import json
import re
from pathlib import Path

import bpy
import numpy as np
import pytest
from hedgehogs import hedgehog
from swinging import key_x

from hairloom.addon import motion_flow
from hairloom.addon.blender.bakes import playback
from hairloom.addon.blender.bakes.cache import Cache
from hairloom.addon.blender.bakes.guide_motion import BakedGuides
from hairloom.addon.blender.base.images import read_texture
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.pictures import studio
from hairloom.addon.render.frame import render_still

LAST = 5


@pytest.fixture
def file(new_hair, sphere, tmp_path):
    """A saved file with hair on a head that moves; the open scene is empty."""
    hair = new_hair(sphere)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, LAST
    key_x(sphere, {1: 0.0, LAST: 0.2})
    hair.hairloom.dynamics.collider_resolution = 8
    hair.hairloom.dynamics.device = "numpy"
    path = tmp_path / "wig.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return path


def test_a_scene_is_baked_and_saved(file, tmp_path):
    report = tmp_path / "report.json"
    arguments = ["bake", "--scene", str(file), "--save", "--report", str(report)]
    assert command_line.run(arguments) == 0
    folder = tmp_path / "hairloom_cache" / "wig" / "Hair"
    assert Cache(folder).facts.last == LAST
    (baked,) = json.loads(report.read_text())["baked"]
    assert 0.0 <= baked.pop("figures")["strands_stretch_max_percent"] < 0.01
    assert baked == {
        "object": "Hair",
        "folder": str(folder),
        "first": 1,
        "last": LAST,
        "frame_rate": 24.0,
        "device": "numpy",
    }
    bpy.ops.wm.open_mainfile(filepath=str(file))
    hair = bpy.data.objects["Hair"]
    assert playback.cache_of(hair).facts.owner == "Hair"
    assert hair.hide_render and hair.hairloom.bake.copy.name == "Hair Baked"


def test_frames_output_and_settings_are_chosen(file, tmp_path):
    curve = "dynamics.style_along=1,0.5,0.25,0.1,0"
    arguments = ["bake", "--scene", str(file), "--frames", "2", "4", "--object", "Hair"]
    arguments += ["--output", str(tmp_path / "out"), "--set", "dynamics.damping=4", "--set", curve]
    assert command_line.run(arguments) == 0
    facts = Cache(tmp_path / "out").facts
    assert (facts.first, facts.last) == (2, 4)
    dynamics = bpy.data.objects["Hair"].hairloom.dynamics
    assert dynamics.damping == 4.0 and dynamics.collider_resolution == 8
    assert list(dynamics.style_along) == pytest.approx([1, 0.5, 0.25, 0.1, 0])


def test_an_object_that_is_named_twice_is_taken_once(file, tmp_path):
    """Duplicate names occur where a script joins lists."""
    report, twice = tmp_path / "report.json", ["--object", "Hair", "--object", "Hair"]
    bake = ["bake", "--scene", str(file), "--frames", "1", "2", *twice]
    bake += ["--output", str(tmp_path / "out"), "--report", str(report)]
    assert command_line.run(bake) == 0
    (baked,) = json.loads(report.read_text())["baked"]
    assert Path(baked["folder"]) == tmp_path / "out"
    export = ["export", "--scene", str(file), *twice, "--output", str(tmp_path / "a.tfx")]
    assert command_line.run([*export, "--report", str(report)]) == 0
    count = len(bpy.data.objects["Hair"].data.curves)
    assert json.loads(report.read_text())["preflight"]["strands"] == count


@pytest.mark.alike
@pytest.mark.parametrize("verb", [["bake"], ["simulate", "--animated"], ["simulate"]])
def test_only_selected_curves_move_by_themselves(file, tmp_path, verb):
    """A file saved with a selection: unselected curves stay exactly at their style."""
    bpy.ops.wm.open_mainfile(filepath=str(file))
    curves = bpy.data.objects["Hair"].data
    is_chosen = np.arange(len(curves.curves)) % 3 == 0
    curves.attributes.new(".selection", "BOOLEAN", "CURVE").data.foreach_set("value", is_chosen)
    bpy.ops.wm.save_mainfile()
    soft = ("only_selected=true", "style_root=1", "style_tip=0.2", "sag_compensation=0")
    chosen = [part for each in soft for part in ("--set", f"dynamics.{each}")]
    place = ["--object" if verb == ["bake"] else "--groom", "Hair"]
    place += ["--seconds", "0.2"] if verb == ["simulate"] else []
    output = ["--output", str(tmp_path / "out")]
    assert command_line.run([*verb, "--scene", str(file), *place, *chosen, *output]) == 0
    motion = BakedGuides.in_folder(tmp_path / "out")
    pose, guides = motion.at(motion.frames[-1])
    away = np.abs(guides - motion_flow.style_of_guides(motion.rig, pose)).max(axis=(1, 2))
    is_chosen = is_chosen[motion.rig.guides]
    assert is_chosen.any() and not is_chosen.all()
    assert (away[is_chosen] > 1e-3).all()
    assert (away[~is_chosen] == 0.0).all()


def test_a_second_bake_shows_nothing_of_its_own_copies(file):
    for _ in range(2):
        assert command_line.run(["bake", "--scene", str(file), "--save"]) == 0
    assert sorted(o.name for o in bpy.data.objects if o.type == "CURVES") == ["Hair", "Hair Baked"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--scene", "nothing.blend"], "no such file"),
        (["--object", "Nobody"], "Nobody"),
        (["--frames", "5", "2"], "--frames"),
        (["--set", "dynamics.damping=-1"], "damping"),
        (["--set", "dynamics.style_along=1,2"], "style_along"),
        (["--preset", "nobody/knows"], "no such preset"),
        (["--scene", "broken.blend"], "broken.blend"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_1(arguments, message, file, tmp_path, capfd):
    (tmp_path / "broken.blend").write_bytes(b"no blend file")
    arguments = [str(tmp_path / a) if a.endswith(".blend") else a for a in arguments]
    scene = [] if "--scene" in arguments else ["--scene", str(file)]
    assert command_line.run(["bake", *scene, *arguments]) == 1
    errors = [line for line in capfd.readouterr().err.splitlines() if line.startswith("hairloom:")]
    assert len(errors) == 1 and message in errors[0]
    assert not (tmp_path / "hairloom_cache").exists()


def test_hair_without_a_surface_is_baked_and_noted(file, tmp_path):
    """A farm's task succeeds, and its report says why the motion may not be the intended one."""
    bpy.ops.wm.open_mainfile(filepath=str(file))
    bpy.data.objects["Hair"].data.surface = bpy.data.objects["Hair"].parent = None
    bpy.ops.wm.save_mainfile()
    report = tmp_path / "report.json"
    assert command_line.run(["bake", "--scene", str(file), "--report", str(report)]) == 0
    (note,) = json.loads(report.read_text())["notes"]
    assert note.startswith("Hair: it has no surface") and "Set Surface" in note


def test_the_failed_task_of_the_farm_page_fails_as_it_says(file, tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "farm" / "README.md").read_text(encoding="utf-8")
    (documented,) = re.findall(r"^```json\n(.+?)^```", page, flags=re.M | re.S)
    report = tmp_path / "report.json"
    arguments = ["bake", "--scene", str(file), "--frames", "250", "1", "--report", str(report)]
    assert command_line.run(arguments) == 1
    failed = json.loads(report.read_text())
    for key, value in json.loads(documented).items():
        assert failed[key] == value


def test_an_empty_scene_has_nothing_to_bake(extension, capfd):
    assert command_line.run(["bake"]) == 1
    assert "nothing to bake" in capfd.readouterr().err


def test_wrong_usage_exits_with_2(extension):
    assert command_line.run(["bake", "--frames", "1"]) == 2
    assert command_line.run(["bake", "--groom", "Hair"]) == 2


def test_the_bake_of_the_command_line_is_that_of_the_button(file, tmp_path):
    assert command_line.run(["bake", "--scene", str(file), "--output", str(tmp_path / "one")]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(file))
    hair = bpy.data.objects["Hair"]
    bpy.context.view_layer.objects.active = hair
    hair.hairloom.bake.folder = str(tmp_path / "two")
    assert bpy.ops.hairloom.bake() == {"FINISHED"}
    one, two = Cache(tmp_path / "one"), Cache(tmp_path / "two")
    assert one.facts == two.facts
    for frame in range(1, LAST + 1):
        for name, array in one.frame(frame).items():
            np.testing.assert_array_equal(two.frame(frame)[name], array)


def test_a_baked_frame_is_drawn(file, tmp_path):
    """The verb `render` draws baked frames; its report notes changes since the bake."""
    assert command_line.run(["bake", "--scene", str(file), "--save"]) == 0
    picture, report = tmp_path / "hair.png", tmp_path / "report.json"
    arguments = ["render", "--scene", str(file), "--groom", "Hair", "--bake", "--width", "96"]
    arguments += ["--height", "72", "--samples", "1", "--output", str(picture)]
    arguments += ["--set", "skin.skin_resolution=128"]
    drawn = {}
    for frame in (1, LAST):
        more = ["--frame", str(frame), "--report", str(report)]
        assert command_line.run([*arguments, *more]) == 0
        drawn[frame] = read_texture(picture, is_color=False)
        assert json.loads(report.read_text())["notes"] == []
    assert drawn[1].std() > 0.01
    assert np.abs(drawn[1] - drawn[LAST]).max() > 0.1, "the hair does not move"
    bpy.ops.wm.open_mainfile(filepath=str(file))
    bpy.data.objects["Hair"].hairloom.dynamics.damping = 7.0
    bpy.ops.wm.save_mainfile()
    assert command_line.run([*arguments, "--frame", "1", "--report", str(report)]) == 0
    assert "out of date (settings)" in json.loads(report.read_text())["notes"][0]


def test_a_bake_in_a_folder_has_the_look_of_the_only_hair_of_the_scene(file, tmp_path, capsys):
    bpy.ops.wm.open_mainfile(filepath=str(file))
    hair = bpy.data.objects["Hair"]
    hair.data.hairloom.shading.base_color = (0.9, 0.02, 0.02)
    bpy.ops.wm.save_mainfile()
    folder, picture = tmp_path / "bake", tmp_path / "hair.png"
    assert command_line.run(["bake", "--scene", str(file), "--output", str(folder)]) == 0
    arguments = ["render", "--scene", str(file), "--bake", str(folder), "--output", str(picture)]
    arguments += ["--width", "32", "--height", "24", "--samples", "1"]
    drawn = []
    for more in ([], ["--groom", "Hair"]):
        assert command_line.run([*arguments, *more]) == 0
        drawn.append(read_texture(picture, is_color=False))
    assert np.array_equal(*drawn)
    assert command_line.run([*arguments, "--groom", "Hairr"]) == 1
    assert "Hairr: this is neither a hair curves object" in capsys.readouterr().err
    bpy.ops.wm.open_mainfile(filepath=str(file))
    other = bpy.data.objects["Hair"].copy()
    bpy.context.collection.objects.link(other)
    bpy.ops.wm.save_mainfile()
    capsys.readouterr()
    assert command_line.run(arguments) == 0
    assert "several objects (Hair, Hair.001), so the bake has" in capsys.readouterr().out


@pytest.mark.slow(instead="test_a_baked_frame_is_drawn")
def test_a_picture_of_another_bake_is_not_skipped(file, tmp_path, capfd):
    assert command_line.run(["bake", "--scene", str(file), "--save"]) == 0
    arguments = ["render", "--scene", str(file), "--groom", "Hair", "--bake", "--skip-existing"]
    arguments += ["--width", "32", "--height", "24", "--samples", "1", "--frame", str(LAST)]
    arguments += ["--output", str(tmp_path / "hair.png")]

    def is_skipped():
        capfd.readouterr()
        assert command_line.run(arguments) == 0
        return "Nothing to do" in capfd.readouterr().out

    assert not is_skipped() and is_skipped()
    assert command_line.run(["bake", "--scene", str(file), "--set", "dynamics.damping=7"]) == 0
    assert not is_skipped()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--groom", "Hair"], "it has no bake"),
        (["--bake", "nowhere"], "there is no bake"),
        (["--groom", "Sphere"], "this is not a hair object"),
        ([], "it has no bake"),  # the only hair of the scene
    ],
)
def test_frames_without_a_bake_are_not_drawn(arguments, message, file, tmp_path, capsys):
    whole = ["render", "--scene", str(file), "--bake", "--output", str(tmp_path / "hair.png")]
    assert command_line.run([*whole, *arguments]) == 1
    assert message in capsys.readouterr().err
    assert not (tmp_path / "hair.png").exists()


def _half_covered_head_that_swells(new_hair, sphere):
    """A head with hair on one side only, and a shape key that deforms the other side."""
    strands = hedgehog()
    hair = new_hair(sphere, strands.take(np.flatnonzero(strands.roots[:, 0] > 0.03)))
    hair.hairloom.dynamics.collider_resolution = 8
    hair.hairloom.dynamics.device = "numpy"
    sphere.shape_key_add(name="Basis")
    nose = sphere.shape_key_add(name="Nose")
    for point in nose.points:
        if point.co.x < 0.0:
            point.co.x *= 2.0
    for frame, value in ((1, 0.0), (LAST, 1.0)):
        nose.value = value
        nose.keyframe_insert("value", frame=frame)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, LAST
    scene.frame_set(1)
    return hair


@pytest.mark.slow(instead="test_a_baked_frame_is_drawn")
def test_the_whole_of_a_deformed_head_is_drawn(
    new_hair, sphere, get_depsgraph, tmp_path, monkeypatch
):
    """The drawn vertices are those that Blender evaluates, with or without roots on them."""
    _half_covered_head_that_swells(new_hair, sphere)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "wig.blend"))
    assert command_line.run(["bake", "--save"]) == 0
    drawn = []

    def watched(snapshot, *arguments, **options):
        drawn.append(snapshot.meshes[0].surface.positions)
        return render_still(snapshot, *arguments, **options)

    monkeypatch.setattr(studio, "render_still", watched)
    arguments = ["render", "--groom", "Hair", "--bake", "--frame", str(LAST), "--width", "32"]
    arguments += ["--height", "32", "--samples", "1", "--output", str(tmp_path / "hair.png")]
    assert command_line.run(arguments) == 0
    bpy.context.scene.frame_set(LAST)
    head = bpy.data.objects["Head"].evaluated_get(get_depsgraph())
    expected = np.array([head.matrix_world @ vertex.co for vertex in head.to_mesh().vertices])
    assert np.ptp(expected[:, 0]) > 0.29, "the shape key acts"
    np.testing.assert_allclose(drawn[0], expected, atol=1e-6)
