"""Draws the pictures of docs/styling.md and docs/painting.md: what each tool does to hair, before
and after.

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
#: the frame of a shake that is pictured
SHAKE_FRAME = 8


def addon_module(module: str) -> Any:
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
    """A picture of the hair as it is now."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for session in list(addon_module("blender.preview.previews").sessions()):
        addon_module("blender.preview.previews").stop(session)
    shown = addon_module("blender.pictures.showing").shown_groom(hair, depsgraph)
    image = shown.studio.picture(shown.pose, shown.points, WIDTH, HEIGHT, SAMPLES)
    return np.asarray(image)


def sheet(folder: Path, name: str, pictures: list[np.ndarray]) -> None:
    """Write pictures side by side, as a small file."""
    images = addon_module("blender.base.images")
    with tempfile.TemporaryDirectory() as temporary:
        images.write_png(
            Path(temporary) / "sheet.png", images.contact_sheet(pictures, len(pictures))
        )
        write_small(Path(temporary) / "sheet.png", folder / name)


def grow(folder: Path) -> None:
    """Draw one groom while it is edited."""
    hair = grown(length=0.24)
    settings = hair.data.hairloom.grow
    pictures = [picture(hair)]
    settings.length, settings.volume = 0.1, 0.02
    pictures.append(picture(hair))
    settings.length, settings.comb_back, settings.wave, settings.clump = 0.3, 0.2, 0.014, 0.6
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


#: strokes of a swept fringe on the built-in head: points on their way, on its skin or near [m]
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


def stroke_on(head: Any, name: str, points: Any) -> Any:
    """A curve on the head near these places, as the Draw tool leaves it."""
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new("BEZIER")
    spline.bezier_points.add(len(points) - 1)
    for bezier_point, point in zip(spline.bezier_points, points, strict=True):
        _, bezier_point.co, _, _ = head.closest_point_on_mesh(point)
        bezier_point.handle_left_type = bezier_point.handle_right_type = "AUTO"
    stroke = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(stroke)
    stroke.parent = head
    return stroke


def flow(folder: Path) -> None:
    hair = grown(method="normals", length=0.1)
    pictures = [picture(hair)]
    strokes = [stroke_on(hair.parent, name, points) for name, points in STROKES.items()]
    for stroke in strokes:
        stroke.select_set(True)
    bpy.ops.hairloom.add_stroke()
    bpy.ops.hairloom.comb_flow(reach=1.0, falloff=0.5, lift=0.15)
    sheet(folder, "flow.jpg", [*pictures, picture(hair)])


def shaken(hair: Any) -> np.ndarray:
    """The hair in the middle of a shake of the head."""
    scene, head = bpy.context.scene, hair.parent
    scene.frame_start, scene.frame_end = 1, SHAKE_FRAME
    for frame, (turn, shift) in {1: (0, 0), 5: (0.9, 0.03), 10: (-0.9, -0.03)}.items():
        head.rotation_euler.z, head.location.x = turn, shift
        head.keyframe_insert("rotation_euler", frame=frame)
        head.keyframe_insert("location", frame=frame)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    session = addon_module("blender.preview.previews").start(hair, depsgraph)
    hair.hairloom.bake.follows = True
    for frame in range(1, SHAKE_FRAME + 1):
        scene.frame_set(frame)
    shown = addon_module("blender.pictures.showing").shown_groom(hair, depsgraph)
    image = shown.studio.picture(shown.pose, session.strands, WIDTH, HEIGHT, SAMPLES)
    return np.asarray(image)


def painted(folder: Path) -> None:
    """Draw stiffness painted on one half of the head."""
    pictures = []
    for name in ("", "Stiff"):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        bpy.ops.hairloom.add_hairstyle(style="long_straight", plays=False)
        hair = bpy.context.object
        head, dynamics, children = hair.parent, hair.hairloom.dynamics, hair.data.hairloom.children
        children.method, children.strand_count, dynamics.device = "multi", 5000, "numpy"
        hair.data.hairloom.guides.guide_count = 300
        group = head.vertex_groups.new(name="Stiff")
        for vertex in head.data.vertices:
            group.add([vertex.index], min(max(0.5 - vertex.co.x / 0.02, 0.02), 1.0), "REPLACE")
        dynamics.style_root, dynamics.style_tip, dynamics.bend = 9.0, 7.0, 6.0
        if not name:
            dynamics.style_root, dynamics.style_tip, dynamics.bend = 1.0, 0.2, 0.2
        dynamics.style_root_mask = dynamics.style_tip_mask = dynamics.bend_mask = name
        pictures.append(shaken(hair))
    sheet(folder, "painted.jpg", pictures)


def colored(folder: Path) -> None:
    """Draw highlights painted on the head, and lighter tips over them."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.hairloom.add_hairstyle(style="long_straight", plays=False)
    hair = bpy.context.object
    head, look = hair.parent, hair.data.hairloom.shading
    look.pigment, look.base_color = "color", (0.045, 0.02, 0.01)
    pictures = [picture(hair)]
    paint_highlights(head.data)
    look.color_map = "Highlights"
    pictures.append(picture(hair))
    look.tip_tint, look.tip_color = 0.85, (0.5, 0.3, 0.12)
    look.tint_start, look.tint_end = 0.3, 0.95
    pictures.append(picture(hair))
    sheet(folder, "painted_colors.jpg", pictures)


def paint_highlights(mesh: Any, size: int = 512, samples: int = 4_000_000) -> None:
    """An image of blond locks on a transparent ground, from front to back, like a painted one."""
    random = np.random.default_rng(1)
    mesh.calc_loop_triangles()
    corners = np.array([each.loops[:] for each in mesh.loop_triangles])
    uv = np.array([each.vector for each in mesh.uv_layers.active.uv])[corners]
    positions = np.array([each.co for each in mesh.vertices])[
        np.array([each.vertices[:] for each in mesh.loop_triangles])
    ]
    area = np.abs(np.linalg.det(uv[:, 1:] - uv[:, :1]))
    triangle = random.choice(len(uv), samples, p=area / area.sum())
    weight = random.dirichlet((1.0, 1.0, 1.0), samples)
    sample_uv = np.einsum("nk,nkj->nj", weight, uv[triangle])
    x, y, z = np.einsum("nk,nkj->nj", weight, positions[triangle]).T
    streaks = np.sin(620.0 * y + 2.0 * np.sin(90.0 * z) + np.sign(x)) + np.sin(230.0 * (y + z))
    pixels = np.zeros((size, size, 4), np.float32)
    pixels[..., :3] = 0.78, 0.57, 0.36  # sRGB
    column, row = np.clip((sample_uv * size).astype(int), 0, size - 1).T
    pixels[row, column, 3] = np.clip(streaks - 0.2, 0.0, 0.9)
    image = bpy.data.images.new("Highlights", size, size, alpha=True)
    image.pixels.foreach_set(pixels.ravel())
    image.update()


def main(folder: Path) -> None:
    gpu.init()
    load_package().register()
    grow(folder)
    settle(folder)
    parting(folder)
    flow(folder)
    painted(folder)
    colored(folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
