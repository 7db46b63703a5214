"""The importer for Unreal, run without Unreal.

Its script runs against a stub of the module `unreal` (unreal/unreal_stub.py) with the names of
Epic's documentation; the HLSL of its nodes is compiled by glslang and compared on the GPU with the
text that it is made from. The behaviour of Unreal itself is not tested.
"""

from __future__ import annotations

import importlib
import importlib.util
import json
import shutil
import subprocess
import sys
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import hair_hlsl
import numpy as np
import pytest
from extension_loader import REPOSITORY

pytest.importorskip("bpy", reason="writing cards needs Blender or the bpy module")

from engine_assets import OUTPUT, Asset, write_asset
from hlsl_on_gpu import probe_glsl, probe_hlsl

from hairloom.addon.blender.cards.textures import texture_channels, texture_roles
from hairloom.addon.cards.export_settings import CardExportSettings
from hairloom.addon.exchange.textures.card_textures import WrittenTexture
from hairloom.addon.exchange.textures.texture_packing import MAP_MEANINGS, PRESETS, pack_textures

HERE = Path(__file__).parent / "unreal"
FOLDER = REPOSITORY / "docs" / "engines" / "unreal"
MESH_VIEW = REPOSITORY / "tests" / "blender" / "mesh_view.py"
PROBE = Path(__file__).parent / "unity" / "probe.glsl"
LOOKS = {"kajiya_kay": "unreal", "marschner": "hairloom", "baked": "unreal_compact"}


@pytest.fixture(scope="module", params=LOOKS)
def asset(request: pytest.FixtureRequest, gpu_context: Any) -> Asset:
    settings = CardExportSettings(packing=LOOKS[request.param])
    return write_asset(f"unreal_{request.param}", request.param, settings, file="cards.fbx")


@pytest.fixture(scope="module")
def unreal() -> Iterator[ModuleType]:
    """The stub under the name of the module."""
    spec = importlib.util.spec_from_file_location("unreal", HERE / "unreal_stub.py")
    assert spec is not None and spec.loader is not None
    stub = importlib.util.module_from_spec(spec)
    sys.modules["unreal"] = stub
    spec.loader.exec_module(stub)
    yield stub
    del sys.modules["unreal"]


@pytest.fixture(scope="module")
def importer(unreal: ModuleType) -> Iterator[ModuleType]:
    sys.path.insert(0, str(FOLDER))
    unreal.levels_of.append(triangles_of)
    yield importlib.import_module("hairloom_import")
    sys.path.remove(str(FOLDER))


@pytest.fixture(autouse=True)
def _empty_project(unreal: ModuleType) -> None:
    unreal.reset()


def triangles_of(fbx: str) -> list[int]:
    """The number of triangles of each level of an FBX file, read with ufbx."""
    result = OUTPUT / "unreal_mesh.json"
    command = [sys.executable, str(MESH_VIEW), fbx, str(result)]
    if subprocess.run(command, capture_output=True, timeout=120).returncode:
        return []
    meshes = json.loads(result.read_text(encoding="utf-8"))["meshes"]
    return [len(meshes[name]["sizes"]) for name in sorted(meshes)]


def sidecar_of(folder: Path) -> dict[str, Any]:
    (path,) = folder.glob("*.hairloom.json")
    return dict(json.loads(path.read_text(encoding="utf-8")))


def code_of(material: Any, about: str) -> str:
    (node,) = (
        each for each in material.values[""] if about in (each.values.get("description") or "")
    )
    return str(node.values["code"])


def attributes_of(material: Any) -> dict[str, Any]:
    """Pin of the material -> the node that is connected to it."""
    (node,) = (each for each in material.values[""] if "the material" in each.inputs)
    return {pin: source for pin, (source, _) in node.inputs.items() if pin != "the material"}


@pytest.mark.parametrize("packing", PRESETS)
def test_directions_are_read_from_the_channels_that_hold_them(
    importer: ModuleType, packing: str
) -> None:
    """The node's code decodes a texel of each packing to the direction before packing."""
    plan = sys.modules["hairloom_plan"]
    tangent = np.array([0.3, 0.9, 0.6], np.float32)
    for texture in pack_textures({"tangent": tangent[None, None]}, packing):
        entry = texture_roles([WrittenTexture(Path("a.png"), texture.layout)], ["tangent"])
        code = plan._texel("Texel", entry["tangent"])
        texel = SimpleNamespace(**dict(zip("rgba", texture.pixels[0, 0], strict=False)))
        found = eval(code, {"float3": lambda *each: each, "Texel": texel})
        found = (found.r, found.g, found.b) if found is texel else found
        z = 0.5 if len(entry["tangent"]["channels"]) == 2 else tangent[2]
        np.testing.assert_allclose(found, [*tangent[:2], z], atol=1e-6)


@pytest.mark.parametrize("packing", PRESETS)
def test_each_picture_has_the_colour_space_of_its_file(importer: ModuleType, packing: str) -> None:
    """Even if a colour texture also contains alpha, which is linear."""
    shapes = {"base": (1, 1, 3), "color": (1, 1, 3), "tangent": (1, 1, 3)}
    maps = {name: np.ones(shapes.get(name, (1, 1)), np.float32) for name in MAP_MEANINGS}
    maps["normal"] = maps["tangent"]
    written = [
        WrittenTexture(Path(f"cards{texture.suffix}.png"), texture.layout)
        for texture in pack_textures(maps, packing)
    ]
    files, roles = texture_channels(written), texture_roles(written, maps)
    for role, entry in roles.items():
        entry.setdefault("color_space", "sRGB" if role in ("base", "color") else "linear")
    assert {each["color_space"] for each in files.values()} == {"sRGB", "linear"}
    for file, each in files.items():
        found = sys.modules["hairloom_plan"]._picture(
            Path("cards.fbx"), file, {"texture_files": files}, roles
        )
        assert found.is_color == (each["color_space"] == "sRGB"), file


def test_all_of_an_export_comes_into_the_project(
    importer: ModuleType, unreal: ModuleType, asset: Asset
) -> None:
    assert importer.main([str(asset.folder / "cards.fbx"), "/Game/Hair/"]) == 0
    assert [kind for kind, _ in unreal.log_lines] == ["log"]
    sidecar = sidecar_of(asset.folder)
    pictures = {f"/Game/Hair/T_{Path(file).stem}" for file in sidecar["texture_files"]}
    assert set(unreal.assets) == pictures | {"/Game/Hair/M_cards", "/Game/Hair/SM_cards"}
    assert set(unreal.saved) == set(unreal.assets)
    for file, entry in sidecar["texture_files"].items():
        texture = unreal.assets[f"/Game/Hair/T_{Path(file).stem}"]
        assert texture.values["srgb"] == (entry["color_space"] == "sRGB")
    again = dict(unreal.assets)
    assert importer.main([str(asset.folder / "cards.fbx"), "/Game/Hair"]) == 0
    assert set(unreal.assets) == set(again)


def test_triangles_stay_in_their_order_and_levels_where_the_file_says(
    importer: ModuleType, unreal: ModuleType, asset: Asset
) -> None:
    """The console variable is set while Unreal builds the mesh, and restored afterwards."""
    importer.main([str(asset.folder / "cards.fbx"), "/Game/Hair"])
    mesh, sidecar = unreal.assets["/Game/Hair/SM_cards"], sidecar_of(asset.folder)
    assert mesh.order == 2 and unreal.console_variables["r.TriangleOrderOptimization"] == 1
    assert mesh.triangles == [level["triangles"] for level in sidecar["levels"]]
    assert all(build["remove_degenerates"] is False for build in mesh.build.values())
    # at that size on a screen of 1,080 lines the level is off by one pixel
    for size, level in list(zip(mesh.screen_sizes, sidecar["levels"], strict=True))[1:]:
        visible = 2.0 * unreal.BoxSphereBounds.sphere_radius / size
        assert level["error"] / visible * 1080.0 <= 1.0 + 1e-6
    assert mesh.screen_sizes == sorted(mesh.screen_sizes, reverse=True)
    assert len(set(mesh.screen_sizes[1:])) > 1 or len(sidecar["levels"]) < 3


def test_the_material_is_hair_of_unreal(
    importer: ModuleType, unreal: ModuleType, asset: Asset
) -> None:
    importer.main([str(asset.folder / "cards.fbx"), "/Game/Hair"])
    material, sidecar = unreal.assets["/Game/Hair/M_cards"], sidecar_of(asset.folder)
    assert material.values["shading_model"] == "MaterialShadingModel.MSM_HAIR"
    assert material.values["blend_mode"] == "BlendMode.BLEND_MASKED"
    pins = attributes_of(material)
    assert set(pins) == {
        "BaseColor",
        "Metallic",
        "Specular",
        "Roughness",
        "ClearCoat",
        "AmbientOcclusion",
        "Normal",
        "OpacityMask",
    }
    names = {pin: node.values.get("parameter_name") for pin, node in pins.items()}
    assert (names["Metallic"], names["ClearCoat"]) == ("Scatter", "Backlit")
    values = sidecar["material"]["values"]
    tint = next(
        node for node in material.values[""] if node.values.get("parameter_name") == "TipTint"
    )
    assert tint.values["default_value"] == values["tip_tint"]
    role = sidecar["textures"]["highlights_by"]
    source, _ = pins["Normal"].inputs["Texel"]
    file = Path(sidecar["textures"][role]["file"]).stem
    assert source.values["texture"].path == f"/Game/Hair/T_{file}"
    has_slant = "hair_view_compensated_alpha(Alpha" in code_of(material, "coverage")
    assert has_slant == ("view_compensated_alpha" in sidecar["textures"])


def test_a_highlight_is_as_wide_as_ours() -> None:
    """Against Unreal's exp(-(theta_i + theta_r)^2 / 2 roughness^4); theta_h is half of that sum."""
    plan = importlib.import_module("hairloom_plan")
    width = 0.1
    marschner = {"model": "marschner", "values": {"width_r": width}}
    assert plan.roughness(marschner) ** 2 / 2.0 == pytest.approx(width)
    theta = np.linspace(-0.3, 0.3, 61)
    ours = np.cos(theta) ** 90.0
    found = plan.roughness({"model": "kajiya_kay", "values": {"primary_exponent": 90.0}})
    np.testing.assert_allclose(np.exp(-0.5 * (2.0 * theta) ** 2 / found**4), ours, atol=0.01)


def test_a_groom_gets_strands_cards_and_its_head(
    importer: ModuleType, unreal: ModuleType, asset: Asset, tmp_path: Path
) -> None:
    groom = tmp_path / "cards_groom.abc"
    groom.write_bytes(b"")
    head = unreal._put(unreal.SkeletalMesh(), "/Game/Head/SK_Head")
    command = [str(asset.folder / "cards.fbx"), "/Game/Hair", "--groom", str(groom)]
    command += ["--skeletal-mesh", head.path, "--simulate"]
    assert importer.main(command) == 0
    made = unreal.assets["/Game/Hair/G_cards_groom"]
    for number, levels in enumerate(made.values["hair_groups_lod"]):
        near, far = levels.values["lo_ds"]
        assert near.values["geometry_type"] == "GroomGeometryType.STRANDS"
        assert far.values["geometry_type"] == "GroomGeometryType.CARDS"
        assert 0.0 < far.values["screen_size"] < near.values["screen_size"]
        assert far.values["visible"] == (number == 0)
    (cards,) = made.values["hair_groups_cards"]
    assert cards.values["imported_mesh"] is unreal.assets["/Game/Hair/SM_cards"]
    textures = cards.values["textures"].values.get("textures", [])
    is_packed = "_Depth" in "".join(sidecar_of(asset.folder)["texture_files"])
    slots = ["Depth", "Coverage", "Tangent", "Attributes", "Material", "Auxiliary"]
    expected = [f"/Game/Hair/T_cards_{slot}" for slot in slots]
    assert [each.path for each in textures] == (expected if is_packed else [])
    warnings = [text for kind, text in unreal.log_lines if kind == "warning"]
    assert len(warnings) == (0 if is_packed else 1)
    solver = made.values["hair_groups_physics"][1].get_editor_property("solver_settings")
    assert solver.values["enable_simulation"] is True
    binding = unreal.assets["/Game/Hair/G_cards_groom_Binding"]
    assert binding.values == {"groom": made, "target_skeletal_mesh": head}
    strands = made.values["hair_groups_materials"][0].values["material"]
    assert "OpacityMask" not in attributes_of(strands)
    assert "/Game/Hair/M_cards_Strands" in unreal.saved


# Bad input


def _copied(asset: Asset, name: str = "unreal_damaged") -> Path:
    folder = OUTPUT / name
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(asset.folder, folder)
    return folder


def _changed(folder: Path, change: Callable[[dict[str, Any]], None]) -> None:
    (path,) = folder.glob("*.hairloom.json")
    content = sidecar_of(folder)
    change(content)
    path.write_text(json.dumps(content), encoding="utf-8")


def _without_sidecar(folder: Path) -> None:
    (folder / "cards.hairloom.json").unlink()


def _garbage(folder: Path) -> None:
    (folder / "cards.hairloom.json").write_text("{no", encoding="utf-8")


def _newer(folder: Path) -> None:
    _changed(folder, lambda content: content.update(hairloom_sidecar=99))


def _elsewhere(folder: Path) -> None:
    _changed(folder, lambda content: content["textures"]["base"].update(file="../../secret.png"))


def _half(folder: Path) -> None:
    _changed(folder, lambda content: content.pop("textures"))


def _cut_off(folder: Path) -> None:
    (folder / "cards.fbx").write_bytes(b"Kaydara FBX Binary")


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (_without_sidecar, "missing"),
        (_garbage, "cannot be read"),
        (_newer, "newer"),
        (_elsewhere, "lies elsewhere"),
        (_half, "damaged"),
        (_cut_off, "cannot import"),
    ],
)
def test_what_cannot_be_read_is_named_in_one_sentence(
    importer: ModuleType,
    unreal: ModuleType,
    asset: Asset,
    damage: Callable[[Path], None],
    message: str,
) -> None:
    folder = _copied(asset)
    damage(folder)
    assert importer.main([str(folder / "cards.fbx"), "/Game/Hair"]) == 1
    ((kind, text),) = unreal.log_lines
    assert kind == "error" and message in text and "; " in text


def test_what_can_be_shown_is_shown(importer: ModuleType, unreal: ModuleType, asset: Asset) -> None:
    """Files without alpha, whose name has characters that content folders do not allow."""
    folder = _copied(asset)
    alpha = sidecar_of(folder)["textures"]["alpha"]["file"]
    (folder / alpha).unlink()
    for each in ("cards.fbx", "cards.hairloom.json"):
        (folder / each).rename(folder / each.replace("cards", "Zöpfe 头发"))
    assert importer.main([str(folder / "Zöpfe 头发.fbx"), "/Game/Hair"]) == 0
    warnings = [text for kind, text in unreal.log_lines if kind == "warning"]
    assert len(warnings) == 2
    assert "names cards.fbx" in warnings[0] and alpha in warnings[1]
    name = "Zopfe_" + f"{zlib.crc32('Zöpfe 头发'.encode()):08x}"
    assert "OpacityMask" not in attributes_of(unreal.assets[f"/Game/Hair/M_{name}"])
    assert f"/Game/Hair/SM_{name}" in unreal.saved
    pictures = [path for path in unreal.assets if "/T_" in path]
    assert pictures and all(path.startswith("/Game/Hair/T_Zopfe_cards_") for path in pictures)


def test_hair_of_another_folder_is_replaced_on_demand_alone(
    importer: ModuleType, unreal: ModuleType, asset: Asset
) -> None:
    """For two exports with the same name in different folders."""
    first, second = (str(_copied(asset, f"unreal_{name}") / "cards.fbx") for name in ("a", "b"))
    assert importer.main([first, "/Game/Hair"]) == 0
    before, unreal.log_lines[:] = dict(unreal.assets), []
    assert importer.main([second, "/Game/Hair"]) == 1
    ((kind, text),) = unreal.log_lines
    assert kind == "error" and f"made of {first}" in text and "--replace" in text
    assert unreal.assets == before
    assert importer.main([first, "/Game/Hair"]) == 0
    assert importer.main([second, "/Game/Hair", "--replace"]) == 0
    assert importer.main([second, "/Game/Hair"]) == 0


def test_a_mesh_that_another_program_reduced_is_named(
    importer: ModuleType, unreal: ModuleType, asset: Asset
) -> None:
    folder = _copied(asset)
    _changed(folder, lambda content: content["levels"][0].update(triangles=7))
    assert importer.main([str(folder / "cards.fbx"), "/Game/Hair"]) == 0
    (warning,) = (text for kind, text in unreal.log_lines if kind == "warning")
    assert "another program has changed" in warning and " 7, " in warning


def test_levels_that_unreal_leaves_out_are_named(importer: ModuleType, asset: Asset) -> None:
    plan = importlib.import_module("hairloom_plan")
    whole = plan.plan_of(asset.folder / "cards.fbx")
    finest = [whole.triangles[0]]
    assert plan.found_triangles(whole, finest).endswith("taken 1 of its 3 levels")


def test_a_project_that_cannot_be_written_is_named(
    importer: ModuleType, unreal: ModuleType, asset: Asset
) -> None:
    unreal.can_save = False
    assert importer.main([str(asset.folder / "cards.fbx"), "/Game/Hair"]) == 1
    ((kind, text),) = unreal.log_lines
    assert kind == "error" and "cannot be saved" in text and "free space" in text


def test_names_stay_apart_and_plain(importer: ModuleType) -> None:
    plan = importlib.import_module("hairloom_plan")
    assert plan.asset_name("Hair_01") == "Hair_01"
    assert plan.asset_name("Haar/Ä.001").startswith("Haar_A_001_")
    names = ["头发", "髪型", "Zöpfe", "Zopfe", "Zopfe 头发", "Zopfe 髪型", "Zopfe_", "Zopfe."]
    made = [plan.asset_name(name) for name in names]
    assert len(set(made)) == len(names) and all(name.isascii() for name in made)
    assert made[0].startswith("Hair_") and made[3] == "Zopfe"


# The shading


def test_the_nodes_shade_as_the_other_engines_do(
    importer: ModuleType,
    unreal: ModuleType,
    sandbox: str,
    asset: Asset,
    tmp_path: Path,
) -> None:
    """The code of the Custom nodes, compiled by glslang and SPIRV-Cross, against the GLSL, both on
    the GPU."""
    importer.main([str(asset.folder / "cards.fbx"), "/Game/Hair"])
    material, sidecar = unreal.assets["/Game/Hair/M_cards"], sidecar_of(asset.folder)
    probe = PROBE.read_text(encoding="utf-8")
    waves = probe[: probe.index("vec4 probe(")]
    shading = hair_hlsl.SOURCE.read_text(encoding="utf-8")
    # glslang mistakes functions inside functions for recursion, so the struct comes before them
    struct = hair_hlsl.nodes(shading)
    struct = struct.replace("HairloomShading shading", "static HairloomShading shading")
    others = hair_hlsl.hlsl(shading + waves)
    others = others[others.index("float probe_wave") :].removesuffix(hair_hlsl.ENDING)
    others = others.replace("hair_unit", "shading.hair_unit")
    text = struct + others + nodes_of(material)
    found = probe_hlsl(OUTPUT / "unreal_probe.hlsl", text, sandbox, tmp_path)
    glsl = shading + waves + expected_glsl(sidecar)
    expected = probe_glsl(tmp_path / "glsl.glsl", glsl, "result_of_probe = probe_both(place)")
    assert np.isfinite(expected).all()
    assert (expected.std(axis=(0, 1)) > 0.01).sum() >= 3
    np.testing.assert_allclose(found, expected, atol=2e-5, rtol=2e-4)


#: input of pins that vary from pixel to pixel, in HLSL and in GLSL
WAVES = {
    "Base": "probe_vector(x, 1.0)",
    "Card": "probe_vector(x, 4.0).xy",
    "Position": "probe_direction(x, 11.0)",
    "Normal": "probe_direction(x, 14.0)",
    "Tangent": "probe_direction(x, 17.0)",
    "ToEye": "probe_direction(x, 20.0)",
    "Alpha": "probe_wave(x, 23.0)",
}
DIRECTION, SHIFT = "probe_vector(x, 7.0)", "probe_wave(x, 7.0)"


def nodes_of(material: Any) -> str:
    """The Custom nodes as functions of their pins, as in Unreal's generated code, and a program
    that calls them: the colour for y below 0.5, else the direction, and the coverage as alpha."""
    functions, calls = [], {}
    for pin, node in attributes_of(material).items():
        if pin not in ("BaseColor", "Normal", "OpacityMask"):
            continue
        values = {name: value_of(name, *node.inputs[name]) for name in pins_of(node)}
        kinds = ", ".join(f"{kind} {name}" for name, (kind, _) in values.items())
        size = node.values["output_type"][-1].replace("1", "")
        # derivatives have no meaning in a program that runs over an array
        code = node.values["code"].replace("cross(ddx(Position), ddy(Position))", "Position")
        struct = hair_hlsl.NODES.read_text(encoding="utf-8")
        assert code.startswith(struct)
        code = code.removeprefix(struct)
        functions.append(f"float{size} node_{pin}({kinds})\n{{\n{code}}}\n")
        calls[pin] = f"node_{pin}({', '.join(value for _, value in values.values())})"
    return "\n".join(functions) + (
        "\nfloat4 main(float2 at : TEXCOORD0) : SV_Target\n{\n  float x = at.x;\n"
        f"  float3 color = {calls['BaseColor']};\n  float3 way = {calls['Normal']};\n"
        f"  return float4(at.y > 0.5 ? way : color, {calls['OpacityMask']});\n}}\n"
    )


def pins_of(node: Any) -> list[str]:
    return [each.values["input_name"] for each in node.values["inputs"]]


def value_of(name: str, source: Any, output: str) -> tuple[str, str]:
    """Type and value of a pin's input: that of a parameter, or waves."""
    value = source.values.get("default_value")
    if isinstance(value, float | int):
        return "float", f"{value:.9g}"
    if value is not None:
        return "float3", f"float3({value.r:.9g}, {value.g:.9g}, {value.b:.9g})"
    if name == "Texel":
        return ("float3", DIRECTION) if output == "RGB" else ("float", SHIFT)
    kind = {"Card": "float2", "Alpha": "float"}.get(name, "float3")
    return kind, WAVES[name]


def expected_glsl(sidecar: dict[str, Any]) -> str:
    """The same with the shared shading, from the sidecar."""
    material, textures = sidecar["material"], sidecar["textures"]
    values = material["values"]
    names = ["tip_tint", "tint_start", "tint_end", "grey_fraction", "base_color", "tip_color"]
    lines = [f"  hair.{name} = {glsl_of(values[name])};" for name in names]
    if material["model"] == "marschner":
        lines += [
            f"  hair.fibre_{end} = {glsl_of(material['fibre'][end])};" for end in ("root", "tip")
        ]
    noise = glsl_of(values["shift_noise"])
    up, out = "vec3(0.0, 1.0, 0.0)", "vec3(0.0, 0.0, 1.0)"
    if textures["highlights_by"] == "tangent":
        is_down = "g" in textures["tangent"].get("inverted", "")
        texel = f"mix({DIRECTION}, 1.0 - {DIRECTION}, vec3(0.0, {float(is_down)}, 0.0))"
        strand = f"hair_tangent({texel}, {up}, {out}, {noise})"
    else:
        strand = f"hair_shifted({up}, {out}, {noise} * ({SHIFT} - 0.5))"
    facing = textures.get("view_compensated_alpha")
    alpha = WAVES["Alpha"]
    if facing:
        range_of_facing = glsl_of([facing["mean_facing"], facing["min_facing"]])
        along = f"normalize(cross({WAVES['Normal']}, {WAVES['Tangent']}))"
        alpha = (
            f"hair_view_compensated_alpha({alpha}, {WAVES['Position']}, {along}, {WAVES['ToEye']}, "
            f"{range_of_facing})"
        )
    gain = glsl_of(textures["base"]["gain"])
    return (
        "vec4 result_of_probe;\n\nvec4 probe_both(vec2 place)\n{\n  float x = place.x;\n"
        f"  HairMaterial hair;\n  hair.model = {int(material['model'] == 'marschner')};\n"
        + "\n".join(lines)
        + f"\n  vec3 strand = {strand};\n"
        f"  vec3 color = hair_color(hair, 1.0 - {WAVES['Card']}.y, {gain} * {WAVES['Base']});\n"
        "  vec3 way = vec3(-strand.x, strand.y, -strand.z);\n"
        f"  return vec4(place.y > 0.5 ? way : color, {alpha});\n}}\n"
    )


def glsl_of(value: Any) -> str:
    if isinstance(value, list):
        return f"vec{len(value)}({', '.join(f'{each:.9g}' for each in value)})"
    return f"float({value:.9g})"
