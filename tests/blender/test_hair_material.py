"""The material of a look as Cycles evaluates it; test_principled.py tests the node's own inputs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from engine_stage import render_picture

from hairloom.addon.blender.properties.presets import apply
from hairloom.addon.blender.scene.curves import set_colors
from hairloom.addon.blender.scene.hair_material import set_look_material
from hairloom.addon.blender.scene.principled import look_from_material
from hairloom.addon.shading.marschner.look import (
    GREY_ABSORPTION,
    root_absorption,
    strand_absorption,
)
from hairloom.addon.shading.marschner.pigment import absorption_color, color_absorption
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.strands import StrandSet

#: vertical strands side by side in front of the camera, one per pixel, from the picture's lower
#: edge up
ROW, TALL = 64, 16


def row() -> StrandSet:
    x = (np.arange(ROW) + 0.5) / ROW - 0.5
    z = np.linspace(-0.5, 0.5, TALL)
    points = np.stack(np.broadcast_arrays(x[:, None], 0.0, z[None, :]), axis=-1)
    return StrandSet(
        points=points.reshape(-1, 3),
        offsets=np.arange(ROW + 1) * TALL,
        radius=np.full(ROW * TALL, 0.5 / ROW),
        group=np.zeros(ROW),
    )


@pytest.fixture
def hair(new_hair: Callable[..., Any], engine_scene: Any) -> Any:
    camera = engine_scene.camera.data
    camera.type, camera.ortho_scale = "ORTHO", 1.0
    engine_scene.render.engine = "CYCLES"
    engine_scene.cycles.samples, engine_scene.cycles.use_denoising = 1, False
    engine_scene.cycles.pixel_filter_type, engine_scene.cycles.max_bounces = "BOX", 0
    return new_hair(strands=row())


def evaluated_input(hair: Any, name: str, folder: Path) -> np.ndarray:
    """An input of the hair node as Cycles evaluates it, (rows from the roots up, strands, 3)."""
    tree = hair.data.materials[0].node_tree
    node = next(each for each in tree.nodes if each.type == "BSDF_HAIR_PRINCIPLED")
    light = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(node.inputs[name].links[0].from_socket, light.inputs["Color"])
    output = next(each for each in tree.nodes if each.type == "OUTPUT_MATERIAL")
    tree.links.new(light.outputs[0], output.inputs["Surface"])
    return render_picture(folder)[..., :3]


ALONG = np.broadcast_to(((np.arange(64) + 0.5) / 64)[:, None], (64, ROW))


def test_cycles_finds_the_tint_of_the_tips(hair: Any, tmp_path: Path) -> None:
    look = ShadingSettings(
        tip_tint=0.8, tint_start=0.2, tint_end=0.7, color_variation=0.0, base_color=(0.3, 0.2, 0.1)
    )
    set_look_material(hair.data, look)
    found = evaluated_input(hair, "Absorption Coefficient", tmp_path)
    even = np.full_like(ALONG, 0.5)
    np.testing.assert_allclose(found, strand_absorption(look, ALONG, even, even), rtol=0.02)


def test_cycles_finds_as_many_grey_strands_and_as_much_variation(hair: Any, tmp_path: Path) -> None:
    look = ShadingSettings(
        grey_fraction=0.3, color_variation=0.4, pigment="absorption", absorption=(0.2, 0.5, 0.9)
    )
    set_look_material(hair.data, look)
    found = evaluated_input(hair, "Absorption Coefficient", tmp_path).mean(axis=0)
    root = root_absorption(look)
    is_grey = found[:, 2] < 0.5 * root[2] * 0.6
    assert 0.12 < is_grey.mean() < 0.5, "of 64 strands, four standard deviations about 0.3"
    amount = found[~is_grey] / root
    np.testing.assert_allclose(amount, amount[:, :1].repeat(3, axis=1), rtol=1e-3)
    assert 0.6 <= amount.min() < 0.75 and 1.25 < amount.max() <= 1.4
    grey = found[is_grey] / (GREY_ABSORPTION * root.mean())
    np.testing.assert_allclose(grey, grey[:, :1].repeat(3, axis=1), rtol=1e-3)


def test_cycles_finds_the_curves_own_colours(hair: Any, tmp_path: Path) -> None:
    look = ShadingSettings(color_variation=0.0, azimuthal_width=0.5, base_color=(0.4, 0.3, 0.2))
    own = np.tile(np.linspace(0.05, 0.9, ROW)[:, None, None], (1, TALL, 3)) * (1.0, 0.7, 0.4)
    own[ROW // 2 :] = np.nan
    set_colors(hair.data, replace(row(), color=own.reshape(-1, 3)))
    set_look_material(hair.data, look)
    tree = hair.data.materials[0].node_tree
    node = next(each for each in tree.nodes if each.type == "BSDF_HAIR_PRINCIPLED")
    radial = node.inputs["Radial Roughness"].default_value
    assert radial > 0.5, "a colour at another roughness is another colour"
    found = evaluated_input(hair, "Color", tmp_path)[32]
    expected = np.where(np.isnan(own[:, 0]), look.base_color, own[:, 0])
    expected = absorption_color(color_absorption(expected), radial)
    np.testing.assert_allclose(found, expected, rtol=0.01, atol=2e-3)


def test_the_button_writes_what_the_other_button_reads(hair: Any) -> None:
    look = ShadingSettings(pigment="melanin", melanin=0.6, redness=0.4, cuticle_tilt=0.06)
    apply(look, hair)
    assert bpy.ops.hairloom.look_to_material() == {"FINISHED"}
    material = hair.data.materials[0]
    again, _ = look_from_material(hair, bpy.context.evaluated_depsgraph_get())
    assert (again.pigment, again.melanin) == ("melanin", pytest.approx(0.6))
    assert again.cuticle_tilt == pytest.approx(0.06)
    hair.data.hairloom.shading.melanin = 0.2
    assert bpy.ops.hairloom.look_to_material() == {"FINISHED"}
    assert list(hair.data.materials) == [material], "written again"
    assert bpy.ops.hairloom.apply_preset(name="looks/black") == {"FINISHED"}
    again, _ = look_from_material(hair, bpy.context.evaluated_depsgraph_get())
    assert root_absorption(again) == pytest.approx(root_absorption(look_of(hair)), rel=0.01), (
        "a preset is followed"
    )


def look_of(hair: Any) -> ShadingSettings:
    from hairloom.addon.blender.properties.properties import settings_of

    return settings_of(hair.data.hairloom.shading, ShadingSettings)


def test_a_material_of_the_artists_own_stays(hair: Any) -> None:
    own = bpy.data.materials.new("Mine")
    before = len(own.node_tree.nodes)
    hair.data.materials.append(own)
    assert bpy.ops.hairloom.apply_preset(name="looks/black") == {"FINISHED"}
    assert hair.data.materials[0] == own
    assert bpy.ops.hairloom.look_to_material() == {"FINISHED"}
    assert hair.data.materials[0] != own and len(own.node_tree.nodes) == before
