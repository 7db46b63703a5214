"""The farm template of docs/farm, run by Open Job Description's own program."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import bpy
import pytest
from swinging import key_x

from hairloom.addon.blender.base.images import read_texture
from hairloom.addon.cards.export_settings import CardExportSettings

pytest.importorskip("openjd.cli", reason="openjd-cli runs the template")
yaml = pytest.importorskip("yaml", reason="openjd-cli brings it along")

REPOSITORY = Path(__file__).parents[2]
TEMPLATE = REPOSITORY / "docs" / "farm" / "hairloom.yaml"
CHARACTERS = ("anna", "ben")
FRAMES = 4
#: replaces Blender; drops the arguments before Hairloom's own
BLENDER = f"""#!/bin/sh
shift 3
exec "{sys.executable}" "{REPOSITORY / "tools" / "headless.py"}" "$@"
"""


def openjd(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "openjd", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300.0, check=False)


@pytest.fixture
def folder(sphere: Any, new_hair: Callable[..., Any], tmp_path: Path) -> Path:
    """A folder with a small scene for each character, and the script that replaces Blender."""
    if sys.platform == "win32":
        pytest.skip("what stands for Blender is a shell script")
    hair, scene = new_hair(sphere), bpy.context.scene
    scene.frame_start, scene.frame_end = 1, FRAMES
    hair.hairloom.dynamics.collider_resolution = 8
    hair.hairloom.dynamics.device = "numpy"
    hair.data.hairloom.cards.source = "guides"
    hair.data.hairloom.atlas.source = "made"
    (tmp_path / "scenes").mkdir()
    for number, name in enumerate(CHARACTERS, start=1):
        key_x(sphere, {1: 0.0, FRAMES: 0.05 * number})
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scenes" / f"{name}.blend"))
    script = tmp_path / "blender.sh"
    script.write_text(BLENDER)
    script.chmod(0o755)
    return tmp_path


def run(folder: Path, step: str, *more: str, chunk: int = 2) -> subprocess.CompletedProcess[str]:
    values = {
        "Blender": folder / "blender.sh",
        "Scenes": folder / "scenes",
        "Output": folder / "out",
        "LastFrame": FRAMES,
        "ChunkSize": chunk,
    }
    given = [word for name, value in values.items() for word in ("-p", f"{name}={value}")]
    return openjd("run", str(TEMPLATE), "--step", step, *given, *more)


def at_once(*tasks: Callable[[], subprocess.CompletedProcess[str]]) -> list[int]:
    """Run tasks in parallel, as workers of a farm do; returns their exit codes."""
    with ThreadPoolExecutor(len(tasks)) as pool:
        return [done.returncode for done in pool.map(lambda task: task(), tasks)]


def bake_of(folder: Path, name: str) -> Callable[[], subprocess.CompletedProcess[str]]:
    return lambda: run(folder, "Bake", "-tp", f"Character={name}")


def strands_of(folder: Path, name: str, first: int) -> Callable[..., Any]:
    return lambda: run(folder, "Strands", "-tp", f"Character={name}", "-tp", f"First={first}")


def made(folder: Path) -> dict[str, int]:
    """File -> time of writing, without reports, which every run writes. The folder of a bake's
    frames, whose name differs per writer, is called "frames"."""
    files = (file for file in (folder / "out").rglob("*") if file.is_file())
    times = {
        file.relative_to(folder / "out").as_posix(): file.stat().st_mtime_ns
        for file in files
        if "verb" not in _content(file)
    }
    return {re.sub("frames-hl-[^/]*", "frames", name): time for name, time in times.items()}


def _content(file: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(file.read_text()) if file.suffix == ".json" else {}
    return content


def test_the_template_is_valid_and_names_existing_verbs_and_options() -> None:
    assert openjd("check", str(TEMPLATE)).returncode == 0
    from hairloom.addon.blender.command_line.command_line import parser

    for step in yaml.safe_load(TEMPLATE.read_text())["steps"]:
        arguments = step["script"]["actions"]["onRun"]["args"]
        assert arguments[:3] == ["--background", "--command", "hairloom"]
        numbers = {"{{Param.FirstFrame}}", "{{Param.LastFrame}}", "{{Param.ChunkSize}}"}
        numbers |= {"{{Task.Param.First}}"}
        plain = ["1" if word in numbers else word.replace("{{", "") for word in arguments[3:]]
        chosen = {"Param.Engine}}": "unreal", "Param.CardMotion}}": "joints"}
        plain = [chosen.get(word, word) for word in plain]
        options = parser().parse_args(plain)
        assert options.skip_existing and options.progress == "openjd" and options.report


def test_the_template_and_its_page_offer_all_that_moves_cards() -> None:
    declared = {
        each["name"]: each for each in yaml.safe_load(TEMPLATE.read_text())["parameterDefinitions"]
    }
    (choices,) = (each.choices for each in CardExportSettings.parameters() if each.name == "motion")
    there_is = {identifier for identifier, *_ in choices}
    assert set(declared["CardMotion"]["allowedValues"]) == there_is
    page = TEMPLATE.with_name("README.md").read_text()
    (documented,) = re.findall(r"`CardMotion` \(([^)]+)\)", page)
    assert set(re.findall("`([^`]+)`", documented)) == there_is


@pytest.mark.slow
def test_a_farm_bakes_exports_and_does_only_what_is_missing(folder: Path) -> None:
    assert at_once(*(bake_of(folder, name) for name in CHARACTERS)) == [0, 0]
    tasks = [strands_of(folder, *task) for task in (("anna", 1), ("anna", 3), ("ben", 1))]
    assert at_once(*tasks) == [0, 0, 0]
    assert run(folder, "Cards", "-tp", "Character=anna").returncode == 0
    done = run(folder, "Pictures", "-tp", "Character=anna", "-tp", "First=3")
    assert done.returncode == 0 and "bake is out of date" not in done.stdout, done.stdout
    drawn = read_texture(folder / "out" / "anna" / "picture_3.png", is_color=False)
    assert drawn.std() > 0.01, "the picture is empty"

    before = made(folder)
    assert {"anna/baked.blend", "anna/strands_1.abc", "anna/cards.glb"} <= before.keys()
    exported = _content(folder / "out" / "anna" / "strands_3.json")
    assert exported["preflight"]["frames"][:2] == [3, FRAMES]
    baked = [_content(folder / "out" / name / "bake.json")["baked"][0] for name in CHARACTERS]
    assert [facts["last"] for facts in baked] == [FRAMES, FRAMES]

    (folder / "out" / "anna" / "strands_3.abc").unlink()
    shutil.rmtree(folder / "out" / "ben" / "bake")
    done = run(folder, "Strands", "--run-dependencies")
    assert done.returncode == 0, done.stdout
    after = made(folder)
    assert after.keys() - before.keys() == {"ben/strands_3.abc", "ben/strands_3.abc.done.json"}
    again = {name for name in before if after[name] != before[name]}
    anna, ben = ({name for name in again if name.startswith(who)} for who in CHARACTERS)
    assert anna == {"anna/strands_3.abc", "anna/strands_3.abc.done.json"}
    assert "ben/baked.blend" in ben and "ben/strands_1.abc" in ben
    assert not any("cards" in name for name in again)


@pytest.mark.slow
def test_a_failed_task_fails_the_job_and_harms_no_other(folder: Path) -> None:
    (folder / "scenes" / "ben.blend").write_bytes(b"no blend file")
    anna, ben = at_once(*(bake_of(folder, name) for name in CHARACTERS))
    assert (anna, ben != 0) == (0, True)
    report = _content(folder / "out" / "ben" / "bake.json")
    assert report["status"] == "failed" and "ben.blend" in report["error"]["place"]
    assert {name for name in made(folder) if name.startswith("ben")} == set()
    assert {"anna/baked.blend", "anna/bake.done.json"} <= made(folder).keys()

    done = run(folder, "Strands", "--run-dependencies")
    assert done.returncode != 0
    assert "ben.blend" in done.stdout, "the log does not say what failed"
    assert "anna/strands_1.abc" not in made(folder), "it ran though what it needs has failed"
