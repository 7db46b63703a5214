"""Shadows of meshes on meshes in the render engine, compared with Cycles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")

from engine_stage import add_ball, render_picture, set_world  # noqa: E402

pytestmark = [pytest.mark.draws, pytest.mark.usefixtures("gpu_context", "extension")]


@pytest.fixture
def props(engine_scene: Any) -> Any:
    """A 40 m ground, a turned block and a floating ball, white in a black world; returns the
    ball."""
    set_world((0.0, 0.0, 0.0))
    bpy.ops.mesh.primitive_plane_add(size=40.0)
    bpy.ops.mesh.primitive_cube_add(size=0.6, location=(0.0, 0.0, 0.35), rotation=(0.2, 0.1, 0.5))
    bpy.context.object.scale = (1.0, 0.6, 1.1)
    ball = add_ball(0.25)
    ball.location = (-0.7, 0.3, 0.7)
    nodes, links = (getattr(bpy.data.materials["Diffuse"].node_tree, n) for n in ("nodes", "links"))
    surface = nodes.new("ShaderNodeOutputMaterial").inputs["Surface"]
    links.new(nodes["Diffuse BSDF"].outputs["BSDF"], surface)
    for obj in bpy.data.objects:
        if obj.type == "MESH":
            obj.data.materials.clear()
            obj.data.materials.append(bpy.data.materials["Diffuse"])
    engine_scene.camera.location, engine_scene.camera.rotation_euler = (
        (0.6, -3.0, 2.6),
        (0.86, 0.0, 0.2),
    )
    engine_scene.hairloom.picture.samples = 16
    return ball


def add_light(kind: str, energy: float, **where: Any) -> Any:
    light = bpy.data.objects.new("Light", bpy.data.lights.new("Light", kind))
    light.data.energy = energy
    for name, value in where.items():
        setattr(light, name, value)
    bpy.context.scene.collection.objects.link(light)
    return light


@pytest.mark.parametrize("kind", ["SUN", "POINT", "SPOT"])
def test_shadows_lie_where_cycles_has_them(
    engine_scene: Any, props: Any, kind: str, tmp_path: Path
) -> None:
    """With point-like lights and no bounces, pictures differ from Cycles only at edges."""
    light = add_light(
        kind,
        3.0 if kind == "SUN" else 150.0,
        location=(1.2, -1.0, 2.2),
        rotation_euler=(0.5, 0.5, 0.3),
    )
    if kind == "SUN":
        light.data.angle = 0.0
    else:
        light.data.shadow_soft_size = 0.0
    found = render_picture(tmp_path)[..., 0]
    engine_scene.render.engine = "CYCLES"
    cycles = engine_scene.cycles
    cycles.samples, cycles.use_denoising, cycles.max_bounces = 16, False, 0
    expected = render_picture(tmp_path)[..., 0]
    scale = np.percentile(expected, 95)
    away = np.abs(found - expected) / scale
    assert expected.max() > 0.1 and (expected < 0.02 * scale).mean() > 0.015
    assert away.mean() < 0.01
    assert (away > 0.2).mean() < 0.008


def test_objects_without_shadow_visibility_cast_none(
    engine_scene: Any, props: Any, tmp_path: Path
) -> None:
    """The picture gets brighter without shadows of one object, of all objects, of the light."""
    light = add_light("SUN", 3.0, rotation_euler=(0.5, 0.5, 0.3))
    with_all = render_picture(tmp_path)[..., 0].mean()
    props.visible_shadow = False
    without_ball = render_picture(tmp_path)[..., 0].mean()
    engine_scene.hairloom.mesh_shadows.mesh_shadows = False
    without_any = render_picture(tmp_path)[..., 0].mean()
    engine_scene.hairloom.mesh_shadows.mesh_shadows = True
    light.data.use_shadow = False
    assert with_all < without_ball < without_any
    assert render_picture(tmp_path)[..., 0].mean() == pytest.approx(without_any, rel=1e-6)


def test_motion_moves_shadows(engine_scene: Any, props: Any, tmp_path: Path) -> None:
    """Shadow maps are kept from frame to frame only while nothing moves."""
    add_light("SUN", 3.0, rotation_euler=(0.5, 0.5, 0.3))
    before = render_picture(tmp_path)[..., 0]
    props.location.x += 0.2
    moved = render_picture(tmp_path)[..., 0]
    props.location.x -= 0.2
    np.testing.assert_array_equal(render_picture(tmp_path)[..., 0], before)
    assert (np.abs(moved - before) > 0.05).mean() > 0.005
