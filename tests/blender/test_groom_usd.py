"""USD between Hairloom and Blender's own importer and exporter, in both directions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")
pytest.importorskip("pxr", reason="this Python has no OpenUSD")

from hairloom.addon.exchange.groom import Groom  # noqa: E402
from hairloom.addon.exchange.usd.groom_usd import write_usd  # noqa: E402
from hairloom.addon.exchange.usd.groom_usd_read import read_usd  # noqa: E402
from hairloom.addon.strands import StrandSet  # noqa: E402

if not hasattr(bpy.ops.wm, "usd_export") or not bpy.app.build_options.usd:
    pytest.skip("this Blender is built without USD", allow_module_level=True)

OFFSETS = [0, 3, 7, 9]


def strands() -> StrandSet:
    random = np.random.default_rng(8)
    return StrandSet(
        random.uniform(-0.3, 0.3, (9, 3)),
        OFFSETS,
        random.uniform(2e-5, 9e-5, 9),
        [0, 4, 0],
        random.random((3, 2)),
    )


def values(attribute: Any, field: str, width: int) -> np.ndarray:
    found = np.empty(len(attribute.data) * width, np.float32 if width > 1 else np.int32)
    attribute.data.foreach_get(field, found)
    return found.reshape(-1, width)


@pytest.mark.parametrize("suffix", [".usdc", ".usda"])
def test_blender_exports_what_we_read(empty_scene: Any, tmp_path: Path, suffix: str) -> None:
    hair, expected = bpy.data.hair_curves.new("hair"), strands()
    hair.add_curves(np.diff(OFFSETS).tolist())
    hair.position_data.foreach_set("vector", expected.points.ravel())
    for name, kind, domain, field, content in (
        ("radius", "FLOAT", "POINT", "value", expected.radius),
        ("surface_uv_coordinate", "FLOAT2", "CURVE", "vector", expected.root_uv),
        ("groom_group_id", "INT", "CURVE", "value", expected.group),
    ):
        hair.attributes.new(name, kind, domain).data.foreach_set(field, np.ravel(content))
    item = bpy.data.objects.new("hair", hair)
    bpy.context.scene.collection.objects.link(item)
    item.location = (1.0, 2.0, 3.0)
    path = tmp_path / f"hair{suffix}"
    bpy.ops.wm.usd_export(filepath=str(path), export_hair=True)
    read = read_usd(path)
    assert read.notes == () and read.dropped == {}
    assert np.allclose(read.strands.points, expected.points + np.float32([1, 2, 3]), atol=1e-6)
    assert read.strands.offsets.tolist() == OFFSETS
    assert np.allclose(read.strands.radius, expected.radius, rtol=1e-5)
    assert np.allclose(read.strands.root_uv, expected.root_uv)
    assert read.strands.group.tolist() == [0, 4, 0]


def test_blender_imports_what_we_write(empty_scene: Any, tmp_path: Path) -> None:
    """Written with another up axis and unit, which Blender converts back."""
    expected = strands()
    path = tmp_path / "hair.usdc"
    write_usd(path, Groom(expected, strand_id=[5, 6, 7]), up="Y", scale=0.01)
    bpy.ops.wm.usd_import(filepath=str(path))
    (item,) = [each for each in bpy.data.objects if each.type == "CURVES"]
    hair = item.data
    assert [curve.points_length for curve in hair.curves] == np.diff(OFFSETS).tolist()
    local = values(hair.attributes["position"], "vector", 3)
    matrix = np.array(item.matrix_world)
    assert np.allclose(local @ matrix[:3, :3].T + matrix[:3, 3], expected.points, atol=1e-5)
    radius = np.array([point.radius for point in hair.points]) * item.matrix_world.median_scale
    assert np.allclose(radius, expected.radius, rtol=1e-4)
    assert values(hair.attributes["groom_id"], "value", 1).ravel().tolist() == [5, 6, 7]
    assert values(hair.attributes["groom_group_id"], "value", 1).ravel().tolist() == [0, 4, 0]
    assert np.allclose(values(hair.attributes["groom_root_uv"], "vector", 2), expected.root_uv)
