"""The exported GLB in a viewer without our module, beside our own picture of the strands.

The sample scene's hair with its own settings, and blond, on a black head under three suns; four
sides. three.js draws the cards with its own loader and standard material.
"""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenImageIO as oiio
from mathutils import Vector

import hairloom
from hairloom.addon.blender.base.parts import run_parts
from hairloom.addon.blender.command_line import command_line
from hairloom.addon.blender.setup.sample_scene import add_sample_scene

REPOSITORY = Path(__file__).parents[1]
PAGE = REPOSITORY / "bench" / "engines" / "plain"
THREE = REPOSITORY / "tools" / "node" / "node_modules" / "three"
SANDBOX = str(REPOSITORY / "tools" / "window_blender")
#: a folder that the browser's sandbox sees
OUTPUT = REPOSITORY / "out" / "bench_engines"
SIZE, SIDES, FIELD_OF_VIEW = 320, 4, 30.0
#: the colours that the hair is drawn in; None: the sample scene's own
COLORS = {"brown": None, "blond": (0.5, 0.255, 0.08)}
#: direction to each sun, Z up, and its irradiance
SUNS = (((0.5, -0.7, 0.6), 3.0), ((-0.8, -0.3, 0.3), 1.0), ((0.1, 0.9, 0.5), 2.0))


def plain_figures() -> dict[str, Any]:
    """plain_levels_visible: meshes of hair that the viewer shows. plain_color_percent: difference
    from our light, summed over all sides, the worst channel of the worst colour."""
    shutil.rmtree(OUTPUT, ignore_errors=True)
    scene, hair, views = _stage()
    found: dict[str, Any] = {"plain_levels_visible": 0, "plain_color_percent": 0.0}
    for name, color in COLORS.items():
        if color is not None:
            look = hair.data.hairloom.shading
            look.pigment, look.base_color = "color", color
        ours = np.stack([_drawn(scene, view) for view in views])
        theirs, shown = _drawn_by_three(hair, views, name)
        np.savez(OUTPUT / f"{name}.npz", ours=ours, theirs=theirs)
        light = theirs.reshape(-1, 3).sum(axis=0) / ours.reshape(-1, 3).sum(axis=0)
        found |= {f"plain_light_{name}_{'rgb'[n]}": float(light[n]) for n in range(3)}
        max_percent = float(100.0 * np.abs(light - 1.0).max())
        found["plain_color_percent"] = max(found["plain_color_percent"], max_percent)
        found["plain_levels_visible"] = max(found["plain_levels_visible"], shown)
    return found


def _stage() -> tuple[Any, Any, list[dict[str, Any]]]:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    if not hasattr(bpy.types.Scene, "hairloom"):
        hairloom.register()
    scene, hair = run_parts(add_sample_scene(()))
    bpy.context.window.scene = scene
    black = bpy.data.materials.new("Black")
    black.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0, 0, 0, 1)
    black.node_tree.nodes["Principled BSDF"].inputs["Specular IOR Level"].default_value = 0.0
    for obj in list(scene.objects):
        if obj.type == "LIGHT":
            bpy.data.objects.remove(obj)
        elif obj.type == "MESH" and obj is not hair:
            if obj is not hair.data.surface:
                bpy.data.objects.remove(obj)
                continue
            for slot in obj.material_slots:
                slot.material = black
    scene.world = bpy.data.worlds.new("Dark")
    scene.world.color = (0.0, 0.0, 0.0)
    for direction, irradiance in SUNS:
        light = bpy.data.lights.new("Sun", "SUN")
        light.energy = irradiance
        sun = bpy.data.objects.new("Sun", light)
        sun.rotation_euler = Vector(direction).to_track_quat("Z", "Y").to_euler()
        scene.collection.objects.link(sun)
    center = sum((Vector(corner) for corner in hair.bound_box), Vector()) / 8.0
    radius = max((Vector(corner) - center).length for corner in hair.bound_box)
    away = 1.1 * radius / math.sin(math.radians(FIELD_OF_VIEW / 2.0))
    views = []
    for side in range(SIDES):
        angle = 2.0 * math.pi * side / SIDES
        eye = center + away * Vector((math.sin(angle), -math.cos(angle), 0.2)).normalized()
        views.append({"eye": tuple(eye), "target": tuple(center), "near": 0.1 * away,
                      "far": 4.0 * away})  # fmt: skip
    return scene, hair, views


def _drawn(scene: Any, view: dict[str, Any]) -> np.ndarray:
    """The engine's picture, linear, over black, row 0 on top."""
    camera = bpy.data.objects.new("Side", bpy.data.cameras.new("Side"))
    camera.data.angle = math.radians(FIELD_OF_VIEW)
    camera.data.clip_start, camera.data.clip_end = view["near"], view["far"]
    direction = Vector(view["target"]) - Vector(view["eye"])
    camera.location, camera.rotation_euler = (
        view["eye"],
        direction.to_track_quat("-Z", "Y").to_euler(),
    )
    scene.collection.objects.link(camera)
    render, scene.camera = scene.render, camera
    render.engine = "HAIRLOOM"
    render.resolution_x = render.resolution_y = SIZE
    render.film_transparent = True
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.filepath = str(OUTPUT / "side.exr")
    bpy.ops.render.render(write_still=True, scene=scene.name)
    return np.asarray(oiio.ImageBuf(render.filepath).get_pixels(oiio.FLOAT))[..., :3]


def _drawn_by_three(hair: Any, views: list[dict[str, Any]], name: str) -> tuple[np.ndarray, int]:
    site = OUTPUT / name
    shutil.copytree(PAGE, site)
    shutil.copytree(THREE, site / "three")
    _export_head(hair.data.surface, site / "head.glb")
    verb = ["cards", "--groom", hair.name, "--output", str(site / "cards.glb")]
    assert command_line.run(verb) == 0
    content = {
        "size": SIZE,
        "field_of_view": FIELD_OF_VIEW,
        "views": [
            view | {"eye": _y_up(view["eye"]), "target": _y_up(view["target"])} for view in views
        ],
        "suns": [
            {"way": _y_up(direction), "irradiance": irradiance} for direction, irradiance in SUNS
        ],
    }
    (site / "view.json").write_text(json.dumps(content), encoding="utf-8")
    shutil.copy2(REPOSITORY / "tools" / "draw_page.py", site)
    command = [SANDBOX, "run", "python3", str(site / "draw_page.py")]
    subprocess.run(command, check=True, timeout=600)
    shown = json.loads((site / "shown.json").read_text(encoding="utf-8"))
    halves = np.frombuffer((site / "pictures.bin").read_bytes(), np.float16)
    pictures = halves.reshape(SIDES, SIZE, SIZE, 4)[:, ::-1, :, :3].astype(np.float32)
    return pictures, shown["meshes"]


def _export_head(head: Any, path: Path) -> None:
    for obj in bpy.context.scene.objects:
        obj.select_set(obj is head)
    bpy.ops.export_scene.gltf(filepath=str(path), use_selection=True, export_apply=False)


def _y_up(vector: Any) -> list[float]:
    return [float(vector[0]), float(vector[2]), -float(vector[1])]
