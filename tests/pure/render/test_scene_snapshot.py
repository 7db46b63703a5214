"""Meshes of a scene in the snapshots of its grooms."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.render.scene_snapshot import DrawnGroom, SceneSnapshot
from hairloom.addon.render.snapshot import MeshSnapshot, Snapshot
from hairloom.addon.strands import Surface

TRIANGLES = np.array([[0, 1, 2]], np.int32)
CORNERS = np.array([[-1.0, -1.0, -0.1], [1.0, -1.0, 0.1], [0.0, 1.0, 0.0]], np.float32)


def hair_at(x: float) -> Snapshot:
    strands = np.zeros((3, 4, 3), np.float32)
    strands[..., 0] = x
    return Snapshot(strands, np.full((3, 4), 1e-4, np.float32))


def test_light_comes_back_to_each_groom_off_its_own_head() -> None:
    """In the colour of its head, whatever other meshes cast shadows."""
    colors = {0.0: (0.1, 0.2, 0.3), 5.0: (0.8, 0.6, 0.4)}
    heads = tuple(
        MeshSnapshot.of(Surface(CORNERS + np.float32([x, 0.0, 0.0]), TRIANGLES), color)
        for x, color in colors.items()
    )
    grooms = tuple(DrawnGroom(x, hair_at(x)) for x in colors)
    scene = SceneSnapshot(casters=heads, grooms=grooms)
    for groom, own in zip(grooms, heads, strict=True):
        lit = scene.lit_snapshot(groom)
        assert lit.skin_color == pytest.approx(own.color)
        assert set(map(id, lit.all_casters)) == set(map(id, heads))
    cap = MeshSnapshot.of(Surface(0.5 * CORNERS, TRIANGLES), (0.9, 0.0, 0.0))
    worn = MeshSnapshot.of(Surface(CORNERS, TRIANGLES), colors[0.0], is_skin=True)
    lit = SceneSnapshot(casters=(cap, worn), grooms=grooms).lit_snapshot(grooms[0])
    assert lit.skin_color == pytest.approx(colors[0.0]), "not in that of a cap"
    assert SceneSnapshot(grooms=grooms).lit_snapshot(grooms[0]).skin_color == (0.0, 0.0, 0.0)
