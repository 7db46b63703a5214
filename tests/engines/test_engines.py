"""Cards in real engines: three.js in Chromium, and Godot, with the shaders of docs/engines.

Both run in the sandbox of `tools/window_blender run`, installed by `tools/window_blender engines`.
"""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from extension_loader import REPOSITORY

pytest.importorskip("bpy", reason="writing cards needs Blender or the bpy module")

from damaged_assets import (
    DAMAGES,
    damaged_copy,
    with_garbage_sidecar,
    with_mirrored_cards,
    with_other_levels,
    with_quantised_positions,
    with_turned_tangents,
    without_index_buffer,
    without_sidecar,
)
from engine_assets import SIZE, Asset, check_picture, write_asset

from hairloom.addon.cards.export_settings import CardExportSettings
from hairloom.addon.exchange.cards.glb_file import GlbFile
from hairloom.addon.exchange.textures.texture_files import read_texture

HERE = Path(__file__).parent
ENGINES = REPOSITORY / "docs" / "engines"
THREE = REPOSITORY / "tools" / "node" / "node_modules" / "three"
#: other files in an asset's folder
OF_ENGINES = shutil.ignore_patterns("godot*", "game", "web*")


@pytest.fixture(scope="module", params=["kajiya_kay", "marschner", "baked"])
def asset(request: pytest.FixtureRequest, gpu_context: Any) -> Asset:
    made = write_asset(request.param, request.param, CardExportSettings(index_buffer=True))
    with_mirrored_cards(made.folder)
    if request.param == "baked":
        with_turned_tangents(made.folder)
    return made


@pytest.fixture(scope="module")
def baked(gpu_context: Any) -> Asset:
    return write_asset("damaged", "baked", CardExportSettings(index_buffer=True))


def godot_project(asset: Asset, name: str) -> Path:
    project = asset.folder / name
    shutil.copytree(HERE / "godot", project)
    shutil.copytree(ENGINES / "godot", project / "addons" / "hairloom")
    shutil.copytree(asset.folder, project / "asset", ignore=OF_ENGINES)
    return project


def run_godot(sandbox: str, *options: str, window: bool = True) -> str:
    """Godot's output, in which no script and no shader may fail."""
    command = [sandbox, "run"]
    if window:
        command += [str(REPOSITORY / "tools" / "with_xvfb"), "godot", "--quit-after", "1000"]
        command += ["--rendering-driver", "vulkan", "--resolution", f"{SIZE}x{SIZE}"]
    else:
        command += ["godot", "--headless"]
    result = subprocess.run([*command, *options], capture_output=True, text=True, timeout=300)
    output = result.stdout + result.stderr
    assert result.returncode == 0, output
    assert "SCRIPT ERROR" not in output and "SHADER ERROR" not in output, output
    return output


#: display values of fog that hides everything
FOG = np.array([0x33, 0x66, 0x99]) / 255.0


def check_fog(asset: Asset, drawn: Path) -> None:
    """Where hair covers a pixel of our picture, the median colour is that of the fog."""
    theirs = read_texture(drawn, is_color=False)[..., :3]
    is_hair = asset.picture[..., 3] > 0.95
    assert is_hair.sum() > 100
    np.testing.assert_allclose(np.median(theirs[is_hair], axis=0), FOG, atol=2.0 / 255.0)


def indices_of(glb: Path, node: str) -> np.ndarray:
    """The triangles of a node's mesh, (triangle_count, 3)."""
    file = GlbFile.of(glb.read_bytes(), str(glb))
    mesh = file.content["meshes"][file.content["nodes"][file.node(node)]["mesh"]]
    indices = file.values(mesh["primitives"][0]["indices"])
    return np.asarray(indices).reshape(-1, 3)


def check_order(asset: Asset, written: Path) -> None:
    """Each triangle keeps its place in the order; Godot reverses the winding of all."""
    theirs = np.array(json.loads(written.read_text(encoding="utf-8"))).reshape(-1, 3)
    ours = indices_of(asset.folder / "cards.glb", "cards_LOD0")
    np.testing.assert_array_equal(np.sort(theirs, axis=1), np.sort(ours, axis=1))


def ranges_of(asset: Asset) -> list[list[float]]:
    """The range of distances [m] of each level, for a field of view of 75 degrees.

    Each level begins where the one before ends, in the middle of the band in which both are drawn;
    there the hair covers the fraction of the screen that the file states. The last one ends at 0.
    """
    path = asset.folder / "cards.glb"
    file = GlbFile.of(path.read_bytes(), str(path))
    extras = file.content["nodes"][file.node("cards_LOD0")]["extras"]
    sidecar = json.loads((asset.folder / "cards.hairloom.json").read_text(encoding="utf-8"))
    bounds = sidecar["levels"][0]["bounds"]
    height = float(np.subtract(bounds["maximum"], bounds["minimum"]).max())
    tops = [
        height / (2.0 * math.tan(math.radians(75.0 / 2.0)) * math.sqrt(each))
        for each in extras["MSFT_screencoverage"][:-1]
    ]
    assert 0.0 < tops[0] < tops[1]
    return [list(each) for each in zip([0.0, *tops], [*tops, 0.0], strict=True)]


def test_godot_draws_cards_as_we_do(asset: Asset, sandbox: str) -> None:
    """With files that no editor has imported."""
    project = godot_project(asset, "godot")
    run_godot(sandbox, "--path", str(project), "--", str(project))
    check_picture(asset, project / "godot.png")
    check_fog(asset, project / "fog.png")
    check_order(asset, project / "order.json")
    shown = json.loads((project / "shown.json").read_text(encoding="utf-8"))
    np.testing.assert_allclose(shown.pop("ranges"), ranges_of(asset), rtol=1e-5)
    assert shown == {"plain": ["cards_LOD0"], "second": ["cards_LOD1"], "beyond": ["cards_LOD2"]}


def test_a_game_that_godot_exported_draws_cards_as_we_do(asset: Asset, sandbox: str) -> None:
    """Imported by the add-on, packed without the source files, run from another folder."""
    project, game = godot_project(asset, "godot_editor"), asset.folder / "game"
    game.mkdir()
    output = run_godot(sandbox, "--path", str(project), "--import", window=False)
    assert "WARNING" not in output and "ERROR" not in output, output
    pack = game / "game.pck"
    run_godot(sandbox, "--path", str(project), "--export-pack", "Pack", str(pack), window=False)
    shutil.rmtree(project)
    output = run_godot(sandbox, "--main-pack", str(pack), "--", str(game))
    assert "WARNING" not in output and "ERROR" not in output, output
    check_picture(asset, game / "godot.png")
    check_order(asset, game / "order.json")
    shown = json.loads((game / "shown.json").read_text(encoding="utf-8"))
    np.testing.assert_allclose(shown.pop("ranges"), ranges_of(asset), rtol=1e-5)
    assert shown == {"second": ["cards_LOD1"], "beyond": ["cards_LOD2"]}


def test_three_js_draws_cards_as_we_do(asset: Asset, sandbox: str) -> None:
    if not THREE.is_dir():
        pytest.skip("three.js is missing: `make setup` installs it")
    site = asset.folder / "web"
    shutil.copytree(HERE / "three", site)
    shutil.copytree(ENGINES / "three", site / "hairloom")
    shutil.copytree(THREE, site / "three")
    shutil.copytree(asset.folder, site / "asset", ignore=OF_ENGINES)
    shutil.copy2(REPOSITORY / "tools" / "draw_page.py", site)
    command = [sandbox, "run", "python3", str(site / "draw_page.py")]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    check_picture(asset, site / "three.png")
    check_fog(asset, site / "fog.png")
    shown = json.loads((site / "levels.json").read_text(encoding="utf-8"))
    sidecar = json.loads((asset.folder / "cards.hairloom.json").read_text(encoding="utf-8"))
    assert shown.pop("begins") == pytest.approx([begin for begin, _ in ranges_of(asset)], rel=1e-5)
    assert shown.pop("shared") is True  # passes share vertices
    assert shown == {"plain": ["cards_LOD0"], "second": sidecar["levels"][1]["triangles"]}


#: fraction of the second level in the view of `fading`
SHARE = 0.3


def fading(asset: Asset, folder: Path) -> None:
    """An asset whose first level fades to the second at the view's distance: the field of view
    makes this 2 % nearer than the distance that the file states."""
    shutil.copytree(asset.folder, folder, ignore=OF_ENGINES)
    view = json.loads((folder / "view.json").read_text(encoding="utf-8"))
    sidecar = json.loads((folder / "cards.hairloom.json").read_text(encoding="utf-8"))
    bounds = sidecar["levels"][0]["bounds"]
    center = np.add(bounds["minimum"], bounds["maximum"]) / 2.0
    distance = float(np.linalg.norm(np.subtract(view["eye"], center)))
    begin = distance / (1.0 + 0.1 * (SHARE - 0.5))
    slope = ranges_of(asset)[1][0] / begin * math.tan(math.radians(75.0 / 2.0))
    view["fade_field_of_view"] = math.degrees(2.0 * math.atan(slope))
    (folder / "view.json").write_text(json.dumps(view), encoding="utf-8")


def check_fade(folder: Path, *mixed: str) -> None:
    """Each pixel is from one of the two levels, and the coarser one has the right fraction; without
    cross-fade, all pixels are from one level."""
    names = ("fine", "coarse", "at_once", *mixed)
    pictures = {
        name: read_texture(folder / f"{name}.png", is_color=False)[..., :3] for name in names
    }
    fine, coarse = pictures["fine"], pictures["coarse"]
    tells = np.abs(fine - coarse).max(axis=-1) > 8.0 / 255.0
    assert tells.mean() > 0.02
    at_once = pictures["at_once"]
    assert min(np.abs(at_once - each).max() for each in (fine, coarse)) < 1.5 / 255.0
    for name in mixed:
        of_fine, of_coarse = (
            np.abs(pictures[name] - each).max(axis=-1) < 1.5 / 255.0 for each in (fine, coarse)
        )
        # rounding differs for hair of another size, in a few pixels at edges of cards
        assert (of_fine | of_coarse).mean() > 0.9999, name
        share = of_coarse[tells].mean()
        assert share == pytest.approx(SHARE, abs=0.03), name


def test_godot_fades_levels_pixel_by_pixel(baked: Asset, sandbox: str) -> None:
    """Also with the add-on in an unusual folder."""
    project = baked.folder / "godot_fade"
    shutil.copytree(HERE / "godot_fade", project)
    shutil.copytree(ENGINES / "godot", project / "tools" / "hair cards")
    fading(baked, project / "asset")
    run_godot(sandbox, "--path", str(project), "--", str(project))
    check_fade(project, "both", "scaled")


def test_three_js_fades_levels_pixel_by_pixel(baked: Asset, sandbox: str) -> None:
    if not THREE.is_dir():
        pytest.skip("three.js is missing: `make setup` installs it")
    site = baked.folder / "web_fade"
    shutil.copytree(HERE / "three_fade", site)
    shutil.copytree(ENGINES / "three", site / "hairloom")
    shutil.copytree(THREE, site / "three")
    fading(baked, site / "asset")
    shutil.copy2(REPOSITORY / "tools" / "draw_page.py", site)
    command = [sandbox, "run", "python3", str(site / "draw_page.py")]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    check_fade(site, "both", "copy", "scaled")


def test_three_js_draws_hair_in_scenes_of_many_kinds(baked: Asset, sandbox: str) -> None:
    """A mirror that draws the hair from far away changes no pixel, nor does a logarithmic depth
    buffer (except for rounding); clipping planes cut the hair."""
    if not THREE.is_dir():
        pytest.skip("three.js is missing: `make setup` installs it")
    site = baked.folder / "web_scene"
    shutil.copytree(HERE / "three_scene", site)
    shutil.copytree(ENGINES / "three", site / "hairloom")
    shutil.copytree(THREE, site / "three")
    fading(baked, site / "asset")
    shutil.copy2(REPOSITORY / "tools" / "draw_page.py", site)
    command = [sandbox, "run", "python3", str(site / "draw_page.py")]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    plain, mirror, logarithmic, clipped, bare = (
        read_texture(site / f"{name}.png", is_color=False)[..., :3]
        for name in ("plain", "mirror", "logarithmic", "clipped", "bare")
    )
    assert json.loads((site / "mirrors.json").read_text(encoding="utf-8"))["mirrors"] == 1
    assert (np.abs(plain - bare).max(axis=-1) > 0.1).mean() > 0.1, "there is hair in it"
    np.testing.assert_array_equal(mirror, plain)
    # touching cards differ in other bits of depth
    assert (np.abs(logarithmic - plain).max(axis=-1) > 8.0 / 255.0).mean() < 0.002
    np.testing.assert_array_equal(clipped[..., 0], bare[..., 0])  # the ball is pure blue
    assert clipped[..., 2].max() == 0.0, "the planes cut all meshes"


def test_three_js_shows_damaged_files_as_far_as_possible_and_reports_them(
    baked: Asset, sandbox: str
) -> None:
    if not THREE.is_dir():
        pytest.skip("three.js is missing: `make setup` installs it")
    site = baked.folder / "web_damaged"
    shutil.copytree(HERE / "three_damaged", site)
    shutil.copytree(ENGINES / "three", site / "hairloom")
    shutil.copytree(THREE, site / "three")
    shutil.copy2(REPOSITORY / "tools" / "draw_page.py", site)
    cases = {"whole": lambda folder: None} | {each.__name__: each for each in DAMAGES}
    files = {}
    for name, damage in cases.items():
        (glb,) = damaged_copy(baked.folder, site / name, damage).glob("*.glb")
        files[name] = glb.name
    for textures in ("exr", "dds"):
        settings = CardExportSettings(index_buffer=True, textures=textures)
        made = write_asset(f"damaged_{textures}", "baked", settings)
        shutil.copytree(made.folder, site / textures)
        files[textures] = "cards.glb"
    (site / "cases.json").write_text(json.dumps(files), encoding="utf-8")
    command = [sandbox, "run", "python3", str(site / "draw_page.py")]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    seen = json.loads((site / "seen.json").read_text(encoding="utf-8"))
    whole = seen.pop("whole")
    assert whole["warnings"] == [] and whole["levels"] == 3 and whole["filled"] > 0.1
    for found in (whole, *seen.values()):
        assert found["bare"] == []
        # three.js keeps its own table for plain materials
        assert found["left"]["textures"] <= 1 < found["held"]
        assert found["left"]["geometries"] == found["left"]["programs"] == 0
    assert whole["left"]["textures"] == 0
    exr, dds = seen.pop("exr"), seen.pop("dds")
    assert exr["warnings"] == [] and exr["off"] < 0.001
    assert dds["levels"] == 3 and all("textures as PNG" in each for each in dds["warnings"])
    for damage, sentence in DAMAGES.items():
        found = seen.pop(damage.__name__)
        assert bool(found["warnings"]) == bool(sentence), damage.__name__
        assert all(sentence in each for each in found["warnings"]), damage.__name__
        is_plain = damage in (without_sidecar, with_garbage_sidecar, with_other_levels)
        assert found["levels"] == (0 if is_plain else 3)
        # at the same place, of the same size and similar brightness
        assert found["filled"] == pytest.approx(whole["filled"], rel=0.05), damage.__name__
        assert found["off"] < 0.03, damage.__name__
        assert 0.3 < found["light"] / whole["light"] < 3.0, damage.__name__
    assert not seen


def test_godot_shows_damaged_files_as_far_as_possible_and_reports_them(
    baked: Asset, sandbox: str
) -> None:
    project = baked.folder / "godot_damaged"
    shutil.copytree(HERE / "godot_damaged", project)
    shutil.copytree(ENGINES / "godot", project / "addons" / "hairloom")
    cases = {"whole": lambda folder: None} | {each.__name__: each for each in DAMAGES}
    files = {}
    for name, damage in cases.items():
        (glb,) = damaged_copy(baked.folder, project / name, damage).glob("*.glb")
        files[name] = glb.name
    (project / "cases.json").write_text(json.dumps(files), encoding="utf-8")
    output = run_godot(sandbox, "--path", str(project), "--", str(project))
    parts = dict(part.split("\n", 1) for part in output.split("CASE ")[1:])
    sentences = {
        name: re.findall(r"^(?:WARNING|ERROR): (.+)$", part, flags=re.M)
        for name, part in parts.items()
    }
    seen = json.loads((project / "seen.json").read_text(encoding="utf-8"))
    assert sentences.pop("whole") == [] and seen["whole"]["own"] == 3
    assert seen["whole"]["filled"] > 0.1
    for damage, sentence in DAMAGES.items():
        name = damage.__name__
        if damage is without_index_buffer:  # Godot cannot use its order of back faces
            assert sentences[name] == []
            continue
        if (
            damage is with_quantised_positions
        ):  # Godot 4.6 does not read such files, with or without the add-on
            assert seen[name] is None and "cannot be read" in sentences[name][-1]
            continue
        expected = {without_sidecar: "no sidecar", with_garbage_sidecar: "no sidecar"}.get(
            damage, sentence
        )
        assert sentences[name] and all(expected in each for each in sentences[name]), name
        is_plain = damage in (without_sidecar, with_garbage_sidecar, with_other_levels)
        assert (seen[name]["own"] == 0) == is_plain, name
        # a plain material is lit from all sides, ours only by the sun
        filled = pytest.approx(seen["whole"]["filled"], rel=0.4 if is_plain else 0.1)
        assert seen[name]["filled"] == filled, name
