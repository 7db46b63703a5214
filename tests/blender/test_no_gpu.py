"""Without a GPU and a software driver, Blender reports an error and does not crash."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import bpy
import pytest
from tiers import few_in_commits

pytestmark = pytest.mark.skipif(
    not (sys.platform.startswith("linux") and bpy.app.module), reason="hides Linux's drivers"
)

HIDDEN = ("__EGL_VENDOR_LIBRARY_FILENAMES", "VK_DRIVER_FILES", "LIBGL_DRIVERS_PATH")
REFUSAL = "there is neither a GPU nor a software driver here"
ENGINE = """
bpy.context.scene.render.engine = "HAIRLOOM"
try:
    bpy.ops.render.render()
except RuntimeError as error:
    print(error)
"""
VERB = """
from hairloom.addon.blender.command_line import command_line
sys.exit(command_line.run(sys.argv[1:]))
"""
SCRIPT = """
import sys
sys.path.insert(0, {tools!r})
from extension_loader import load_package
import bpy
load_package().register()
{work}
"""
SMALL = ["--width", "64", "--height", "64"]
FEW = [
    f"--set={each}"
    for each in (
        "grow.method=normals",
        "children.method=none",
        "grow.strand_count=40",
        "guides.guide_count=20",
        "cards.card_count=20",
        "cards.levels=1",
        "atlas.size=512",
    )
]


def without_gpu(work: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    script = SCRIPT.format(tools=str(Path(__file__).parents[2] / "tools"), work=work)
    return subprocess.run(
        [sys.executable, "-c", script, *arguments],
        env=os.environ | dict.fromkeys(HIDDEN, "/nowhere"),
        capture_output=True,
        text=True,
    )


@pytest.mark.slow(instead="test_verbs_that_draw_report_a_missing_gpu_and_write_nothing")
def test_the_engine_reports_that_there_is_no_gpu() -> None:
    done = without_gpu(ENGINE)
    assert done.returncode == 0, done.stderr
    assert REFUSAL in done.stdout


@pytest.mark.parametrize(
    "arguments",
    few_in_commits(
        [["self-test"], ["render", *SMALL, *FEW], ["turntable", "--frames", "2", *SMALL, *FEW]]
    ),
    ids=lambda arguments: arguments[0],
)
def test_verbs_that_draw_report_a_missing_gpu_and_write_nothing(
    arguments: list[str], tmp_path: Path
) -> None:
    output = tmp_path / "still.png"
    if arguments[0] != "self-test":
        arguments = [*arguments, "--output", str(output)]
    done = without_gpu(VERB, *arguments)
    assert done.returncode == 1, done.stderr
    assert done.stderr.count("hairloom: ") == 1 and REFUSAL in done.stderr
    assert "Traceback" not in done.stderr and list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_cards_are_made_without_a_gpu(tmp_path: Path) -> None:
    """numpy draws the atlas instead."""
    output = tmp_path / "cards.glb"
    done = without_gpu(VERB, "cards", "--output", str(output), *FEW)
    assert done.returncode == 0, done.stderr
    assert output.is_file() and (tmp_path / "cards.hairloom.json").is_file()
