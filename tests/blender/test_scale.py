"""Scenes of any size and unit scale have the same motion, warnings, children and cards."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest
from grids import strand_grid
from mathutils import Matrix
from tiers import few_in_commits

from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.preview.diagnostics import issues_of
from hairloom.addon.blender.strands.export_check import ExportCheck
from hairloom.addon.exchange.strand_export_settings import StrandExportSettings
from hairloom.addon.exchange.strand_formats import STRAND_FORMATS
from hairloom.addon.strands import StrandSet

FRAMES = 3


def curled(scale: float) -> StrandSet:
    """Hair that stands on the sphere of radius 0.1 m and bends to one side, scaled."""
    outward = np.random.default_rng(1).normal(size=(60, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    along = np.linspace(0.0, 1.0, 8)[:, None]
    points = outward[:, None] * (0.1 + 0.08 * along) + along**2 * [0.02, 0.0, 0.0]
    return StrandSet(
        points=scale * points.reshape(-1, 3),
        offsets=np.arange(61) * 8,
        radius=np.full(480, 5.0e-5 * scale),
        group=np.zeros(60, int),
    )


def frames_and_messages(
    sphere: Any, new_hair: Callable[..., Any], get_depsgraph: Callable[[], Any], scale: float
) -> tuple[np.ndarray, dict[str, Any]]:
    """Strands in frames of a moving head, divided by the scale, and all messages about them."""
    head = sphere.copy()
    head.data = sphere.data.copy()
    head.data.transform(Matrix.Scale(scale, 4))
    bpy.context.collection.objects.link(head)
    bpy.context.scene.gravity = (0.0, 0.0, -9.81 * scale)
    hair = new_hair(head, curled(scale))
    hair.data.hairloom.widths.method = "auto"
    hair.data.hairloom.children.method = "multi"
    hair.data.hairloom.children.strand_count = 100
    hair.hairloom.dynamics.device = "numpy"
    session = previews.start(hair, get_depsgraph())
    previews.play(get_depsgraph())
    frames = []
    for _ in range(FRAMES):
        head.location.x += 0.02 * scale
        bpy.context.view_layer.update()
        previews.advance(get_depsgraph(), 1.0 / 24.0)
        frames.append(np.asarray(strand_grid(session), np.float64) / scale)
    check = ExportCheck.of([hair])
    warnings = {}
    for kind in STRAND_FORMATS:
        check.refresh(kind, StrandExportSettings())
        warnings[kind.name] = check.warnings
    messages = {
        "warnings": warnings,
        "issues": [issue.text.replace(head.name, "head") for issue in issues_of(hair, session)],
        "notes": session.rig.notes,
        "widths": session.rig.widths.reason.partition(",")[0],
        "hairs": round(session.rig.widths.hairs, 3),
        "children": session.rig.child_count,
        "loose": session.groom.loose_roots,
    }
    previews.end()
    return np.array(frames), messages


# powers of two: on a sphere with equal triangles, rounding would decide where the first children
# grow
@pytest.mark.slow(
    instead="tests/pure/groom/test_children.py::test_children_are_the_same_at_any_scale"
)
@pytest.mark.parametrize("scale", few_in_commits([2.0**-10, 2.0**10]))
def test_a_scene_of_another_size_moves_and_warns_the_same(
    sphere: Any, new_hair: Callable[..., Any], get_depsgraph: Callable[[], Any], scale: float
) -> None:
    one, messages = frames_and_messages(sphere, new_hair, get_depsgraph, 1.0)
    other, messages_again = frames_and_messages(sphere, new_hair, get_depsgraph, scale)
    assert messages_again == messages
    assert messages["children"] == 100
    assert np.abs(one[-1] - one[0] - [0.02 * (FRAMES - 1), 0.0, 0.0]).max() > 0.005
    assert np.abs(other - one).max() < 1e-4  # a thousandth of the hair's length


@pytest.mark.parametrize("unit", few_in_commits([0.01, 1000.0]))
@pytest.mark.slow
def test_the_unit_scale_only_changes_how_numbers_are_shown(
    sphere: Any, new_hair: Callable[..., Any], get_depsgraph: Callable[[], Any], unit: float
) -> None:
    """As in Blender's own physics, which takes gravity in scene units."""
    one, messages = frames_and_messages(sphere, new_hair, get_depsgraph, 1.0)
    bpy.context.scene.unit_settings.scale_length = unit
    other, messages_again = frames_and_messages(sphere, new_hair, get_depsgraph, 1.0)
    np.testing.assert_array_equal(other, one)
    assert messages_again == messages
