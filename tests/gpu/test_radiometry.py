"""Our lights against Cycles': the same values must give the same brightness."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiers import few_by_name

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
    """A function that renders a light on a matt square, seen from above, in Cycles."""
    import bpy

    from hairloom.addon.blender.scene.lights import read_lights

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
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.device = 2048, False, "CPU"
    scene.cycles.use_adaptive_sampling, scene.cycles.pixel_filter_type = False, "BOX"
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(tmp_path / "cycles.exr")

    def render(
        light: Any,
        location: tuple[float, ...],
        rotation: tuple[float, ...],
        scale: tuple[float, ...] = (1.0, 1.0, 1.0),
    ) -> tuple[np.ndarray, Light]:
        lamp = bpy.data.objects.new("Lamp", light)
        lamp.location, lamp.rotation_euler, lamp.scale = location, rotation, scale
        lamp.visible_camera = False
        scene.collection.objects.link(lamp)
        bpy.ops.render.render(write_still=True, scene=scene.name)
        image = bpy.data.images.load(scene.render.filepath)
        pixels = np.array(image.pixels[:]).reshape(SIZE, SIZE, -1)[..., :3]
        bpy.data.images.remove(image)
        layer = scene.view_layers[0]
        layer.update()
        (read,) = read_lights(layer.depsgraph, np.zeros(3))
        return pixels, read

    yield render
    bpy.data.scenes.remove(scene)
    for name, kept in before.items():
        for block in set(getattr(bpy.data, name)) - kept:
            getattr(bpy.data, name).remove(block)
    bpy.data.materials.remove(material)
    bpy.data.worlds.remove(world)


def ours(light: Light) -> np.ndarray:
    from hairloom.addon.render.camera import Camera, look_at, orthographic
    from hairloom.addon.render.frame import render_image
    from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot

    square = Surface(CORNERS, np.array([[0, 1, 2], [0, 2, 3]]))
    snapshot = Snapshot(
        np.zeros((0, 2, 3), np.float32),
        np.zeros((0, 2), np.float32),
        meshes=(MeshSnapshot(square, square.vertex_normals(), ALBEDO, specular=0.0),),
        lights=(light,),
        ambient=WORLD,
    )
    camera = Camera(look_at((0, 0, 3), (0, 0, 0), up=(0, 1, 0)), orthographic(2.0, 1.0, 0.0, 9.0))
    return render_image(snapshot, camera, SIZE, SIZE, 4)[..., :3]


def test_sun(cycles: Any) -> None:
    import bpy

    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.color, sun.angle = 2.5, (1.0, 0.6, 0.3), 0.02
    tilt = np.radians(35.0)
    theirs, read = cycles(sun, (0.0, 0.0, 5.0), (0.0, tilt, 0.0))
    light = Light.sun((-np.sin(tilt), 0.0, -np.cos(tilt)), (1.0, 0.6, 0.3), 2.5)
    assert read.angle == pytest.approx(0.02)
    assert ours(light)[INNER] == pytest.approx(theirs[INNER], rel=0.005)
    assert ours(read)[INNER] == pytest.approx(theirs[INNER], rel=0.005)


def test_point(cycles: Any) -> None:
    import bpy

    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.energy, lamp.color, lamp.shadow_soft_size = 30.0, (0.4, 0.7, 1.0), 0.0
    theirs, read = cycles(lamp, (0.7, -0.5, 1.2), (0.0, 0.0, 0.0))
    light = Light.point((0.7, -0.5, 1.2), (0.4, 0.7, 1.0), 30.0)
    assert ours(light)[INNER] == pytest.approx(theirs[INNER], rel=0.005)
    assert ours(read)[INNER] == pytest.approx(theirs[INNER], rel=0.005)


#: settings of the light, its location, its rotation [degrees], and its object's scale
SPOTS = {
    "narrow, rim": (
        {"spot_size": np.radians(50.0), "spot_blend": 0.3},
        ((0.1, -0.2, 1.5), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
    ),
    "all blend, turned, exposed": (
        {"spot_size": np.radians(80.0), "spot_blend": 1.0, "exposure": 1.0},
        ((0.9, 0.3, 1.2), (10.0, 35.0, 20.0), (1.0, 1.0, 1.0)),
    ),
    "scaled": (
        {"spot_size": np.radians(60.0), "spot_blend": 0.5},
        ((0.0, 0.0, 1.4), (-15.0, 10.0, 40.0), (1.0, 0.5, 1.3)),
    ),
    "disk with a radius": (
        {"spot_size": np.radians(50.0), "spot_blend": 0.15, "shadow_soft_size": 0.15},
        ((0.0, 0.0, 1.5), (0.0, 15.0, 0.0), (1.0, 1.0, 1.0)),
    ),
    "ball with a radius": (
        {
            "spot_size": np.radians(50.0),
            "spot_blend": 0.4,
            "shadow_soft_size": 0.1,
            "use_soft_falloff": False,
        },
        ((0.0, 0.0, 1.5), (0.0, 15.0, 0.0), (1.0, 1.0, 1.0)),
    ),
}
AREAS = {
    "square, near": (
        {"shape": "SQUARE", "size": 0.8},
        ((0.2, -0.1, 0.6), (0.0, 0.0, 30.0), (1.0, 1.0, 1.0)),
    ),
    "square, far": (
        {"shape": "SQUARE", "size": 0.8},
        ((2.0, -3.0, 3.0), (30.0, 25.0, 0.0), (1.0, 1.0, 1.0)),
    ),
    "rectangle, turned and scaled": (
        {"shape": "RECTANGLE", "size": 0.5, "size_y": 1.2},
        ((-0.5, 0.3, 0.9), (-20.0, -25.0, 50.0), (0.5, 1.5, 2.0)),
    ),
    "disk, near": (
        {"shape": "DISK", "size": 1.0},
        ((-0.2, 0.1, 0.5), (15.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
    ),
    "disk, far, its radiance given": (
        {"shape": "DISK", "size": 1.0, "normalize": False},
        ((1.0, 1.0, 3.0), (-15.0, 20.0, 0.0), (1.2, 1.2, 1.0)),
    ),
    "ellipse, near": (
        {"shape": "ELLIPSE", "size": 1.2, "size_y": 0.4},
        ((0.1, 0.2, 0.5), (0.0, 20.0, 60.0), (1.0, 1.0, 1.0)),
    ),
    "ellipse, far": (
        {"shape": "ELLIPSE", "size": 1.2, "size_y": 0.4},
        ((-2.0, 1.0, 3.0), (-20.0, -30.0, 10.0), (1.0, 1.4, 1.0)),
    ),
    "rectangle of narrow spread, near": (
        {"shape": "RECTANGLE", "size": 0.6, "size_y": 1.0, "spread": np.radians(40.0)},
        ((0.1, 0.0, 0.8), (10.0, 15.0, 0.0), (1.0, 1.0, 1.0)),
    ),
    "disk of narrow spread, far": (
        {"shape": "DISK", "size": 0.8, "spread": np.radians(60.0)},
        ((0.5, 0.0, 2.5), (0.0, 15.0, 0.0), (1.0, 1.0, 1.0)),
    ),
}
OTHERS = {
    "soft point": (
        "POINT",
        {"shadow_soft_size": 0.3},
        ((0.2, -0.1, 0.8), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
    ),
    "ball of a given radiance": (
        "POINT",
        {"shadow_soft_size": 0.2, "use_soft_falloff": False, "normalize": False},
        ((0.2, -0.1, 0.8), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
    ),
    "warm sun of a given radiance": (
        "SUN",
        {
            "angle": np.radians(30.0),
            "normalize": False,
            "use_temperature": True,
            "temperature": 3000.0,
        },
        ((0.0, 0.0, 2.0), (10.0, 30.0, 0.0), (1.0, 1.0, 1.0)),
    ),
}
CASES = {
    **{f"spot: {name}": ("SPOT", *case) for name, case in SPOTS.items()},
    **{f"area: {name}": ("AREA", *case) for name, case in AREAS.items()},
    **OTHERS,
}


#: Cases that others cover.
SLOW = (
    *("spot: narrow, rim", "spot: ball with a radius", "area: square, far", "area: disk, near"),
    *("area: ellipse, far", "area: disk of narrow spread, far", "ball of a given radiance"),
)


@pytest.mark.parametrize("case", few_by_name(CASES, *SLOW))
def test_as_cycles_has_it(cycles: Any, case: tuple[str, dict[str, Any], Any]) -> None:
    """Pixels differ by less than 1.5 % of the brightest, and by 0.15 % of it on average.

    The largest errors are at the rim of a spot with a radius, and at the rim of a narrow spread
    close to its panel; light in closed form is within Cycles' noise.
    """
    import bpy

    kind, settings, (location, turned, scale) = case
    lamp = bpy.data.lights.new("Lamp", kind)
    lamp.energy, lamp.color, lamp.shadow_soft_size = 30.0, (0.4, 0.7, 1.0), 0.0
    for name, value in settings.items():
        setattr(lamp, name, value)
    theirs, light = cycles(lamp, location, tuple(np.radians(turned)), scale)
    off = (ours(light) - theirs)[INNER] / (theirs[INNER].max(axis=(0, 1)))
    assert np.ptp(theirs[INNER]) > 0.0
    assert np.abs(off).max() < 0.015
    assert np.abs(off.mean(axis=(0, 1))).max() < 0.0015
