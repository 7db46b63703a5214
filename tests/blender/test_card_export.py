"""Hair cards as FBX, USD and OBJ, read back by independent readers: ufbx and usd-core."""

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
from full_disk import full_disk
from guide_cards import build_cards

from hairloom.addon.cards.card_mesh import CardMesh
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.cards.card_formats import FBX, GLB, OBJ, USD, CardFormat, format_of
from hairloom.addon.exchange.cards.glb_file import GlbFile
from hairloom.addon.exchange.files.axes import from_z_up
from hairloom.addon.exchange.files.file_set import atomic_file_set
from hairloom.addon.exchange.usd.usd_levels import add_level_variants

bpy = pytest.importorskip("bpy", reason="Blender's exporters need Blender or the bpy module")

from hairloom.addon.blender.cards import exporters  # noqa: E402
from hairloom.addon.blender.cards.exporters import (  # noqa: E402
    CardLook,
    check_exporter,
    write_card_mesh,
)

MESH_VIEW = Path(__file__).parent / "mesh_view.py"
NAME, NODE = "Haar/Ä.001", "Haar_Ä_001"
LOOK = CardLook(base="hair_base.png", alpha="hair_alpha.png")

needs_ufbx = pytest.mark.skipif(
    importlib.util.find_spec("ufbx") is None, reason="ufbx is missing: `make setup` installs it"
)


def shuffled_cards(segments: int, seed: int) -> CardMesh:
    """Cards around a circle, their triangles in an order that no exporter would choose."""
    random = np.random.default_rng(seed)
    angle = random.uniform(0.0, 2.0 * np.pi, 20)
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(20)], axis=-1)
    fall = np.linspace([0.0, 0.0, 0.1], [0.0, 0.0, -0.1], 8)
    guides = out[:, None] * 0.1 + fall + random.uniform(-0.01, 0.01, (20, 1, 3))
    settings = CardSettings(segment_count=segments)
    mesh = build_cards(guides.astype(np.float32), out.astype(np.float32), settings)
    shuffle = random.permutation(len(mesh.triangles))
    mesh = replace(mesh, triangles=mesh.triangles[shuffle], card=mesh.card[shuffle])
    return mesh.with_occlusion(random.random(len(mesh.positions)))


@pytest.fixture(scope="module")
def levels() -> list[CardMesh]:
    return [shuffled_cards(6, 0), shuffled_cards(3, 1)]


def written(
    folder: Path,
    levels: list[CardMesh],
    file_format: CardFormat,
    *,
    portable: bool = True,
    suffix: str = "",
) -> Path:
    path = folder / f"hair{suffix or file_format.suffixes[0]}"
    with atomic_file_set(path) as staging:
        write_card_mesh(
            staging / path.name, levels, file_format, LOOK, name=NAME, portable=portable
        )
    return path


def read_by_ufbx(path: Path, folder: Path) -> dict[str, Any]:
    result = folder / "read.json"
    subprocess.run([sys.executable, MESH_VIEW, str(path), str(result)], check=True, timeout=120)
    return json.loads(result.read_text(encoding="utf-8"))


def at_corners(values: np.ndarray, mesh: CardMesh) -> np.ndarray:
    """The values at each corner of each triangle, in order, (corners, width)."""
    return values[mesh.triangles.ravel()]


def across(mesh: CardMesh) -> np.ndarray:
    return np.cross(mesh.tangent, mesh.normal)


@needs_ufbx
def test_fbx_keeps_order_attributes_and_levels(levels: list[CardMesh], tmp_path: Path) -> None:
    read = read_by_ufbx(written(tmp_path, levels, FBX), tmp_path)
    assert read["nodes"] == {NODE: "LodGroup", f"{NODE}_LOD0": "Mesh", f"{NODE}_LOD1": "Mesh"}
    for number, mesh in enumerate(levels):
        got = read["meshes"][f"{NODE}_LOD{number}"]
        assert set(got["sizes"]) == {3} and got["vertices"] == len(mesh.positions)
        place = at_corners(from_z_up(mesh.positions, "Y") * 100.0, mesh)
        np.testing.assert_allclose(got["position"], place, atol=1e-4)
        np.testing.assert_allclose(got["uv"][0], at_corners(mesh.uv, mesh), atol=1e-6)
        openness = np.stack([mesh.occlusion, mesh.along], axis=1)
        np.testing.assert_allclose(got["uv"][1], at_corners(openness, mesh), atol=1e-6)
        normal = at_corners(from_z_up(mesh.normal, "Y"), mesh)
        np.testing.assert_allclose(got["normal"], normal, atol=2e-4)
        side = at_corners(from_z_up(across(mesh), "Y"), mesh)
        assert (np.array(got["tangent"][0]) * side).sum(axis=1).min() > 0.9


def mirrored(levels: list[CardMesh]) -> list[CardMesh]:
    """Levels whose cards an artist has mirrored: u is reversed, strands and faces are unchanged."""
    return [replace(mesh, uv=np.abs([1.0, 0.0] - mesh.uv).astype(np.float32)) for mesh in levels]


@pytest.mark.parametrize("is_mirrored", [False, True])
def test_glb_stores_the_direction_of_strands(
    levels: list[CardMesh], tmp_path: Path, is_mirrored: bool
) -> None:
    """The sidecar's formula gives the strands' direction, also for mirrored UVs."""
    assert "TANGENT.w * cross(NORMAL, TANGENT.xyz)" in GLB.attributes["TANGENT"]
    path = written(tmp_path, mirrored(levels) if is_mirrored else levels, GLB)
    file = GlbFile.of(path.read_bytes(), str(path))
    for number, mesh in enumerate(levels):
        node = file.content["nodes"][file.node(f"{NODE}_LOD{number}")]
        (part,) = file.content["meshes"][node["mesh"]]["primitives"]
        corners = np.asarray(file.values(part["indices"])).ravel().astype(int)
        normal, tangent = (
            np.asarray(file.values(part["attributes"][name]))[corners]
            for name in ("NORMAL", "TANGENT")
        )
        assert set(np.sign(tangent[:, 3])) == {-1.0 if is_mirrored else 1.0}
        along = tangent[:, 3:] * np.cross(normal, tangent[:, :3])
        ours = at_corners(from_z_up(mesh.tangent, "Y"), mesh)
        assert (along * ours).sum(axis=1).min() > 0.9


@needs_ufbx
@pytest.mark.parametrize("is_mirrored", [False, True])
def test_fbx_stores_the_direction_of_strands(
    levels: list[CardMesh], tmp_path: Path, is_mirrored: bool
) -> None:
    assert "root to tip" in FBX.attributes["LayerElementBinormal 0"]
    path = written(tmp_path, mirrored(levels) if is_mirrored else levels, FBX)
    read = read_by_ufbx(path, tmp_path)
    for number, mesh in enumerate(levels):
        along = np.array(read["meshes"][f"{NODE}_LOD{number}"]["bitangent"][0])
        ours = at_corners(from_z_up(mesh.tangent, "Y"), mesh)
        assert (along * ours).sum(axis=1).min() > 0.9


@needs_ufbx
def test_fbx_is_in_centimetres_with_y_up_and_no_object_is_scaled_or_turned(
    levels: list[CardMesh], tmp_path: Path
) -> None:
    path = written(tmp_path, levels, FBX)
    read = read_by_ufbx(path, tmp_path)
    positive_y = 2
    assert (read["up"], read["unit_meters"]) == (positive_y, 0.01)
    assert np.array(read["scales"]) == pytest.approx(1.0)
    assert np.array(read["turns"]) == pytest.approx(np.tile([0, 0, 0, 1], (len(read["turns"]), 1)))
    textures = {"DiffuseColor": "hair_base.png", "TransparencyFactor": "hair_alpha.png"}
    assert read["textures"] == textures
    # FBX also stores absolute paths: they must point to the final folder, not the temporary one
    assert str(tmp_path / "hair_base.png").encode() in path.read_bytes()


@needs_ufbx
def test_obj_keeps_order_and_attributes(levels: list[CardMesh], tmp_path: Path) -> None:
    read = read_by_ufbx(written(tmp_path, levels, OBJ), tmp_path)
    for number, mesh in enumerate(levels):
        got = read["meshes"][f"{NODE}_LOD{number}"]
        assert set(got["sizes"]) == {3}
        place = at_corners(from_z_up(mesh.positions, "Y"), mesh)
        np.testing.assert_allclose(got["position"], place, atol=1e-6)
        np.testing.assert_allclose(got["uv"][0], at_corners(mesh.uv, mesh), atol=1e-6)
        openness = at_corners(np.stack([mesh.occlusion, mesh.along], axis=1), mesh)
        # OBJ stores four digits, and Blender's table approximates the sRGB curve
        np.testing.assert_allclose(np.array(got["color"][0])[:, :2], openness, atol=3e-4)
        normal = at_corners(from_z_up(mesh.normal, "Y"), mesh)
        np.testing.assert_allclose(got["normal"], normal, atol=2e-4)


def test_obj_and_its_materials_name_each_other_and_no_folder(
    levels: list[CardMesh], tmp_path: Path
) -> None:
    path = written(tmp_path, levels, OBJ)
    assert "mtllib hair.mtl\n" in path.read_text(encoding="utf-8")
    lines = (tmp_path / "hair.mtl").read_text(encoding="utf-8").splitlines()
    assert {"map_Kd hair_base.png", "map_d hair_alpha.png", f"newmtl {NODE}"} <= set(lines)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["hair.mtl", "hair.obj"]


@pytest.mark.parametrize("suffix", [".usda", ".usdc"])
def test_usd_keeps_order_attributes_and_levels(
    levels: list[CardMesh], tmp_path: Path, suffix: str
) -> None:
    usd = pytest.importorskip("pxr.Usd", reason="usd-core is missing: `make setup` installs it")
    geometry = importlib.import_module("pxr.UsdGeom")
    path = written(tmp_path, levels, USD, portable=False, suffix=suffix)
    stage = usd.Stage.Open(str(path))
    assert geometry.GetStageUpAxis(stage) == "Z"
    assert geometry.GetStageMetersPerUnit(stage) == 1.0
    for number, mesh in enumerate(levels):
        node = f"{NODE}_LOD{number}"
        got = geometry.Mesh(stage.GetPrimAtPath(f"/{NODE}/{node}/{node}"))
        assert set(got.GetFaceVertexCountsAttr().Get()) == {3}
        indices = np.array(got.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
        np.testing.assert_array_equal(indices, mesh.triangles)
        np.testing.assert_array_equal(np.array(got.GetPointsAttr().Get()), mesh.positions)
        primvars = geometry.PrimvarsAPI(got)

        def flat(name: str, primvars: Any = primvars) -> np.ndarray:
            return np.array(primvars.GetPrimvar(name).ComputeFlattened())

        np.testing.assert_allclose(flat("st"), at_corners(mesh.uv, mesh), atol=1e-6)
        openness = np.stack([mesh.occlusion, mesh.along], axis=1)
        np.testing.assert_allclose(flat("st1"), at_corners(openness, mesh), atol=1e-6)
        np.testing.assert_allclose(flat("_AO"), mesh.occlusion, atol=1e-6)
        np.testing.assert_allclose(flat("tangents"), across(mesh), atol=1e-6)
        normals = np.array(got.GetNormalsAttr().Get())
        np.testing.assert_allclose(normals, at_corners(mesh.normal, mesh), atol=2e-4)
        transform = geometry.XformCache().GetLocalToWorldTransform(got.GetPrim())
        np.testing.assert_allclose(np.array(transform), np.eye(4), atol=1e-7)
    files = [
        attribute.Get().path
        for prim in stage.Traverse()
        for attribute in prim.GetAttributes()
        if attribute.GetName() == "inputs:file"
    ]
    assert sorted(files) == ["hair_alpha.png", "hair_base.png"]
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("suffix", [".usda", ".usdc"])
def test_a_full_disk_during_usd_levels_is_reported(
    levels: list[CardMesh], tmp_path: Path, suffix: str
) -> None:
    if not bpy.app.build_options.usd:
        pytest.skip("this Blender was built without USD")
    path = written(tmp_path, levels, USD, suffix=suffix)
    with full_disk(500), pytest.raises(HairloomError, match="this file cannot be written"):
        add_level_variants(path, [f"{NODE}_LOD{number}" for number in range(len(levels))])


def test_the_users_blocks_keep_their_names(levels: list[CardMesh], tmp_path: Path) -> None:
    """Blocks in the scene keep the names that the export needs; the file has them too."""
    mesh = bpy.data.meshes.new(f"{NODE}_LOD0")
    obj = bpy.data.objects.new(f"{NODE}_LOD0", mesh)
    bpy.context.scene.collection.objects.link(obj)
    material = bpy.data.materials.new(NODE)
    path = written(tmp_path, levels, OBJ)
    assert (mesh.name, obj.name, material.name) == (f"{NODE}_LOD0", f"{NODE}_LOD0", NODE)
    lines = path.read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if line.startswith("o ")] == [
        f"o {NODE}_LOD0",
        f"o {NODE}_LOD1",
    ]


@pytest.mark.parametrize("file_format", [GLB, FBX, USD, OBJ], ids=lambda each: each.name)
def test_nothing_is_left_in_the_scene(
    levels: list[CardMesh], tmp_path: Path, file_format: CardFormat
) -> None:
    if file_format is USD and not bpy.app.build_options.usd:
        pytest.skip("this Blender was built without USD")
    kinds = [p.identifier for p in bpy.data.bl_rna.properties if p.type == "COLLECTION"]

    def counts() -> dict[str, int]:
        return {kind: len(getattr(bpy.data, kind)) for kind in kinds}

    before, scene = counts(), bpy.context.window.scene
    written(tmp_path, levels, file_format)
    assert counts() == before
    assert bpy.context.window.scene == scene


@pytest.mark.parametrize("file_format", [FBX, USD, OBJ], ids=lambda each: each.name)
def test_a_missing_exporter_is_reported_and_nothing_is_written(
    levels: list[CardMesh],
    tmp_path: Path,
    file_format: CardFormat,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Such as in a Blender that was built without this exporter."""
    monkeypatch.setitem(
        exporters._OPERATORS, file_format.name, lambda: bpy.ops.wm.hairloom_no_such_export
    )
    with pytest.raises(HairloomError, match="exporter of"):
        check_exporter(file_format, "hair")
    with pytest.raises(HairloomError, match="exporter of"):
        written(tmp_path, levels, file_format)
    assert list(tmp_path.iterdir()) == []


def test_the_suffix_chooses_the_format_and_is_added_if_missing() -> None:
    assert format_of(Path("a/hair.v1.FBX")) == (Path("a/hair.v1.FBX"), FBX)
    assert format_of(Path("hair.usda"), "usd") == (Path("hair.usda"), USD)
    assert format_of(Path("hair.v1"), "obj") == (Path("hair.v1.obj"), OBJ)
    for path, name in (("hair.stl", None), ("hair", None), ("hair.glb", "fbx")):
        with pytest.raises(HairloomError, match=r"Use \.") as caught:
            format_of(Path(path), name)
        assert caught.value.place == path
