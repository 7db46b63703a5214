"""Cards in motion: exported files against the simulation, played by our readers and by others."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from glb_files import Glb, validator_report
from glb_player import Player
from shaken import ComputedMotion, shaken_poses
from test_card_page import asset_of
from tiers import few_in_commits

bpy = pytest.importorskip("bpy", reason="writing cards needs Blender or the bpy module")

from hairloom.addon import motion_flow, rig_flow  # noqa: E402
from hairloom.addon.blender.bakes.guide_motion import GuideMotion  # noqa: E402
from hairloom.addon.blender.cards.build import CardInputs, build_steps  # noqa: E402
from hairloom.addon.blender.cards.files import CardOutput, WrittenCards, write_cards  # noqa: E402
from hairloom.addon.blender.command_line.inputs import Sources, read_inputs  # noqa: E402
from hairloom.addon.card_flow import bound_cards, cards_at  # noqa: E402
from hairloom.addon.cards.atlas_settings import AtlasSettings  # noqa: E402
from hairloom.addon.cards.edits import CardEdits, find_edits, piece_prints  # noqa: E402
from hairloom.addon.cards.export_settings import CardExportSettings  # noqa: E402
from hairloom.addon.cards.settings import CardSettings  # noqa: E402
from hairloom.addon.cards.steps import result_of  # noqa: E402
from hairloom.addon.errors import HairloomError  # noqa: E402
from hairloom.addon.exchange.cards.card_formats import FBX, GLB, USD  # noqa: E402
from hairloom.addon.groom.settings import GrowSettings, GuideSettings  # noqa: E402
from hairloom.addon.params import SettingsMap  # noqa: E402
from hairloom.addon.rig_flow import Pose, Rig  # noqa: E402
from hairloom.addon.shading.texture_settings import TextureSettings  # noqa: E402
from hairloom.addon.strands import Surface  # noqa: E402
from hairloom.addon.strands.arc_length import typical_length  # noqa: E402

FRAMES, RATE = 31, 30.0
PANDA_MOTION = Path(__file__).parent / "panda_motion.py"
SETTINGS = SettingsMap(
    CardSettings(source="guides", levels=2, order_by="distance"),
    AtlasSettings(source="made"),
    TextureSettings(variant_width=32, height=64),
)


@pytest.fixture(scope="module")
def motion() -> GuideMotion:
    """Hair on a shaking head. Guides lag behind the head, and each swings with its own phase."""
    grown = read_inputs(Sources(), GrowSettings(strand_count=400, length=0.12))
    scalp = grown.strands.take(np.flatnonzero(grown.strands.group == 0))
    rig = rig_flow.prepare(scalp, grown.head, GuideSettings(guide_count=60), place="x")
    poses = shaken_poses(rig, FRAMES, RATE)
    carried = [motion_flow.carried_guides(rig, pose) for pose in poses]
    along = np.linspace(0.0, 1.0, carried[0].shape[1])[:, None] ** 2

    def frame_state(frame: int) -> tuple[Pose, np.ndarray]:
        before = carried[max(frame - 3, 0)]
        phase = np.arange(len(rig.guides))[:, None, None] * 0.1 + frame * 0.3
        wave = 0.006 * np.sin(phase) * along * min(frame / 5.0, 1.0)
        return poses[frame], (carried[frame] * (1 - along) + before * along + wave).astype("f4")

    return ComputedMotion(rig, range(FRAMES), RATE, frame_state)


def write(path: Path, motion: GuideMotion, kind: str, **more: Any) -> WrittenCards:
    output = CardOutput(settings=CardExportSettings(motion=kind, **more))
    return write_cards(path, CardInputs(motion.rig, SETTINGS), output, motion=motion)


def test_the_first_view_of_a_page_holds_all_places_that_hair_is_carried_to(
    motion: GuideMotion, tmp_path: Path
) -> None:
    low, high = {}, {}
    for space in ("head", "world"):
        path = tmp_path / space / "hair.glb"
        path.parent.mkdir()
        write(path, motion, kind="joints", motion_space=space, page=True, page_texture="512")
        corners = np.array(asset_of(path.with_suffix(".html"))["corners"])
        low[space], high[space] = corners.min(axis=0), corners.max(axis=0)
    roots = np.concatenate([motion.at(frame)[1][:, 0] for frame in motion.frames])
    way = np.ptp(GLB.to_file_space(roots), axis=0) - np.ptp(
        GLB.to_file_space(motion.at(0)[1][:, 0]), axis=0
    )
    assert way.max() > 0.02, "the head moves [m]"
    wider = (high["world"] - low["world"]) - (high["head"] - low["head"])
    assert (wider > 0.9 * way).all()
    assert (low["world"] < GLB.to_file_space(roots).min(axis=0) + 0.005).all()
    assert (high["world"] > GLB.to_file_space(roots).max(axis=0) - 0.005).all()


def simulated(motion: GuideMotion, written: WrittenCards, frame: int) -> list[np.ndarray]:
    """The corners of all triangles of each level, world space, (triangle_count, 3, 3) each."""
    rig: Rig = motion.rig
    corners = []
    for level in written.levels:
        mesh = cards_at(rig, bound_cards(rig, level), *motion.at(frame))
        corners.append(mesh.positions[mesh.triangles])
    return corners


def head_matrix(motion: GuideMotion, frame: int) -> np.ndarray:
    """The matrix of the head, which moves rigidly."""
    return motion.at(frame)[0].matrix


@pytest.fixture(scope="module")
def joints(
    motion: GuideMotion, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, WrittenCards]:
    path = tmp_path_factory.mktemp("joints") / "hair.glb"
    return path, write(path, motion, kind="joints", chains=40)


def off(found: list[np.ndarray], expected: list[np.ndarray]) -> np.ndarray:
    return np.concatenate(
        [np.linalg.norm(a - b, axis=-1).ravel() for a, b in zip(found, expected, strict=True)]
    )


def test_skinned_cards_are_the_simulated_ones(
    motion: GuideMotion, joints: tuple[Path, WrittenCards]
) -> None:
    """Skinned corners, with the head's motion added, are within 1 % of the hair's length (RMS) of
    the simulated ones in all levels; the motion itself is over five times larger."""
    path, written = joints
    player, entry = Player(path), written.motion
    assert entry["joints_in_chain"] <= 16
    wrong, moved = [], []
    for frame in range(FRAMES):
        back = head_matrix(motion, frame)
        played = [each @ back[:3, :3].T + back[:3, 3] for each in player.corners(frame / RATE)]
        wrong.append(off(played, simulated(motion, written, frame)))
        moved.append(off(player.corners(frame / RATE), player.corners(0.0)))
    assert off(player.corners(0.0), simulated(motion, written, 0)).max() < 1e-3
    rms = np.sqrt(np.mean(np.square(wrong)))
    length = entry["error"]["hair_length"]
    steps = np.diff(motion.rig.guide_grid, axis=1)
    assert length == typical_length(np.linalg.norm(steps, axis=2).sum(axis=1))
    assert rms < 0.01 * length
    # within 20 %, because vertices count once for each corner here
    assert rms == pytest.approx(entry["error"]["root_mean_square"], rel=0.2)
    assert np.sqrt(np.mean(np.square(moved))) > 5.0 * rms


@pytest.mark.slow
def test_the_root_joint_moves_with_the_head_on_request(motion: GuideMotion, tmp_path: Path) -> None:
    path = tmp_path / "hair.glb"
    written = write(path, motion, kind="joints", motion_space="world", chains=40)
    player = Player(path)
    wrong = [off(player.corners(f / RATE), simulated(motion, written, f)) for f in range(FRAMES)]
    assert np.sqrt(np.mean(np.square(wrong))) < 0.01 * written.motion["error"]["hair_length"]


def test_khronos_validator_finds_no_fault(joints: tuple[Path, WrittenCards]) -> None:
    report = validator_report(joints[0])
    assert report["issues"]["numErrors"] == 0, report
    # as in Blender's own files, the skinned meshes have a parent node, which does not move
    warning = 1
    grave = [each for each in report["issues"]["messages"] if each["severity"] <= warning]
    codes = {message["code"] for message in grave}
    assert codes <= {"NODE_SKINNED_MESH_NON_ROOT"}, report
    assert report["info"]["animationCount"] == 1


def test_weights_are_four_of_sum_one_and_levels_share_the_joints(
    joints: tuple[Path, WrittenCards],
) -> None:
    player = Player(joints[0])
    assert len(player.json["skins"]) == 1
    meshes = [node for node in player.json["nodes"] if "mesh" in node]
    assert [node["skin"] for node in meshes] == [0, 0]
    for node in meshes:
        (primitive,) = player.json["meshes"][node["mesh"]]["primitives"]
        weight = player.file.accessor(primitive["attributes"]["WEIGHTS_0"])
        assert weight.shape[1] == 4
        np.testing.assert_allclose(weight.sum(axis=1), 1.0, atol=1e-6)
    names = [player.json["nodes"][n]["name"] for n in player.json["skins"][0]["joints"]]
    assert names[:3] == ["hair_root", "chain_00_joint_00", "chain_00_joint_01"]
    assert len(set(names)) == len(names)


def test_panda3d_plays_the_same(
    motion: GuideMotion, joints: tuple[Path, WrittenCards], tmp_path: Path
) -> None:
    """Panda3D's own skinning and timing agree with our player to 1.5 mm."""
    for module in ("panda3d", "gltf"):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"{module} is missing: `make setup` installs it")
    path, written = joints
    output = tmp_path / "bounds.json"
    frames = [4, 12, 20, 28]  # Panda3D's reader shows frame 1 for frame 0
    command = [sys.executable, str(PANDA_MOTION), str(path), str(output), str(RATE)]
    command += [str(frame) for frame in frames]
    result = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert result.returncode == 0, result.stderr
    bounds = np.array(json.loads(output.read_text()))
    for frame, (low, high) in zip(frames, bounds, strict=True):
        played = Player(path).vertices(frame / RATE)
        expected = np.percentile(played, (1, 99), axis=0)
        np.testing.assert_allclose([low, high], expected, atol=1.5e-3)
    assert np.abs(bounds[1:] - bounds[0]).max() > 0.003
    assert written.motion["frames"]["count"] == FRAMES


@pytest.mark.parametrize("depth", few_in_commits(["half", "float"]))
def test_a_motion_texture_holds_the_simulated_cards(
    motion: GuideMotion, tmp_path: Path, depth: str
) -> None:
    """Decoded as a vertex shader would, from the GLB's texels, the sidecar and the EXR."""
    library = pytest.importorskip("OpenImageIO")
    path = tmp_path / "hair.glb"
    written = write(path, motion, kind="texture", motion_space="world", motion_depth=depth)
    entry = json.loads((tmp_path / "hair.hairloom.json").read_text("utf-8"))["motion"]
    pictures = {}
    for name, texture in entry["textures"].items():
        image = library.ImageBuf(str(tmp_path / texture["file"]))
        assert str(image.spec().format) == depth
        pictures[name] = image.get_pixels(library.FLOAT)[..., :3]
        assert pictures[name].shape[:2] == (entry["height"], entry["width"])
    file = Glb(path)
    worst = 0.0
    for level, mesh in enumerate(file.json["meshes"]):
        (primitive,) = mesh["primitives"]
        index = file.accessor(primitive["indices"]).reshape(-1)
        rest = file.accessor(primitive["attributes"]["POSITION"])[index]
        texel = file.accessor(primitive["attributes"]["TEXCOORD_2"])[index].astype(np.float64)
        for frame in (0, 7, FRAMES - 1):
            v = texel[:, 1] + frame * entry["frame_step"]
            row, column = (
                (v * entry["height"]).astype(int),
                (texel[:, 0] * entry["width"]).astype(int),
            )
            moved = rest + pictures["position"][row, column]
            mesh_now = cards_at(
                motion.rig,
                bound_cards(motion.rig, written.levels[level]),
                *motion.at(frame),
            )
            corners = mesh_now.triangles.reshape(-1)
            miss = np.abs(moved - GLB.to_file_space(mesh_now.positions[corners]))
            worst = max(worst, float(miss.max()))
            for name in ("normal", "tangent"):
                expected = GLB.to_file_space(getattr(mesh_now, name)[corners])
                np.testing.assert_allclose(pictures[name][row, column], expected, atol=6e-4)
    # half floats have 11 significant bits; offsets here are below 12.5 cm
    assert worst < (0.125 * 2.0**-11 + 1e-6 if depth == "half" else 1e-6)
    error = entry["error"]
    assert error["root_mean_square"] <= error["percentile_99"] <= error["worst"]
    # the stored error is in 3D, over all frames; `worst` is along one axis, over three frames
    assert worst - 1e-6 <= error["worst"] <= 2.0 * worst if depth == "half" else not error["worst"]


@pytest.mark.slow(instead="test_a_motion_texture_holds_the_simulated_cards")
@pytest.mark.parametrize("file_format", few_in_commits([USD, FBX]))
def test_motion_texture_is_written_in_all_formats(
    motion: GuideMotion, tmp_path: Path, file_format: Any
) -> None:
    path = tmp_path / f"hair{file_format.suffixes[0]}"
    if file_format is USD and not bpy.app.build_options.usd:
        pytest.skip("this Blender was built without USD")
    written = write(path, motion, kind="texture")
    assert written.motion["frame_step"] < 0.0
    assert written.motion["texel"] in ("LayerElementUV 2", "primvars:st2")
    assert (tmp_path / "hair_motion_position.exr").is_file()


def test_impossible_motions_are_refused_before_the_work(
    motion: GuideMotion, tmp_path: Path
) -> None:
    with pytest.raises(HairloomError, match="joints are written to GLB"):
        write(tmp_path / "hair.fbx", motion, kind="joints")
    with pytest.raises(HairloomError, match="one frame"):
        write(tmp_path / "hair.glb", replace(motion, frames=range(1)), kind="joints")
    with pytest.raises(HairloomError, match="OBJ"):
        write(tmp_path / "hair.obj", motion, kind="texture")
    assert list(tmp_path.iterdir()) == []


def test_the_sidecar_follows_the_schema(
    motion: GuideMotion, joints: tuple[Path, WrittenCards], tmp_path: Path
) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads((Path(__file__).parents[2] / "docs/sidecar.schema.json").read_text("utf-8"))
    write(tmp_path / "hair.glb", motion, kind="texture")
    for folder in (joints[0].parent, tmp_path):
        content = json.loads((folder / "hair.hairloom.json").read_text("utf-8"))
        jsonschema.Draft202012Validator(schema).validate(content)
        assert "motion" in content
        content["motion"].pop("kind")
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.Draft202012Validator(schema).validate(content)


@pytest.fixture(scope="module")
def card_edits(motion: GuideMotion) -> CardEdits:
    """Edits: one card moved, one deleted, one copied."""
    build = result_of(build_steps(CardInputs(motion.rig, SETTINGS))).build
    mesh, made = build.finest, build.record
    assert made is not None
    surface = Surface(mesh.positions, mesh.triangles, mesh.uv[mesh.triangles])
    record = replace(made, prints=piece_prints(surface, mesh.card))
    positions = mesh.positions.copy()
    positions[mesh.triangles[mesh.card == 3]] += np.float32([0.0, 0.0, 0.01])
    copied = mesh.triangles[mesh.card == 7]
    positions = np.concatenate([positions, mesh.positions + np.float32([0.0, 0.0, 0.02])])
    left = mesh.card != 5
    triangles = np.concatenate([mesh.triangles[left], copied + len(mesh.positions)])
    number = np.concatenate([mesh.card[left], np.full(len(copied), -1)])
    uv = np.concatenate([mesh.uv, mesh.uv])[triangles]
    edits = find_edits(Surface(positions, triangles, uv), number, record, np.eye(4))
    assert (edits.edited_count, edits.deleted_count, edits.added_count) == (1, 1, 1)
    return edits


@pytest.mark.parametrize("kind", few_in_commits(["joints", "texture", "springs"]))
def test_edited_cards_move_too(
    motion: GuideMotion, card_edits: CardEdits, tmp_path: Path, kind: str
) -> None:
    path = tmp_path / "hair.glb"
    inputs = CardInputs(motion.rig, SETTINGS, edits=card_edits)
    output = CardOutput(settings=CardExportSettings(motion=kind, chains=20))
    written = write_cards(path, inputs, output, motion=motion)
    assert written.build.edits == card_edits.counts
    there = set(written.mesh.card.tolist())
    assert 3 in there and 5 not in there and len(there) == 60
    if kind == "joints":
        player = Player(path)
        assert off(player.corners(0.0), simulated(motion, written, 0)).max() < 1e-3
        middle = FRAMES // 2
        back = head_matrix(motion, middle)
        played = [each @ back[:3, :3].T + back[:3, 3] for each in player.corners(middle / RATE)]
        wrong = off(played, simulated(motion, written, middle))
        assert np.sqrt(np.mean(wrong**2)) < 0.02 * written.motion["error"]["hair_length"]


@pytest.mark.alike
@pytest.mark.parametrize("suffix", few_in_commits(["fbx", "usdc", "obj"]))
def test_every_format_has_the_edits(
    motion: GuideMotion, card_edits: CardEdits, tmp_path: Path, suffix: str
) -> None:
    """Blender's importers read as many triangles as the edited cards have."""
    if suffix == "usdc" and not bpy.app.build_options.usd:
        pytest.skip("this Blender was built without USD")
    path = tmp_path / f"hair.{suffix}"
    inputs = CardInputs(motion.rig, SETTINGS, edits=card_edits)
    written = write_cards(path, inputs, CardOutput())
    before = set(bpy.data.meshes)
    importers = {
        "fbx": lambda: bpy.ops.import_scene.fbx(filepath=str(path)),
        "usdc": lambda: bpy.ops.wm.usd_import(filepath=str(path)),
        "obj": lambda: bpy.ops.wm.obj_import(filepath=str(path)),
    }
    importers[suffix]()
    counts = {len(mesh.polygons) for mesh in set(bpy.data.meshes) - before}
    assert len(written.mesh.triangles) in counts
