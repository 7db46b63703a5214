"""Verbs that draw and verbs that write cards take several grooms, which appear together."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from hedgehogs import hedgehog

from hairloom.addon.arrays import Floats
from hairloom.addon.blender.base.images import read_texture
from hairloom.addon.blender.cards.build import CardInputs
from hairloom.addon.blender.cards.occluders import Occluders
from hairloom.addon.blender.command_line import cards_job, command_line
from hairloom.addon.blender.pictures.group_studio import GroupStudio, PosedCompanion
from hairloom.addon.blender.pictures.studio import Studio
from hairloom.addon.blender.properties.groom_settings import GroomSettings
from hairloom.addon.blender.sessions.prepared_groom import PreparedGroom, prepare_groom
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.hair_file import write_hair_file
from hairloom.addon.groom import automatic_children
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.params import SettingsMap
from hairloom.addon.refine.settings import DetailSettings
from hairloom.addon.render.camera import frame_camera
from hairloom.addon.rig_flow import prepare
from hairloom.addon.shading.ambient_settings import AmbientSettings
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.stage_settings import StageSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import StrandSet

pytestmark = [pytest.mark.draws(light=False), pytest.mark.usefixtures("gpu_context")]

#: a small picture, without shadows, whose programs take long to compile, and with all strands
SMALL = ["--width", "64", "--height", "64", "--samples", "1"]
SMALL += ["--set", "volume.shadows=none", "--set", "detail.min_density=1"]


def moved(strands: StrandSet, offset: np.ndarray) -> StrandSet:
    return strands.with_points(strands.points + offset)


def half(strands: StrandSet, sign: float) -> StrandSet:
    """60 strands at one side of the head."""
    return strands.take(np.flatnonzero(sign * strands.roots[:, 0] > 0.0)[:60])


def thick(strands: StrandSet) -> StrandSet:
    return StrandSet(
        strands.points, strands.offsets, np.full(len(strands.points), 2.0e-3), strands.group
    )


@pytest.fixture
def scene(sphere: Any, new_hair: Callable[..., Any], tmp_path: Path) -> Path:
    """A saved file with red hair on one side of a head and green hair on the other; the open scene
    is empty."""
    for name, strands, color in (
        ("Hair", half(hedgehog(200), -1.0), (0.9, 0.02, 0.02)),
        ("Fringe", half(hedgehog(200), 1.0), (0.02, 0.9, 0.02)),
    ):
        hair = new_hair(sphere, thick(strands))
        hair.name = name
        hair.data.hairloom.shading.base_color = color
        hair.hairloom.dynamics.device = "numpy"
    path = tmp_path / "wig.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return path


@pytest.fixture
def run(scene: Path) -> Callable[..., dict[str, Any]]:
    """A function that runs a verb on the scene and returns its report."""

    def done(verb: str, *arguments: str, output: str, code: int = 0) -> dict[str, Any]:
        report = scene.with_name("report.json")
        named = ["--output", str(scene.with_name(output)), "--report", str(report)]
        assert command_line.run([verb, "--scene", str(scene), *arguments, *named]) == code
        return json.loads(report.read_text(encoding="utf-8"))

    return done


def reds_and_greens(path: Path) -> tuple[int, int]:
    """The number of pixels that are clearly red, and clearly green."""
    red, green, _ = np.moveaxis(read_texture(path, is_color=False)[..., :3], -1, 0)
    return int((red > 1.5 * green + 0.05).sum()), int((green > 1.5 * red + 0.05).sum())


def test_all_hair_of_a_scene_is_in_one_picture(
    run: Callable[..., dict[str, Any]], scene: Path
) -> None:
    plain = ["--stage", "plain", *SMALL]
    facts = run("render", *plain, output="both.png")
    assert sorted(facts["groom"].split(", ")) == ["Fringe", "Hair"] and facts["strands"] == 120
    assert [each["strands"] for each in facts["grooms"]] == [60, 60]
    (left, *_), (right, *_) = facts["bounds_m"]
    assert left < -0.15 and right > 0.15
    assert 60 < facts["drawn"]["strands"] <= 120  # some are behind the head
    assert min(reds_and_greens(scene.with_name("both.png"))) > 5
    run("render", *plain, "--object", "Hair", output="one.png")
    assert reds_and_greens(scene.with_name("one.png"))[1] == 0
    run("render", *plain, "--groom", "Hair", "--object", "Fringe", output="named.png")
    assert min(reds_and_greens(scene.with_name("named.png"))) > 5


@pytest.mark.slow(instead="test_all_hair_of_a_scene_is_in_one_picture")
def test_a_sheet_and_a_turntable_show_all_hair(
    run: Callable[..., dict[str, Any]], scene: Path
) -> None:
    plain = ["--stage", "plain", *SMALL]
    assert run("sheet", *plain, output="sheet.png")["strands"] == 120
    assert min(reds_and_greens(scene.with_name("sheet.png"))) > 20
    facts = run("turntable", *plain, "--frames", "2", "--no-video", output="turn")
    assert facts["strands"] == 120
    for name in facts["outputs"]:
        assert min(reds_and_greens(scene.with_name("turn") / name)) > 5, name


def test_files_and_objects_are_drawn_together(
    run: Callable[..., dict[str, Any]], scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = scene.with_name("back.hair")
    write_hair_file(path, thick(hedgehog(40)))
    facts = run("render", "--groom", str(path), "--groom", "Hair", *SMALL, output="p.png")
    assert facts["groom"] == "back.hair, Hair" and facts["strands"] == 100
    run("render", "--groom", "Hair", "--object", "Hairr", *SMALL, output="p.png", code=1)
    assert "Hairr: this is not hair curves" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "says"),
    [("--slices", "of one groom"), ("--skin-shadow", "of one groom"), ("--bake", "a folder holds")],
)
def test_what_takes_one_groom_names_them(
    run: Callable[..., dict[str, Any]], capsys: pytest.CaptureFixture[str], option: str, says: str
) -> None:
    grooms = ["--groom", "Hair", "--groom", "Fringe"]
    value = "bake" if option == "--bake" else "more.png"
    run("render", *grooms, *SMALL, option, value, output="p.png", code=1)
    message = capsys.readouterr().err
    assert says in message and "Hair, Fringe" in message and "with --groom" in message


@pytest.mark.slow(instead="test_all_hair_of_a_scene_is_in_one_picture")
def test_bakes_are_drawn_in_the_same_frame(
    run: Callable[..., dict[str, Any]], scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, frames in (("Hair", ("1", "3")), ("Fringe", ("3", "4"))):
        arguments = ["--object", name, "--frames", *frames, "--save"]
        assert command_line.run(["bake", "--scene", str(scene), *arguments]) == 0
    facts = run(
        "render", "--bake", *SMALL, "--sheet", str(scene.with_name("s.png")), output="p.png"
    )
    assert facts["strands"] == 120 and facts["outputs"] == ["s.png", "p.png"]
    # one frame in common, so the other places are empty
    assert read_texture(scene.with_name("s.png"), is_color=False)[10, 400:].max() == 0.0
    run("render", "--bake", "--frame", "4", *SMALL, output="p.png", code=1)
    assert "Hair: " in capsys.readouterr().err


def test_cards_of_several_grooms_are_a_file_each(
    run: Callable[..., dict[str, Any]], scene: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    small = ["--set", "cards.card_count=6", "--set", "atlas.size=256", "--levels", "1"]
    facts = run("cards", *small, output="wig.glb")
    meshes = [name for name in facts["outputs"] if name.endswith(".glb")]
    assert sorted(meshes) == ["wig_Fringe.glb", "wig_Hair.glb"]
    sidecars = [scene.with_name(f"wig_{name}.hairloom.json") for name in ("Fringe", "Hair")]
    cards = [json.loads(each.read_text(encoding="utf-8")) for each in sidecars]
    triangles = [each["levels"][0]["triangles"] for each in cards]
    assert facts["card_triangles"] == sum(triangles) and min(triangles) > 0
    assert not scene.with_name("wig.glb").exists()
    shown = capfd.readouterr().out
    assert "wig_Fringe.glb" in shown and "wig_Hair.glb" in shown


def test_the_folder_of_several_bakes_names_them(
    run: Callable[..., dict[str, Any]], scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The verb bake writes a folder for each object into its own."""
    folder = str(scene.with_name("baked"))
    arguments = ["bake", "--scene", str(scene), "--frames", "1", "2", "--output", folder]
    assert command_line.run(arguments) == 0
    capsys.readouterr()
    run("render", "--bake", folder, *SMALL, output="p.png", code=1)
    assert "there is no bake here. Choose one of those in it: Fringe, Hair." in (
        capsys.readouterr().err
    )


@pytest.mark.parametrize(("count", "option"), [(40, "method=multi"), (1000, "method=none")])
def test_a_remedy_for_children_names_its_option(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    sphere: Any,
    count: int,
    option: str,
) -> None:
    """The panel's words alone do not help on the command line."""
    monkeypatch.setattr(automatic_children, "_MAX_STRANDS", 2000)
    path = tmp_path / "back.hair"
    write_hair_file(path, hedgehog(count))
    head = [] if count == 40 else ["--head", "Head"]
    arguments = ["export", "--groom", str(path), *head, "--output", str(tmp_path / "out.hair")]
    assert command_line.run(arguments) == 0
    (line,) = [each for each in capfd.readouterr().out.splitlines() if "Set Method to" in each]
    assert line.endswith(f" (--set children.{option}).")


def test_cards_of_files_darken_each_other(
    run: Callable[..., dict[str, Any]], scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As cards of hair in one scene do, with *Other Hair*."""
    files = [scene.with_name(f"{name}.hair") for name in ("back", "tail")]
    for number, path in enumerate(files):
        write_hair_file(path, thick(hedgehog(40 + 10 * number)))
    inputs: list[CardInputs] = []

    def stop(path: Path, given: CardInputs, *_: Any) -> None:
        inputs.append(given)
        raise HairloomError("it is enough", place=str(path), remedy="None")

    monkeypatch.setattr(cards_job, "write_cards", stop)
    grooms = [argument for path in files for argument in ("--groom", str(path))]
    run("cards", *grooms, "--set", "card_occlusion.others=true", output="wig.glb", code=1)
    (given,) = inputs
    assert given.rig.strands.strand_count == 40
    found, notes = given.occluders.cards()
    alone = Occluders().with_rigs([]).cards()[0]
    assert len(found) == 3 and not alone and not notes  # those of the scene, and the other file


def groom_of(strands: StrandSet) -> PreparedGroom:
    rig = prepare(strands, None, GuideSettings(), place="hair")
    return prepare_groom(rig, AmbientSettings())


def picture_of(*parts: StrandSet, shadows: str = "none") -> Floats:
    """A transparent picture of all parts together, under a sun from above."""
    settings = GroomSettings(
        SettingsMap(
            VolumeSettings(shadows=shadows),
            DetailSettings(min_density=1.0),
            StageSettings(ambient=(0.0, 0.0, 0.0)),
        )
    )
    first, *others = (groom_of(each) for each in parts)
    companions = [
        PosedCompanion(
            Studio(each, settings), each.rig.rest_pose, each.rig.strands.points, each.rig.guide_grid
        )
        for each in others
    ]
    studio = GroupStudio(companions, first, settings) if others else Studio(first, settings)
    camera = frame_camera((np.full(3, -0.18), np.full(3, 0.18)), (0.0, -1.0, 0.0), 0.5, 1.0)
    return studio.picture(
        first.rig.rest_pose,
        first.rig.strands.points,
        *(64, 64, 2, camera),
        lights=(Light.sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0), 3.0),),
        is_transparent=True,
    )


def test_a_groom_in_two_parts_looks_like_the_whole() -> None:
    whole = thick(hedgehog(200))
    parts = whole.take(np.arange(0, 200, 2)), whole.take(np.arange(1, 200, 2))
    expected, found = picture_of(whole), picture_of(*parts)
    assert np.abs(found[..., 3] - expected[..., 3]).mean() < 0.01
    assert np.abs(picture_of(parts[0])[..., 3] - expected[..., 3]).mean() > 0.05


@pytest.mark.slow(instead="test_a_groom_in_two_parts_looks_like_the_whole")
def test_a_groom_shadows_another() -> None:
    """A dense mat of hair above it, outside of the picture, keeps the light from it."""
    hair = thick(hedgehog(200))
    mat = moved(thick(hedgehog(4000)), np.array([0.0, 0.0, 0.6], np.float32))
    lit, shadowed = picture_of(hair, shadows="deep"), picture_of(hair, mat, shadows="deep")
    is_hair = lit[..., 3] > 0.5
    assert np.abs(lit[..., 3] - shadowed[..., 3]).max() < 0.05
    assert shadowed[is_hair, :3].mean() < 0.6 * lit[is_hair, :3].mean()
