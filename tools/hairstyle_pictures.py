"""Draws the pictures of docs/hairstyles.md: each hairstyle that the page makes from nothing, after
each of its steps.

python tools/hairstyle_pictures.py FOLDER [NAME ...]
"""

import sys
from pathlib import Path

import bpy
import gpu
import styling_pictures
from extension_loader import load_package
from guide_steps import steps

#: smaller than other pictures: there are three in a row
WIDTH, HEIGHT, SAMPLES = 400, 430, 5


def main(folder: Path, names: list[str]) -> None:
    gpu.init()
    load_package().register()
    styling_pictures.WIDTH, styling_pictures.HEIGHT = WIDTH, HEIGHT
    styling_pictures.SAMPLES = SAMPLES
    for name, codes in steps().items():
        if names and name not in names:
            continue
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        known = {"bpy": bpy}
        pictures = []
        for code in codes:
            exec(compile(code, name, "exec"), known)
            pictures.append(styling_pictures.picture(known["hair"]))
        styling_pictures.sheet(folder, f"from_nothing_{name}.jpg", pictures)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
