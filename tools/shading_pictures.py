"""Draws the places of highlights, for docs/shading.md: a ball of combed blond hair.

python tools/shading_pictures.py FOLDER

From the left: R alone, TRT alone, TT alone against the light, all of Marschner's model with the
light in front of the ball, and Kajiya-Kay. Lobes alone are without shadows and scattering.
"""

import importlib
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy  # noqa: F401  it must come before gpu, which lives inside it
import gpu
import numpy as np
from extension_loader import PACKAGE, REPOSITORY, load_package
from hair_ball import ball_mesh, combed_strands
from preset_pictures import BACKDROP

BLOND = REPOSITORY / "presets" / "looks" / "blond.json"
STRANDS, RADIUS = 16_000, 0.003
#: side of a picture [pixels]; what it shows from bottom to top [m]
SIZE, HEIGHT, SAMPLES = 250, 2.3, 4
#: directions of light: past the eye, and towards it
FORWARD, AGAINST = (0.1, -0.25, -1.0), (-0.45, -0.35, 0.8)
STRENGTH = 3.0


def addon_module(module: str) -> Any:
    return importlib.import_module(f"{PACKAGE}.addon.{module}")


def alone(blond: Any, lobe: str) -> Any:
    """One lobe of the look, without approximate multiple scattering."""
    others = {f"strength_{name}": 0.0 for name in ("r", "tt", "trt", "higher") if name != lobe}
    return replace(blond, fake_scattering=0.0, **others)


def main(folder: Path) -> None:
    gpu.init()
    load_package().register()
    frame, images = addon_module("render.frame"), addon_module("blender.base.images")
    cameras, snapshots = addon_module("render.camera"), addon_module("render.snapshot")
    shading, lights = (
        addon_module("parameters").ALL_SETTINGS["shading"],
        addon_module("shading.lights"),
    )
    blond = replace(
        addon_module("params.preset").read_any_preset(BLOND, {shading.section: shading}).settings,
        shift_noise=0.0,
        color_variation=0.2,
    )
    volume = addon_module("parameters").ALL_SETTINGS["volume"]
    strands = combed_strands(STRANDS)
    skin = addon_module("strands").Surface(*ball_mesh())
    ball = replace(snapshots.MeshSnapshot.of(skin, color=(0.0, 0.0, 0.0)), specular=0.0)
    camera = cameras.Camera(
        cameras.look_at((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0)),
        cameras.orthographic(HEIGHT, 1.0, 1.0, 9.0),
    )

    def picture(
        look: Any, shines_along: tuple[float, ...], strength: float, shadows: str = "none"
    ) -> Any:
        snapshot = snapshots.Snapshot(
            strands,
            np.full(strands.shape[:2], RADIUS, np.float32),
            meshes=(ball,),
            lights=(lights.Light.sun(shines_along, (1.0, 1.0, 1.0), strength),),
            ambient=(0.0, 0.0, 0.0),
            shading=look,
            volume=volume(shadows=shadows),
            volume_center=np.zeros(3, np.float32),
        )
        return frame.render_image(snapshot, camera, SIZE, SIZE, SAMPLES, background=BACKDROP)

    shown = [
        picture(alone(blond, "r"), FORWARD, STRENGTH),
        picture(alone(blond, "trt"), FORWARD, STRENGTH),
        picture(alone(blond, "tt"), AGAINST, 0.5 * STRENGTH),
        picture(blond, FORWARD, STRENGTH, "deep"),
        picture(replace(blond, model="kajiya_kay"), FORWARD, STRENGTH, "deep"),
    ]
    images.write_png(folder / "highlights.png", images.contact_sheet(shown, len(shown)))
    print("Wrote highlights.png", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
