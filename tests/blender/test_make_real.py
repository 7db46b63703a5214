"""Make Real writes the strands that Hairloom draws into curves for other tools."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from engine_stage import add_ball, render_picture
from hedgehogs import hedgehog

from hairloom.addon.blender.bakes.baked_rig import RestMatrices, baked_rig_of, rig_arrays
from hairloom.addon.blender.base.attributes import set_attribute
from hairloom.addon.blender.colliders.rigs import CachedRig
from hairloom.addon.blender.scene.curves import curve_points
from hairloom.addon.blender.scene.masks import MaskReader
from hairloom.addon.blender.scene.source import read_source
from hairloom.addon.blender.sessions.groom_source import GroomSource
from hairloom.addon.groom.masks import SELECTION
from hairloom.addon.rig_flow import strand_seeds
from hairloom.addon.strands import StrandSet

RED = (0.8, 0.02, 0.03)


@pytest.fixture
def hair(new_hair: Callable[..., Any], sphere: Any) -> Any:
    """Curves, the left half red, with children, a tip tint, grey strands and thin tips."""
    strands: StrandSet = hedgehog()
    is_left = np.repeat(strands.roots[:, 0] < 0.0, strands.point_counts)[:, None]
    made = new_hair(sphere, replace(strands, color=np.where(is_left, RED, np.nan)))
    groom = made.data.hairloom
    groom.children.method, groom.children.strand_count = "multi", 300
    groom.shading.tip_tint, groom.shading.grey_fraction = 0.7, 0.2
    groom.strands.tip_width, groom.strands.fullness = 0.3, 8.0
    return made


def made_real() -> Any:
    assert bpy.ops.hairloom.make_real() == {"FINISHED"}
    return bpy.context.active_object


def test_every_strand_is_kept_at_its_place(hair: Any) -> None:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    rig = CachedRig.of(hair, read_source(hair, depsgraph)).rig
    assert rig.child_count > 100
    real = made_real()
    assert real != hair and len(real.data.curves) == rig.strands.strand_count
    points = np.empty((len(real.data.points), 3), np.float32)
    real.data.position_data.foreach_get("vector", points.ravel())
    np.testing.assert_allclose(points, rig.strands.points, atol=1e-6)
    assert real.parent == hair.parent and real.data.surface == hair.data.surface


def test_every_strand_keeps_its_noise(hair: Any) -> None:
    """Seeds are kept when curves are added later, and in a bake."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    seeds = strand_seeds(CachedRig.of(hair, read_source(hair, depsgraph)).rig)
    assert (np.diff(seeds) != 1).any(), "children have others than their numbers"
    real = made_real()
    real.data.add_curves([2])
    real.data.position_data[len(real.data.points) - 1].vector = (0.0, 0.0, 0.3)
    rig = CachedRig.of(real, read_source(real, bpy.context.evaluated_depsgraph_get())).rig
    assert strand_seeds(rig).tolist() == [*seeds, len(seeds)]
    baked = baked_rig_of(rig_arrays(rig, RestMatrices(np.eye(4), np.eye(4))), "bake").rig
    np.testing.assert_array_equal(strand_seeds(baked), strand_seeds(rig))


@pytest.mark.parametrize("domain", ["CURVE", "POINT"])
@pytest.mark.parametrize("children", ["none", "multi"])
def test_it_moves_as_it_was_painted_on_the_curves(
    hair: Any, domain: str, children: str, get_depsgraph: Any
) -> None:
    """Children get the weighted values of their guides; unsimulated strands stay unsimulated."""
    hair.data.hairloom.children.method = children
    is_left = curve_points(hair.data)[:, 0] < 0.0
    place = np.tile(np.linspace(0.0, 1.0, 8), len(hair.data.curves))
    values = (is_left * (1.0 + place)).astype(np.float32)
    is_left = is_left[::8]
    painted = values if domain == "POINT" else is_left.astype(np.float32)
    set_attribute(hair.data, "Stiff", domain, painted)
    set_attribute(hair.data, SELECTION, "CURVE", is_left)
    dynamics = hair.hairloom.dynamics
    dynamics.style_root_mask, dynamics.only_selected = "Stiff", True
    source = read_source(hair, get_depsgraph())
    mask_reader = MaskReader(hair, hair.parent, source.head, source.strands, source.curve_indices)
    was = {name: mask_reader.mask(name, get_depsgraph()).grid for name in ("Stiff", SELECTION)}
    real = made_real()
    assert not [each for each in GroomSource(real, get_depsgraph()).warnings if "Stiff" in each]
    made = read_source(real, get_depsgraph())
    mask_reader = MaskReader(real, real.parent, made.head, made.strands, made.curve_indices)
    roots = source.strands.roots
    for name, before in was.items():
        now = mask_reader.mask(name, get_depsgraph()).grid
        assert now[: len(roots)] == pytest.approx(before, abs=2e-3)
        assert now.min() >= 0.0 and now.max() <= before.max() + 1e-5
        # all guides of these children are on their side
        far = np.abs(made.strands.roots[:, 0]) > 0.07
        sides = made.strands.roots[far, 0] < 0.0
        assert (now[far].max(axis=1) > 0.0).tolist() == sides.tolist()


@pytest.mark.slow
def test_it_is_drawn_as_the_hair_was(hair: Any, engine_scene: Any, tmp_path: Path) -> None:
    """Our engine's picture is the same, except for the shadows."""
    add_ball(0.1)
    light = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    engine_scene.collection.objects.link(light)
    bpy.context.view_layer.objects.active = hair
    hair.select_set(True)
    engine_scene.camera.location.y = -0.6
    engine_scene.render.resolution_x = engine_scene.render.resolution_y = (
        256  # enough pixels to draw all strands
    )
    before = render_picture(tmp_path)
    real = made_real()
    assert hair.hide_render and not real.hide_render
    after = render_picture(tmp_path)
    real.hide_render = True
    without = render_picture(tmp_path)
    is_hair = np.abs(before - without).max(axis=-1) > 0.02
    assert is_hair.mean() > 0.1
    assert np.abs(after - before)[is_hair].mean() < 0.02  # other strands cast the shadows
    real.hide_render = False
    real.data.hairloom.shading.base_color = (1.0, 1.0, 1.0)
    # colours are stored in the curves
    np.testing.assert_allclose(render_picture(tmp_path), after, atol=1e-3)


def test_the_hair_stays_and_undo_is_there(hair: Any) -> None:
    count = len(hair.data.curves)
    made_real()
    assert len(hair.data.curves) == count and hair.hide_viewport
    assert "UNDO" in bpy.types.HAIRLOOM_OT_make_real.bl_options


def test_unreadable_hair_changes_nothing(new_hair: Callable[..., Any]) -> None:
    hair = new_hair()
    hair.data.remove_curves()
    before = set(bpy.data.objects)
    with pytest.raises(RuntimeError, match="no "):
        bpy.ops.hairloom.make_real()
    assert set(bpy.data.objects) == before and not hair.hide_render
