"""Draws the looping animations of docs/quick_start.md and the tutorials.

python tools/motion_pictures.py FOLDER

They are animated WebP, which code hosts show as pictures of a page, unlike films.
"""

import sys
import tempfile
from pathlib import Path
from typing import Any

import bpy
import gpu
import numpy as np
from extension_loader import load_package
from PIL import Image

SIDE, SAMPLES = 480, 4
#: frames of the scene that a loop takes, at 24 a second, of which every second one is drawn
LOOP, STEP = 72, 2
#: part of a loop -> turn about the vertical axis and nod of the head [degrees]
TURNS = (
    (0.0, 0.0, 0.0),
    (0.22, 26.0, -3.0),
    (0.4, 12.0, 5.0),
    (0.62, -26.0, -3.0),
    (0.84, -8.0, 4.0),
)
#: of WebP, up to 100
QUALITY = 86


def main(folder: Path) -> None:
    gpu.init()
    load_package().register()
    bpy.ops.hairloom.sample_scene(plays=False)
    scene, hair = bpy.context.scene, bpy.context.object
    scene.hairloom.picture.samples = SAMPLES
    turn(hair.data.surface)
    bake = hair.hairloom.bake
    with tempfile.TemporaryDirectory() as scratch:
        # after a first loop, hair begins each loop where it ends
        bake.folder, bake.use_own_range, bake.first, bake.last = scratch, True, 1, 2 * LOOP
        bpy.ops.hairloom.bake()
        write_loop(folder / "turning.webp", render_loop(scene, Path(scratch)))


def turn(head: Any) -> None:
    """Keyframes that loop smoothly."""
    head.animation_data_clear()
    for fraction, angle, nod in (*TURNS, (1.0, *TURNS[0][1:])):
        head.rotation_euler = np.radians((nod, 0.0, angle))
        head.keyframe_insert("rotation_euler", frame=1.0 + fraction * LOOP)
    (bag,) = head.animation_data.action.layers[0].strips[0].channelbags
    for curve in bag.fcurves:
        curve.modifiers.new("CYCLES")


def render_loop(scene: Any, scratch: Path) -> list[Image.Image]:
    """Pictures of the second loop."""
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.render.image_settings.file_format = "PNG"
    pictures = []
    for frame in range(LOOP + 1, 2 * LOOP + 1, STEP):
        scene.frame_set(frame)
        scene.render.filepath = str(scratch / f"{frame}.png")
        bpy.ops.render.render(write_still=True)
        pictures.append(Image.open(scene.render.filepath).convert("RGB"))
        print(f"Drew frame {frame}", flush=True)
    return pictures


def write_loop(path: Path, pictures: list[Image.Image]) -> None:
    """Write pictures as an endless loop."""
    first, *others = pictures
    first.save(
        path,
        save_all=True,
        append_images=others,
        duration=round(1000.0 * STEP / 24.0),
        loop=0,
        quality=QUALITY,
        method=6,
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
