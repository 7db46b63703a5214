"""The verb `import`, and groom files of all formats in the other verbs."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from hairloom.addon import rig_flow
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.command_line.inputs import Sources, read_inputs
from hairloom.addon.blender.scene.mesh_files import import_mesh_file, read_mesh_file
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.alembic.groom_alembic import write_groom_alembic
from hairloom.addon.exchange.groom import Groom
from hairloom.addon.exchange.hair_file import write_hair_file
from hairloom.addon.exchange.tressfx import write_tfx
from hairloom.addon.exchange.usd.groom_usd import write_usd
from hairloom.addon.groom.settings import GrowSettings, GuideSettings
from hairloom.addon.strands import StrandSet

pytestmark = pytest.mark.usefixtures("extension")

#: a box of 20 x 20 x 20 cm on the ground, as an .obj with Y up
HEAD_OBJ = """
v -0.1 0 -0.1
v 0.1 0 -0.1
v 0.1 0 0.1
v -0.1 0 0.1
v -0.1 0.2 -0.1
v 0.1 0.2 -0.1
v 0.1 0.2 0.1
v -0.1 0.2 0.1
vt 0 0
vt 1 0
vt 1 1
vt 0 1
f 1/1 2/2 3/3 4/4
f 8/1 7/2 6/3 5/4
f 1/1 5/2 6/3 2/4
f 2/1 6/2 7/3 3/4
f 3/1 7/2 8/3 4/4
f 4/1 8/2 5/3 1/4
"""
WRITERS: dict[str, Callable[[Path, Groom], Any]] = {
    ".abc": write_groom_alembic,
    ".usdc": write_usd,
    ".tfx": write_tfx,
    ".hair": write_hair_file,
}
if importlib.util.find_spec("pxr") is None:  # some Linux distributions build Blender without it
    del WRITERS[".usdc"]


def hairdo() -> Groom:
    """Straight hair on top of the box; every fifth strand is a guide."""
    random = np.random.default_rng(5)
    root = random.uniform(-0.09, 0.09, (50, 1, 3)) * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.2]
    points = root + np.linspace(0.0, 0.1, 8)[:, None] * [0.3, 0.1, 1.0]
    strands = StrandSet(
        points.reshape(-1, 3), np.arange(51) * 8, np.full(400, 4e-5), np.arange(50) % 2
    )
    return Groom(strands, is_guide=np.arange(50) % 5 == 0, group_names={0: "left", 1: "right"})


@pytest.fixture
def head(tmp_path: Path) -> Path:
    path = tmp_path / "head.obj"
    path.write_text(HEAD_OBJ)
    return path


def grooms_of(scene: Path) -> dict[str, Any]:
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    return {each.name: each for each in bpy.data.objects if each.type == "CURVES"}


def test_files_of_all_formats_come_into_a_scene_on_a_head_from_a_file(
    tmp_path: Path, head: Path
) -> None:
    files = [tmp_path / f"from_{suffix[1:]}{suffix}" for suffix in WRITERS]
    for file in files:
        WRITERS[file.suffix](file, hairdo())
    scene, report = tmp_path / "made" / "scene.blend", tmp_path / "report.json"
    arguments = ["import", *map(str, files), "--head", str(head), "--output", str(scene)]
    arguments += ["--set", "shading.melanin=0.25", "--report", str(report)]

    assert command_line.run(arguments) == 0

    facts = json.loads(report.read_text())
    assert facts["head"] == "head" and facts["status"] == "done" and facts["dropped"] == {}
    assert [each["file"] for each in facts["objects"]] == [file.name for file in files]
    assert [each["strands"] for each in facts["objects"]] == [40] * len(WRITERS)
    assert any("10 guides were left out" in note for note in facts["notes"])
    assert facts["outputs"] == ["scene.blend"] and "import" in facts["stages_ms"]
    grooms = grooms_of(scene)
    assert sorted(grooms) == sorted(file.stem for file in files)
    expected = hairdo().without_guides().strands.points
    for hair in grooms.values():
        assert hair.data.surface == hair.parent == bpy.data.objects["head"]
        assert hair.data.hairloom.shading.melanin == 0.25
        points = np.empty((320, 3), np.float32)
        hair.data.position_data.foreach_get("vector", points.ravel())
        np.testing.assert_allclose(points, expected, atol=1e-6)


def test_settings_that_imported_hair_does_not_have_are_refused(
    tmp_path: Path, head: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_groom_alembic(tmp_path / "hair.abc", hairdo())
    scene = tmp_path / "scene.blend"
    arguments = ["import", str(tmp_path / "hair.abc"), "--head", str(head)]
    arguments += ["--output", str(scene), "--preset", "stage/daylight"]
    assert command_line.run(arguments) == 1
    assert "hair: it has no settings of 'stage'" in capsys.readouterr().err
    assert not scene.exists()


def test_guides_can_be_apart_on_a_head_of_the_scene(tmp_path: Path, sphere: Any) -> None:
    sphere.scale = (1.5, 1.5, 1.0)
    sphere.location.z = 0.1
    write_groom_alembic(tmp_path / "hair.abc", hairdo())
    scene = tmp_path / "scene.blend"
    arguments = ["import", str(tmp_path / "hair.abc"), "--head", "Head", "--guides", "apart"]
    assert command_line.run([*arguments, "--output", str(scene)]) == 0
    counts = {name: len(hair.data.curves) for name, hair in grooms_of(scene).items()}
    assert counts == {"hair": 40, "hair Guides": 10}


@pytest.mark.parametrize(
    ("head", "problem"),
    [
        ("Nobody", "Nobody: this is not a mesh"),
        ("Camera", "Camera: this is not a mesh"),
        ("none.obj", "none.obj: there is no such file"),
    ],
)
def test_an_unusable_head_is_named(
    tmp_path: Path, head: str, problem: str, capfd: pytest.CaptureFixture[str]
) -> None:
    bpy.context.collection.objects.link(
        bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    )
    write_groom_alembic(tmp_path / "hair.abc", hairdo())
    name = str(tmp_path / head) if "." in head else head
    output = tmp_path / "scene.blend"
    arguments = ["import", str(tmp_path / "hair.abc"), "--head", name, "--output", str(output)]
    assert command_line.run(arguments) == 1
    assert problem in capfd.readouterr().err
    assert not output.exists()


def test_missing_materials_of_a_head_are_one_note(tmp_path: Path) -> None:
    head = tmp_path / "head.obj"
    head.write_text(f"mtllib skin.mtl\n{HEAD_OBJ}")
    note = "head.obj: its materials are plain. Missing beside it: skin.mtl"
    assert read_mesh_file(head, need_uv=False)[1] == (note,)
    assert import_mesh_file(head)[1] == (note,)
    (tmp_path / "skin.mtl").write_text("newmtl skin\n")
    assert read_mesh_file(head, need_uv=False)[1] == ()


def test_a_head_of_several_meshes_is_one(tmp_path: Path) -> None:
    """The head has an eye whose UV map has another name; joined, all vertices keep their places."""
    corners = {"head": ((0.0, 0.0, 0.1), 0.2), "eye": ((0.0, -0.1, 0.15), 0.02)}
    for name, (place, size) in corners.items():
        bpy.ops.mesh.primitive_cube_add(size=size, location=place)
        bpy.context.object.name = name
        bpy.context.object.data.uv_layers[0].name = f"UV of {name}"
    head, report = tmp_path / "head.fbx", tmp_path / "report.json"
    bpy.ops.export_scene.fbx(filepath=str(head), object_types={"MESH"})
    for name in corners:
        bpy.data.objects.remove(bpy.data.objects[name])
    write_groom_alembic(tmp_path / "hair.abc", hairdo())
    scene = tmp_path / "scene.blend"
    arguments = ["import", str(tmp_path / "hair.abc"), "--head", str(head)]
    arguments += ["--output", str(scene), "--report", str(report)]
    assert command_line.run(arguments) == 0
    facts = json.loads(report.read_text())
    assert facts["head"] == "head"
    assert "head.fbx: its 2 meshes (eye, head) were joined into head" in facts["notes"]
    (hair,) = grooms_of(scene).values()
    joined = hair.data.surface
    assert joined.name == facts["head"] and len(joined.data.uv_layers) == 1
    y, z = np.array([(joined.matrix_world @ each.co)[1:] for each in joined.data.vertices]).T
    assert (y.min(), y.max()) == pytest.approx((-0.11, 0.1), abs=1e-6)
    assert (z.min(), z.max()) == pytest.approx((0.0, 0.2), abs=1e-6)


def test_one_bad_file_keeps_the_scene_from_being_written(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    write_groom_alembic(tmp_path / "hair.abc", hairdo())
    (tmp_path / "bad.abc").write_bytes(b"no hair in here")
    report, output = tmp_path / "report.json", tmp_path / "scene.blend"
    files = [str(tmp_path / name) for name in ("hair.abc", "bad.abc")]
    arguments = ["import", *files, "--output", str(output), "--report", str(report)]
    assert command_line.run(arguments) == 1
    message = capfd.readouterr().err
    assert "bad.abc: this is not an Alembic file" in message and "Traceback" not in message
    assert not output.exists() and json.loads(report.read_text())["status"] == "failed"


def test_strict_refuses_what_would_be_dropped(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "hair.tfx"
    write_tfx(path, hairdo())
    content = bytearray(path.read_bytes())
    content[160:164] = np.float32(np.nan).tobytes()  # the first point of the first strand
    path.write_bytes(content)
    output = tmp_path / "scene.blend"
    arguments = ["import", str(path), "--output", str(output)]
    assert command_line.run([*arguments, "--strict"]) == 1
    assert "would be dropped: 1 with a point that is not finite. " in capfd.readouterr().err
    assert not output.exists()
    assert command_line.run(arguments) == 0
    assert len(grooms_of(output)["hair"].data.curves) == 39


@pytest.mark.parametrize("suffix", WRITERS)
def test_other_verbs_take_grooms_of_all_formats(tmp_path: Path, head: Path, suffix: str) -> None:
    path = tmp_path / f"hair{suffix}"
    WRITERS[suffix](path, hairdo())
    inputs = read_inputs(Sources(groom=str(path), head=str(head)), GrowSettings())
    expected = hairdo().without_guides().strands.points
    np.testing.assert_allclose(inputs.strands.points, expected, atol=1e-6)
    assert inputs.dropped == {}
    facts = any("10 guides were left out" in note for note in inputs.notes)
    assert facts == (suffix in (".abc", ".usdc"))


def test_axes_and_scale_of_a_groom_are_passed_on(tmp_path: Path, head: Path) -> None:
    """A .tfx has Y up. Read with Z up, its numbers are not converted."""
    write_tfx(tmp_path / "hair.tfx", hairdo())
    sources = Sources(str(tmp_path / "hair.tfx"), str(head), groom_up="Z", groom_scale=2.0)
    x, y, z = hairdo().without_guides().strands.points.T
    points = read_inputs(sources, GrowSettings()).strands.points
    np.testing.assert_allclose(points, np.stack([x, z, -y], axis=1) * 2.0, atol=1e-6)


def test_files_in_centimetres_are_reported_and_both_can_be_scaled(
    tmp_path: Path, head: Path
) -> None:
    """A box of 24 m with hair. The collider is scaled as the head is."""
    large = np.array([line.split()[1:] for line in HEAD_OBJ.splitlines() if line[:2] == "v "])
    vertices = [f"v {' '.join(map(str, row))}" for row in large.astype(float) * 120.0]
    others = [line for line in HEAD_OBJ.splitlines() if line[:2] != "v "]
    path = tmp_path / "large.obj"
    path.write_text("\n".join([*vertices, *others]))
    write_tfx(tmp_path / "hair.tfx", hairdo(), scale=1.0 / 120.0)
    sources = Sources(str(tmp_path / "hair.tfx"), str(path))
    notes = read_inputs(sources, GrowSettings()).notes
    assert any("--groom-scale 0.01 --head-scale 0.01" in note for note in notes)
    scaled = replace(sources, groom_scale=1 / 120, head_scale=1 / 120, collider=str(path))
    inputs = read_inputs(scaled, GrowSettings())
    assert not any("centimetres" in note for note in inputs.notes)
    expected = read_inputs(Sources(str(tmp_path / "hair.tfx"), str(head)), GrowSettings()).head
    assert inputs.head is not None and expected is not None and inputs.collider is not None
    np.testing.assert_allclose(inputs.head.positions, expected.positions, atol=1e-6)
    np.testing.assert_allclose(inputs.collider.positions, expected.positions, atol=1e-6)
    expected_points = hairdo().without_guides().strands.points
    np.testing.assert_allclose(inputs.strands.points, expected_points, atol=1e-5)


@pytest.mark.usefixtures("sphere")
def test_only_heads_of_files_can_be_scaled() -> None:
    for name in ("Head", None):
        with pytest.raises(HairloomError, match="only a head that is read from a file"):
            read_inputs(Sources(None, name, head_scale=0.01), GrowSettings())


def test_hair_beside_its_head_is_reported(tmp_path: Path, head: Path) -> None:
    """Hair 2 cm above a box of 20 cm is near enough to be bound to it: a note, not an error."""
    moved = np.eye(4)
    moved[2, 3] = 0.02
    strands = hairdo().without_guides().strands
    for matrix, is_reported in ((np.eye(4), False), (moved, True)):
        write_tfx(tmp_path / "hair.tfx", Groom(strands.transformed(matrix)))
        sources = Sources(str(tmp_path / "hair.tfx"), str(head))
        inputs = read_inputs(sources, GrowSettings())
        rig = rig_flow.prepare(inputs.strands, inputs.head, GuideSettings(), place="hair.tfx")
        assert any("its roots lie 20 mm from" in note for note in rig.notes) == is_reported


def test_a_name_that_is_neither_an_object_nor_a_file_is_reported(
    tmp_path: Path, head: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    arguments = ["render", "--groom", "Hair.017", "--head", str(head)]
    assert command_line.run([*arguments, "--output", str(tmp_path / "a.png")]) == 1
    assert "Hair.017: this is neither a hair curves object" in capfd.readouterr().err
