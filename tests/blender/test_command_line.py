"""The command line as a farm calls it: exit codes, messages, no incomplete files."""

from __future__ import annotations

import json
import re
import struct
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy", reason="the command line runs inside Blender")

import bpy

from hairloom.addon.blender.bakes.cache import Cache
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.scene.curves import write_curves
from hairloom.addon.exchange.tressfx import read_tfx, write_tfx
from hairloom.addon.strands import StrandSet

HEAD_OBJ = """
v -0.1 -0.1 0.0
v 0.1 -0.1 0.0
v 0.1 0.1 0.0
v -0.1 0.1 0.0
v 0.0 0.0 0.15
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vt 0.5 0.5
f 4/4 3/3 2/2 1/1
f 1/1 2/2 5/5
f 2/2 3/3 5/5
f 3/3 4/4 5/5
f 4/4 1/1 5/5
"""
#: verbs run with the extension enabled
pytestmark = pytest.mark.usefixtures("extension")

#: of the files that verbs write; the other verbs write folders
SUFFIXES = {"export": ".tfx", "cards": ".glb", "render": ".png"}
SMALL = ["--set", "guides.guide_count=20", "--set", "guides.cv_count=8"]


def hair_on_pyramid(strand_count: int = 60, cv_count: int = 8) -> StrandSet:
    """Straight hair on the pyramid of HEAD_OBJ, as importing that OBJ (Y up) places it."""
    random = np.random.default_rng(5)
    root = random.uniform(-0.05, 0.05, (strand_count, 3)) * [1.0, 0.0, 1.0] + [0.0, -0.075, 0.0]
    along = np.linspace(0.0, 0.1, cv_count)[None, :, None] * np.array([0.3, -1.0, 0.2])
    points = (root[:, None] + along).astype(np.float32)
    return StrandSet(
        points.reshape(-1, 3),
        np.arange(strand_count + 1) * cv_count,
        np.full(strand_count * cv_count, 4e-5),
        np.zeros(strand_count),
    )


@pytest.fixture
def head(tmp_path: Path) -> Path:
    path = tmp_path / "head.obj"
    path.write_text(HEAD_OBJ)
    return path


@pytest.fixture
def groom(tmp_path: Path) -> Path:
    path = tmp_path / "hair.tfx"
    write_tfx(path, hair_on_pyramid())
    return path


def tfx_bytes(positions: np.ndarray, version: float = 4.0) -> bytes:
    """A TressFX v4 file, made without our writer, by the format's table; positions (s, v, 3)."""
    strands, vertices = positions.shape[:2]
    header = struct.pack("<f8I", version, strands, vertices, 160, 0, 0, 0, 0, 0).ljust(160, b"\0")
    block = np.ones((strands, vertices, 4), "<f4")
    block[..., :3] = positions
    return header + block.tobytes()


STRAIGHT = np.linspace([0, 0, 0.15], [0, 0, 0.25], 8)[None]
BAD_GROOMS = {
    "truncated": tfx_bytes(np.repeat(STRAIGHT, 9, axis=0))[:700],
    "wrong version": tfx_bytes(STRAIGHT, version=2.0),
    "garbage": bytes(np.random.default_rng(1).integers(0, 256, 4000, dtype=np.uint8)),
    "empty": b"",
    "no strands": tfx_bytes(np.zeros((0, 8, 3))),
    "one-point strands": tfx_bytes(STRAIGHT[:, :1]),
    "only NaN": tfx_bytes(np.full((5, 8, 3), np.nan)),
    "another scale": tfx_bytes(np.repeat(STRAIGHT, 30, axis=0) * 100.0),
}


@pytest.mark.parametrize("kind", BAD_GROOMS)
@pytest.mark.parametrize("verb", ["simulate", "render", "cards", "export", "demo"])
def test_a_bad_groom_gets_a_message_and_leaves_nothing(
    verb: str, kind: str, head: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bad = tmp_path / "bad.tfx"
    bad.write_bytes(BAD_GROOMS[kind])
    output = tmp_path / "made" / f"result{SUFFIXES.get(verb, '')}"
    arguments = [verb, "--groom", str(bad), "--head", str(head), "--output", str(output)]
    blocks = data_blocks()

    assert command_line.run(arguments) == 1

    message = capfd.readouterr().err
    assert message.startswith("hairloom: ") and str(bad) in message
    assert message.count(". ") >= 1, f"no remedy in: {message}"
    assert "Traceback" not in message
    assert not output.exists() and not output.parent.exists()
    assert data_blocks() == blocks


def data_blocks() -> dict[str, int]:
    names = ("objects", "meshes", "materials", "images", "scenes", "hair_curves")
    return {name: len(getattr(bpy.data, name)) for name in names}


def test_another_scale_names_the_factor(
    head: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    big = tmp_path / "big.tfx"
    strands = hair_on_pyramid()
    write_tfx(big, strands.with_points(strands.points * 100.0))
    arguments = ["export", "--groom", str(big), "--head", str(head)]
    assert command_line.run([*arguments, "--output", str(tmp_path / "out.tfx")]) == 1
    assert "0.01" in capfd.readouterr().err
    scaled = [*arguments, "--groom-scale", "0.01", "--output", str(tmp_path / "out.tfx")]
    assert command_line.run(scaled) == 0


@pytest.mark.parametrize("verb", ["simulate", "render", "cards", "export"])
def test_a_head_without_uvs_is_refused_when_strict(
    verb: str, groom: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bare = tmp_path / "bare.obj"
    lines = [line for line in HEAD_OBJ.splitlines() if not line.startswith("vt")]
    faces = [" ".join(word.split("/")[0] for word in line.split(" ")) for line in lines]
    bare.write_text("\n".join(faces))
    arguments = [verb, "--groom", str(groom), "--head", str(bare), "--strict", *SMALL]
    output = tmp_path / f"result{SUFFIXES.get(verb, '')}"
    assert command_line.run([*arguments, "--output", str(output)]) == 1
    message = capfd.readouterr().err
    assert str(bare) in message and "UV" in message and "--strict" in message
    assert not output.exists()


def test_a_head_without_uvs_warns_once(
    groom: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bare = tmp_path / "bare.obj"
    bare.write_text("\n".join(x for x in HEAD_OBJ.replace("/", " /").splitlines() if x[:2] == "v "))
    with open(bare, "a") as file:
        file.write("\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n")
    arguments = ["export", "--groom", str(groom), "--head", str(bare), *SMALL]
    assert command_line.run([*arguments, "--output", str(tmp_path / "out.tfx")]) == 0
    assert capfd.readouterr().out.count("no UVs") == 1


@pytest.mark.parametrize(
    ("option", "value", "named"),
    [
        ("--head", "nowhere.obj", "nowhere.obj"),
        ("--head", "no such object", "no such object"),
        ("--head", "notes.txt", "notes.txt"),
        ("--groom", "nowhere.tfx", "nowhere.tfx"),
        ("--set", "dynamics.nonsense=1", "nonsense"),
        ("--set", "guides.guide_count=many", "guide_count"),
        ("--set", "nonsense", "--set"),
    ],
)
def test_a_wrong_name_is_named(
    option: str,
    value: str,
    named: str,
    groom: Path,
    head: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    arguments = ["cards", "--groom", str(groom), "--head", str(head), option, value]
    assert command_line.run([*arguments, "--output", str(tmp_path / "out.glb")]) == 1
    assert named in capfd.readouterr().err
    assert not (tmp_path / "out.glb").exists()


def test_wrong_usage_exits_with_2() -> None:
    assert command_line.run(["paint"]) == 2
    assert command_line.run(["render"]) == 2
    assert command_line.run(["render", "--help"]) == 0


def test_single_bad_strands_are_counted_or_refused(
    head: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    positions = np.repeat(STRAIGHT, 30, axis=0) + np.random.default_rng(2).normal(
        0.0, 0.01, (30, 1, 3)
    )
    positions[4, 3] = np.nan
    spoiled = tmp_path / "spoiled.tfx"
    spoiled.write_bytes(tfx_bytes(positions))
    report = tmp_path / "report.json"
    arguments = ["export", "--groom", str(spoiled), "--head", str(head), *SMALL]
    arguments += ["--output", str(tmp_path / "out.tfx"), "--report", str(report)]
    assert command_line.run(arguments) == 0
    assert json.loads(report.read_text())["dropped"] == {"a point that is not finite": 1}
    (tmp_path / "out.tfx").unlink()
    assert command_line.run([*arguments, "--strict"]) == 1
    assert "not finite" in capfd.readouterr().err
    assert not (tmp_path / "out.tfx").exists()


def test_hair_grows_where_and_as_long_as_the_groups_say(
    sphere: bpy.types.Object, head: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    place = np.array([vertex.co[:] for vertex in sphere.data.vertices])
    for name, value in (("Right", place[:, 0] > 0.0), ("Half", np.full(len(place), 0.5))):
        group = sphere.vertex_groups.new(name=name)
        for weight in np.unique(value):
            chosen = np.flatnonzero(value == weight).tolist()
            group.add(chosen, float(weight), "REPLACE")
    arguments = ["export", "--set", "grow.method=normals", "--set", "grow.length=0.1"]
    arguments += [
        "--set",
        "grow.length_variation=0",
        "--set",
        "children.method=none",
        "--set",
        "grow.strand_count=200",
    ]
    arguments += ["--output", str(tmp_path / "hair.tfx")]
    groups = ["--density-group", "Right", "--length-group", "Half"]
    assert command_line.run([*arguments, "--head", sphere.name, *groups]) == 0
    strands = read_tfx(tmp_path / "hair.tfx", up="Y").strands
    spacing = np.ptp(np.unique(place[:, 0])) / 8
    assert strands.strand_count == 200 and (strands.roots[:, 0] > -spacing).all()
    np.testing.assert_allclose(strands.lengths(), 0.05, rtol=1e-3)

    capfd.readouterr()
    assert command_line.run([*arguments, "--head", sphere.name, "--length-group", "Left"]) == 1
    assert "Left" in capfd.readouterr().err
    assert command_line.run([*arguments, "--head", str(head), *groups]) == 1
    assert "vertex groups" in capfd.readouterr().err


def test_simulate_render_and_export_agree_on_the_motion(
    groom: Path,
    head: Path,
    tmp_path: Path,
    gpu_context: object,
    capfd: pytest.CaptureFixture[str],
) -> None:
    # a software driver takes long to compile the shader that moves hair
    numpy = ("--set", "dynamics.device=numpy")
    source = ["--groom", str(groom), "--head", str(head), *SMALL, *numpy]
    bake = tmp_path / "hair"
    shake = ["--seconds", "0.2", "--output", str(bake)]
    assert command_line.run(["simulate", *source, *shake]) == 0
    guides = guides_of(bake)
    assert guides.shape == (13, 20, 8, 3)
    assert np.abs(guides[-1] - guides[0]).max() > 1e-3, "nothing moved"
    picture = tmp_path / "still.png"
    drawn = ["--bake", str(bake), "--frame", "12", "--width", "64", "--height", "48"]
    assert command_line.run(["render", *source, *drawn, "--output", str(picture)]) == 0
    idle = "--set guides.guide_count, guides.cv_count, dynamics.device: the bake keeps the settings"
    output = capfd.readouterr().out
    samples = re.findall(r"drawing the still: (\d+)/(\d+)", output)
    assert idle in output and samples[0][0] == "0" and samples[-1] == (samples[0][1],) * 2
    image = bpy.data.images.load(str(picture))
    pixels = np.array(image.pixels[:]).reshape(48, 64, 4)
    bpy.data.images.remove(image)
    assert np.ptp(pixels[..., :3]) > 0.2, "the picture is empty"
    # a bake has its own head; the built-in one is not used
    alone = tmp_path / "alone.png"
    assert command_line.run(["render", *drawn, "--output", str(alone)]) == 0 and alone.exists()
    assert "the bake keeps" not in capfd.readouterr().out
    wrong = ["--bake", str(bake), "--frame", "13", "--output", str(tmp_path / "none.png")]
    assert command_line.run(["render", *source, *wrong]) == 1
    assert not (tmp_path / "none.png").exists()


def test_the_demo_writes_everything_the_report_names(tmp_path: Path, gpu_context: object) -> None:
    """A small demo on the built-in head and groom."""
    small = [
        "--set",
        "children.method=none",
        "--set",
        "grow.strand_count=300",
        "--set",
        "guides.guide_count=40",
    ]
    small += ["--set", "atlas.size=512", "--set", "card_occlusion.rays=16"]
    # a software driver takes a minute to compile the shader that moves hair
    small += ["--set", "dynamics.device=numpy", "--set", "guides.cv_count=8"]
    small += ["--set", "cards.order_by=distance", "--set", "skin.skin_resolution=128"]
    size = ["--width", "96", "--height", "72", "--samples", "1", "--seconds", "0.05"]
    assert command_line.run(["demo", *small, *size, "--output", str(tmp_path)]) == 0
    report = json.loads((tmp_path / "report.json").read_text())
    for name in report["outputs"]:
        assert (tmp_path / name).stat().st_size > 0
    # a quarter as many brow hairs as strands, and a tenth as many lashes
    assert report["strands"] == 300 + 75 + 30 and report["guides"] == 40
    assert report["children"] == 0 and "found from the groom" in report["widths"]
    assert {"still.png", "close_up.png", "motion.png", "cards.png"} <= set(report["outputs"])
    assert report["stretch_max_percent"] < 1.0
    assert report["strands_stretch_max_percent"] < 0.2
    assert report["backend"] and report["renderer"]
    assert re.fullmatch(r"\d+\.\d+\.\d+", report["hairloom"])
    assert {"read inputs", "simulate frame", "draw still", "build cards"} <= set(
        report["stages_ms"]
    )


@pytest.fixture
def walking_head(extension: None) -> bpy.types.Object:
    """A tetrahedron that moves 0.5 m along x from frame 1 to 5; the current frame is 3."""
    scene = bpy.context.scene
    mesh = bpy.data.meshes.new("Walking")
    corners = [(-1, -1, 0), (1, -1, 0), (0, 1, 0), (0, 0, -1)]
    mesh.from_pydata(corners, [], [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)])
    mesh.uv_layers.new(name="UVMap")
    head = bpy.data.objects.new("Walking head", mesh)
    scene.collection.objects.link(head)
    head.keyframe_insert("location", frame=1)
    head.location.x = 0.5
    head.keyframe_insert("location", frame=5)
    scene.frame_start, scene.frame_end = 1, 5
    scene.frame_set(3)
    return head


def standing_hair() -> StrandSet:
    """25 strands on top of the tetrahedron at frame 3."""
    random = np.random.default_rng(3)
    roots = random.uniform(-0.2, 0.2, (25, 1, 3)) * [1, 1, 0] + [0.25, 0, 0]
    points = (roots + np.linspace([0, 0, 0.0], [0, 0, 0.3], 8)).astype(np.float32)
    return StrandSet(points.reshape(-1, 3), np.arange(26) * 8, np.full(200, 4e-5), np.zeros(25))


def test_the_scene_moves_the_head(tmp_path: Path, walking_head: bpy.types.Object) -> None:
    """With --animated, hair follows the head's animation; the current frame is unchanged."""
    write_curves("Walking hair", standing_hair(), walking_head, bpy.context.scene.collection)
    bake = tmp_path / "bake"
    arguments = ["simulate", "--groom", "Walking hair", "--animated", *SMALL]
    assert command_line.run([*arguments, "--output", str(bake)]) == 0
    assert bpy.context.scene.frame_current == 3
    root = guides_of(bake)[:, :, 0]
    assert Cache(bake).facts.frame_rate == 24.0
    way = np.tile([0.5, 0.0, 0.0], (20, 1))
    np.testing.assert_allclose(root[-1] - root[0], way, atol=1e-5)
    assert abs(root[0, :, 0].mean()) < 0.2, "frame 1 begins where the head is in frame 1"


def guides_of(folder: Path) -> np.ndarray:
    """The guides in all frames of a bake, (frame_count, guide_count, cv_count, 3)."""
    bake = Cache(folder)
    frames = range(bake.facts.first, bake.facts.last + 1)
    return np.stack([bake.frame(frame)["guides"] for frame in frames])
