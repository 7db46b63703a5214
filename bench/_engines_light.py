"""Colours of exported hair in an engine beside the same strands as Hairloom draws them.

The web page of a bob's cards, which uses the shaders of docs/engines, is drawn in Chromium in the
light of one sun from the front, of one from the side, or of a grey sky. Its mean colour, where the
strands cover a pixel, is compared with theirs, with opacity maps and scattering. The head is a
holdout.

light_LOOK_LIGHT_percent is how far it is off, the worst channel.

Writes out/bench_page/light_LOOK.png, strands above and the page below.
"""

from __future__ import annotations

import base64
import json
import math
import subprocess
from dataclasses import replace
from typing import Any

import bpy
import numpy as np
from _cards_strands import _shown
from _engines_atlas import _lit
from _engines_page import OUTPUT, REPOSITORY, SANDBOX

import hairloom
from hairloom.addon.blender.base.images import contact_sheet, write_png
from hairloom.addon.blender.cards.build import CardInputs, read_inputs
from hairloom.addon.blender.cards.files import CardOutput, write_cards
from hairloom.addon.cards.export_settings import CardExportSettings
from hairloom.addon.exchange.textures.texture_files import read_texture
from hairloom.addon.render.camera import Camera, frame_camera
from hairloom.addon.render.frame import render_image
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.settings import ShadingSettings

STYLE = "bob"
#: melanin of each look
LOOKS = {"blond": 0.25, "brown": 0.6, "black": 1.0}
SIZE, FIELD_OF_VIEW, SAMPLES = 320, 30.0, 1
#: from the hair to the eye
TO_EYE = np.array([-0.6, -0.8, 0.25])
#: name -> the sun's angle around the hair from the eye [rad]; None: a grey sky
LIGHTS = {"front": 0.25, "side": -math.pi / 3.0, "sky": None}
HEIGHT, IRRADIANCE, SKY = 0.5, 4.0, 1.0

STAGE = """(() => {
  const { scene, hair, camera, renderer } = globalThis.hairloom;
  hair.autoUpdate = false;
  hair.levels.forEach(({ object }, number) => { object.visible = number === 0; });
  const suns = [];
  scene.traverse((each) => {
    if (each.isDirectionalLight) suns.push(each);
    if (each.isAmbientLight) { each.color.set('#ffffff'); each.intensity = Math.PI * SKY; }
  });
  suns.forEach((sun, number) => {
    sun.intensity = number ? 0 : IRRADIANCE;
    sun.color.set('#ffffff');
  });
  suns[0].position.set(...TO_SUN).multiplyScalar(10);
  suns[0].target.position.set(0, 0, 0);
  suns[0].updateMatrixWorld();
  suns[0].target.updateMatrixWorld();
  scene.background = null;
  renderer.setClearColor(0x000000, 1);
  renderer.setPixelRatio(1);
  renderer.setSize(SIZE, SIZE, false);
  camera.matrixAutoUpdate = false;
  camera.matrix.fromArray(CAMERA);
  camera.matrixWorldNeedsUpdate = true;
  camera.updateMatrixWorld();
  Object.assign(camera, { aspect: 1, fov: FIELD, near: 0.05, far: 20 });
  camera.updateProjectionMatrix();
  renderer.render(scene, camera);
  return renderer.domElement.toDataURL();
})()"""


def light_figures() -> dict[str, Any]:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    if not hasattr(bpy.types.Scene, "hairloom"):
        hairloom.register()
    bpy.ops.hairloom.add_hairstyle(style=STYLE, plays=False)
    inputs = read_inputs(bpy.context.object, bpy.context.evaluated_depsgraph_get())[0]
    found: dict[str, Any] = {}
    for name, melanin in LOOKS.items():
        look = replace(inputs.settings[ShadingSettings], pigment="melanin", melanin=melanin)
        found |= _of_look(name, replace(inputs, settings=inputs.settings.with_settings(look)))
    return found


def _of_look(name: str, inputs: CardInputs) -> dict[str, Any]:
    camera = frame_camera(inputs.rig.strands.bounds(), TO_EYE, math.radians(FIELD_OF_VIEW), 1.0)
    ours = [_strands(inputs, camera, turn) for turn in LIGHTS.values()]
    theirs = _page(name, inputs, camera)
    found = {}
    for light, strands, page in zip(LIGHTS, ours, theirs, strict=True):
        is_hair = strands[..., 3] > 0.95
        ratio = page[is_hair].mean(axis=0) / strands[is_hair][:, :3].mean(axis=0)
        print(f"{name} {light}: {ratio.round(2)} of the strands' light", flush=True)
        found[f"light_{name}_{light}_percent"] = 100.0 * float(np.abs(ratio - 1.0).max())
    opaque = [np.concatenate([page, np.ones((SIZE, SIZE, 1))], axis=-1) for page in theirs]
    sheet = [_shown(each) for each in (*ours, *opaque)]
    write_png(OUTPUT / f"light_{name}.png", contact_sheet(sheet, len(LIGHTS)))
    return found


def _to_sun(turn: float) -> np.ndarray:
    x, y, _ = TO_EYE
    found = np.array(
        [x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn), HEIGHT]
    )
    return found / np.linalg.norm(found)


def _strands(inputs: CardInputs, camera: Camera, turn: float | None) -> np.ndarray:
    hair = replace(_lit(inputs), lights=(), ambient=(SKY,) * 3)
    if turn is not None:
        sun = Light.sun(tuple(-_to_sun(turn)), (1.0, 1.0, 1.0), IRRADIANCE)
        hair = replace(hair, lights=(sun,), ambient=(0.0, 0.0, 0.0))
    return render_image(hair, camera, SIZE, SIZE, SAMPLES)


def _page(name: str, inputs: CardInputs, camera: Camera) -> list[np.ndarray]:
    """The page's pictures, scene-linear, (SIZE, SIZE, 3)."""
    OUTPUT.mkdir(parents=True, exist_ok=True)
    settings = CardExportSettings(page=True, page_head=False)
    page = (OUTPUT / f"light_{name}.glb").with_suffix(".html")
    write_cards(page.with_suffix(".glb"), inputs, CardOutput(settings=settings))
    steps: list[dict[str, Any]] = [
        {"media": {"prefers-reduced-motion": "reduce"}},
        {"screen": [1000, SIZE, 1]},
        {"open": True},
        *({"evaluate": _stage(camera, turn)} for turn in LIGHTS.values()),
    ]
    (OUTPUT / "steps.json").write_text(json.dumps(steps), encoding="utf-8")
    driver = REPOSITORY / "tools" / "drive_page.py"
    command = [SANDBOX, "run", "python3", str(driver), str(page), str(OUTPUT / "steps.json")]
    subprocess.run([SANDBOX, "engines"], check=True)
    subprocess.run([*command, str(OUTPUT)], check=True, timeout=500)
    report = json.loads((OUTPUT / "report.json").read_text(encoding="utf-8"))
    return [_decoded(value) for value in report["values"][-len(LIGHTS) :]]


def _stage(camera: Camera, turn: float | None) -> str:
    up = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # the file's Y is up
    place = up @ np.linalg.inv(camera.view)
    values = {
        "SKY": SKY if turn is None else 0.0,
        "IRRADIANCE": 0.0 if turn is None else IRRADIANCE,
        "TO_SUN": [0, 1, 0] if turn is None else (up[:3, :3] @ _to_sun(turn)).tolist(),
        "SIZE": SIZE,
        "CAMERA": place.T.ravel().tolist(),
        "FIELD": FIELD_OF_VIEW,
    }
    script = STAGE
    for key, value in values.items():
        script = script.replace(key, json.dumps(value))
    return script


def _decoded(address: str) -> np.ndarray:
    path = OUTPUT / "decoded.png"
    path.write_bytes(base64.b64decode(address.partition(",")[2]))
    encoded = np.asarray(read_texture(path, is_color=False))[..., :3]
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
