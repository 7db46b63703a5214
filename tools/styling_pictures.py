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


def grow(folder: Path) -> None:
    """One groom, edited."""
    hair = grown(length=0.24)
    own = hair.data.hairloom.grow
    pictures = [picture(hair)]
    own.length, own.volume = 0.1, 0.02
    pictures.append(picture(hair))
    own.length, own.comb_back, own.wave, own.clump = 0.3, 0.2, 0.014, 0.6
    sheet(folder, "grow.jpg", [*pictures, picture(hair)])


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


#: strokes of a swept fringe on the built-in head: what they go through, on its skin or near [m]
STROKES = {
    "Fringe": ((0.035, -0.04, 0.1), (-0.01, -0.065, 0.09), (-0.06, -0.06, 0.05)),
    "Top": ((0.035, 0.01, 0.115), (-0.03, 0.0, 0.11), (-0.07, -0.02, 0.06)),
    "Back Top": ((0.035, 0.05, 0.11), (-0.02, 0.07, 0.1), (-0.07, 0.05, 0.04)),
    "Other Side": ((0.04, -0.03, 0.1), (0.065, -0.02, 0.07), (0.08, 0.02, 0.0)),
    "Behind": ((0.04, 0.04, 0.1), (0.07, 0.06, 0.06), (0.075, 0.07, -0.02)),
    "Brow": ((0.045, -0.06, 0.085), (0.07, -0.045, 0.05), (0.08, 0.0, 0.0)),
    "Crown": ((0.02, 0.08, 0.11), (-0.02, 0.1, 0.08), (-0.05, 0.1, 0.02)),
    "Temple": ((-0.06, -0.04, 0.06), (-0.08, 0.01, 0.02), (-0.08, 0.05, -0.03)),
    "Nape": ((0.0, 0.09, 0.09), (0.0, 0.11, 0.03), (0.0, 0.1, -0.05)),
}


def stroke_on(head: Any, name: str, places: Any) -> Any:
    """A curve on the head near these places, as the Draw tool leaves it."""
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new("BEZIER")
    spline.bezier_points.add(len(places) - 1)
    for point, place in zip(spline.bezier_points, places, strict=True):
        _, point.co, _, _ = head.closest_point_on_mesh(place)
        point.handle_left_type = point.handle_right_type = "AUTO"
    stroke = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(stroke)
    stroke.parent = head
    return stroke


def flow(folder: Path) -> None:
    hair = grown(method="normals", length=0.1)
    pictures = [picture(hair)]
    strokes = [stroke_on(hair.parent, name, places) for name, places in STROKES.items()]
    for stroke in strokes:
        stroke.select_set(True)
    bpy.ops.hairloom.add_stroke()
    bpy.ops.hairloom.comb_flow(reach=1.0, falloff=0.5, lift=0.15)
    sheet(folder, "flow.jpg", [*pictures, picture(hair)])


def main(folder: Path) -> None:
    gpu.init()
    load_package().register()
    grow(folder)
    settle(folder)
    parting(folder)
    flow(folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
