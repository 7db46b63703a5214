"""Springs in Godot, by the add-on of docs/engines: they move as our own do."""

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
from test_springs import sprung_as_told
from three_springs import head_matrices, to_z_up

from hairloom.addon.blender.bakes.guide_motion import GuideMotion
from hairloom.addon.cards.spring_bones import STEP_RATE, stepped

HERE = Path(__file__).parent
#: the engines run where nothing but the repository is seen
PROJECT = REPOSITORY / "out" / "engines" / "godot_springs"
#: Of the hair's length: Godot reckons in single precision.
MOST_OFF = 1.0e-3


@pytest.fixture(scope="module")
def told(motion: GuideMotion, sandbox: str) -> dict[str, Any]:  # noqa: F811
    """A project with an asset; what its sidecar says of the springs, and beside it the joints in
    each step as we move them, in the world."""
    shutil.rmtree(PROJECT, ignore_errors=True)
    shutil.copytree(HERE / "godot_springs", PROJECT)
    shutil.copytree(REPOSITORY / "docs" / "engines", PROJECT / "addons" / "hairloom")
    glb = PROJECT / "asset" / "hair.glb"
    glb.parent.mkdir()
    told = dict(write(glb, motion, kind="springs", spring_joints=40).motion)
    carrier = stepped(np.stack([head_matrix(motion, n) for n in range(FRAMES)]), RATE)
    (PROJECT / "poses.json").write_text(json.dumps({"matrices": head_matrices(carrier)}))
    ours = sprung_as_told(told, glb, carrier)
    ours = ours.reshape(len(ours), -1, 3)
    world = np.einsum("fab,fjb->fja", carrier[:, :3, :3], ours) + carrier[:, None, :3, 3]
    return told | {"world": world}


@pytest.mark.parametrize("is_imported", [False, True])
def test_godot_moves_springs_as_we_do(
    told: dict[str, Any], sandbox: str, is_imported: bool
) -> None:
    """A file that no editor has imported, and one that the add-on has made a scene of."""
    if is_imported:
        run_godot(sandbox, "--path", str(PROJECT), "--import")
        (PROJECT / "asset" / "hair.glb").unlink()
    rate, written = str(int(STEP_RATE)), PROJECT / f"imported_{is_imported}.json"
    run_godot(sandbox, "--fixed-fps", rate, "--path", str(PROJECT), "--", str(written))
    found = json.loads(written.read_text(encoding="utf-8"))
    assert found["springs"] == told["chains"]
    assert found["collisions"] == len(told["colliders"]) > 0
    names = [name for spring in told["springs"] for name in spring["joints"]]
    world = np.array([[frame[name] for name in names] for frame in found["frames"]])
    off = np.linalg.norm(to_z_up(world) - told["world"], axis=-1)
    assert off.max() < MOST_OFF * told["error"]["hair_length"]


def run_godot(sandbox: str, *options: str) -> None:
    command = [sandbox, "run", "godot", "--headless", *options]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300)
    said = result.stdout + result.stderr
    assert result.returncode == 0 and "ERROR" not in said and "WARNING" not in said, said
