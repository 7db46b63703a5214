"""Springs: what a GLB holds, moved by three-vrm, which knows nothing of us."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from glb_files import to_blender, validated
from glb_player import Player
from test_card_motion import FRAMES, RATE, head_matrix, motion, off, simulated, write  # noqa: F401
from three_springs import MODULE, MovedByThree, moved_by_three, rest_of

bpy = pytest.importorskip("bpy", reason="writing cards needs Blender or the bpy module")

from hairloom.addon.blender.bakes.guide_motion import GuideMotion  # noqa: E402
from hairloom.addon.blender.cards.files import WrittenCards  # noqa: E402
from hairloom.addon.cards.spring_bones import (  # noqa: E402
    Balls,
    SpringChains,
    SpringValues,
    sprung,
)
from hairloom.addon.errors import HairloomError  # noqa: E402

ROOT = Path(__file__).parents[2]
JOINTS = 40


@pytest.fixture(scope="module")
def springs(
    motion: GuideMotion,  # noqa: F811
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[Path, WrittenCards]:
    path = tmp_path_factory.mktemp("springs") / "hair.glb"
    return path, write(path, motion, kind="springs", spring_joints=JOINTS)


@pytest.fixture(scope="module")
def moved(
    motion: GuideMotion,  # noqa: F811
    springs: tuple[Path, WrittenCards],
) -> MovedByThree:
    """Through the head's shake."""
    if not MODULE.is_dir():
        pytest.skip("three-vrm-springbone is missing: `make setup` installs it")
    head = np.stack([head_matrix(motion, frame) for frame in range(FRAMES)])
    return moved_by_three(springs[0], head, RATE, springs[1].motion["chains"])


def test_khronos_validator_finds_no_fault(springs: tuple[Path, WrittenCards]) -> None:
    report = validated(springs[0])
    assert report["issues"]["numErrors"] == 0, report
    grave = [each for each in report["issues"]["messages"] if each["severity"] <= 1]
    assert {each["code"] for each in grave} <= {"NODE_SKINNED_MESH_NON_ROOT"}, report
    assert report["info"]["animationCount"] == 0


def test_three_vrm_moves_it_as_our_own_springs_do(
    springs: tuple[Path, WrittenCards], moved: MovedByThree
) -> None:
    """From the numbers in the sidecar; and it does move."""
    told = springs[1].motion
    assert told["joints"] == 1 + told["chains"] * told["joints_in_chain"] <= JOINTS
    assert moved.spring_count == told["chains"] * (told["joints_in_chain"] - 1)
    ours = sprung_as_told(told, springs[0], moved.carrier)
    length = told["error"]["hair_length"]
    assert np.abs(moved.places - ours).max() < 1e-3 * length
    assert np.linalg.norm(ours - ours[0], axis=-1).max() > 0.1 * length


def sprung_as_told(told: dict[str, Any], path: Path, carrier: np.ndarray) -> np.ndarray:
    """By the numbers that the sidecar has."""
    rest = rest_of(path).reshape(told["chains"], -1, 4, 4)
    shapes = [each["sphere"] for each in told["colliders"]]
    root = to_blender(np.array(told["root_place"]))
    centers = to_blender(np.array([each["offset"] for each in shapes])) + root
    balls = Balls.of(centers, np.array([each["radius"] for each in shapes]))
    hits = np.zeros((len(rest), len(shapes)), bool)
    for number, spring in enumerate(told["springs"]):
        hits[number, spring["colliders"]] = True
    names = ("stiffness", "drag", "gravity", "hit_radius")
    values = [np.array([each[name] for each in told["springs"]]) for name in names]
    return sprung(SpringChains(rest, balls, hits), SpringValues(*values), carrier)


def test_what_three_vrm_moves_is_near_the_bake(
    motion: GuideMotion,  # noqa: F811
    springs: tuple[Path, WrittenCards],
    moved: MovedByThree,
) -> None:
    """With the weights in the file, all levels; and as far as is said."""
    written = springs[1]
    levels, wrong, rigid = moved.levels(FRAMES, RATE), [], []
    for frame in range(FRAMES):
        back = head_matrix(motion, frame)
        expected = [
            (each - back[:3, 3]) @ back[:3, :3] for each in simulated(motion, written, frame)
        ]
        wrong.append(off([each[..., frame, :] for each in levels], expected))
        rigid.append(off([each.positions[each.triangles] for each in written.levels], expected))
    told = written.motion["error"]
    p99 = np.quantile(wrong, 0.99)
    assert p99 < 0.1 * told["hair_length"]
    assert p99 < 0.5 * np.quantile(rigid, 0.99)
    assert p99 == pytest.approx(told["percentile_99"], rel=0.2)  # corners count twice


def test_springs_are_for_glb(motion: GuideMotion, tmp_path: Path) -> None:  # noqa: F811
    with pytest.raises(HairloomError, match="springs are written to GLB"):
        write(tmp_path / "hair.fbx", motion, kind="springs")


def test_the_sidecar_says_what_the_file_does(springs: tuple[Path, WrittenCards]) -> None:
    schema = pytest.importorskip("jsonschema")
    path, written = springs
    sidecar = json.loads(path.with_name("hair.hairloom.json").read_text("utf-8"))
    schema.validate(sidecar, json.loads((ROOT / "docs" / "sidecar.schema.json").read_text()))
    extension = Player(path).json["extensions"]["VRMC_springBone"]
    nodes = Player(path).json["nodes"]
    assert extension["specVersion"] == "1.0"
    for told, spring in zip(sidecar["motion"]["springs"], extension["springs"], strict=True):
        assert told["joints"] == [nodes[each["node"]]["name"] for each in spring["joints"]]
        assert told["stiffness"] == [each["stiffness"] for each in spring["joints"][:-1]]
    shapes = [each["shape"] for each in extension["colliders"]]
    assert shapes == sidecar["motion"]["colliders"]
    assert written.motion["step_rate"] == 60.0
