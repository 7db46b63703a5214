"""A verb refuses, before any work, to overwrite its inputs or a file of another kind."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import pytest
from hedgehogs import hedgehog

from hairloom.addon.blender.command_line import command_line, job_steps
from hairloom.addon.blender.command_line.output_checks import check_outputs
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.groom import Groom
from hairloom.addon.exchange.tressfx import write_tfx

pytestmark = pytest.mark.usefixtures("extension")

RENDER = ["render", "--scene", "wig.blend", "--groom", "Hair"]
EXPORT = ["export", "--groom", "hair.tfx"]
PNG = "--output writes a .png file"
#: arguments and message
REFUSED = [
    ([*RENDER, "--output", "wig.blend"], PNG),
    ([*RENDER, "--output", "kept"], PNG),
    ([*RENDER, "--output", "a.png", "--slices", "hair.tfx"], "--slices writes a .png file"),
    (
        [*RENDER, "--output", "a.png", "--sheet", "./a.png"],
        "two results would be written to this file",
    ),
    ([*RENDER, "--output", "a.png", "--report", "wig.blend"], "--report writes a .json file"),
    ([*RENDER, "--output", "hair.tfx/a.png"], "hair.tfx is not a folder"),
    ([*RENDER, "--output", "kept.png"], "a folder has this name"),
    (["sheet", "--groom", "hair.tfx", "--output", "wig.blend"], PNG),
    (["turntable", "--groom", "hair.tfx", "--output", "wig.blend"], "a file has this name"),
    (["simulate", "--groom", "hair.tfx", "--output", "wig.blend"], "a file has this name"),
    (["bake", "--scene", "wig.blend", "--output", "hair.tfx"], "a file has this name"),
    (["bake", "--scene", "wig.blend", "--output", "kept"], "other files too, such as notes.txt. "),
    ([*EXPORT, "--output", "hair.tfx"], "the job reads this"),
    ([*EXPORT, "--output", "link.tfx"], "the job reads this"),
    ([*EXPORT, "--output", ""], "--output: an empty value is given. "),
    (["turntable", "--groom", "hair.tfx", "--output="], "--output: an empty value is given. "),
    (["render", "--groom", "", "--output", "a.png"], "--groom: an empty value is given. "),
    ([*EXPORT, "--output", "/"], "this names a folder, not a file"),
    ([*EXPORT, "--output", f"{'x' * 252}.tfx"], "Choose a shorter name"),
    ([*EXPORT, "--output", f"{'x' * 400}/a.tfx"], "Choose a shorter name"),
    ([*EXPORT, "--output", f"{'x' * 244}.tfx", "--skip-existing"], "Choose a shorter name"),
    (["simulate", "--groom", "hair.tfx", "--output", "x" * 256], "Choose a shorter name"),
    ([*EXPORT, "--output", "a.tfx", "--report", "look.json", "--preset", "look.json"], "reads"),
]


@pytest.fixture
def folder(
    sphere: Any, new_hair: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Path:
    """A scene with hair on a head, a groom, and other files of an artist."""
    new_hair(sphere)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "wig.blend"))
    write_tfx(tmp_path / "hair.tfx", Groom(hedgehog()))
    (tmp_path / "link.tfx").symlink_to("hair.tfx")
    (tmp_path / "look.json").write_text("{}")
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "notes.txt").write_text("mine")
    (tmp_path / "kept.png").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(("arguments", "message"), REFUSED, ids=lambda each: " ".join(each)[-40:])
def test_outputs_that_would_overwrite_inputs_are_refused_before_any_work(
    arguments: list[str],
    message: str,
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(job_steps, "read_inputs", lambda *_: pytest.fail("it has begun"))
    before = contents(folder)
    assert command_line.run(arguments) == 1
    assert message in capsys.readouterr().err
    assert contents(folder) == before


def test_the_report_says_that_the_output_is_refused(folder: Path) -> None:
    assert command_line.run([*EXPORT, "--output", "hair.tfx", "--report", "r.json"]) == 1
    error = json.loads((folder / "r.json").read_text())["error"]
    assert error["place"] == "hair.tfx" and "another name" in error["remedy"]


def test_a_folder_with_the_name_of_a_verb_or_an_object_is_no_input(folder: Path) -> None:
    for arguments in (
        ["bake", "--scene", "wig.blend", "--output", "bake"],
        ["turntable", "--scene", "wig.blend", "--output", "turntable"],
        ["simulate", "--scene", "wig.blend", "--groom", "Hair", "--output", "Hair"],
    ):
        options = command_line.parser().parse_args(arguments)
        options.output.mkdir()
        (verb,) = (each for each in command_line.VERBS if each.name == options.verb)
        check_outputs(verb, options)
    options.bake = "Hair"
    with pytest.raises(HairloomError, match="the job reads this"):
        check_outputs(verb, options)


def test_a_check_of_an_export_needs_no_place(folder: Path) -> None:
    assert command_line.run([*EXPORT, "--output", "hair.tfx", "--preflight"]) == 0


def test_a_scene_that_is_saved_over_itself_is_kept_as_the_version_before(folder: Path) -> None:
    before = (folder / "wig.blend").read_bytes()
    bpy.context.preferences.filepaths.save_version = 1
    grow = ["grow", "--scene", "wig.blend", "--head", "Head", "--set=grow.strand_count=20"]
    assert command_line.run([*grow, "--output", "wig.blend"]) == 0
    assert (folder / "wig.blend1").read_bytes() == before != (folder / "wig.blend").read_bytes()


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"hair", "this is not a Blender file"), (None, "Blender cannot open this")],
)
def test_files_that_are_no_scenes_are_named_briefly(
    content: bytes | None, message: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = content or (folder / "wig.blend").read_bytes()[:-5000]
    (folder / "cut.blend").write_bytes(cut)
    assert command_line.run(["export", "--scene", "cut.blend", "--output", "a.tfx"]) == 1
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith(f"hairloom: cut.blend: {message}") and line.count("cut.blend") == 1
