"""The package for Unity, compiled and run without Unity.

Its C# runs against stubs of the API that it calls (unity/Stubs.cs), its shaders are compiled by
glslang's HLSL front end with stubs of their includes. The behaviour of Unity itself is not tested.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import hair_hlsl
import numpy as np
import pytest
from extension_loader import REPOSITORY

pytest.importorskip("bpy", reason="writing cards needs Blender or the bpy module")

from damaged_assets import (
    DAMAGES,
    change_sidecar,
    damaged_copy,
    with_mirrored_cards,
    with_other_levels,
    with_quantised_positions,
    with_renamed_files,
    with_reordered_triangles,
    without_index_buffer,
    without_textures,
    without_unused,
)
from engine_assets import OUTPUT, Asset, write_asset
from hlsl_on_gpu import probe_glsl, probe_hlsl

from hairloom.addon.cards.export_settings import CardExportSettings
from hairloom.addon.exchange.cards.glb_file import GlbFile

HERE = Path(__file__).parent / "unity"
PACKAGE = REPOSITORY / "docs" / "engines" / "unity"
SHADERS = PACKAGE / "Shaders" / "HairloomCards.hlsl"
ENTRIES = {
    "vertex": "vert",
    "fragment": "frag",
    "vertex_of_shadow": "vert",
    "fragment_of_shadow": "frag",
    "fragment_of_depth": "frag",
    "fragment_of_normal": "frag",
}
#: Unity's passes that draw only opaque pixels
OPAQUE_MODES = ("ShadowCaster", "DepthOnly", "DepthNormalsOnly")


@pytest.fixture(scope="module")
def asset(gpu_context: Any) -> Asset:
    made = write_asset("unity", "marschner", CardExportSettings(index_buffer=True))
    with_mirrored_cards(made.folder)
    return made


@pytest.fixture(scope="module")
def imported(sandbox: str) -> Callable[..., dict[str, Any]]:
    """A function that imports a GLB, calling the package as Unity does."""
    program = OUTPUT / "unity.exe"
    OUTPUT.mkdir(parents=True, exist_ok=True)
    sources = sorted([*HERE.glob("*.cs"), *(PACKAGE / "Editor").glob("*.cs")])
    options = ["-langversion:latest", "-warnaserror", "-r:System.Web.Extensions.dll"]
    compiled = subprocess.run(
        [sandbox, "run", "mcs", *options, f"-out:{program}", *map(str, sources)],
        capture_output=True,
        text=True,
    )
    assert compiled.returncode == 0, compiled.stdout + compiled.stderr

    def run(glb: Path, *options: str) -> dict[str, Any]:
        done = subprocess.run(
            [sandbox, "run", "mono", str(program), str(glb), *options],
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return dict(json.loads(done.stdout))

    return run


@pytest.fixture(scope="module")
def hair(imported: Callable[..., dict[str, Any]], asset: Asset) -> dict[str, Any]:
    return imported(glb_of(asset.folder))


def glb_of(folder: Path) -> Path:
    return next(folder.glob("*.glb"))


def values(glb: Path, node: str) -> dict[str, np.ndarray]:
    """A level's attributes and indices in the file, read independently of the package."""
    file = GlbFile.of(glb.read_bytes(), str(glb))
    part = file.content["meshes"][file.content["nodes"][file.node(node)]["mesh"]]["primitives"][0]
    found = {name: np.asarray(file.values(number)) for name, number in part["attributes"].items()}
    return found | {"indices": np.asarray(file.values(part["indices"])).reshape(-1, 3)}


def level(
    hair: dict[str, Any], number: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[Any]]:
    """A level's positions, normals, strand directions, and the triangles of each part."""
    mesh = hair["meshes"][number]
    vectors = (np.reshape(mesh[name], (-1, 3)) for name in ("positions", "normals", "tangents"))
    place, normal, along = vectors
    return place, normal, along, [np.reshape(part, (-1, 3)) for part in mesh["parts"]]


def sidecar_of(folder: Path) -> dict[str, Any]:
    path = next(folder.glob("*.hairloom.json"))
    return dict(json.loads(path.read_text(encoding="utf-8")))


def test_every_level_comes_in_the_order_of_the_file(asset: Asset, hair: dict[str, Any]) -> None:
    sidecar = sidecar_of(asset.folder)
    assert not hair["errors"] and not hair["warnings"]
    assert [mesh["name"] for mesh in hair["meshes"]] == [each["node"] for each in sidecar["levels"]]
    for number, each in enumerate(sidecar["levels"]):
        expected = values(glb_of(asset.folder), each["node"])
        place, _, _, (opaque, _back, front) = level(hair, number)
        np.testing.assert_allclose(place * (-1, 1, 1), expected["POSITION"], atol=1e-7)
        for part in (opaque, front):
            wanted = np.sort(expected["indices"], axis=1)
            np.testing.assert_array_equal(np.sort(part, axis=1), wanted)


def test_back_faces_have_the_order_of_the_index_buffer(asset: Asset, hair: dict[str, Any]) -> None:
    sidecar = sidecar_of(asset.folder)
    buffer = sidecar["index_buffer"]
    kind = {"uint16": "<u2", "uint32": "<u4"}[buffer["type"]]
    all_indices = np.fromfile(asset.folder / buffer["file"], kind)
    for number, each in enumerate(sidecar["levels"]):
        first = each["buffer_back_first"]
        wanted = all_indices[first : first + each["indices"]].reshape(-1, 3)
        _, _, _, (_, back, front) = level(hair, number)
        np.testing.assert_array_equal(np.sort(back, axis=1), np.sort(wanted, axis=1))
        assert (back != front).any()


def test_a_mirrored_object_keeps_front_faces_in_front(asset: Asset, hair: dict[str, Any]) -> None:
    """Unity's front faces are clockwise and its axes left-handed, so the same cross product
    identifies front faces."""
    node = sidecar_of(asset.folder)["levels"][0]["node"]
    file = values(glb_of(asset.folder), node)
    place, normal, _, parts = level(hair, 0)

    def faces(place: np.ndarray, normal: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        a, b, c = (place[triangles[:, k]] for k in range(3))
        across = np.cross(b - a, c - a)
        return np.asarray(np.einsum("ij,ij->i", across, normal[triangles].sum(axis=1)) > 0.0)

    in_file = faces(file["POSITION"], file["NORMAL"], file["indices"])
    np.testing.assert_array_equal(faces(place, normal, parts[2]), in_file)
    assert in_file.any()


def test_strands_run_from_root_to_tip(asset: Asset, hair: dict[str, Any]) -> None:
    """Along each edge that follows a strand, the strand's direction points towards the tip."""
    place, normal, along, parts = level(hair, 0)
    how_far = np.array(hair["meshes"][0]["along"])
    begin, end = np.concatenate([parts[0][:, [0, 1]], parts[0][:, [1, 2]]]).T
    further = how_far[end] - how_far[begin]
    leads = np.einsum("ij,ij->i", place[end] - place[begin], along[begin] + along[end])
    does_go_on = np.abs(further) > 0.02
    assert does_go_on.sum() > 100
    assert (leads[does_go_on] * further[does_go_on] > 0.0).mean() > 0.99
    np.testing.assert_allclose(np.einsum("ij,ij->i", normal, along), 0.0, atol=2e-3)


def test_levels_switch_at_the_sizes_of_the_file(asset: Asset, hair: dict[str, Any]) -> None:
    content = GlbFile.of(glb_of(asset.folder).read_bytes(), "").content
    coverage = content["nodes"][0]["extras"]["MSFT_screencoverage"]
    np.testing.assert_allclose(hair["heights"], np.sqrt(coverage), rtol=1e-6)
    assert sorted(hair["heights"], reverse=True) == hair["heights"]


@pytest.mark.parametrize(
    ("coverage", "heights"),
    [
        ([1.0, 1.0, 0.0], [1.0, 0.999, 0.0]),
        ([0.25, 0.25, 0.0], [0.5, 0.4995, 0.0]),
        (None, [0.5, 0.25, 0.0]),
    ],
)
def test_levels_end_one_after_the_other_where_the_file_has_them_end_together(
    imported: Callable[..., dict[str, Any]],
    asset: Asset,
    coverage: list[float] | None,
    heights: list[float],
) -> None:
    """Unity rejects all levels otherwise. A file has equal ends if a coarser level is equally
    good."""
    folder = damaged_copy(asset.folder, OUTPUT / "unity_damaged", lambda folder: None)
    glb = glb_of(folder)
    file = GlbFile.of(glb.read_bytes(), str(glb))
    extras = file.content["nodes"][file.node("cards_LOD0")]["extras"]
    extras.pop("MSFT_screencoverage")
    if coverage:
        extras["MSFT_screencoverage"] = coverage
    glb.write_bytes(file.data())
    found = imported(glb)
    assert not found["errors"] and not found["warnings"]
    np.testing.assert_allclose(found["heights"], heights, rtol=2e-3)
    assert sorted(set(found["heights"]), reverse=True) == found["heights"]


def test_levels_fade_into_each_other_unless_that_is_turned_off(
    imported: Callable[..., dict[str, Any]], asset: Asset, hair: dict[str, Any]
) -> None:
    assert hair["fade"] == "CrossFade"
    assert hair["fades"] == pytest.approx([0.1, 0.1, 0.0])
    at_once = imported(glb_of(asset.folder), "at_once")
    assert at_once["fade"] == "None" and at_once["fades"] == [0.0, 0.0, 0.0]


def test_materials_are_the_passes_of_the_sidecar(asset: Asset, hair: dict[str, Any]) -> None:
    """With the sidecar's passes, states, values and textures."""
    sidecar = sidecar_of(asset.folder)
    assert [each["queue"] for each in hair["materials"]] == sorted(
        each["queue"] for each in hair["materials"]
    )
    for material, one in zip(hair["materials"], sidecar["passes_fallback"], strict=True):
        found = material["values"]
        assert found["_Cull"] == ["none", "front", "back"].index(one["cull"])
        assert bool(found["_ZWrite"]) == one["depth_write"]
        assert (found["_SrcBlend"] == 1) == (one["blend"] == "off")
        assert found["_model"] == 1
        for name, value in sidecar["material"]["values"].items():
            if f"_{name}" in found:
                wanted = [*value, 0.0] if isinstance(value, list) else value
                assert found[f"_{name}"] == pytest.approx(wanted, rel=1e-6), name
        for name, lanes in sidecar["material"]["fibre"].items():
            assert found[f"_fibre_{name}"] == pytest.approx(lanes, rel=1e-6)
        assert found["_alpha_texture"] == sidecar["textures"]["alpha"]["file"]
        assert found["_paths"] == sidecar["material"]["tables"]["paths"]["file"]
    alpha = [
        (each["values"]["_MinAlpha"], each["values"]["_MaxAlpha"]) for each in hair["materials"]
    ]
    opaque, least = sidecar["opaque_alpha"], sidecar["min_alpha"]
    wanted_alpha = [(opaque, 2.0), (0.0, opaque), (least, opaque)]
    np.testing.assert_allclose(alpha, wanted_alpha, rtol=1e-6)


@pytest.mark.parametrize(
    ("channels", "inverted", "lanes"),
    [
        ("rgb", "", [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]),
        ("rgb", "g", [[1, 0, 0, 0], [0, -1, 0, 1], [0, 0, 1, 0]]),
        ("gr", "g", [[0, -1, 0, 1], [1, 0, 0, 0], [0, 0, 0, 0.5]]),
    ],
)
def test_directions_are_read_from_the_channels_that_hold_them(
    imported: Callable[..., dict[str, Any]],
    asset: Asset,
    channels: str,
    inverted: str,
    lanes: list[list[float]],
) -> None:
    def change(content: dict[str, Any]) -> None:
        content["textures"]["tangent"] |= {"channels": channels, "inverted": inverted}
        content["textures"]["normal"] = content["textures"]["tangent"] | {"channels": channels}

    folder = damaged_copy(
        asset.folder, OUTPUT / "unity_damaged", lambda at: change_sidecar(at, change)
    )
    found = imported(glb_of(folder))["materials"][0]["values"]
    assert [found[f"_tangent_{axis}"] for axis in "xyz"] == lanes
    assert found["_has_normal_map"] == (2 if len(channels) == 2 else 1)


def test_every_value_of_a_material_is_a_property_of_the_shader(hair: dict[str, Any]) -> None:
    shader = (PACKAGE / "Shaders" / "HairloomCards.shader").read_text(encoding="utf-8")
    unused = {"_color_texture", *OPAQUE_MODES} | {
        f"_{role}_mask" for role in ("base", "tangent", "normal")
    }
    for name in set(hair["materials"][0]["values"]) - unused:
        assert f" {name} (" in shader, name


def test_opaque_pixels_alone_are_in_depths_and_shadows(hair: dict[str, Any]) -> None:
    shader = (PACKAGE / "Shaders" / "HairloomCards.shader").read_text(encoding="utf-8")
    for mode in OPAQUE_MODES:
        assert f'"LightMode" = "{mode}"' in shader
        assert [each["values"][mode] for each in hair["materials"]] == [True, False, False]


def test_every_function_that_the_shader_names_is_compiled() -> None:
    shader = (PACKAGE / "Shaders" / "HairloomCards.shader").read_text(encoding="utf-8")
    named = re.findall(r"#pragma (?:vertex|fragment) (\w+)", shader)
    assert set(named) == set(ENTRIES)


def test_textures_keep_their_values(asset: Asset, hair: dict[str, Any]) -> None:
    sidecar = sidecar_of(asset.folder)
    for file, how in hair["textures"].items():
        is_table = file.endswith(".exr")
        color = "linear" if is_table else sidecar["texture_files"][file]["color_space"]
        assert how["sRGB"] == (color == "sRGB"), file
        assert (how["format"] == "RGBAFloat") == is_table, file
        assert how["size"] >= 4096, "an atlas of 4,096 is not halved"
    assert any(how["sRGB"] for how in hair["textures"].values())


def test_textures_are_imported_again_once_their_sidecar_exists(
    asset: Asset, hair: dict[str, Any]
) -> None:
    """Textures that were imported before their sidecar existed are imported again, once."""
    sidecar = sidecar_of(asset.folder)
    sidecar_file = next(asset.folder.glob("*.hairloom.json")).name
    assert set(hair["sources"]) == {sidecar_file, sidecar["index_buffer"]["file"]}
    assert sorted(hair["reimported"]) == sorted(hair["textures"])


def test_in_the_high_definition_pipeline_its_own_material_is_used(
    imported: Callable[..., dict[str, Any]], asset: Asset
) -> None:
    found = imported(glb_of(asset.folder), "hdrp")
    assert {each["shader"] for each in found["materials"]} == {"HDRP/Lit"}
    assert [each["values"]["_SurfaceType"] for each in found["materials"]] == [0, 1, 1]


def _without_sidecar(folder: Path) -> None:
    next(folder.glob("*.hairloom.json")).unlink()


def _cut_off(folder: Path) -> None:
    glb = glb_of(folder)
    glb.write_bytes(glb.read_bytes()[:5000])


def _compressed(folder: Path) -> None:
    """Make a GLB look compressed by meshopt, with its bytes in another buffer."""
    glb = glb_of(folder)
    content = glb.read_bytes().replace(b'"buffer":0,', b'"buffer":1,')
    assert content != glb.read_bytes()
    glb.write_bytes(content)


def _garbage(folder: Path) -> None:
    next(folder.glob("*.hairloom.json")).write_text("{no", encoding="utf-8")


def _newer(folder: Path) -> None:
    sidecar = next(folder.glob("*.hairloom.json"))
    sidecar.write_text(json.dumps(sidecar_of(folder) | {"hairloom_sidecar": 99}), encoding="utf-8")


def _elsewhere(folder: Path) -> None:
    sidecar = next(folder.glob("*.hairloom.json"))
    content = sidecar_of(folder)
    content["index_buffer"]["file"] = "../../secret.bin"
    sidecar.write_text(json.dumps(content), encoding="utf-8")


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (_without_sidecar, "missing"),
        (with_other_levels, "which its sidecar names"),
        (_cut_off, "cut off"),
        (_compressed, "another program has changed it"),
        (_garbage, "no JSON"),
        (_newer, "update this package"),
        (_elsewhere, "lies elsewhere"),
    ],
)
def test_what_cannot_be_read_is_named(
    imported: Callable[..., dict[str, Any]],
    asset: Asset,
    damage: Callable[[Path], None],
    message: str,
) -> None:
    folder = OUTPUT / "unity_damaged"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(asset.folder, folder)
    damage(folder)
    found = imported(glb_of(folder))
    assert len(found["errors"]) == 1 and message in found["errors"][0], found["errors"]


@pytest.mark.parametrize(
    "damage",
    [
        with_renamed_files,
        without_textures,
        without_index_buffer,
        with_reordered_triangles,
        without_unused,
    ],
)
def test_what_can_be_shown_is_shown(
    imported: Callable[..., dict[str, Any]], asset: Asset, damage: Callable[[Path], None]
) -> None:
    folder = damaged_copy(asset.folder, OUTPUT / "unity_damaged", damage)
    found = imported(glb_of(folder))
    assert not found["errors"] and len(found["meshes"]) == 3
    assert found["warnings"] and all(DAMAGES[damage] in each for each in found["warnings"])
    values = found["materials"][0]["values"]
    assert (values["_has_tangent_map"], values["_base_gain"] == 1.0) == (
        (0, True) if damage is without_textures else (1, values["_base_gain"] == 1.0)
    )
    _, _, _, (_, back, front) = level(found, 0)
    has_own_order = damage in (with_renamed_files, without_textures)
    assert (back != front).any() == has_own_order


def test_rounded_positions_are_where_they_were(
    imported: Callable[..., dict[str, Any]], asset: Asset, hair: dict[str, Any]
) -> None:
    folder = damaged_copy(asset.folder, OUTPUT / "unity_damaged", with_quantised_positions)
    found = imported(glb_of(folder))
    assert not found["errors"] and not found["warnings"]
    place, _, _, parts = level(found, 0)
    expected, _, _, wanted = level(hair, 0)
    assert 0.0 < np.abs(place - expected).max() < 0.1 / 32_000
    np.testing.assert_array_equal(parts, wanted)


def test_in_the_high_definition_pipeline_alpha_comes_with_the_colour_or_with_a_warning(
    imported: Callable[..., dict[str, Any]], asset: Asset
) -> None:
    folder = damaged_copy(asset.folder, OUTPUT / "unity_damaged", lambda folder: None)
    (warning,) = imported(glb_of(folder), "hdrp")["warnings"]
    assert "packing Unity HDRP" in warning
    sidecar = next(folder.glob("*.hairloom.json"))
    content = sidecar_of(folder)
    content["textures"]["alpha"] |= {"file": content["textures"]["color"]["file"], "channels": "a"}
    sidecar.write_text(json.dumps(content), encoding="utf-8")
    assert not imported(glb_of(folder), "hdrp")["warnings"]


@pytest.mark.parametrize("loop", ["", "-D_FORWARD_PLUS", "-D_CLUSTER_LIGHT_LOOP"])
def test_every_light_is_seen_once(sandbox: str, loop: str) -> None:
    """With clustered lights, which contain only lamps, suns have their own loop."""
    options = ["-E", "-D", "-S", "frag", f"-I{HERE}", "-D_ADDITIONAL_LIGHTS", *loop.split()]
    done = subprocess.run(
        [sandbox, "run", "glslangValidator", *options, str(SHADERS)],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    loops = re.findall(
        r"for \(uint (\w+) = (\w+); \1 < (.+?); ?(?:\+\+ ?\1|\1 ?\+\+)\)\s*{"
        r"\s*radiance \+= radiance_of\(hair, here, GetAdditionalLight\(\1,",
        done.stdout,
    )
    counts = {"sun_count": 2, "light_count": 5, "count": 5, "min": min}
    seen: list[int] = []
    for _, first, end in loops:
        seen += range(*(eval(each.replace("0u", "0"), counts) for each in (first, end)))
    assert seen == list(range(5))


@pytest.mark.parametrize("entry", ENTRIES)
def test_the_shaders_compile(sandbox: str, entry: str) -> None:
    OUTPUT.mkdir(parents=True, exist_ok=True)
    program = OUTPUT / f"unity_{entry}.spv"
    options = ["-D", "-V", "-S", ENTRIES[entry], "-e", entry, f"-I{HERE}"]
    options += ["-D_ADDITIONAL_LIGHTS", "-DLOD_FADE_CROSSFADE"]
    options += ["--auto-map-bindings", "--auto-map-locations", "-o", str(program)]
    for command in (
        ["glslangValidator", *options, str(SHADERS)],
        ["spirv-val", str(program)],
    ):
        done = subprocess.run([sandbox, "run", *command], capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr


def test_its_shading_is_that_of_the_other_engines(
    sandbox: str, gpu_context: Any, tmp_path: Path
) -> None:
    """HLSL, compiled by glslang and SPIRV-Cross, against the text that it is made from, both on the
    GPU."""
    probe = (HERE / "probe.glsl").read_text(encoding="utf-8")
    shading = hair_hlsl.SOURCE.read_text(encoding="utf-8")
    text = hair_hlsl.hlsl(shading + probe) + PROBE_HLSL
    found = probe_hlsl(OUTPUT / "unity_probe.hlsl", text, sandbox, tmp_path)
    glsl = shading + probe + PROBE_GLSL
    expected = probe_glsl(tmp_path / "glsl.glsl", glsl, "result_of_probe = probe_both(place)")
    assert np.isfinite(expected).all() and expected.std(axis=(0, 1)).min() > 0.01
    np.testing.assert_allclose(found, expected, atol=2e-5, rtol=2e-4)


PROBE_HLSL = """
Texture2D longitudinal, azimuthal, paths;

float4 main(float2 at : TEXCOORD0) : SV_Target
{
  return probe(longitudinal, azimuthal, paths, at.x, (int)at.y);
}
"""
PROBE_GLSL = """
vec4 result_of_probe;

vec4 probe_both(vec2 at)
{
  return probe(longitudinal, azimuthal, paths, at.x, int(at.y));
}
"""
