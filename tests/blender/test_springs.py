"""Springs: what a GLB holds, moved by three-vrm, which knows nothing of us."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from glb_files import VALIDATOR_FOLDER, node_program, to_blender, validated
from glb_player import Player
from test_card_motion import FRAMES, RATE, head_matrix, motion, off, simulated, write  # noqa: F401

bpy = pytest.importorskip("bpy", reason="writing cards needs Blender or the bpy module")

from hairloom.addon.blender.bakes.guide_motion import GuideMotion  # noqa: E402
from hairloom.addon.blender.cards.files import WrittenCards  # noqa: E402
from hairloom.addon.cards.joint_solve import skinned  # noqa: E402
from hairloom.addon.cards.joints import Skin, joint_moves  # noqa: E402
from hairloom.addon.cards.spring_bones import STEP_RATE, at_frames, stepped, turns_to  # noqa: E402
from hairloom.addon.errors import HairloomError  # noqa: E402
from hairloom.addon.exchange.cards.card_formats import GLB  # noqa: E402

THREE_SPRINGS = Path(__file__).parent / "three_springs.mjs"
JOINTS = 40


@pytest.fixture(scope="module")
def springs(
    motion: GuideMotion,  # noqa: F811
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[Path, WrittenCards]:
    path = tmp_path_factory.mktemp("springs") / "hair.glb"
    return path, write(path, motion, kind="springs", spring_joints=JOINTS)


def test_khronos_validator_finds_no_fault(springs: tuple[Path, WrittenCards]) -> None:
    report = validated(springs[0])
    assert report["issues"]["numErrors"] == 0, report
    grave = [each for each in report["issues"]["messages"] if each["severity"] <= 1]
    assert {each["code"] for each in grave} <= {"NODE_SKINNED_MESH_NON_ROOT"}, report
    assert report["info"]["animationCount"] == 0


def by_three(path: Path, carrier: np.ndarray, folder: Path) -> dict[str, Any]:
    """Where three-vrm has the joints in each step, in the world, Z up."""
    if not (VALIDATOR_FOLDER / "node_modules" / "@pixiv" / "three-vrm-springbone").is_dir():
        pytest.skip("three-vrm-springbone is missing: `make setup` installs it")
    axes = np.eye(4)
    axes[:3, :3] = GLB.placed(np.eye(3)).T
    poses = folder / "poses.json"
    matrices = (axes @ carrier @ axes.T).swapaxes(1, 2).reshape(-1, 16)
    poses.write_text(json.dumps({"step": 1.0 / STEP_RATE, "matrices": matrices.tolist()}))
    command = [node_program(), THREE_SPRINGS, VALIDATOR_FOLDER, path, poses]
    result = subprocess.run(
        [str(each) for each in command], capture_output=True, text=True, timeout=120
    )
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout)


@pytest.fixture(scope="module")
def moved_by_three(
    motion: GuideMotion,  # noqa: F811
    springs: tuple[Path, WrittenCards],
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[dict[str, Any], np.ndarray, np.ndarray]:
    """What it says, where joints are in the space of the head, and the head, in each step."""
    carrier = stepped(np.stack([head_matrix(motion, frame) for frame in range(FRAMES)]), RATE)
    told = by_three(springs[0], carrier, tmp_path_factory.mktemp("three"))
    world = to_blender(np.array(told["frames"]))
    local = np.einsum("fab,fja->fjb", carrier[:, :3, :3], world - carrier[:, None, :3, 3])
    return told, local, carrier


def test_three_vrm_moves_it_as_our_own_springs_do(
    springs: tuple[Path, WrittenCards],
    moved_by_three: tuple[dict[str, Any], np.ndarray, np.ndarray],
) -> None:
    """From the numbers in the file alone, through the head's shake; and it does move."""
    told, local, carrier = moved_by_three
    motion_told = springs[1].motion
    assert motion_told["joints"] == len(told["names"]) <= JOINTS
    assert told["springs"] == motion_told["chains"] * (motion_told["joints_in_chain"] - 1)
    ours = sprung_as_told(motion_told, springs[0], carrier)
    theirs = local[:, 1:].reshape(ours.shape)
    length = motion_told["error"]["hair_length"]
    assert np.abs(theirs - ours).max() < 1e-3 * length
    assert np.linalg.norm(theirs - theirs[0], axis=-1).max() > 0.1 * length


def sprung_as_told(told: dict[str, Any], path: Path, carrier: np.ndarray) -> np.ndarray:
    from hairloom.addon.cards.spring_bones import Balls, SpringChains, SpringValues, sprung

    rest = rest_of(path, told)
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


def rest_of(path: Path, told: dict[str, Any]) -> np.ndarray:
    """(chains, joints, 4, 4) Z up, by the file's inverse bind matrices."""
    player = Player(path)
    (skin,) = player.json["skins"]
    columns = player.file.accessor(skin["inverseBindMatrices"]).astype(np.float64)
    matrices = np.linalg.inv(columns.reshape(-1, 4, 4).swapaxes(1, 2))
    axes = np.eye(4)
    axes[:3, :3] = GLB.placed(np.eye(3)).T
    rest = axes.T @ matrices @ axes
    return rest[1:].reshape(told["chains"], told["joints_in_chain"], 4, 4)


def test_what_three_vrm_moves_is_near_the_bake(
    motion: GuideMotion,  # noqa: F811
    springs: tuple[Path, WrittenCards],
    moved_by_three: tuple[dict[str, Any], np.ndarray, np.ndarray],
) -> None:
    """With the weights in the file, all levels; and as far as is said."""
    path, written = springs
    _, local, _ = moved_by_three
    told, rest = written.motion, rest_of(path, written.motion)
    places = at_frames(local[:, 1:].reshape(len(local), *rest.shape[:2], 3), FRAMES, RATE)
    turns = turns_to(rest, places).transpose(1, 2, 0, 3, 4)
    turn, shift = joint_moves(rest, turns, places.transpose(1, 2, 0, 3))
    still = np.tile(np.eye(3), (1, FRAMES, 1, 1))
    turn, shift = np.concatenate([still, turn]), np.concatenate([np.zeros_like(shift[:1]), shift])
    played, player = [], Player(path)
    for node in (each for each in player.json["nodes"] if "mesh" in each):
        (primitive,) = player.json["meshes"][node["mesh"]]["primitives"]
        read = {name: player.file.accessor(n) for name, n in primitive["attributes"].items()}
        skin = Skin(read["JOINTS_0"].astype(int), read["WEIGHTS_0"].astype(np.float64))
        points = skinned(to_blender(read["POSITION"]).astype(np.float64), skin, turn, shift)
        index = player.file.accessor(primitive["indices"]).reshape(-1, 3)
        played.append(points[index])
    wrong, rigid = [], []
    for frame in range(FRAMES):
        back = head_matrix(motion, frame)
        expected = [
            (each - back[:3, 3]) @ back[:3, :3] for each in simulated(motion, written, frame)
        ]
        wrong.append(off([each[..., frame, :] for each in played], expected))
        rigid.append(off([each.positions[each.triangles] for each in written.levels], expected))
    length = told["error"]["hair_length"]
    p99 = np.quantile(wrong, 0.99)
    assert p99 < 0.1 * length
    assert p99 < 0.5 * np.quantile(rigid, 0.99)
    assert p99 == pytest.approx(told["error"]["percentile_99"], rel=0.2)  # corners count twice


def test_springs_are_for_glb(motion: GuideMotion, tmp_path: Path) -> None:  # noqa: F811
    with pytest.raises(HairloomError, match="springs are written to GLB"):
        write(tmp_path / "hair.fbx", motion, kind="springs")


def test_the_sidecar_says_what_the_file_does(springs: tuple[Path, WrittenCards]) -> None:
    schema = pytest.importorskip("jsonschema")
    path, written = springs
    sidecar = json.loads(path.with_name("hair.hairloom.json").read_text("utf-8"))
    root = Path(__file__).parents[2]
    schema.validate(sidecar, json.loads((root / "docs" / "sidecar.schema.json").read_text()))
    extension = Player(path).json["extensions"]["VRMC_springBone"]
    nodes = Player(path).json["nodes"]
    assert extension["specVersion"] == "1.0"
    for told, spring in zip(sidecar["motion"]["springs"], extension["springs"], strict=True):
        assert told["joints"] == [nodes[each["node"]]["name"] for each in spring["joints"]]
        assert told["stiffness"] == [each["stiffness"] for each in spring["joints"][:-1]]
    shapes = [each["shape"] for each in extension["colliders"]]
    assert shapes == sidecar["motion"]["colliders"]
    assert written.motion["step_rate"] == 60.0
