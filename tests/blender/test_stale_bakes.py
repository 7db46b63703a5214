"""Stale bakes are reported before and after their motion is written to a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from grids import baked_grid
from swinging import key_x

from hairloom.addon.blender.bakes import playback
from hairloom.addon.blender.bakes.guide_motion import BakedGuides
from hairloom.addon.blender.bakes.stale_bakes import changed_inputs
from hairloom.addon.blender.preview.bake import Bake
from hairloom.addon.blender.strands.export_check import ExportCheck
from hairloom.addon.blender.strands.strand_export import StrandExport
from hairloom.addon.exchange.strand_export_settings import StrandExportSettings
from hairloom.addon.exchange.strand_formats import ALEMBIC

LAST = 4


@pytest.fixture
def baked(new_hair: Any, sphere: Any, tmp_path: Path) -> tuple[Any, Any]:
    """Baked hair on a head that moves; the current frame is 2."""
    hair, scene = new_hair(sphere), bpy.context.scene
    scene.frame_start, scene.frame_end = 1, LAST
    key_x(sphere, {1: 0.0, LAST: 0.1})
    hair.hairloom.dynamics.collider_resolution = 8
    hair.hairloom.dynamics.device = "numpy"
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    scene.frame_set(1)
    list(Bake.of([hair], scene).steps())
    scene.frame_set(2)
    return hair, sphere


@pytest.fixture
def changed(
    baked: tuple[Any, Any], get_depsgraph: Callable[[], Any]
) -> Callable[[], tuple[str, ...]]:
    def look() -> tuple[str, ...]:
        cache = playback.cache_of(baked[0])
        assert cache is not None
        return changed_inputs(baked[0], cache, get_depsgraph())

    return look


@pytest.mark.parametrize("frame", [0, 1, 2, LAST, LAST + 5])
def test_a_new_bake_is_up_to_date_in_any_frame(frame: int, changed: Any) -> None:
    for subframe in (0.0, 0.5):  # also between frames, for motion blur
        bpy.context.scene.frame_set(frame, subframe=subframe)
        assert changed() == ()


@pytest.mark.parametrize("frame", [0, 2])
def test_changed_settings_are_reported_in_any_frame(frame: int, baked: Any, changed: Any) -> None:
    bpy.context.scene.frame_set(frame)
    baked[0].hairloom.dynamics.damping = 7.0
    assert changed() == ("settings",)


def test_another_device_of_the_solver_keeps_the_bake_valid(baked: Any, changed: Any) -> None:
    baked[0].hairloom.dynamics.device = "automatic"
    assert changed() == ()


def test_animated_settings_are_those_of_their_frame(baked: Any, changed: Any) -> None:
    hair, scene = baked[0], bpy.context.scene
    for frame, value in ((1, 0.5), (LAST, 6.0)):
        hair.hairloom.dynamics.damping = value
        hair.keyframe_insert("hairloom.dynamics.damping", frame=frame)
    assert changed() == ("settings",)
    list(Bake.of([hair], scene).steps())
    for frame in (0, 3, LAST, 9):
        scene.frame_set(frame)
        assert changed() == ()


def test_changed_drivers_and_inputs_are_named(baked: Any, changed: Any) -> None:
    hair, head = baked
    scene = bpy.context.scene
    head.location.z = 0.2
    bpy.context.view_layer.update()
    assert changed() == ("pose",)
    scene.frame_set(2)
    head.location.z = 0.0
    scene.use_gravity = False
    assert "forces" in changed()
    scene.use_gravity = True
    scene.render.fps = 30
    assert "frame rate" in changed()
    scene.render.fps = 24
    hair.data.hairloom.guides.guide_count += 5
    assert "guides" in changed()
    head.data.vertices[0].co.x += 0.01
    assert "head" in changed()
    hair.data.remove_curves(indices=[0])
    assert "hair" in changed()


def test_a_disabled_or_thickened_collider_is_reported(baked: Any, changed: Any) -> None:
    hair, head = baked
    colliders = bpy.data.collections.new("Colliders")
    bpy.context.scene.collection.children.link(colliders)
    body = bpy.data.objects.new("Body", head.data.copy())
    colliders.objects.link(body)
    hair.hairloom.collider_collection = colliders
    # a deforming modifier that moves no vertex from frame to frame
    thick = body.modifiers.new("Solidify", "SOLIDIFY")
    list(Bake.of([hair], bpy.context.scene).steps())
    assert changed() == ()
    thick.thickness = 0.05
    assert changed() == ("colliders",)
    thick.thickness = 0.01
    assert changed() == ()
    body.hide_viewport = True
    assert changed() == ("colliders",)


def test_a_head_with_another_vertex_count_is_reported_and_stops_nothing(
    baked: Any, changed: Any
) -> None:
    baked[1].modifiers.new("Subdivision", "SUBSURF").levels = 1
    bpy.context.view_layer.update()
    assert "pose" in changed()


def test_motion_exports_report_stale_bakes(
    baked: Any, tmp_path: Path, get_depsgraph: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    hair, frames = baked[0], range(1, LAST + 1)

    def notes() -> list[tuple[str, ...]]:
        plan = StrandExport.of(
            [hair], get_depsgraph(), ALEMBIC, StrandExportSettings(), frames=frames
        )
        return [BakedGuides.of(hair).notes, tuple(n for n in plan.notes if "bake" in n)]

    def line() -> str:
        check = ExportCheck.of([hair])
        check.refresh(ALEMBIC, StrandExportSettings())
        return check.motion_lines(use_bake=True)[0]

    assert notes() == [(), ()] and "out of date" not in line()
    hair.hairloom.dynamics.damping = 7.0
    for (note,) in notes():
        assert "out of date (settings)" in note and "Bake again" in note
    assert line().endswith("at 24 fps, out of date (settings)")
    still = StrandExport.of([hair], get_depsgraph(), ALEMBIC, StrandExportSettings())
    assert not any("out of date" in note for note in still.notes), "a still has no motion"

    capfd.readouterr()
    before = baked_grid(playback.cache_of(hair), LAST)
    bpy.ops.hairloom.export_alembic(filepath=str(tmp_path / "hair.abc"), frames="scene")
    assert "out of date (settings)" in "".join(capfd.readouterr())
    np.testing.assert_array_equal(baked_grid(playback.cache_of(hair), LAST), before)


def test_widths_that_were_edited_make_a_bake_out_of_date(baked: Any, changed: Any) -> None:
    hair, _ = baked
    assert changed() == ()
    for value in hair.data.attributes["radius"].data:
        value.value *= 2.0
    assert "hair" in changed()


def test_curves_of_another_type_make_a_bake_out_of_date(baked: Any, changed: Any) -> None:
    hair, _ = baked
    hair.data.set_types(type="NURBS")
    assert "hair" in changed()
    hair.data.set_types(type="CATMULL_ROM")
    assert changed() == ()
