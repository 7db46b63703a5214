"""Soft shadows on a matt floor, of a ball and of a curtain of hair, beside Cycles.

A sun of 10 degrees and an area light of a metre; rms error over the floor, relative to its
brightest place. Pictures are rendered by the engine, as with F12.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

SIZE, SAMPLES, PATHS = 160, 64, 256
#: how far above the floor the camera is [m], and how much of the floor it sees
ABOVE, SEEN = 6.0, 2.4


def soft_shadows(rendered: Callable[[Any], tuple[dict[str, np.ndarray], float]]) -> dict[str, Any]:
    """soft_shadow_rms: the larger of both lights. soft_shadow_hard_rms: the same without softness,
    our lights having no size, for comparison.

    Args:
        rendered: renders a scene; see picture.py.
    """
    found: dict[str, Any] = {}
    for name, light in (("sun", _sun), ("area", _area)):
        scene = _scene(light())
        theirs, ours, hard = (_floor(scene, each, rendered) for each in ("CYCLES", "", "hard"))
        is_floor = np.isfinite(theirs) & np.isfinite(ours)
        brightest = float(np.percentile(theirs[is_floor], 99.0))
        for kind, picture in (("soft", ours), ("hard", hard)):
            off = (picture - theirs)[is_floor] / brightest
            found[f"soft_shadow_{name}_{kind}_rms"] = float(np.sqrt(np.mean(off**2)))
    max_rms = {
        kind: max(found[f"soft_shadow_{name}_{kind}_rms"] for name in ("sun", "area"))
        for kind in ("soft", "hard")
    }
    return {"soft_shadow_rms": max_rms["soft"], "soft_shadow_hard_rms": max_rms["hard"], **found}


def _sun() -> Any:
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = np.pi, np.radians(10.0)
    return light


def _area() -> Any:
    light = bpy.data.lights.new("Area", "AREA")
    light.energy, light.shape, light.size = 60.0, "SQUARE", 1.0
    return light


def _scene(light: Any) -> Any:
    scene = bpy.data.scenes.new("Floor")
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.view_layers[0].use_pass_z = True
    scene.world = bpy.data.worlds.new("Black")
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    cycles = scene.cycles
    cycles.samples, cycles.max_bounces, cycles.use_denoising = PATHS, 0, False
    cycles.use_adaptive_sampling = False
    scene.hairloom.picture.samples = SAMPLES

    def add(name: str, data: Any, *, place: tuple[float, float, float], turn: Any = None) -> Any:
        thing = bpy.data.objects.new(name, data)
        thing.location = place
        thing.rotation_euler = turn or (0.0, 0.0, 0.0)
        scene.collection.objects.link(thing)
        return thing

    lens = bpy.data.cameras.new("Camera")
    lens.type, lens.ortho_scale = "ORTHO", SEEN
    scene.camera = add("Camera", lens, place=(0.0, 0.0, ABOVE))
    add("Light", light, place=(-0.9, 0.0, 1.8), turn=(0.0, -np.radians(26.0), 0.0))
    add("Floor", _floor_mesh(), place=(0.0, 0.0, 0.0))
    add("Ball", _ball(), place=(0.0, 0.5, 0.35))
    add("Hair", _curtain(), place=(0.0, -0.5, 0.0))
    return scene


def _matt(mesh: Any) -> Any:
    material = bpy.data.materials.new("Matt")
    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    inputs["Specular IOR Level"].default_value = 0.0
    mesh.materials.append(material)
    return mesh


def _floor_mesh() -> Any:
    mesh = bpy.data.meshes.new("Floor")
    corners = [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    return _matt(mesh)


def _ball() -> Any:
    import bmesh

    mesh, shape = bpy.data.meshes.new("Ball"), bmesh.new()
    bmesh.ops.create_icosphere(shape, subdivisions=4, radius=0.2)
    shape.to_mesh(mesh)
    shape.free()
    return _matt(mesh)


def _curtain() -> Any:
    """Straight hair that hangs from a bar, thick enough to be opaque."""
    count, points = 1200, 6
    curves = bpy.data.hair_curves.new("Hair")
    curves.add_curves([points] * count)
    x, down = np.linspace(-0.2, 0.2, count), np.linspace(0.8, 0.3, points)
    places = np.zeros((count, points, 3), np.float32)
    places[..., 0], places[..., 2] = x[:, None], down
    places[..., 1] = 0.02 * np.random.default_rng(1).uniform(-1.0, 1.0, count)[:, None]
    curves.attributes["position"].data.foreach_set("vector", places.ravel())
    width = curves.attributes.get("radius") or curves.attributes.new("radius", "FLOAT", "POINT")
    width.data.foreach_set("value", np.full(count * points, 0.001, np.float32))
    material = bpy.data.materials.new("Black")
    nodes = material.node_tree.nodes
    node = nodes.new("ShaderNodeBsdfHairPrincipled")
    node.model, node.parametrization = "CHIANG", "ABSORPTION"
    node.inputs["Absorption Coefficient"].default_value = (30.0, 30.0, 30.0)
    material.node_tree.links.new(node.outputs[0], nodes["Material Output"].inputs["Surface"])
    curves.materials.append(material)
    curves.hairloom.widths.method = "own"
    curves.hairloom.children.method = "none"
    curves.hairloom.strands.tip_width = 1.0
    return curves


def _floor(scene: Any, engine: str, rendered: Callable[..., Any]) -> np.ndarray:
    """Light on the floor, (SIZE, SIZE); NaN where something is in front of it."""
    scene.render.engine = "CYCLES" if engine == "CYCLES" else "HAIRLOOM"
    light = scene.objects[next(each.name for each in scene.objects if each.type == "LIGHT")].data
    old_size = light.angle if light.type == "SUN" else light.size
    if engine == "hard":
        setattr(light, "angle" if light.type == "SUN" else "size", 1e-4)
    passes, _ = rendered(scene)
    setattr(light, "angle" if light.type == "SUN" else "size", old_size)
    depth = passes["Depth"][..., 0]
    return np.where(np.abs(depth - ABOVE) < 1e-2, passes["Combined"][..., 1], np.nan)
