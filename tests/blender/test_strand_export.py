"""Strands exported from the open scene, read back by Alembic's low-level API and by usd-core."""

from __future__ import annotations

import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from hedgehogs import hedgehog
from strand_files import (
    needs_usd,
    push_up,
    read_alembic_curves,
    read_usd_curves,
    straight_strands,
    to_unreal,
)

from hairloom.addon.blender.scene.curves import write_curves
from hairloom.addon.blender.scene.groom_attributes import store_groom
from hairloom.addon.blender.strands.export_check import ExportCheck
from hairloom.addon.blender.strands.strand_export import StrandExport
from hairloom.addon.exchange.groom import Groom
from hairloom.addon.exchange.hair_file import read_hair_file
from hairloom.addon.exchange.strand_export_settings import StrandExportSettings
from hairloom.addon.exchange.strand_formats import TRESSFX
from hairloom.addon.exchange.tressfx import read_tfx
from hairloom.addon.strands import StrandSet


def test_a_strand_of_a_metre_stands_where_unreal_looks_for_it(
    new_hair: Any, tmp_path: Path
) -> None:
    new_hair(strands=straight_strands())
    path = tmp_path / "hair.abc"
    assert bpy.ops.hairloom.export_alembic(filepath=str(path), parts="strands") == {"FINISHED"}
    (curves,) = read_alembic_curves(path).values()
    np.testing.assert_allclose(curves["points"][0][0], [100.0, -200.0, 300.0], rtol=1e-6)
    np.testing.assert_allclose(curves["points"][0][4], [100.0, -200.0, 400.0], rtol=1e-6)
    np.testing.assert_allclose(curves["groom_width"], 8e-3, rtol=1e-6)


def test_a_file_is_written_in_a_thread(
    new_hair: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The window responds while a large file is written."""
    new_hair(strands=straight_strands())
    writers = []

    def write(*given: Any) -> Any:
        writers.append(threading.current_thread())
        return written(*given)

    written = StrandExport.write
    monkeypatch.setattr(StrandExport, "write", write)
    path = tmp_path / "hair.tfx"
    assert bpy.ops.hairloom.export_tressfx(filepath=str(path)) == {"FINISHED"}
    assert path.is_file()
    assert threading.main_thread() not in writers and len(writers) == 1


@pytest.mark.parametrize(
    ("engine", "up", "unit", "root"),
    [
        ("unreal", "Z", 0.01, (100.0, 200.0, 300.0)),
        ("maya", "Y", 0.01, (100.0, 300.0, -200.0)),
        ("blender", "Z", 1.0, (1.0, 2.0, 3.0)),
    ],
)
@needs_usd
def test_usd_stores_its_unit_and_axes(
    new_hair: Any, tmp_path: Path, engine: str, up: str, unit: float, root: Any
) -> None:
    new_hair(strands=straight_strands())
    path = tmp_path / "hair.usdc"
    bpy.ops.hairloom.export_usd(filepath=str(path), engine=engine, parts="strands")
    stage, curves = read_usd_curves(path)
    from pxr import UsdGeom

    assert (UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)) == (up, unit)
    np.testing.assert_allclose(curves.GetPointsAttr().Get()[0], root, rtol=1e-6)
    np.testing.assert_allclose(curves.GetWidthsAttr().Get()[0], 8e-5 / unit, rtol=1e-5)


@needs_usd
def test_chosen_axes_and_unit_override_those_of_the_program(new_hair: Any, tmp_path: Path) -> None:
    new_hair(strands=straight_strands())
    path = tmp_path / "hair.usda"
    bpy.ops.hairloom.export_usd(
        filepath=str(path), engine="unreal", up="Y", scale=0.1, parts="strands"
    )
    _, curves = read_usd_curves(path)
    np.testing.assert_allclose(curves.GetPointsAttr().Get()[0], (10.0, 30.0, -20.0), rtol=1e-6)
    bpy.ops.hairloom.export_hair(filepath=str(tmp_path / "h.hair"), up="Y", scale=0.01)
    read = read_hair_file(tmp_path / "h.hair", up="Z", scale=1.0).strands
    np.testing.assert_allclose(read.points[0], (100.0, 300.0, -200.0), rtol=1e-6)


def test_guides_lie_beside_the_strands_and_name_what_rides_on_them(
    new_hair: Any, sphere: Any, tmp_path: Path
) -> None:
    hair = new_hair(sphere)
    hair.data.hairloom.guides.guide_count = 7
    path = tmp_path / "hair.abc"
    bpy.ops.hairloom.export_alembic(filepath=str(path))
    (curves,) = read_alembic_curves(path).values()
    guide, ids = curves["groom_guide"] == 1, curves["groom_id"]
    assert (len(guide), guide.sum()) == (67, 7) and len(np.unique(ids)) == 67
    assert np.isin(curves["groom_closest_guides"], ids[guide]).all()
    np.testing.assert_allclose(curves["groom_guide_weights"].sum(axis=1), 1.0, rtol=1e-5)
    roots = curves["points"][0].reshape(67, 8, 3)[:, 0]
    of_id = dict(zip(ids.tolist(), roots, strict=True))
    for strand in range(60):
        own = [
            np.linalg.norm(of_id[closest] - roots[strand])
            for closest in curves["groom_closest_guides"][strand].tolist()
        ]
        others = curves["groom_group_id"][guide] == curves["groom_group_id"][strand]
        nearest = np.linalg.norm(roots[guide][others] - roots[strand], axis=1).min()
        assert min(own) == pytest.approx(nearest), "the nearest guide of its group is one of three"
    assert curves["groom_root_uv"].shape == (67, 2) and np.ptp(curves["groom_root_uv"]) > 0.5


def test_modifiers_are_in_the_file_and_the_scene_is_untouched(
    new_hair: Any, tmp_path: Path
) -> None:
    hair = new_hair(strands=straight_strands())
    push_up(hair, 0.25)
    before = np.empty(30, np.float32)
    hair.data.position_data.foreach_get("vector", before)
    blocks = {data.name_full for data in bpy.data.user_map()}
    path = tmp_path / "hair.abc"
    bpy.ops.hairloom.export_alembic(filepath=str(path), parts="strands")
    (curves,) = read_alembic_curves(path).values()
    expected = to_unreal(straight_strands().points + np.array([0.0, 0.0, 0.25]))
    np.testing.assert_allclose(curves["points"][0], expected, rtol=1e-5)
    after = np.empty(30, np.float32)
    hair.data.position_data.foreach_get("vector", after)
    np.testing.assert_array_equal(before, after)
    assert {data.name_full for data in bpy.data.user_map()} == blocks
    assert [modifier.name for modifier in hair.modifiers] == ["Push"]


def test_uneven_point_counts_are_kept(new_hair: Any, tmp_path: Path) -> None:
    counts = np.array([4, 9, 2, 30])
    points = np.concatenate([np.linspace([i, 0, 0], [i, 0, 0.1], n) for i, n in enumerate(counts)])
    offsets = np.concatenate([[0], np.cumsum(counts)])
    new_hair(strands=StrandSet(points * 0.1, offsets, np.full(counts.sum(), 5e-5), [0] * 4))
    bpy.ops.hairloom.export_alembic(filepath=str(tmp_path / "a.abc"), parts="strands")
    (curves,) = read_alembic_curves(tmp_path / "a.abc").values()
    np.testing.assert_array_equal(curves["counts"], counts)


def test_curves_that_are_all_guides_are_strands_for_the_check_as_for_the_file(
    new_hair: Any, tmp_path: Path
) -> None:
    hair = new_hair()
    store_groom(hair.data, Groom(hedgehog(), is_guide=np.ones(60, bool)))
    bpy.ops.hairloom.export_tressfx(filepath=str(tmp_path / "a.tfx"))
    assert read_tfx(tmp_path / "a.tfx").strands.strand_count == 60
    check = ExportCheck.of([hair])
    check.refresh(TRESSFX, StrandExportSettings())
    assert check.lines[0].startswith("60 strands, 0 guides")


def test_attributes_of_the_groom_are_in_the_file(new_hair: Any, tmp_path: Path) -> None:
    strands = replace(hedgehog(), color=np.random.default_rng(3).random((480, 3)))
    hair = new_hair(strands=strands)
    is_guide = np.arange(60) % 20 < 2  # two in each group
    stored = Groom(
        strands,
        strand_id=np.arange(60) * 3 + 7,
        is_guide=is_guide,
        group_names={0: "crown", 1: "nape"},
    )
    store_groom(hair.data, stored)
    path = tmp_path / "hair.abc"
    bpy.ops.hairloom.export_alembic(filepath=str(path), by_group=True)
    found = read_alembic_curves(path)
    assert set(found) == {"crown", "nape"}
    for group, name in ((0, "crown"), (1, "nape")):
        own = strands.group == group
        np.testing.assert_array_equal(found[name]["groom_id"], stored.strand_id[own])
        np.testing.assert_array_equal(found[name]["groom_guide"], is_guide[own])
        color = stored.color.reshape(60, 8, 3)[own].reshape(-1, 3)
        np.testing.assert_allclose(found[name]["groom_color"], color, atol=1e-6)
        guides = stored.strand_id[is_guide & own]
        assert np.isin(found[name]["groom_closest_guides"], guides).all()


def test_hair_without_a_colour_has_that_of_its_look(new_hair: Any, tmp_path: Path) -> None:
    hair = new_hair(strands=straight_strands())
    hair.data.hairloom.shading.base_color = (0.25, 0.5, 0.75)
    bpy.ops.hairloom.export_alembic(filepath=str(tmp_path / "a.abc"))
    (curves,) = read_alembic_curves(tmp_path / "a.abc").values()
    np.testing.assert_allclose(curves["groom_color"], np.tile([0.25, 0.5, 0.75], (20, 1)))


def test_several_hairs_are_groups_of_one_groom(new_hair: Any, sphere: Any, tmp_path: Path) -> None:
    brows = write_curves("Brows", hedgehog(20, 5, seed=2), sphere, bpy.context.collection)
    scalp = new_hair(sphere)
    brows.select_set(True)
    path = tmp_path / "both.abc"
    bpy.ops.hairloom.export_alembic(filepath=str(path), by_group=True)
    found = read_alembic_curves(path)
    assert set(found) == {"Hair_0", "Hair_1", "Brows_0", "Brows_1"}
    ids = np.concatenate([each["groom_id"] for each in found.values()])
    assert len(np.unique(ids)) == len(ids)
    for each in found.values():
        own = each["groom_id"][each["groom_guide"] == 1]
        assert np.isin(each["groom_closest_guides"], own).all()
    bpy.ops.hairloom.export_alembic(
        filepath=str(tmp_path / "x.abc"), several="each", parts="strands"
    )
    assert {p.name for p in tmp_path.glob("x*.abc")} == {"x_Hair.abc", "x_Brows.abc"}
    (one,) = read_alembic_curves(tmp_path / "x_Brows.abc").values()
    assert len(one["counts"]) == 20
    assert scalp.name == "Hair"


def test_grooms_with_equal_file_names_get_two_files(
    new_hair: Any, sphere: Any, tmp_path: Path
) -> None:
    """On Windows, hair_001 would overwrite the file of Hair.001."""
    other = write_curves("hair_001", hedgehog(20, 5, seed=2), sphere, bpy.context.collection)
    hair = new_hair(sphere)
    hair.name = "Hair.001"
    other.select_set(True)
    bpy.ops.hairloom.export_tressfx(filepath=str(tmp_path / "x.tfx"), several="each")
    files = sorted(tmp_path.iterdir())
    assert len({each.name.casefold() for each in files}) == len(files) == 2
    counts = sorted(read_tfx(each).strands.strand_count for each in files)
    assert counts == sorted([20, len(hair.data.curves)])


@pytest.mark.slow
def test_children_are_strands_and_their_guides_are_marked(
    new_hair: Any, sphere: Any, tmp_path: Path
) -> None:
    hair = new_hair(sphere)
    hair.data.hairloom.guides.guide_count = 60
    hair.data.hairloom.children.method = "multi"
    hair.data.hairloom.children.strand_count = 200
    bpy.ops.hairloom.export_alembic(filepath=str(tmp_path / "a.abc"))
    (curves,) = read_alembic_curves(tmp_path / "a.abc").values()
    assert curves["groom_guide"].sum() == 60 and len(curves["groom_guide"]) == 320
