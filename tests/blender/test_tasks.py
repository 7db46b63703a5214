"""Features that farms need: reports of failures, progress lines, interrupted and repeated tasks."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import pytest
from waiting import TIMEOUT_S

from hairloom.addon.blender.bakes.cache import Cache
from hairloom.addon.blender.base import interruption
from hairloom.addon.blender.base.report import Report
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.command_line.stamp import Stamp

REPOSITORY = Path(__file__).parents[2]
QUICK = ["--set", "dynamics.device=numpy", "--set", "dynamics.collider_resolution=8"]


@pytest.fixture
def scene(sphere: Any, new_hair: Callable[..., Any], tmp_path: Path) -> Path:
    """A saved file with hair on a head; the open scene is empty."""
    new_hair(sphere)
    path = tmp_path / "wig.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return path


@pytest.fixture
def task(scene: Path, tmp_path: Path) -> Callable[..., dict[str, Any]]:
    """A function that bakes the scene as a farm's task does and returns the report."""

    def run(*more: str, code: int = 0) -> dict[str, Any]:
        report = tmp_path / "report.json"
        arguments = ["bake", "--scene", str(scene), "--frames", "1", "3", *QUICK]
        arguments += ["--output", str(tmp_path / "bake"), "--skip-existing"]
        assert command_line.run([*arguments, "--report", str(report), *more]) == code
        facts: dict[str, Any] = json.loads(report.read_text())
        return facts

    return run


def test_a_task_that_is_done_is_not_done_again(
    task: Callable[..., dict[str, Any]], tmp_path: Path
) -> None:
    assert task()["status"] == "done"
    made = {file: file.stat().st_mtime_ns for file in (tmp_path / "bake").rglob("*")}
    assert task()["status"] == "skipped"
    assert {file: file.stat().st_mtime_ns for file in (tmp_path / "bake").rglob("*")} == made
    assert task("--progress", "openjd")["status"] == "skipped", "progress is no part of the result"


def test_the_report_of_a_task_that_is_skipped_still_names_outputs_and_notes(
    task: Callable[..., dict[str, Any]], scene: Path
) -> None:
    """When a farm repeats a job because one task failed, the notes of the others are kept."""
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    bpy.data.objects["Hair"].data.surface = bpy.data.objects["Hair"].parent = None
    bpy.ops.wm.save_mainfile()
    done, skipped = task(), task()
    assert (done["status"], skipped["status"]) == ("done", "skipped")
    assert skipped["outputs"] == done["outputs"] == ["bake"]
    assert skipped["notes"] == done["notes"] and "it has no surface" in done["notes"][0]


def largest(folder: Path) -> Path:
    files = (file for file in folder.rglob("*") if file.is_file())
    return max(files, key=lambda file: file.stat().st_size)


@pytest.mark.parametrize(
    "change", ["scene", "cut output", "no output", "option", "no stamp", "stamp"]
)
def test_a_task_is_done_again_when_anything_has_changed(
    change: str, task: Callable[..., dict[str, Any]], scene: Path, tmp_path: Path
) -> None:
    task()
    bake, stamp, more = tmp_path / "bake", tmp_path / "bake.done.json", list[str]()
    frame = largest(bake)
    size = frame.stat().st_size
    if change == "scene":
        bpy.ops.wm.open_mainfile(filepath=str(scene))
        bpy.data.objects["Hair"].hairloom.dynamics.damping = 7.0
        bpy.ops.wm.save_mainfile()
    elif change == "cut output":
        frame.write_bytes(frame.read_bytes()[:-9])
    elif change == "no output":
        frame.unlink()
    elif change == "option":
        more = ["--set", "dynamics.damping=3"]
    elif change == "no stamp":
        stamp.unlink()
    else:
        stamp.write_text(stamp.read_text()[:-40])
    assert task(*more)["status"] == "done"
    assert largest(bake).stat().st_size == size and Cache(bake).facts.last == 3
    assert task(*more)["status"] == "skipped"


def test_a_job_whose_folders_are_moved_together_is_still_done(scene: Path, tmp_path: Path) -> None:
    """The stamp has relative paths to the scene, the bake and the scene that plays it."""
    job, report = tmp_path / "job", tmp_path / "report.json"
    (job / "scenes").mkdir(parents=True)
    shutil.copy(scene, job / "scenes" / "wig.blend")

    def status(folder: Path, *more: str) -> str:
        arguments = ["bake", "--scene", str(folder / "scenes" / "wig.blend"), "--frames", "1", "3"]
        arguments += ["--output", str(folder / "out" / "bake"), *QUICK, "--skip-existing"]
        arguments += ["--save-as", str(folder / "out" / "baked.blend"), "--report", str(report)]
        assert command_line.run([*arguments, *more]) == 0
        return str(json.loads(report.read_text())["status"])

    assert status(job) == "done" and status(job) == "skipped"
    stamp = (job / "out" / "bake.done.json").read_text()
    assert str(tmp_path) not in stamp and "../scenes/wig.blend" in json.loads(stamp)["inputs"]
    moved = job.rename(tmp_path / "elsewhere")
    assert status(moved) == "skipped"
    assert status(moved, "--set", "dynamics.damping=3") == "done"
    with open(moved / "scenes" / "wig.blend", "ab") as file:
        file.write(b"changed")
    assert status(moved, "--set", "dynamics.damping=3") == "done"


def test_a_linked_library_is_an_input(
    task: Callable[..., dict[str, Any]], scene: Path, tmp_path: Path
) -> None:
    library = tmp_path / "props.blend"
    bpy.data.objects.new("Prop", None).use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(library))
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    with bpy.data.libraries.load(str(library), link=True) as (_, into):
        into.objects = ["Prop"]
    bpy.context.collection.objects.link(bpy.data.objects["Prop"])
    bpy.ops.wm.save_mainfile()
    task()
    assert task()["status"] == "skipped"
    bpy.ops.wm.open_mainfile(filepath=str(library))
    bpy.data.objects.new("Another", None).use_fake_user = True
    bpy.ops.wm.save_mainfile()
    assert task()["status"] == "done"


def test_a_picture_that_is_missing_is_an_input(
    task: Callable[..., dict[str, Any]], scene: Path, tmp_path: Path
) -> None:
    """As on a machine that cannot access the disk: once the file exists, the task is done again."""
    picture = tmp_path / "skin.png"
    shutil.copy(REPOSITORY / "docs" / "images" / "still.jpg", picture)
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    bpy.data.images.load(str(picture)).use_fake_user = True
    bpy.ops.wm.save_mainfile()
    away = picture.rename(tmp_path / "away.png")
    task()
    assert task()["status"] == "skipped"
    away.rename(picture)
    assert task()["status"] == "done"


@pytest.fixture
def export(scene: Path, tmp_path: Path) -> Callable[..., int]:
    """A function that exports the hair's motion as a farm's task does and returns the exit code."""

    def run(*more: str) -> int:
        arguments = ["export", "--scene", str(scene), "--frames", "1", "3", "--skip-existing"]
        return command_line.run([*arguments, "--output", str(tmp_path / "a.abc"), *more])

    return run


def test_hair_whose_bake_is_not_there_is_exported_in_no_other_motion(
    export: Callable[..., int],
    scene: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    bake = ["bake", "--scene", str(scene), "--frames", "1", "3", *QUICK, "--save"]
    assert command_line.run([*bake, "--output", str(tmp_path / "bake")]) == 0
    away = (tmp_path / "bake").rename(tmp_path / "away")
    for more in ([], ["--use-bake"]):
        assert export(*more) == 1
        assert "its bake is not in" in capfd.readouterr().err
    cards = ["cards", "--scene", str(scene), "--groom", "Hair", "--motion", "joints"]
    assert command_line.run([*cards, "--output", str(tmp_path / "a.glb")]) == 1
    assert "its bake is not in" in capfd.readouterr().err
    assert not list(tmp_path.glob("a.*"))
    assert export("--no-use-bake") == 0
    away.rename(tmp_path / "bake")
    assert export() == 0
    assert "Nothing to do" not in capfd.readouterr().out


def test_hair_that_was_never_baked_is_exported_again_once_it_is(
    export: Callable[..., int],
    scene: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    bpy.data.objects["Hair"].hairloom.bake.folder = "//bake"
    bpy.ops.wm.save_mainfile()
    assert export("--use-bake") == 1
    assert "it has no bake" in capfd.readouterr().err
    assert export() == 0 and export() == 0
    assert "Nothing to do" in capfd.readouterr().out
    bake = ["bake", "--scene", str(scene), "--frames", "1", "3", *QUICK]
    assert command_line.run([*bake, "--output", str(tmp_path / "bake")]) == 0
    assert export() == 0
    assert "bake has changed" in capfd.readouterr().out


def test_files_that_a_head_refers_to_are_inputs(extension: None, tmp_path: Path) -> None:
    head, output = tmp_path / "head.obj", tmp_path / "a.tfx"
    head.write_text("mtllib skin.mtl\nv 0 0 0\n")
    (tmp_path / "skin.mtl").write_text("newmtl skin\n")
    asked = ["export", "--head", str(head), "--output", str(output), "--skip-existing"]
    options = command_line.parser().parse_args(asked)
    stamp, report = Stamp(options), Report("export")
    output.write_bytes(b"strands")
    report.add_output(output)
    stamp.write(report)
    assert Stamp(options).reason_to_run() == ""
    (tmp_path / "skin.mtl").write_text("newmtl other\n")
    assert Stamp(options).reason_to_run() == "skin.mtl has changed"
    (tmp_path / "skin.mtl").unlink()
    Stamp(options).write(report)
    assert Stamp(options).reason_to_run() == ""
    (tmp_path / "skin.mtl").write_text("newmtl skin\n")
    assert Stamp(options).reason_to_run() == "skin.mtl has changed", "it was missing"


def test_files_that_blender_brings_along_are_no_inputs(
    task: Callable[..., dict[str, Any]], scene: Path, tmp_path: Path
) -> None:
    """Node groups of Blender's own assets, linked as the asset browser links them."""
    assets = Path(bpy.utils.resource_path("LOCAL") or bpy.utils.resource_path("SYSTEM"))
    found = list(assets.glob("datafiles/assets/**/procedural_hair_node_assets.blend"))
    if not found:
        pytest.skip("this Blender comes without assets")
    (nodes,) = found
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    with bpy.data.libraries.load(str(nodes), link=True) as (there, into):
        into.node_groups = there.node_groups[:1]
    group = bpy.data.node_groups.new("Own", "GeometryNodeTree")
    group.nodes.new("GeometryNodeGroup").node_tree = into.node_groups[0]
    group.use_fake_user = True
    bpy.ops.wm.save_mainfile()
    task()
    assert set(json.loads((tmp_path / "bake.done.json").read_text())["inputs"]) == {"wig.blend"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(["bake", "--skip-existing"], "--output"), (["bake", "--output", "x", "--save"], "--save-as")],
)
def test_what_cannot_be_skipped_is_said(
    arguments: list[str], message: str, extension: None, capfd: pytest.CaptureFixture[str]
) -> None:
    assert command_line.run([*arguments, "--skip-existing"]) == 1
    assert message in capfd.readouterr().err


def test_a_failed_task_reports_why(
    task: Callable[..., dict[str, Any]], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    facts = task("--object", "Nobody", "--progress", "openjd", code=1)
    assert facts["status"] == "failed" and facts["verb"] == "bake"
    assert facts["error"]["place"] == "Nobody"
    assert set(facts["error"]) == {"problem", "place", "remedy"} and all(facts["error"].values())
    output = capfd.readouterr()
    assert f"openjd_fail: Nobody: {facts['error']['problem']}" in output.out
    assert facts["error"]["problem"] in output.err
    assert not (tmp_path / "bake").exists() and not (tmp_path / "bake.done.json").exists()


def test_a_report_that_cannot_be_written_fails_the_task(extension: None, tmp_path: Path) -> None:
    assert command_line.run(["run", "--report", str(tmp_path)]) == 1


def test_a_fault_of_ours_is_in_the_report_too(
    task: Callable[..., dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The report is never that of an earlier run."""
    task()
    monkeypatch.setattr(command_line, "check_numbers", lambda _options: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        task()
    facts = json.loads((tmp_path / "report.json").read_text())
    assert facts["status"] == "failed" and "ZeroDivisionError" in facts["error"]["problem"]


def test_the_report_of_a_task_that_is_killed_says_so(
    task: Callable[..., dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While the task runs, its report on disk says "begun"."""
    task()
    found: list[str] = []

    def look(*_: Any) -> int:
        found.append(json.loads((tmp_path / "report.json").read_text())["status"])
        return 0

    monkeypatch.setattr(command_line, "_run_and_report", look)
    task()
    assert found == ["begun"]


def test_a_farm_reads_status_and_progress(
    task: Callable[..., dict[str, Any]], capfd: pytest.CaptureFixture[str]
) -> None:
    task("--progress", "openjd")
    lines = capfd.readouterr().out.splitlines()
    shares = [float(line.split(": ")[1]) for line in lines if line.startswith("openjd_progress: ")]
    assert shares == sorted(shares) and shares[-1] == 100.0 and len(shares) == 3
    states = [line.split(": ")[1] for line in lines if line.startswith("openjd_status: ")]
    assert states == ["open scene", "bake frame"]
    assert not any(re.match(r"baking: ", line) for line in lines)


@pytest.mark.skipif(not bpy.app.module, reason="tools/headless.py needs Blender as a module")
@pytest.mark.slow
def test_an_interrupted_task_leaves_nothing(scene: Path, tmp_path: Path) -> None:
    """A farm sends SIGTERM to the process, and Ctrl-C sends SIGINT."""
    for number in (signal.SIGINT, signal.SIGTERM):
        report, bake = tmp_path / f"{number}.json", tmp_path / f"bake{number}"
        command = [sys.executable, "tools/headless.py", "bake", "--scene", str(scene), *QUICK]
        command += ["--frames", "1", "5000", "--output", str(bake), "--report", str(report)]
        log = tmp_path / "log"
        with open(log, "w") as file:
            process = subprocess.Popen(
                command, cwd=REPOSITORY, stdout=file, stderr=file, env=os.environ
            )
            end = time.monotonic() + TIMEOUT_S
            while "baking: 0/5000" not in log.read_text() and "baking: 1" not in log.read_text():
                assert time.monotonic() < end and process.poll() is None, log.read_text()
                time.sleep(0.05)
            process.send_signal(number)
            assert process.wait(TIMEOUT_S) == 128 + number, log.read_text()
        assert json.loads(report.read_text())["status"] == "interrupted"
        left = [file for file in tmp_path.iterdir() if file.name.startswith((bake.name, "."))]
        assert left == [], "something half-written remains"


def test_an_operator_that_is_interrupted_is_not_said_to_fail(
    extension: None,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def execute(_self: Any, _context: Any) -> set[str]:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(1.0)
        return {"FINISHED"}

    monkeypatch.setattr(bpy.types.HAIRLOOM_OT_sample_scene, "execute", execute)
    report = tmp_path / "report.json"
    arguments = ["run", "sample_scene", "--output", str(tmp_path / "a.blend")]
    assert command_line.run([*arguments, "--report", str(report)]) == 128 + signal.SIGTERM
    assert capsys.readouterr().err.endswith("hairloom: interrupted (SIGTERM)\n")
    assert json.loads(report.read_text())["status"] == "interrupted"


def test_signals_are_as_before_afterwards() -> None:
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(interruption.Interrupted) as caught, interruption.interruptible():
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(1.0)
    assert caught.value.exit_code == 130
    assert signal.getsignal(signal.SIGINT) is before
    with interruption.interruptible():
        interruption.raise_if_interrupted()  # the earlier signal is forgotten
