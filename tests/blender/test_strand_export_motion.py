"""Moving strands exported from the open scene: from bakes and modifiers, in steps and cancelled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from bake_files import frames_in
from grids import baked_grid
from hedgehogs import hedgehog
from strand_files import (
    needs_usd,
    push_up,
    read_alembic_curves,
    read_usd_curves,
    straight_strands,
    to_unreal,
)
from swinging import shake_head
from waiting import wait_until

from hairloom.addon.blender.bakes import playback
from hairloom.addon.blender.preview.bake import Bake
from hairloom.addon.blender.scene.curves import set_colors
from hairloom.addon.blender.scene.groom_attributes import store_groom
from hairloom.addon.blender.strands.export_check import ExportCheck
from hairloom.addon.blender.strands.strand_export import StrandExport
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.groom import Groom
from hairloom.addon.exchange.strand_export_settings import StrandExportSettings
from hairloom.addon.exchange.strand_formats import ALEMBIC, TRESSFX, USD

LAST = 6


@pytest.fixture
def read_output(capfd: pytest.CaptureFixture[str]) -> Callable[[], str]:
    return lambda: "".join(capfd.readouterr())


@pytest.fixture
def swinging(new_hair: Any, sphere: Any, tmp_path: Path) -> tuple[Any, Any]:
    """Hair on a head that shakes for some frames: (hair, head)."""
    return shake_head(new_hair(sphere), sphere, LAST, tmp_path / "bake", peak=3)


def bake(*objects: Any, **options: Any) -> None:
    list(Bake.of(list(objects), bpy.context.scene, **options).steps())


@needs_usd
def test_each_frame_is_that_of_the_bake(swinging: Any, tmp_path: Path) -> None:
    hair, _ = swinging
    bake(hair)
    bpy.context.scene.frame_set(3)
    abc, usd = tmp_path / "hair.abc", tmp_path / "hair.usdc"
    for operator, path in (("export_alembic", abc), ("export_usd", usd)):
        getattr(bpy.ops.hairloom, operator)(filepath=str(path), frames="scene", parts="strands")
    assert bpy.context.scene.frame_current == 3
    cache = playback.cache_of(hair)
    assert cache is not None
    (curves,) = read_alembic_curves(abc).values()
    stage, prim = read_usd_curves(usd)
    rate = bpy.context.scene.render.fps
    assert len(curves["points"]) == LAST and stage.GetTimeCodesPerSecond() == rate
    np.testing.assert_allclose(curves["times"], np.arange(1, LAST + 1) / rate)
    moved = 0.0
    for frame in range(1, LAST + 1):
        baked = baked_grid(cache, frame).reshape(-1, 3)
        np.testing.assert_allclose(curves["points"][frame - 1], to_unreal(baked), rtol=1e-6)
        np.testing.assert_array_equal(prim.GetPointsAttr().Get(frame), baked)
        moved = max(moved, np.abs(baked - baked_grid(cache, 1).reshape(-1, 3)).max())
    assert moved > 0.05
    assert curves["groom_root_uv"].shape == (60, 2)


def test_guides_of_a_bake_move_as_their_strands_do(swinging: Any, tmp_path: Path) -> None:
    hair, _ = swinging
    hair.data.hairloom.guides.guide_count = 9
    bake(hair)
    bpy.ops.hairloom.export_alembic(filepath=str(tmp_path / "a.abc"), frames="own", first=2, last=4)
    (curves,) = read_alembic_curves(tmp_path / "a.abc").values()
    (line,) = ExportCheck.of([hair]).motion_lines(use_bake=True)
    assert line == "Hair: bake of frames 1 to 6 at 24 fps"
    cache = playback.cache_of(hair)
    assert cache is not None and curves["groom_guide"].sum() == 9
    rig = playback.rig_in(cache).rig
    for place, frame in enumerate((2, 3, 4)):
        strands = baked_grid(cache, frame)
        expected = np.concatenate([strands, strands[rig.guides]]).reshape(-1, 3)
        np.testing.assert_allclose(curves["points"][place], to_unreal(expected), rtol=1e-6)


def test_a_bake_keeps_attributes_of_its_curves(swinging: Any, tmp_path: Path) -> None:
    hair, _ = swinging
    hair.data.hairloom.guides.cv_count = 15
    color = np.random.default_rng(6).random((480, 3)).astype(np.float32)
    stored = Groom(hedgehog(), strand_id=np.arange(60) + 9, group_names={1: "nape"})
    store_groom(hair.data, stored)
    set_colors(hair.data, replace(stored.strands, color=color))
    bake(hair, frames=range(1, 3))
    path = tmp_path / "a.abc"
    bpy.ops.hairloom.export_alembic(
        filepath=str(path), frames="own", first=1, last=2, parts="strands", by_group=True
    )
    found = read_alembic_curves(path)
    assert set(found) == {"Hair_0", "nape"}
    own = found["nape"]
    np.testing.assert_array_equal(own["groom_id"], np.arange(60)[1::2] + 9)
    written, expected = own["groom_color"].reshape(30, 15, 3), color.reshape(60, 8, 3)[1::2]
    np.testing.assert_allclose(written[:, [0, -1]], expected[:, [0, -1]], atol=1e-6)
    # on straight strands, new points are evenly spaced
    np.testing.assert_allclose(written[:, ::2], expected, atol=1e-5)


def test_frames_that_were_not_baked_are_named_and_nothing_is_written(
    swinging: Any, tmp_path: Path, read_output: Callable[[], str]
) -> None:
    hair, _ = swinging
    bake(hair, frames=range(2, 5))
    path = tmp_path / "hair.abc"
    with pytest.raises(RuntimeError, match=r"bake holds frames 2 to 4, not all of 1 to 6.*Bake"):
        bpy.ops.hairloom.export_alembic(filepath=str(path), frames="scene")
    (frames_in(tmp_path / "bake") / "frame_000003.npz").unlink()
    path.write_bytes(b"old")
    playback.forget()
    with pytest.raises(RuntimeError, match=r"frame_000003\.npz.*Bake again"):
        bpy.ops.hairloom.export_alembic(filepath=str(path), frames="own", first=2, last=4)
    read_output()
    assert path.read_bytes() == b"old"
    assert {p.name for p in tmp_path.iterdir()} == {"bake", "hair.abc"}


@needs_usd
def test_hair_without_a_bake_moves_as_its_modifiers_move_it(
    new_hair: Any, tmp_path: Path, read_output: Callable[[], str]
) -> None:
    hair = new_hair(strands=straight_strands())
    push_up(hair, 0.1, frame_driven=True)
    bpy.context.scene.frame_set(2)
    path = tmp_path / "hair.usdc"
    bpy.ops.hairloom.export_usd(filepath=str(path), frames="own", first=1, last=4)
    assert "no bake" in read_output()
    assert bpy.context.scene.frame_current == 2
    _, curves = read_usd_curves(path)
    for frame in range(1, 5):
        expected = straight_strands().points + np.array([0.0, 0.0, 0.1 * frame])
        np.testing.assert_allclose(curves.GetPointsAttr().Get(frame), expected, rtol=1e-5)
    bake_too = {"use_bake": False, "frames": "own", "first": 1, "last": 4}
    bpy.ops.hairloom.export_usd(filepath=str(path), **bake_too)
    assert "no bake" not in read_output()


@needs_usd
@pytest.mark.parametrize("children", ["none", "multi"])
def test_widths_are_those_of_the_first_frame_wherever_the_scene_is(
    new_hair: Any, sphere: Any, tmp_path: Path, children: str
) -> None:
    hair = new_hair(sphere)
    hair.data.hairloom.children.method = children
    hair.data.hairloom.children.strand_count = 80
    push_up(hair, 0.002, frame_driven=True)
    tree = hair.modifiers[-1].node_group
    radius, thin = tree.nodes.new("GeometryNodeSetCurveRadius"), tree.nodes.new("ShaderNodeMath")
    time = tree.nodes.new("GeometryNodeInputSceneTime")
    thin.operation, thin.inputs[1].default_value = "MULTIPLY", 1e-5
    (end,) = (each for each in tree.nodes if each.type == "GROUP_OUTPUT")
    tree.links.new(time.outputs["Frame"], thin.inputs[0])
    tree.links.new(thin.outputs[0], radius.inputs["Radius"])
    tree.links.new(end.inputs[0].links[0].from_socket, radius.inputs[0])
    tree.links.new(radius.outputs[0], end.inputs[0])
    written = []
    for playhead in (1, 9):
        bpy.context.scene.frame_set(playhead, subframe=0.25)
        path = tmp_path / f"{playhead}" / "a.usda"
        bpy.ops.hairloom.export_usd(filepath=str(path), frames="own", first=3, last=5)
        assert bpy.context.scene.frame_current_final == playhead + 0.25
        written.append(path.read_bytes())
    assert written[0] == written[1]
    _, curves = read_usd_curves(path)
    widths = np.array(curves.GetWidthsAttr().Get())
    np.testing.assert_allclose(widths[:480], 2.0 * 3e-5, rtol=1e-4)


@needs_usd
def test_children_follow_guides_that_modifiers_move(
    new_hair: Any, sphere: Any, tmp_path: Path
) -> None:
    """All points move up equally, and so do the children between them."""
    hair = new_hair(sphere)
    hair.data.hairloom.guides.guide_count = 60
    hair.data.hairloom.children.method = "multi"
    hair.data.hairloom.children.strand_count = 100
    push_up(hair, 0.02, frame_driven=True)
    bpy.context.scene.frame_set(0)
    bpy.ops.hairloom.export_usd(filepath=str(tmp_path / "a.usdc"), frames="own", first=0, last=3)
    _, curves = read_usd_curves(tmp_path / "a.usdc")
    first, last = (np.array(curves.GetPointsAttr().Get(frame)) for frame in (0, 3))
    rise = (last - first).reshape(160, -1, 3)
    np.testing.assert_allclose(rise[:60], np.broadcast_to([0, 0, 0.06], rise[:60].shape), atol=1e-6)
    assert rise[60:, 1:, 2].min() > 0.02, "the children stay"


@needs_usd
def test_changing_curve_counts_are_reported_and_leave_no_file(
    new_hair: Any, tmp_path: Path
) -> None:
    hair = new_hair(strands=straight_strands())
    plan = StrandExport.of(
        [hair],
        bpy.context.evaluated_depsgraph_get(),
        USD,
        StrandExportSettings(),
        frames=range(1, 4),
    )
    hair.data.remove_curves(indices=[0])
    with pytest.raises(HairloomError, match=r"in frame 1 its curves have changed"):
        plan.write(tmp_path / "a.usdc")
    assert list(tmp_path.iterdir()) == []


@needs_usd
def test_a_cancelled_export_leaves_the_old_file(swinging: Any, tmp_path: Path) -> None:
    """Esc in the window cancels work halfway in the same way."""
    hair, _ = swinging
    bake(hair)
    for suffix, kind in ((".abc", ALEMBIC), (".usdc", USD)):
        path = tmp_path / f"hair{suffix}"
        path.write_bytes(b"old")
        depsgraph = bpy.context.evaluated_depsgraph_get()
        plan = StrandExport.of(
            [hair], depsgraph, kind, StrandExportSettings(), frames=range(1, LAST + 1)
        )
        positions = plan.positions()
        work = plan.write_in_thread(path, positions)
        wait_until(lambda w=work, p=plan: w.run_main_thread_steps() or p.frames_read >= 3)
        work.cancel()
        positions.close()
        wait_until(work.run_main_thread_steps)
        assert plan.frames_read >= 3
        assert path.read_bytes() == b"old"
    assert {p.name for p in tmp_path.iterdir()} == {"bake", "hair.abc", "hair.usdc"}


def test_in_steps_the_same_file_is_written_as_at_once(swinging: Any, tmp_path: Path) -> None:
    hair, _ = swinging
    bake(hair)
    for path in (tmp_path / "once.abc", tmp_path / "steps.abc"):
        depsgraph = bpy.context.evaluated_depsgraph_get()
        plan = StrandExport.of(
            [hair], depsgraph, ALEMBIC, StrandExportSettings(), frames=range(1, LAST + 1)
        )
        if path.stem == "once":
            plan.write(path)
        else:
            work = plan.write_in_thread(path, plan.positions())
            wait_until(work.run_main_thread_steps)
            assert "frames 1 to 6" in work.result().result
    once, steps = (read_alembic_curves(tmp_path / name) for name in ("once.abc", "steps.abc"))
    for name, curves in once.items():
        for one, other in zip(curves["points"], steps[name]["points"], strict=True):
            np.testing.assert_array_equal(one, other)


def test_motion_into_a_format_without_is_refused(new_hair: Any, tmp_path: Path) -> None:
    plan = StrandExport.of(
        [new_hair(strands=straight_strands())],
        bpy.context.evaluated_depsgraph_get(),
        TRESSFX,
        StrandExportSettings(),
        frames=range(1, 3),
    )
    with pytest.raises(HairloomError, match=r"TressFX cannot store motion.*Alembic"):
        plan.write(tmp_path / "a.tfx")


@pytest.mark.parametrize("children", ["none", "multi"])
@pytest.mark.parametrize("name", ["Hair", "Head"])
def test_an_object_that_is_deleted_during_an_export_is_named(
    name: str, children: str, swinging: Any, get_depsgraph: Any
) -> None:
    hair, _ = swinging
    hair.data.hairloom.children.method = children
    hair.data.hairloom.children.strand_count = 80
    settings = StrandExportSettings(use_bake=False)
    plan = StrandExport.of([hair], get_depsgraph(), ALEMBIC, settings, frames=range(1, LAST))
    before, positions = bpy.context.scene.frame_current, plan.positions()
    next(positions)
    bpy.data.objects.remove(bpy.data.objects[name])
    with pytest.raises(HairloomError, match=f"{name}: this object is gone. Export again"):
        next(positions)
    assert bpy.context.scene.frame_current == before
