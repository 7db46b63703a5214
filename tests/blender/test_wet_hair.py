"""Wet hair in Blender: water changes the settings in effect, not the stored ones."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.bakes import playback
from hairloom.addon.blender.bakes.groom_hashes import settings_hash
from hairloom.addon.blender.bakes.stale_bakes import changed_inputs
from hairloom.addon.blender.colliders.rigs import CachedRig
from hairloom.addon.blender.preview.bake import Bake
from hairloom.addon.blender.preview.preview import baked_rig_for
from hairloom.addon.blender.properties.groom_settings import GroomSettings
from hairloom.addon.blender.scene.source import read_source
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.shading.drawn_strands import look_color
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.wet_and_dusty import wet_and_dusty_color


@pytest.fixture
def hair(new_hair: Any, sphere: Any) -> Any:
    made = new_hair(sphere)
    children = made.data.hairloom.children
    children.method, children.strand_count, children.clump = "multi", 500, 0.3
    return made


def rig(hair: Any) -> Any:
    return CachedRig.of(hair, read_source(hair, bpy.context.evaluated_depsgraph_get())).rig


def test_water_acts_on_look_children_and_motion_and_leaves_what_is_stored(hair: Any) -> None:
    dry, before = GroomSettings.of(hair), rig(hair)
    stored = hair.hairloom.dynamics.style_tip, hair.data.hairloom.shading.width_r
    hair.data.hairloom.shading.wetness = 1.0
    wet = GroomSettings.of(hair)
    assert wet[DynamicsSettings].style_tip < 0.8 * dry[DynamicsSettings].style_tip
    assert not np.allclose(rig(hair).strands.points, before.strands.points)
    assert (hair.hairloom.dynamics.style_tip, hair.data.hairloom.shading.width_r) == stored
    hair.data.hairloom.shading.wetness = 0.0
    np.testing.assert_array_equal(rig(hair).strands.points, before.strands.points)


def test_a_bake_of_dry_hair_is_out_of_date_once_it_is_wet(hair: Any) -> None:
    before = settings_hash(hair)
    hair.data.hairloom.shading.wetness = 0.5
    assert settings_hash(hair) != before
    hair.data.hairloom.shading.wetness = 0.0
    hair.data.hairloom.shading.dust = 0.5  # dust has no weight
    assert settings_hash(hair) == before


def test_hair_that_becomes_wet_is_baked_with_the_children_of_its_first_frame(
    hair: Any, tmp_path: Any
) -> None:
    """The bake is up to date in every frame, and the preview uses its hair."""
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 3
    hair.hairloom.bake.folder, hair.hairloom.dynamics.device = str(tmp_path / "bake"), "numpy"
    for frame, wetness in ((1, 0.0), (3, 1.0)):
        hair.data.hairloom.shading.wetness = wetness
        hair.data.hairloom.shading.keyframe_insert("wetness", frame=frame)
    list(Bake.of([hair], scene).steps())
    cache = playback.cache_of(hair)
    assert cache is not None
    for frame in (1, 2, 3):
        scene.frame_set(frame)
        assert changed_inputs(hair, cache, bpy.context.evaluated_depsgraph_get()) == ()
        assert baked_rig_for(hair, scene) is not None


def test_hair_made_real_has_its_water_within_it(hair: Any) -> None:
    """Water counts once: real hair has a dry look, and the colours of wet hair."""
    shading = hair.data.hairloom.shading
    shading.base_color, shading.color_variation, shading.wetness = (0.4, 0.2, 0.1), 0.0, 1.0
    look = GroomSettings.of(hair)[ShadingSettings]
    expected = wet_and_dusty_color(np.array([0.4, 0.2, 0.1]), ShadingSettings(wetness=1.0))
    np.testing.assert_allclose(look_color(look), expected, rtol=1e-5)
    assert bpy.ops.hairloom.make_real() == {"FINISHED"}
    real = bpy.context.active_object
    own = GroomSettings.of(real)[ShadingSettings]
    assert own.wetness == 0.0 and own.width_r == pytest.approx(look.width_r)
    colors = np.empty((len(real.data.points), 4), np.float32)
    real.data.attributes["color"].data.foreach_get("color", colors.ravel())
    np.testing.assert_allclose(colors[:, :3], np.tile(expected, (len(colors), 1)), atol=2e-3)
