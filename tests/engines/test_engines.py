"""Cards in real engines: three.js in Chromium, and Godot, by the shaders of docs/engines.

Both run where `tools/window_blender run` runs; `tools/window_blender engines` gets them there.
"""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from extension_loader import REPOSITORY

pytest.importorskip("bpy", reason="writing cards needs Blender or the bpy module")

from hairloom.addon import pipeline
from hairloom.addon.blender.cards.build import CardInputs
from hairloom.addon.blender.cards.files import CardOutput, WrittenCards, write_cards
from hairloom.addon.cards.atlas_settings import AtlasSettings
from hairloom.addon.cards.export_settings import CardExportSettings
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.exchange.cards.glb_file import GlbFile
from hairloom.addon.exchange.textures.texture_files import read_texture
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.params import SettingsMap
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.texture_settings import TextureSettings
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.strands import StrandSet

HERE = Path(__file__).parent
ENGINES = REPOSITORY / "docs" / "engines"
THREE = REPOSITORY / "tools" / "node" / "node_modules" / "three"
SANDBOX = str(REPOSITORY / "tools" / "window_blender")
#: the engines run where nothing but the repository is seen
OUTPUT = REPOSITORY / "out" / "engines"
#: what lies beside the files of an asset
OF_ENGINES = shutil.ignore_patterns("godot*", "game", "web")

SIZE, FIELD_OF_VIEW = 480, 30.0
EYE, TARGET = (0.25, -0.45, 0.1), (0.0, 0.0, -0.01)
TO_SUN = tuple(np.array([0.5, -0.7, 0.5]) / np.linalg.norm([0.5, -0.7, 0.5]))
IRRADIANCE = 4.0
NEAR, FAR = 0.05, 5.0

MOST_MEAN = 1.0 / 255.0
#: Share of pixels that differ by more than 8 / 255, at most: mip maps are not made alike, and sharp
#: highlights show it. Baked cards that did not grow denser at a slant would be at 0.022.
MOST_DIFFERENT = {"kajiya_kay": 0.03, "marschner": 0.005, "baked": 0.015}


@dataclass(frozen=True)
class Asset:
    """A folder with all that an engine reads, and the same picture by Hairloom, row 0 on top."""

    folder: Path
    picture: np.ndarray


def curtain() -> StrandSet:
    """Strands that hang around a circle."""
    angle = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(40)], axis=-1)
    fall = np.linspace([0.0, 0.0, 0.1], [0.0, 0.0, -0.1], 8)
    points = out[:, None] * 0.1 + fall + out[:, None] * np.linspace(0.0, 0.05, 8)[:, None] ** 2
    return StrandSet(
        points=points.reshape(-1, 3),
        offsets=np.arange(41) * 8,
        radius=np.full(320, 2.0e-3),
        group=np.zeros(40, np.int32),
    )


def glb_axes(vector: Any) -> list[float]:
    return [float(vector[0]), float(vector[2]), -float(vector[1])]


@pytest.fixture(scope="module", params=["kajiya_kay", "marschner", "baked"])
def asset(request: pytest.FixtureRequest, gpu_context: Any) -> Asset:
    is_baked = request.param == "baked"
    model = "marschner" if is_baked else request.param
    folder = OUTPUT / request.param
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    look = ShadingSettings(
        model=model,
        base_color=(0.5, 0.3, 0.15),
        tip_color=(0.3, 0.1, 0.05),
        tip_tint=0.6,
        grey_fraction=0.1,
    )
    texture = TextureSettings(
        variant_width=16,
        height=64,
        strand_count=6,
        highlights="shift" if model == "kajiya_kay" else "tangent",
    )
    rig = pipeline.prepare(curtain(), None, GuideSettings(), place="curtain")
    settings = SettingsMap(
        CardSettings(source="clusters" if is_baked else "guides", width_factor=1.5, card_count=40),
        AtlasSettings(source="baked" if is_baked else "made", size="512", columns=8),
        texture,
        look,
    )
    output = CardOutput(settings=CardExportSettings(index_buffer=True))
    written = write_cards(folder / "cards.glb", CardInputs(rig, settings), output)
    view = {
        "eye": glb_axes(EYE),
        "target": glb_axes(TARGET),
        "to_sun": glb_axes(TO_SUN),
        "irradiance": IRRADIANCE,
        "size": SIZE,
        "field_of_view": FIELD_OF_VIEW,
        "near": NEAR,
        "far": FAR,
    }
    (folder / "view.json").write_text(json.dumps(view), encoding="utf-8")
    return Asset(folder, by_hairloom(written, look))


def by_hairloom(written: WrittenCards, look: ShadingSettings) -> np.ndarray:
    from hairloom.addon.render.camera import Camera, look_at, perspective
    from hairloom.addon.render.card_snapshot import CardSnapshot
    from hairloom.addon.render.frame import render_image
    from hairloom.addon.render.snapshot import Snapshot

    snapshot = Snapshot(
        np.zeros((0, 2, 3), np.float32),
        np.zeros((0, 2), np.float32),
        cards=CardSnapshot(
            written.mesh,
            written.maps.textures,
            written.maps.has_tangent_map,
            is_view_compensated=written.maps.is_view_compensated,
        ),
        lights=(Light.sun(tuple(-x for x in TO_SUN), (1.0, 1.0, 1.0), IRRADIANCE),),
        ambient=(0.0, 0.0, 0.0),
        shading=look,
        volume=VolumeSettings(shadows="none"),
    )
    projection = perspective(math.radians(FIELD_OF_VIEW), 1.0, NEAR, FAR)
    return render_image(snapshot, Camera(look_at(EYE, TARGET), projection), SIZE, SIZE, 1)


@pytest.fixture(scope="module")
def sandbox() -> str:
    """The program that runs a command where the engines are."""
    result = subprocess.run([SANDBOX, "engines"], capture_output=True, text=True)
    if result.returncode == 77:
        pytest.skip(result.stderr.strip().splitlines()[-1])
    assert result.returncode == 0, result.stderr
    return SANDBOX


def check(asset: Asset, drawn: Path) -> None:
    """The engine's picture is ours, as a screen shows both."""
    theirs = read_texture(drawn, is_color=False)[..., :3]
    ours = read_encoded(asset.picture)
    difference = np.abs(theirs - ours)
    assert (ours.max(axis=-1) > 0.1).mean() > 0.1  # there is hair in it
    assert difference.mean() < MOST_MEAN
    assert (difference.max(axis=-1) > 8.0 / 255.0).mean() < MOST_DIFFERENT[asset.folder.name]


def read_encoded(linear: np.ndarray) -> np.ndarray:
    """Scene-linear in front of black, (height, width, 3), by the sRGB curve."""
    color = np.clip(linear[..., :3], 0.0, 1.0)
    return np.where(color <= 0.0031308, 12.92 * color, 1.055 * color ** (1 / 2.4) - 0.055)


def godot_project(asset: Asset, name: str) -> Path:
    project = asset.folder / name
    shutil.copytree(HERE / "godot", project)
    shutil.copytree(ENGINES, project / "addons" / "hairloom")
    shutil.copytree(asset.folder, project / "asset", ignore=OF_ENGINES)
    return project


def run_godot(sandbox: str, *options: str, window: bool = True) -> str:
    """What it says; no script and no shader may fail."""
    command = [sandbox, "run"]
    if window:
        command += [str(REPOSITORY / "tools" / "with_xvfb"), "godot", "--quit-after", "1000"]
        command += ["--rendering-driver", "vulkan", "--resolution", f"{SIZE}x{SIZE}"]
    else:
        command += ["godot", "--headless"]
    result = subprocess.run([*command, *options], capture_output=True, text=True, timeout=300)
    said = result.stdout + result.stderr
    assert result.returncode == 0, said
    assert "SCRIPT ERROR" not in said and "SHADER ERROR" not in said, said
    return said


def indices_of(glb: Path, node: str) -> np.ndarray:
    """Of the triangles of a node's mesh, (triangle_count, 3)."""
    file = GlbFile.of(glb.read_bytes(), str(glb))
    mesh = file.content["meshes"][file.content["nodes"][file.node(node)]["mesh"]]
    indices = file.values(mesh["primitives"][0]["indices"])
    return np.asarray(indices).reshape(-1, 3)


def check_order(asset: Asset, written: Path) -> None:
    """Each triangle is at its place; Godot turns all of them over."""
    theirs = np.array(json.loads(written.read_text(encoding="utf-8"))).reshape(-1, 3)
    ours = indices_of(asset.folder / "cards.glb", "cards_LOD0")
    np.testing.assert_array_equal(np.sort(theirs, axis=1), np.sort(ours, axis=1))


def ranges_of(asset: Asset) -> list[list[float]]:
    """From where to where each level is shown [m], by a camera of 75 degrees: each begins where the
    last one ends, and that is where the hair takes up the fraction of a screen that the file says;
    0 for the end of the last."""
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
    """Files that no editor has imported."""
    project = godot_project(asset, "godot")
    run_godot(sandbox, "--path", str(project), "--", str(project))
    check(asset, project / "godot.png")
    check_order(asset, project / "order.json")
    shown = json.loads((project / "shown.json").read_text(encoding="utf-8"))
    np.testing.assert_allclose(shown.pop("ranges"), ranges_of(asset), rtol=1e-5)
    assert shown == {"plain": ["cards_LOD0"], "second": ["cards_LOD1"]}


def test_a_game_that_godot_exported_draws_cards_as_we_do(asset: Asset, sandbox: str) -> None:
    """Imported by the add-on, packed without the files themselves, played from elsewhere."""
    project, game = godot_project(asset, "godot_editor"), asset.folder / "game"
    game.mkdir()
    said = run_godot(sandbox, "--path", str(project), "--import", window=False)
    assert "WARNING" not in said and "ERROR" not in said, said
    pack = game / "game.pck"
    run_godot(sandbox, "--path", str(project), "--export-pack", "Pack", str(pack), window=False)
    shutil.rmtree(project)
    said = run_godot(sandbox, "--main-pack", str(pack), "--", str(game))
    assert "WARNING" not in said and "ERROR" not in said, said
    check(asset, game / "godot.png")
    check_order(asset, game / "order.json")
    shown = json.loads((game / "shown.json").read_text(encoding="utf-8"))
    np.testing.assert_allclose(shown.pop("ranges"), ranges_of(asset), rtol=1e-5)
    assert shown == {"second": ["cards_LOD1"]}


def test_three_js_draws_cards_as_we_do(asset: Asset, sandbox: str) -> None:
    if not THREE.is_dir():
        pytest.skip("three.js is missing: `make setup` installs it")
    site = asset.folder / "web"
    shutil.copytree(HERE / "three", site)
    shutil.copytree(ENGINES, site / "hairloom")
    shutil.copytree(THREE, site / "three")
    shutil.copytree(asset.folder, site / "asset", ignore=OF_ENGINES)
    shutil.copy2(REPOSITORY / "tools" / "draw_page.py", site)
    command = [sandbox, "run", "python3", str(site / "draw_page.py")]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    check(asset, site / "three.png")
    shown = json.loads((site / "levels.json").read_text(encoding="utf-8"))
    sidecar = json.loads((asset.folder / "cards.hairloom.json").read_text(encoding="utf-8"))
    assert shown.pop("begins") == pytest.approx([begin for begin, _ in ranges_of(asset)], rel=1e-5)
    assert shown == {"plain": ["cards_LOD0"], "second": sidecar["levels"][1]["triangles"]}
