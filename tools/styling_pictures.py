"""Draws the pictures of docs/styling.md: what each tool does to hair, before and after.

python tools/styling_pictures.py FOLDER
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
from small_pictures import write_small

WIDTH, HEIGHT, SAMPLES = 560, 600, 8
CURVES, CHILDREN = 1200, 24_000


def of_addon(module: str) -> Any:
    return importlib.import_module(f"{PACKAGE}.addon.{module}")


def grown(**values: Any) -> Any:
    """Hair on a new built-in head, dense enough to look like hair."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.hairloom.add_hairstyle(style="brows", plays=False)
    head = next(obj for obj in bpy.data.objects if obj.type == "MESH")
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    head.select_set(True)
    bpy.context.view_layer.objects.active = head
    bpy.ops.hairloom.add_groom(
        strand_count=CURVES, density_group="scalp", plays=False, per_vertex=False, **values
    )
    hair = bpy.context.object
    children = hair.data.hairloom.children
    children.method, children.strand_count = "multi", CHILDREN
    hair.hairloom.children_density = "scalp"
    return hair


def picture(hair: Any) -> np.ndarray:
    """The hair as it is now."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for session in list(of_addon("blender.preview.previews").sessions()):
        of_addon("blender.preview.previews").stop(session)
    shown = of_addon("blender.pictures.showing").shown_groom(hair, depsgraph)
    image = shown.studio.picture(shown.pose, shown.points, WIDTH, HEIGHT, SAMPLES)
    return np.asarray(image)


def sheet(folder: Path, name: str, pictures: list[np.ndarray]) -> None:
    """Side by side, as a small file."""
    images = of_addon("blender.base.images")
    with tempfile.TemporaryDirectory() as drawn:
        images.write_png(Path(drawn) / "sheet.png", images.contact_sheet(pictures, len(pictures)))
        write_small(Path(drawn) / "sheet.png", folder / name)


def settle(folder: Path) -> None:
    hair = grown(method="normals", length=0.24)
    pictures = [picture(hair)]
    bpy.ops.hairloom.settle()
    sheet(folder, "settle.jpg", [*pictures, picture(hair)])


def parting(folder: Path) -> None:
    hair = grown(method="normals", length=0.24)
    bpy.ops.hairloom.add_parting()
    bpy.ops.hairloom.comb_parting()
    pictures = [picture(hair)]
    bpy.ops.hairloom.settle()
    sheet(folder, "parting.jpg", [*pictures, picture(hair)])


def main(folder: Path) -> None:
    gpu.init()
    load_package().register()
    settle(folder)
    parting(folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
