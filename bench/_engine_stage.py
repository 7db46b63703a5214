"""A head with hair under a sun, as an artist's scene, rendered by the engine Hairloom."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np

import hairloom


def build_stage(width: int, height: int, samples: int) -> Any:
    """A new file with the scene; returns the scene."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    if not hasattr(bpy.types.Scene, "hairloom"):
        hairloom.register()
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1, segments=48, ring_count=24)
    head = bpy.context.object
    head.name = "Head"
    bpy.ops.object.shade_smooth()
    bpy.ops.hairloom.grow(method="normals", lift=1.0, strand_count=1500, length=0.08)
    bpy.context.object.name = "Hair"
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 3.0, (0.9, 0.3, 0.0)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -0.8, 0.0), (np.pi / 2.0, 0.0, 0.0)
    camera.data.clip_start = 0.01
    for each in (sun, camera):
        scene.collection.objects.link(each)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("World")
    render = scene.render
    render.engine, render.dither_intensity = "HAIRLOOM", 0.0
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    render.image_settings.file_format = "PNG"
    scene.hairloom.picture.samples = samples
    return scene


def shown_picture(scene: Any, samples: int) -> np.ndarray:
    """The picture that F12 saves, (height, width, 3) in 0 to 1."""
    scene.hairloom.picture.samples = samples
    with tempfile.TemporaryDirectory(prefix="hairloom") as folder:
        path = Path(folder) / "picture.png"
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
        return read_picture(path)


def read_picture(path: Path) -> np.ndarray:
    """The values that an image file stores, (height, width, 3) in 0 to 1, the top row first."""
    image = bpy.data.images.load(str(path), check_existing=False)
    image.colorspace_settings.is_data = True
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    width, height = image.size
    bpy.data.images.remove(image)
    return np.ascontiguousarray(pixels.reshape(height, width, 4)[::-1, :, :3])
