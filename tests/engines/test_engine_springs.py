"""Springs in Godot, with the add-on of docs/engines, and in a browser, with the module, move as our
own do."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from extension_loader import REPOSITORY

pytest.importorskip("bpy", reason="writing cards needs Blender or the bpy module")

from test_card_motion import FRAMES, RATE, head_matrix, motion, write  # noqa: F401
from test_springs import simulated_springs
from three_springs import MODULE, head_matrices, to_z_up

from hairloom.addon.blender.bakes.guide_motion import GuideMotion
from hairloom.addon.cards.spring_bones import STEP_RATE, resampled_to_steps
from hairloom.addon.exchange.cards.glb_file import GlbFile
from hairloom.addon.exchange.cards.glb_skin import add_head_bone

HERE = Path(__file__).parent
ENGINES = REPOSITORY / "docs" / "engines"
#: in the repository: the engines run in a sandbox that sees nothing else
OUTPUT = REPOSITORY / "out" / "engines" / "springs"
PROJECT = OUTPUT / "godot"
#: tolerance as a fraction of the hair's length: Godot computes in single precision
MAX_ERROR = 1.0e-3


@pytest.fixture(scope="module")
def springs(motion: GuideMotion) -> dict[str, Any]:  # noqa: F811
    """Writes an asset and the head's motion; the sidecar's entry on the springs, with our positions
    of all joints in each step, in world space."""
    shutil.rmtree(OUTPUT, ignore_errors=True)
    glb = OUTPUT / "asset" / "hair.glb"
    glb.parent.mkdir(parents=True)
    entry = dict(write(glb, motion, kind="springs", spring_joints=40).motion)
    carrier = resampled_to_steps(np.stack([head_matrix(motion, n) for n in range(FRAMES)]), RATE)
    (OUTPUT / "poses.json").write_text(json.dumps({"matrices": head_matrices(carrier)}))
    ours = simulated_springs(entry, glb, carrier)
    ours = ours.reshape(len(ours), -1, 3)
    world = np.einsum("fab,fjb->fja", carrier[:, :3, :3], ours) + carrier[:, None, :3, 3]
    return entry | {"world": world}


def copied(kind: str, folder: Path) -> None:
    """Copy the files for an engine: its program, the asset and the head's motion."""
    shutil.copytree(HERE / kind, folder)
    shutil.copytree(OUTPUT / "asset", folder / "asset")
    shutil.copy2(OUTPUT / "poses.json", folder)


def check(springs: dict[str, Any], frames: list[dict[str, list[float]]]) -> None:
    names = [name for spring in springs["springs"] for name in spring["joints"]]
    world = np.array([[frame[name] for name in names] for frame in frames])
    off = np.linalg.norm(to_z_up(world) - springs["world"], axis=-1)
    assert off.max() < MAX_ERROR * springs["error"]["hair_length"]


@pytest.fixture(scope="module")
def project(springs: dict[str, Any], sandbox: str) -> Path:
    copied("godot_springs", PROJECT)
    shutil.copytree(ENGINES / "godot", PROJECT / "addons" / "hairloom")
    return PROJECT


@pytest.mark.parametrize("is_imported", [False, True])
def test_godot_moves_springs_as_we_do(
    springs: dict[str, Any], project: Path, sandbox: str, is_imported: bool
) -> None:
    """With a file that no editor has imported, and with one that the add-on has imported as a
    scene."""
    if is_imported:
        run_godot(sandbox, "--path", str(project), "--import")
        (project / "asset" / "hair.glb").unlink()
    rate, written = str(int(STEP_RATE)), project / f"imported_{is_imported}.json"
    run_godot(sandbox, "--fixed-fps", rate, "--path", str(project), "--", str(written))
    found = json.loads(written.read_text(encoding="utf-8"))
    assert found["springs"] == springs["chains"]
    assert found["collisions"] == len(springs["colliders"]) > 0
    check(springs, found["frames"])


def run_godot(sandbox: str, *options: str) -> None:
    command = [sandbox, "run", "godot", "--headless", *options]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300)
    output = result.stdout + result.stderr
    assert result.returncode == 0 and "ERROR" not in output and "WARNING" not in output, output


def rigged(glb: Path) -> None:
    """Put the hair below a character's bone, as for a rigged head; joints stay in place."""
    file = GlbFile.of(glb.read_bytes(), str(glb))
    bone = np.eye(4)
    bone[:3] = [[1.0, 0.0, 0.0, 0.1], [0.0, 0.0, -1.0, 0.2], [0.0, 1.0, 0.0, 1.4]]
    names = [node["name"] for node in file.content["nodes"]]
    add_head_bone(file, names.index("hair_root"), "head", bone)
    glb.write_bytes(file.data())


@pytest.mark.parametrize("is_rigged", [False, True])
def test_our_module_passes_springs_to_three_vrm(
    springs: dict[str, Any], sandbox: str, is_rigged: bool
) -> None:
    if not MODULE.is_dir():
        pytest.skip("three-vrm-springbone is missing: `make setup` installs it")
    site = OUTPUT / f"web_{is_rigged}"
    copied("three_springs", site)
    if is_rigged:
        rigged(site / "asset" / "hair.glb")
    shutil.copytree(ENGINES / "three", site / "hairloom")
    shutil.copytree(MODULE.parents[1] / "three", site / "three")
    shutil.copytree(MODULE / "lib", site / "springs")
    shutil.copy2(REPOSITORY / "tools" / "draw_page.py", site)
    command = [sandbox, "run", "python3", str(site / "draw_page.py")]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    found = json.loads((site / "joints.json").read_text(encoding="utf-8"))
    assert found["warnings"] == []
    assert found["isWhole"]  # a copy is bound to its own joints
    assert not found["hasSprings"]  # which the original's springs do not move
    check(springs, found["frames"])
