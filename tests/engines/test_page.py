"""The web page of an export in Chromium, opened from a file, without a network."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from extension_loader import REPOSITORY

pytest.importorskip("bpy", reason="writing cards needs Blender or the bpy module")

from engine_assets import (
    EYE,
    FIELD_OF_VIEW,
    IRRADIANCE,
    NEAR,
    OUTPUT,
    SIZE,
    TARGET,
    TO_SUN,
    Asset,
    glb_axes,
    read_encoded,
    write_asset,
)
from test_card_motion import motion, write  # noqa: F401

from hairloom.addon.blender.bakes.guide_motion import GuideMotion
from hairloom.addon.cards.export_settings import CardExportSettings
from hairloom.addon.exchange.textures.texture_files import read_texture

TOOLS = REPOSITORY / "tools"
NAME = '</script> "Zöpfe" 头发'
#: Half of the difference is from the page's anti-aliasing, which our picture lacks, the rest from
#: fewer levels in its textures.
MOST_MEAN, MOST_LIGHT = 2.0 / 255.0, 0.05
#: draws the same view as the engines: one sun, a black background, no panel
OWN_VIEW = """(({ hair, scene, camera, redraw }, view) => {
  scene.background = null;
  scene.traverse((each) => { if (each.isLight) each.intensity = 0; });
  const sun = scene.children.find((each) => each.isDirectionalLight);
  [sun.intensity, hair.autoUpdate] = [view.irradiance, false];
  sun.color.set('white');
  sun.target.position.set(0, 0, 0);
  sun.position.set(...view.to_sun);
  hair.levels.forEach(({ object }, number) => { object.visible = number === 0; });
  document.querySelectorAll('aside, header, #corner').forEach((each) => { each.hidden = true; });
  document.querySelector('main').style.display = 'block';
  document.querySelector('#stage').style.height = '100vh';
  camera.fov = view.field_of_view;
  camera.near = view.near;
  camera.updateProjectionMatrix();
  hairloom.controls.target.set(...view.target);
  camera.position.set(...view.eye);
  hairloom.controls.update();
  redraw();
})(hairloom, VIEW)"""


@pytest.fixture(scope="module")
def asset(gpu_context: Any) -> Asset:
    settings = CardExportSettings(page=True, page_texture="2048")
    return write_asset("page", "baked", settings, NAME)


def driven(sandbox: str, asset: Asset, name: str, *steps: dict[str, Any]) -> dict[str, Any]:
    """The browser's report of these steps; pictures are saved in the asset's folder `name`."""
    folder = asset.folder / name
    folder.mkdir()
    page = folder / "a page äö.html"
    shutil.copy2(asset.folder / "cards.html", page)  # no other file is beside it
    (folder / "steps.json").write_text(json.dumps(steps), encoding="utf-8")
    command = [sandbox, "run", "python3", str(TOOLS / "drive_page.py")]
    command += [str(page), str(folder / "steps.json"), str(folder)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=500)
    assert result.returncode == 0, result.stderr
    report: dict[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    return report


def picture(path: Path) -> np.ndarray:
    return read_texture(path, is_color=False)[..., :3]


STILL = {"media": {"prefers-reduced-motion": "reduce"}}


def chosen(selector: str) -> dict[str, str]:
    """A step that clicks an element, which causes a redraw."""
    return {"evaluate": f"document.querySelector({json.dumps(selector)}).click()"}


def test_a_page_opens_from_its_file_and_its_controls_change_the_picture(
    asset: Asset,
    sandbox: str,
) -> None:
    controls = {
        "lights": {
            "evaluate": "{ const bar = document.querySelector('#lights'); bar.value = 120; "
            "bar.dispatchEvent(new Event('input', { bubbles: true })); }"
        },
        "order": chosen("#order"),
        "level": chosen("#levels input[value='2']"),
        "surroundings": chosen("#surroundings input[value='Paper']"),
        "wireframe": chosen("#wireframe"),
    }
    steps: list[dict[str, Any]] = [STILL, {"screen": [760, 480, 1]}, {"open": True}]
    steps += [chosen("#levels input[value='0']"), {"picture": "first.png"}]
    steps += [{"picture": "again.png"}]
    for name, control in controls.items():
        steps += [control, {"picture": f"{name}.png"}]
    steps += [{"evaluate": "document.querySelector('#picture').focus()"}, {"key": "ArrowLeft"}]
    steps += [{"picture": "key.png"}, {"evaluate": "document.querySelector('#status').textContent"}]
    report = driven(sandbox, asset, "controls", *steps)
    assert report["complaints"] == []
    assert [each for each in report["requests"][1:] if not each.startswith("blob:")] == []
    folder = asset.folder / "controls"
    before = picture(folder / "first.png")
    stage = before[:, :440]
    assert stage.std() > 0.05, "there is something in it"
    np.testing.assert_array_equal(picture(folder / "again.png"), before)
    for name in (*controls, "key"):
        after = picture(folder / f"{name}.png")
        changed = (np.abs(after - before)[60:, :440].max(axis=-1) > 4.0 / 255.0).mean()
        assert changed > 0.002, name
        before = after
    sidecar = json.loads((asset.folder / "cards.hairloom.json").read_text(encoding="utf-8"))
    coarse = sidecar["levels"][2]
    assert report["values"][-1] == (
        f"{coarse['triangles']:,} triangles in {coarse['cards']:,} cards, level 2"
    )


def test_a_page_draws_cards_as_we_do(asset: Asset, sandbox: str) -> None:
    """With the same view as in the tests of engines."""
    view = {
        "eye": glb_axes(EYE),
        "target": glb_axes(TARGET),
        "to_sun": glb_axes(TO_SUN),
        "irradiance": IRRADIANCE,
        "field_of_view": FIELD_OF_VIEW,
        "near": NEAR,
    }
    steps = [STILL, {"screen": [SIZE, SIZE, 1]}, {"open": True}]
    steps += [{"evaluate": OWN_VIEW.replace("VIEW)", f"{json.dumps(view)})")}]
    steps += [{"picture": "view.png"}]
    report = driven(sandbox, asset, "view", *steps)
    assert report["complaints"] == []
    theirs, ours = picture(asset.folder / "view" / "view.png"), read_encoded(asset.picture)
    assert (ours.max(axis=-1) > 0.1).mean() > 0.1  # there is hair in it
    assert np.abs(theirs - ours).mean() < MOST_MEAN
    assert theirs.mean() / ours.mean() == pytest.approx(1.0, abs=MOST_LIGHT)


def test_without_webgl_a_page_says_so(asset: Asset, sandbox: str) -> None:
    steps = [{"block_webgl": True}, {"open": True}]
    steps += [{"evaluate": "document.querySelector('#sentence').textContent"}]
    steps += [{"evaluate": "document.querySelector('h1').textContent"}]
    report = driven(sandbox, asset, "no_webgl", *steps)
    sentence, title = report["values"][-2:]
    assert "WebGL 2 is off" in sentence and title == NAME
    assert report["complaints"] == []


def test_motion_plays_unless_the_reader_prefers_reduced_motion(asset: Asset, sandbox: str) -> None:
    """Without an animation the camera moves around the hair, unless reduced motion is preferred."""
    angle = "hairloom.controls.getAzimuthalAngle()"
    pressed = {"evaluate": "document.querySelector('#play').getAttribute('aria-pressed')"}
    steps = [{"screen": [300, 300, 1]}, {"open": True}, pressed]
    goes = [{"evaluate": f"globalThis.begin = {angle}"}, {"wait": f"{angle} !== begin"}]
    moving = driven(sandbox, asset, "moving", *steps, *goes)
    frame = {"evaluate": "new Promise((done) => requestAnimationFrame(done)).then(() => 0)"}
    begin, end = ({"evaluate": angle} for _ in range(2))
    still = driven(sandbox, asset, "still", STILL, *steps, begin, *[frame] * 10, end)
    assert moving["values"][2] == "true"
    assert still["values"][3] == "false" and still["values"][4] == still["values"][-1]


#: the median distance [m] that roots have moved since the page was opened, relative to the head and
#: in world space
WAY_OF_ROOTS = """(() => {
  const { hair, scene } = hairloom;
  const [mesh] = hair.levels[0].object.children;
  const { position, uv1 } = mesh.geometry.attributes;
  let head;
  scene.traverse((each) => { if (Array.isArray(each.material)) head = each; });
  scene.updateMatrixWorld(true);
  const places = [];
  for (let number = 0; number < position.count; number++) {
    if (uv1.getY(number) > 0.01) continue;
    const world = mesh.getVertexPosition(number, hair.center.clone());
    mesh.localToWorld(world);
    places.push([head.worldToLocal(world.clone()), world]);
  }
  globalThis.atFirst ??= places;
  const way = (which) => places.map((each, at) => each[which].distanceTo(atFirst[at][which]));
  const median = (which) => way(which).sort((one, two) => one - two)[places.length >> 1];
  return [median(0), median(1)];
})()"""


def test_the_head_moves_with_hair_that_has_its_motion(
    motion: GuideMotion,  # noqa: F811
    sandbox: str,
) -> None:
    folder = OUTPUT / "page_in_world"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    more = {"motion_space": "world", "page": True, "page_texture": "512"}
    write(folder / "cards.glb", motion, kind="joints", **more)
    asset = Asset(folder, np.empty(0))
    steps: list[dict[str, Any]] = [STILL, {"screen": [300, 300, 1]}, {"open": True}]
    steps += [{"evaluate": WAY_OF_ROOTS}, chosen("#play")]
    steps += [{"wait": f"(globalThis.seen = {WAY_OF_ROOTS})[1] > 0.02"}, {"evaluate": "seen"}]
    report = driven(sandbox, asset, "moving", *steps)
    assert report["complaints"] == []
    to_head, in_world = report["values"][-1]
    assert in_world > 0.02 and to_head < 0.1 * in_world
