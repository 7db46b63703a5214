"""Draws the pictures of docs/quick_start.md: the sample scene, baked and rendered by Hairloom.

python tools/quick_start_pictures.py FOLDER
"""

import importlib
import sys
import tempfile
from pathlib import Path
from typing import Any

import bpy
import gpu
import numpy as np
from extension_loader import PACKAGE, load_package

FRAMES, SIDE, SAMPLES = (1, 16, 24, 40), 320, 16


def of_addon(module: str) -> Any:
    return importlib.import_module(f"{PACKAGE}.addon.{module}")


def main(folder: Path) -> None:
    gpu.init()
    load_package().register()
    bpy.ops.hairloom.sample_scene()
    scene, hair = bpy.context.scene, bpy.context.object
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.hairloom.picture.samples = SAMPLES
    bake = hair.hairloom.bake
    pictures = []
    with tempfile.TemporaryDirectory() as scratch:
        bake.folder, bake.use_own_range, bake.first, bake.last = scratch, True, 1, max(FRAMES)
        bpy.ops.hairloom.bake()
        for frame in FRAMES:
            scene.frame_set(frame)
            scene.render.filepath = str(Path(scratch) / "frame.png")
            bpy.ops.render.render(write_still=True)
            image = bpy.data.images.load(scene.render.filepath)
            pixels = np.empty((SIDE, SIDE, 4), np.float32)
            image.pixels.foreach_get(pixels.ravel())
            pictures.append(of_addon("exchange.textures.srgb").srgb_decoded(pixels))
            bpy.data.images.remove(image)
            print(f"Drew frame {frame}", flush=True)
    images = of_addon("blender.base.images")
    images.write_png(folder / "sample.png", images.contact_sheet(pictures, len(FRAMES)))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
