"""Draws the picture of docs/tutorials/look_like_cycles.md by walking its steps; the other tutorials
show pictures of other pages.

python tools/tutorial_pictures.py FOLDER
"""

import sys
import tempfile
from pathlib import Path
from typing import Any

import bpy
import gpu
import numpy as np
from extension_loader import load_package
from guide_steps import tutorial
from styling_pictures import addon_module, sheet

SIDE, SAMPLES, CYCLES_SAMPLES = 420, 12, 48


def main(folder: Path) -> None:
    gpu.init()
    load_package().register()
    known: dict[str, Any] = {"bpy": bpy}
    *before, last = tutorial("look_like_cycles")
    for code in before:
        exec(compile(code, "step", "exec"), known)
    bpy.context.scene.hairloom.picture.samples = SAMPLES
    pictures = [rendered()]
    exec(compile(last, "step", "exec"), known)
    cycles = bpy.context.scene.cycles
    cycles.samples, cycles.use_denoising = CYCLES_SAMPLES, True
    sheet(folder, "tutorial_cycles.jpg", [*pictures, rendered()])


def rendered() -> np.ndarray:
    """The scene by its own engine, (SIDE, SIDE, 4) scene-linear."""
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.render.image_settings.file_format = "PNG"
    pixels = np.empty((SIDE, SIDE, 4), np.float32)
    with tempfile.TemporaryDirectory() as scratch:
        scene.render.filepath = str(Path(scratch) / "picture.png")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath, check_existing=False)
        image.pixels.foreach_get(pixels.ravel())
        bpy.data.images.remove(image)
    return np.asarray(addon_module("exchange.textures.srgb").srgb_decoded(pixels))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
