"""Our lights against Cycles': the same numbers must give the same brightness."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hairloom.addon.shading.lights import Light
from hairloom.addon.strands import Surface

SIZE = 16
ALBEDO = (0.8, 0.5, 0.2)
WORLD = (0.1, 0.2, 0.3)
#: Cycles' pixel filter reaches over the square's border
INNER = np.s_[2:-2, 2:-2]
CORNERS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)


@pytest.fixture
def cycles(gpu_context: Any, tmp_path: Path) -> Iterator[Any]:
    """A scene with a matt square seen from above; give it a light and render it."""
    import bpy

    scene = bpy.data.scenes.new("Radiometry")
    before = {name: set(getattr(bpy.data, name)) for name in ("objects", "meshes", "lights")}
    mesh = bpy.data.meshes.new("Square")
    mesh.from_pydata(CORNERS.tolist(), [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("Matt")
    nodes, links = material.node_tree.nodes, material.node_tree.links
    matt = nodes.new("ShaderNodeBsdfDiffuse")
    matt.inputs["Color"].default_value = (*ALBEDO, 1.0)
    links.new(matt.outputs["BSDF"], nodes["Material Output"].inputs["Surface"])
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("Square", mesh))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 2.0, (0.0, 0.0, 3.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    world = bpy.data.worlds.new("World")
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (*WORLD, 1.0)
    scene.world = world
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.device = 512, False, "CPU"
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(tmp_path / "cycles.exr")

    def render(light: Any, location: tuple[float, ...], rotation: tuple[float, ...]) -> np.ndarray:
        lamp = bpy.data.objects.new("Lamp", light)
        lamp.location, lamp.rotation_euler = location, rotation
        scene.collection.objects.link(lamp)
        bpy.ops.render.render(write_still=True, scene=scene.name)
        image = bpy.data.images.load(scene.render.filepath)
        pixels = np.array(image.pixels[:]).reshape(SIZE, SIZE, -1)[..., :3]
        bpy.data.images.remove(image)
        return pixels

    yield render
    bpy.data.scenes.remove(scene)
    for name, kept in before.items():
        for block in set(getattr(bpy.data, name)) - kept:
            getattr(bpy.data, name).remove(block)
    bpy.data.materials.remove(material)
    bpy.data.worlds.remove(world)


def ours(light: Light) -> np.ndarray:
    from hairloom.addon.render.frame import (
        Camera,
        MeshSnapshot,
        Snapshot,
        look_at,
        orthographic,
        render_image,
    )

    square = Surface(CORNERS, np.array([[0, 1, 2], [0, 2, 3]]))
    snapshot = Snapshot(
        np.zeros((0, 2, 3), np.float32),
        np.zeros((0, 2), np.float32),
        meshes=(MeshSnapshot(square, square.vertex_normals(), ALBEDO, sheen=0.0),),
        lights=(light,),
        ambient=WORLD,
    )
    camera = Camera(look_at((0, 0, 3), (0, 0, 0), up=(0, 1, 0)), orthographic(2.0, 1.0, 0.0, 9.0))
    return render_image(snapshot, camera, SIZE, SIZE, 4)[..., :3]


def test_sun(cycles: Any) -> None:
    import bpy

    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.color, sun.angle = 2.5, (1.0, 0.6, 0.3), 0.0
    tilt = np.radians(35.0)
    theirs = cycles(sun, (0.0, 0.0, 5.0), (0.0, tilt, 0.0))
    light = Light.sun((-np.sin(tilt), 0.0, -np.cos(tilt)), (1.0, 0.6, 0.3), 2.5)
    assert ours(light)[INNER] == pytest.approx(theirs[INNER], rel=0.005)


def test_point(cycles: Any) -> None:
    import bpy

    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.energy, lamp.color, lamp.shadow_soft_size = 30.0, (0.4, 0.7, 1.0), 0.0
    theirs = cycles(lamp, (0.7, -0.5, 1.2), (0.0, 0.0, 0.0))
    light = Light.point((0.7, -0.5, 1.2), (0.4, 0.7, 1.0), 30.0)
    assert ours(light)[INNER] == pytest.approx(theirs[INNER], rel=0.005)
