"""Hair cards and the files beside them: from the command line, a button and a collection."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from glb_files import Glb, validator_report
from tiers import few_in_commits

from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.cards.card_formats import FORMATS
from hairloom.addon.exchange.textures.card_textures import FORMATS as TEXTURE_FORMATS
from hairloom.addon.exchange.textures.card_textures import WrittenTexture
from hairloom.addon.exchange.textures.texture_packing import PRESETS
from hairloom.addon.shading.card_look import plain_albedo
from hairloom.addon.shading.marschner.look import fibre_of
from hairloom.addon.shading.marschner.pigment import melanin_absorption
from hairloom.addon.shading.marschner.tables import marschner_tables, shape_of
from hairloom.addon.shading.settings import ShadingSettings

bpy = pytest.importorskip("bpy", reason="exporters need Blender or the bpy module")
pytest.importorskip("jsonschema", reason="it is missing: `make setup` installs it")

from card_exports import BAKED_OPTIONS, export_cards, grow_hair, read_sidecar  # noqa: E402

from hairloom.addon.blender.cards import files  # noqa: E402
from hairloom.addon.blender.cards.textures import (  # noqa: E402
    TABLE_SIZE,
    texture_channels,
    texture_roles,
)
from hairloom.addon.ui.operators_card_export import HAIRLOOM_OT_export_cards  # noqa: E402

pytestmark = pytest.mark.usefixtures("extension")


def oiio_pixels(path: Path) -> np.ndarray:
    """All channels as stored, row 0 at the bottom."""
    library = pytest.importorskip("OpenImageIO")
    source = library.ImageInput.open(str(path))
    spec = source.spec()
    pixels = np.asarray(source.read_image(0, 0, 0, spec.nchannels, library.FLOAT), np.float32)
    source.close()
    return pixels.reshape(spec.height, spec.width, spec.nchannels)[::-1]


@pytest.mark.parametrize("suffix", [".glb", ".fbx", ".usda", ".obj"])
def test_every_format_comes_with_a_sidecar_that_follows_the_schema(
    tmp_path: Path, suffix: str
) -> None:
    if suffix == ".usda" and not bpy.app.build_options.usd:
        pytest.skip("this Blender was built without USD")
    assert export_cards(tmp_path / f"hair{suffix}", "--levels", "2") == 0
    content = read_sidecar(tmp_path / f"hair{suffix}")
    assert [level["node"] for level in content["levels"]] == ["hair_LOD0", "hair_LOD1"]
    assert content["levels"][1]["triangles"] < 0.6 * content["levels"][0]["triangles"]
    assert set(content["textures"]) >= {"color", "base", "alpha", "shift", "noise", "tangent"}
    assert "index_buffer" not in content
    for written in tmp_path.iterdir():
        assert not written.name.startswith(".")


def test_the_index_buffer_holds_the_indices_of_the_glb(tmp_path: Path, capfd: Any) -> None:
    """For each level, the buffer has the GLB's indices, then its triangles in back-face order."""
    assert (
        export_cards(tmp_path / "hair.glb", *BAKED_OPTIONS, "--levels", "3", "--index-buffer") == 0
    )
    steps = [line for line in capfd.readouterr().out.splitlines() if line.startswith("building")]
    assert steps[1] == "building hair cards: cards from strands"
    assert "building hair cards: ambient occlusion" in steps and len(set(steps)) == len(steps) > 5
    content, glb = read_sidecar(tmp_path / "hair.glb"), Glb(tmp_path / "hair.glb")
    indices = np.frombuffer((tmp_path / "hair.indices.bin").read_bytes(), "<u2")
    nodes = {node["name"]: node for node in glb.json["nodes"]}
    assert len(content["levels"]) == 3
    for level in content["levels"]:
        (primitive,) = glb.json["meshes"][nodes[level["node"]]["mesh"]]["primitives"]
        expected = glb.accessor(primitive["indices"]).ravel()
        found = indices[level["buffer_first"] :][: level["indices"]]
        np.testing.assert_array_equal(found, expected)
        assert level["indices_adler32"] == zlib.adler32(expected.astype("<u4").tobytes())
        back = indices[level["buffer_back_first"] :][: level["indices"]]
        corners = {tuple(triangle) for triangle in found.reshape(-1, 3).tolist()}
        assert {tuple(triangle) for triangle in back.reshape(-1, 3).tolist()} == corners
        assert not np.array_equal(back, found)
        positions = glb.json["accessors"][primitive["attributes"]["POSITION"]]
        assert positions["count"] == level["vertices"]
        np.testing.assert_allclose(positions["min"], level["bounds"]["minimum"], atol=1e-6)
        np.testing.assert_allclose(positions["max"], level["bounds"]["maximum"], atol=1e-6)


def test_a_baked_atlas_is_packed_as_the_engine_wants_it(tmp_path: Path) -> None:
    assert (
        export_cards(tmp_path / "hair.fbx", *BAKED_OPTIONS, "--packing", "gltf", "--levels", "1")
        == 0
    )
    content = read_sidecar(tmp_path / "hair.fbx")
    color, alpha = (content["textures"][role] for role in ("color", "alpha"))
    assert color["file"] == alpha["file"] == "hair_baseColor.png"
    assert (color["channels"], alpha["channels"]) == ("rgb", "a")
    assert b"hair_baseColor.png" in (tmp_path / "hair.fbx").read_bytes()
    assert (content["atlas"]["columns"], content["atlas"]["rows"]) == (4, 2)


@pytest.mark.parametrize(
    ("packing", "alpha"), [("unreal", "hair_Coverage.png"), ("unreal_compact", "")]
)
def test_only_a_picture_of_alpha_alone_is_linked_as_opacity(
    tmp_path: Path, packing: str, alpha: str
) -> None:
    """Plain importers read opacity as the mean of all channels."""
    assert (
        export_cards(tmp_path / "hair.obj", *BAKED_OPTIONS, "--packing", packing, "--levels", "1")
        == 0
    )
    material = (tmp_path / "hair.mtl").read_text(encoding="utf-8")
    linked = [line.split()[-1] for line in material.splitlines() if line.startswith("map_d")]
    assert linked == [alpha] * bool(alpha)


def test_a_generic_viewer_shows_one_level_in_the_hairs_colour(
    tmp_path: Path,
) -> None:
    path = tmp_path / "hair.glb"
    melanin = (
        "--set",
        "shading.pigment=melanin",
        "--set",
        "shading.melanin=0.5",
        "--set",
        "shading.redness=0.6",
    )
    assert export_cards(path, *melanin, "--levels", "3") == 0
    assert not validator_report(path)["issues"]["numErrors"]
    glb = Glb(path)
    nodes, (scene,) = glb.json["nodes"], glb.json["scenes"]
    waiting, met = list(scene["nodes"]), []
    while waiting:
        node = nodes[waiting.pop()]
        met.append(node["name"])
        waiting += node.get("children", [])
    assert sorted(met) == ["hair", "hair_LOD0"]
    (finest,) = (node for node in nodes if node["name"] == "hair_LOD0")
    others = [nodes[number]["name"] for number in finest["extensions"]["MSFT_lod"]["ids"]]
    assert others == ["hair_LOD1", "hair_LOD2"]
    coverage = finest["extras"]["MSFT_screencoverage"]
    assert len(coverage) == 3 and coverage == sorted(coverage, reverse=True) and coverage[2] == 0
    # the colour of a mass of such hair, by Chiang et al. 2016
    (material,) = glb.json["materials"]
    assert "baseColorFactor" not in material["pbrMetallicRoughness"]
    color = oiio_pixels(tmp_path / "hair_color.png")[..., :3].reshape(-1, 3)
    linear = np.where(color > 0.04045, ((color + 0.055) / 1.055) ** 2.4, color / 12.92)
    power = np.polyval([0.245, 5.574, -10.73, 2.532, -0.215, 5.969], 0.3)
    expected = np.exp(-power * np.sqrt(melanin_absorption(0.5, 0.6)))
    base = oiio_pixels(tmp_path / "hair_base.png")[..., :3].reshape(-1, 3)
    factor = np.where(base > 0.04045, ((base + 0.055) / 1.055) ** 2.4, base / 12.92)
    # `bench engines` judges this fit
    albedo = plain_albedo(expected * factor)
    np.testing.assert_allclose(linear.mean(0), albedo.mean(0), rtol=0.03)


def test_the_occlusion_of_a_vertex_is_what_a_viewer_reads_from_the_ramp(tmp_path: Path) -> None:
    path = tmp_path / "hair.glb"
    assert export_cards(path, "--levels", "1") == 0
    glb = Glb(path)
    (material,) = glb.json["materials"]
    assert material["occlusionTexture"]["texCoord"] == 1
    texture = glb.json["textures"][material["occlusionTexture"]["index"]]
    picture = tmp_path / "ramp.png"
    picture.write_bytes(glb.view(glb.json["images"][texture["source"]]["bufferView"]))
    ramp = oiio_pixels(picture)[0, :, 0]
    (attributes,) = (
        primitive["attributes"] for mesh in glb.json["meshes"] for primitive in mesh["primitives"]
    )
    occlusion = glb.accessor(attributes["TEXCOORD_1"])[:, 0]
    assert occlusion.min() < 0.8 < occlusion.max()
    centers = (np.arange(len(ramp)) + 0.5) / len(ramp)
    read = np.interp(occlusion, centers, ramp)  # linear, clamped
    np.testing.assert_allclose(read, occlusion, atol=0.005)


@pytest.mark.parametrize(
    ("suffix", "textures", "space"), [(".usda", "png", "sRGB"), (".usdc", "exr", None)]
)
def test_usd_shows_one_level_of_many_and_says_how_colours_are_coded(
    tmp_path: Path, suffix: str, textures: str, space: str | None
) -> None:
    if not bpy.app.build_options.usd:
        pytest.skip("this Blender was built without USD")
    usd = pytest.importorskip("pxr.Usd", reason="usd-core is missing: `make setup` installs it")
    path = tmp_path / f"hair{suffix}"
    assert export_cards(path, "--levels", "3", "--textures", textures) == 0
    stage = usd.Stage.Open(str(path))
    spaces = {
        prim.GetAttribute("inputs:file").Get().path: prim.GetAttribute(name).Get()
        for prim in stage.Traverse()
        if prim.HasAttribute(name := "inputs:sourceColorSpace")
    }
    # without this attribute it is "auto": sRGB for eight bits, linear for more
    assert spaces.get(read_sidecar(path)["textures"]["color"]["file"]) == space

    def shown() -> list[str]:
        return [prim.GetName() for prim in stage.Traverse() if prim.GetTypeName() == "Mesh"]

    assert shown() == ["hair_LOD0"]
    variants = stage.GetPrimAtPath("/hair").GetVariantSet("LOD")
    assert variants.GetVariantNames() == ["LOD0", "LOD1", "LOD2"]
    variants.SetVariantSelection("LOD2")
    assert shown() == ["hair_LOD2"]


def test_both_models_give_all_their_values(tmp_path: Path) -> None:
    for model in ("kajiya_kay", "marschner"):
        path = tmp_path / f"{model}.glb"
        assert export_cards(path, "--set", f"shading.model={model}", "--levels", "1") == 0
        material = read_sidecar(path)["material"]
        assert material["model"] == model
        assert set(material["values"]) == set(material["units"]) == set(material["meanings"])
        assert ("primary_shift" in material["values"]) == (model == "kajiya_kay")
        assert ("cuticle_tilt" in material["values"]) == (model == "marschner")
        assert {"base_color", "shift_noise"} <= set(material["values"])
        assert bool(material["tables"]) == bool(material["fibre"]) == (model == "marschner")
    assert material["units"]["cuticle_tilt"] == "rad"
    tables = marschner_tables(shape_of(fibre_of(ShadingSettings())), TABLE_SIZE)
    expected = {"longitudinal": tables.longitudinal[0]}
    expected |= {name: getattr(tables, name) for name in ("azimuthal", "paths")}
    for name, values in expected.items():
        file = tmp_path / material["tables"][name]["file"]
        np.testing.assert_array_equal(oiio_pixels(file), values.astype(np.float32))
        # uncompressed rows: games in Godot read them without a library
        assert values[0, :, 1].astype("<f4").tobytes() in file.read_bytes()


@pytest.mark.parametrize("suffix", few_in_commits([".glb", ".obj"]))
def test_a_failure_in_the_middle_leaves_the_old_files(
    tmp_path: Path,
    suffix: str,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """The disk is full at the last file: all old files are kept."""
    assert export_cards(tmp_path / f"hair{suffix}", "--levels", "1") == 0
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def full(_content: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files, "sidecar_text", full)
    assert (
        export_cards(tmp_path / f"hair{suffix}", "--set", "grow.length=0.2", "--levels", "2") == 1
    )
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    output = capfd.readouterr().err
    assert f"{tmp_path / f'hair{suffix}'}: " in output and "No space left on device" in output


@pytest.mark.slow(instead="test_a_failure_in_the_middle_leaves_the_old_files")
@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="folders have no owners here")
def test_a_folder_that_may_not_be_written_to_keeps_its_files(
    capfd: pytest.CaptureFixture[str],
) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        assert export_cards(folder / "hair.glb", "--levels", "1") == 0
        before = {path.name: path.read_bytes() for path in folder.iterdir()}
        folder.chmod(0o555)
        try:
            with nobody():
                assert export_cards(folder / "hair.glb", "--set", "grow.length=0.2") == 1
        finally:
            folder.chmod(0o755)
        assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    assert "Permission denied" in capfd.readouterr().err


@contextmanager
def small_disk(folder: Path, size: int) -> Iterator[Path]:
    """A mounted disk of this many bytes."""
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={size}", "none", str(folder)]
    if subprocess.run(command, capture_output=True).returncode:
        pytest.skip("nothing can be mounted here")
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.slow(instead="test_a_failure_in_the_middle_leaves_the_old_files")
@pytest.mark.skipif(sys.platform != "linux", reason="disks are mounted as Linux does")
@pytest.mark.parametrize("suffix", few_in_commits([".fbx", ".glb", ".obj", ".usdc"]))
def test_a_disk_that_becomes_full_at_the_mesh_keeps_its_files(
    tmp_path: Path, suffix: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """There is room for all textures and half of the mesh. File names mix two scripts."""
    if suffix == ".usdc" and not bpy.app.build_options.usd:
        pytest.skip("this Blender was built without USD")
    name = f"Zöpfe 头发{suffix}"
    options = ("--textures", "dds", "--levels", "1", *BAKED_OPTIONS, "--set", "atlas.size=256")
    assert export_cards(tmp_path / name, *options) == 0
    assert read_sidecar(tmp_path / name)["file"] == name
    sizes = {path.name: path.stat().st_size for path in tmp_path.iterdir()}
    kept = b"of another day"
    pages = sum(-(-size // 4096) for file, size in sizes.items() if file != name)
    pages += 1 + sizes[name] // 2 // 4096
    with small_disk(tmp_path / "disk", 4096 * pages) as disk:
        (disk / name).write_bytes(kept)
        capfd.readouterr()
        assert export_cards(disk / name, *options) == 1
        assert {path.name: path.read_bytes() for path in disk.iterdir()} == {name: kept}
    output = capfd.readouterr().err
    assert "Traceback" not in output and output.count("cannot be written") == 1
    assert f"{name}: this file cannot be written (No space left on device)" in output


@contextmanager
def nobody() -> Iterator[None]:
    """Drop the rights of root, who may write to any folder."""
    is_root = os.geteuid() == 0
    if is_root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if is_root:
            os.seteuid(0)


@pytest.mark.slow(instead="test_a_failure_in_the_middle_leaves_the_old_files")
@pytest.mark.parametrize("refused", few_in_commits([3, 1]))
def test_a_file_that_cannot_be_replaced_leaves_all_old_files(
    tmp_path: Path, refused: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The third or first move fails, such as where another program has the file open; the new files
    are kept in another folder."""
    assert export_cards(tmp_path / "hair.glb", "--levels", "1") == 0
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    really, moves = os.replace, []

    def replace(source: Path, target: Path) -> None:
        if Path(target).parent == tmp_path and Path(source).parent.parent == tmp_path:
            moves.append(target)
            if len(moves) == refused:
                raise PermissionError(13, "Permission denied")
        really(source, target)

    monkeypatch.setattr(os, "replace", replace)
    assert export_cards(tmp_path / "hair.glb", "--set", "grow.length=0.2", "--levels", "1") == 1
    assert len(moves) == refused
    kept = tmp_path / "hair new"
    assert {path.name for path in kept.iterdir()} == set(before)
    assert (kept / "hair.glb").read_bytes() != before["hair.glb"]
    shutil.rmtree(kept)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_files_of_an_artist_are_kept_and_own_ones_replaced(tmp_path: Path, capfd: Any) -> None:
    (tmp_path / "hair_base.png").write_bytes(b"painted")
    assert export_cards(tmp_path / "hair.glb", "--levels", "1") == 0
    assert (tmp_path / "hair_base old.png").read_bytes() == b"painted"
    assert "hair_base.png already existed" in capfd.readouterr().out
    names = {path.name for path in tmp_path.iterdir()}
    assert export_cards(tmp_path / "hair.glb", "--set", "grow.length=0.2", "--levels", "1") == 0
    assert {path.name for path in tmp_path.iterdir()} == names, "its own are no artist's"
    assert "there already" not in capfd.readouterr().out


@pytest.mark.slow(instead="test_files_of_an_artist_are_kept_and_own_ones_replaced")
def test_meshes_that_would_have_one_sidecar_are_not_written_into_one_folder(
    tmp_path: Path, capfd: Any
) -> None:
    (tmp_path / "hair.fbx").touch()
    (tmp_path / "hair.hairloom.json").write_text('{"hairloom_sidecar": 1, "file": "hair.fbx"}')
    (tmp_path / "Brows.glb").touch()
    for name, other in (("hair.glb", "hair.fbx"), ("brows.glb", "Brows.glb")):
        assert export_cards(tmp_path / name, *BAKED_OPTIONS, "--levels", "1") == 1
        assert f"{other} is in this folder" in capfd.readouterr().err
        assert not (tmp_path / name).exists()
    assert len(list(tmp_path.iterdir())) == 3


def test_a_source_picture_is_not_replaced_by_its_export(tmp_path: Path, capfd: Any) -> None:
    assert export_cards(tmp_path / "hair.glb", "--levels", "1") == 0
    base = tmp_path / "hair_base.png"
    before = base.read_bytes()
    assert export_cards(tmp_path / "hair.glb", "--texture", f"base={base}", "--levels", "1") == 1
    assert "under another name" in capfd.readouterr().err and base.read_bytes() == before
    assert export_cards(tmp_path / "other.glb", "--texture", f"base={base}", "--levels", "1") == 0


def test_the_format_may_be_named_and_others_are_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert export_cards(tmp_path / "hair.v1", "--format", "obj", "--levels", "1") == 0
    assert (tmp_path / "hair.v1.obj").is_file()
    assert read_sidecar(tmp_path / "hair.v1.obj")["levels"][0]["node"] == "hair_v1"
    capfd.readouterr()
    assert export_cards(tmp_path / "hair.stl") == 1
    assert "Use .glb" in capfd.readouterr().err
    assert export_cards(tmp_path / "hair.glb", "--levels", "9") == 1
    assert "levels" in capfd.readouterr().err


def test_a_name_too_long_for_its_textures_is_refused_before_any_work(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(files, "build_steps", lambda *_, **__: pytest.fail("it has begun"))
    assert export_cards(tmp_path / f"{'x' * 240}.glb", "--levels", "1") == 1
    assert "Choose a shorter name" in capfd.readouterr().err


def test_a_button_writes_under_the_hairs_name(sphere: Any, tmp_path: Path) -> None:
    grow_hair(sphere, "Haar/Ä.001")
    out = tmp_path / "Haar_Ä.obj"
    options = {"own_levels": True, "levels": 2, "index_buffer": True}
    assert bpy.ops.hairloom.export_cards(filepath=str(out), **options) == {"FINISHED"}
    nodes = [level["node"] for level in read_sidecar(out)["levels"]]
    assert nodes == ["Haar_Ä_001_LOD0", "Haar_Ä_001_LOD1"]
    assert [line[2:] for line in out.read_text("utf-8").splitlines() if line[:2] == "o "] == nodes


@pytest.mark.slow(instead="test_no_folder_stays_of_an_export_that_fails")
def test_an_export_with_a_folder_is_that_folder_and_nothing_else(
    sphere: Any, tmp_path: Path
) -> None:
    """The folder is the same on a second export, from beside it and from within it."""
    grow_hair(sphere, "Hair")
    loose, out = tmp_path / "loose" / "Hair.glb", tmp_path / "Hair.glb"
    options = {"own_levels": True, "levels": 1}
    bpy.ops.hairloom.export_cards(filepath=str(loose), **options)
    names = sorted(path.name for path in loose.parent.iterdir())
    assert len(names) > 5, "a path that was named is not taken"
    folder = tmp_path / "Hair"
    for path in (out, out, folder / "Hair.glb"):
        bpy.ops.hairloom.export_cards(filepath=str(path), own_folder=True, **options)
        assert sorted(path.name for path in folder.iterdir()) == names
        assert sorted(tmp_path.iterdir()) == [folder, loose.parent]
    assert (folder / "Hair.glb").read_bytes() == loose.read_bytes()


def test_no_folder_stays_of_an_export_that_fails(
    sphere: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any, **__: Any) -> None:
        raise HairloomError("it broke", place="mesh", remedy="Wait")

    grow_hair(sphere, "Hair")
    monkeypatch.setattr(files, "write_card_mesh", fail)
    with pytest.raises(RuntimeError, match="it broke"):
        bpy.ops.hairloom.export_cards(filepath=str(tmp_path / "Hair.glb"), own_folder=True)
    assert list(tmp_path.iterdir()) == []


def test_all_formats_and_packings_can_be_chosen() -> None:
    properties = bpy.ops.hairloom.export_cards.get_rna_type().properties
    offered = {
        "format": [each.name for each in FORMATS],
        "packing": list(PRESETS),
        "textures": list(TEXTURE_FORMATS),
    }
    for name, choices in offered.items():
        assert sorted(properties[name].enum_items.keys()) == sorted(choices)
    assert all(properties[name].description for name in (*offered, "levels", "index_buffer"))


def test_the_suffix_follows_the_format() -> None:
    def suffix(chosen: str, path: str) -> Any:
        operator = SimpleNamespace(format=chosen, filepath=path)
        return HAIRLOOM_OT_export_cards.filename_ext.fget(operator)

    assert suffix("glb", "hair.fbx") == ".glb"
    assert suffix("usd", "hair.usda") == ".usda"
    assert suffix("usd", "hair") == ".usd"


@pytest.mark.slow(instead="test_a_button_writes_under_the_hairs_name")
def test_a_collections_exporter_writes_all_its_hair(sphere: Any, tmp_path: Path) -> None:
    """The selection does not matter: here nothing is selected."""
    collection = bpy.data.collections.new("Assets")
    bpy.context.scene.collection.children.link(collection)
    for name in ("Front", "Haar/Ä.001"):
        collection.objects.link(grow_hair(sphere, name))
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = None
    layer = bpy.context.view_layer.layer_collection.children["Assets"]
    bpy.context.view_layer.active_layer_collection = layer
    assert bpy.ops.collection.exporter_add(name="HAIRLOOM_FH_cards") == {"FINISHED"}
    (exporter,) = collection.exporters
    exporter.export_properties.filepath = str(tmp_path / "hair.glb")
    assert bpy.ops.collection.export_all() == {"FINISHED"}
    for name in ("Front", "Haar_Ä_001"):
        (level, *_) = read_sidecar(tmp_path / f"hair_{name}.glb")["levels"]
        assert level["node"].startswith(name)
    exporter.export_properties.filepath = str(tmp_path / "folders" / "hair.glb")
    exporter.export_properties.own_folder = True
    assert bpy.ops.collection.export_all() == {"FINISHED"}
    found = sorted(path.name for path in (tmp_path / "folders").iterdir())
    assert found == ["hair_Front", "hair_Haar_Ä_001"]


def test_a_collection_without_hair_is_reported(sphere: Any, tmp_path: Path) -> None:
    grow_hair(sphere, "Hair")
    bpy.data.collections.new("Empty")
    for name in ("Empty", "Nowhere"):
        with pytest.raises(RuntimeError, match=f"Collection '{name}': there is no hair to write"):
            bpy.ops.hairloom.export_cards(filepath=str(tmp_path / "a.glb"), collection=name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("suffix", "space"), [(".png", "sRGB"), (".exr", "linear")])
def test_a_sidecar_says_how_colours_are_stored(suffix: str, space: str) -> None:
    color, alpha = PRESETS["hairloom"][:2]
    written = [WrittenTexture(Path(f"hair{each.suffix}{suffix}"), each) for each in (color, alpha)]
    assert [each["color_space"] for each in texture_channels(written).values()] == [space, "linear"]
    named = texture_roles(written, ["color", "alpha"])
    assert named["color"].get("color_space", "sRGB") == space


def test_a_glb_changes_with_its_look_and_with_nothing_else(tmp_path: Path) -> None:
    """Engines import a GLB again only if its bytes change; the look alone must change them."""
    looks = {"one": "1", "two": "1", "three": "3"}
    written = {}
    for folder, strength in looks.items():
        (tmp_path / folder).mkdir()
        path = tmp_path / folder / "hair.glb"
        assert export_cards(path, "--levels", "1", "--set", f"shading.strength_r={strength}") == 0
        written[folder] = {each.name: each.read_bytes() for each in path.parent.iterdir()}
    assert written["one"] == written["two"] and "hair_paths.exr" in written["one"]
    changed = {name for name, data in written["one"].items() if data != written["three"].get(name)}
    assert changed == {"hair.glb", "hair.hairloom.json"}
    validator_report(tmp_path / "three" / "hair.glb")
