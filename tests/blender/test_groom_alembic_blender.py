"""Groom Alembic and Blender's own Alembic in one process, in both directions."""

from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="these tests need Blender or the bpy module")
pytest.importorskip("alembic3d", reason="this Python has no alembic3d")

from hairloom.addon.blender.strands.child_python import python_for  # noqa: E402
from hairloom.addon.exchange.alembic.groom_alembic import write_groom_alembic  # noqa: E402
from hairloom.addon.exchange.alembic.groom_alembic_read import read_groom_alembic  # noqa: E402
from hairloom.addon.exchange.groom import Groom  # noqa: E402
from hairloom.addon.exchange.groom_presets import PRESETS  # noqa: E402
from hairloom.addon.strands import StrandSet  # noqa: E402

if not bpy.app.build_options.alembic:
    pytest.skip("this Blender is built without Alembic", allow_module_level=True)

COUNT, POINTS = 40, 6


@pytest.fixture
def strands():
    random = np.random.default_rng(6)
    steps = random.normal(0.0, 0.02, (COUNT, POINTS, 3)).astype(np.float32)
    offsets = np.arange(COUNT + 1) * POINTS
    radius = np.repeat(random.uniform(3e-5, 8e-5, COUNT), POINTS)
    points = np.cumsum(steps, axis=1).reshape(-1, 3)
    return StrandSet(points, offsets, radius, np.zeros(COUNT))


def curves_of(objects):
    """World-space points of the only hair among these objects."""
    (hair,) = [each for each in objects if each.type == "CURVES"]
    points = np.empty(3 * len(hair.data.points), np.float32)
    hair.data.position_data.foreach_get("vector", points)
    world = np.array(hair.matrix_world)
    return points.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]


def test_blender_reads_what_we_write_and_we_what_it_writes(strands, tmp_path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    ours, blenders = tmp_path / "ours.abc", tmp_path / "blenders.abc"
    picture = bpy.data.images.new("Any", 4, 4, float_buffer=True)
    for _ in range(2):  # alternating, so that each library runs after the other
        write_groom_alembic(ours, Groom(strands), PRESETS["blender"])
        bpy.ops.wm.alembic_import(filepath=str(ours), as_background_job=False)
        np.testing.assert_allclose(curves_of(bpy.context.scene.objects), strands.points, atol=1e-6)
        bpy.ops.wm.alembic_export(filepath=str(blenders), as_background_job=False)
        read = read_groom_alembic(blenders, python=python_for(blenders))
        np.testing.assert_allclose(read.strands.points, strands.points, atol=1e-6)
        np.testing.assert_allclose(read.strands.radius, strands.radius, rtol=1e-5)
        # OpenEXR also contains Imath
        picture.filepath_raw, picture.file_format = str(tmp_path / "a.exr"), "OPEN_EXR"
        picture.save()
        assert Path(picture.filepath_raw).stat().st_size > 100
        for each in list(bpy.context.scene.objects):
            bpy.data.objects.remove(each)
