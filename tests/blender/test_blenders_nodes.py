"""The curves that Blender's own hair nodes make are the curves that are drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import bpy
import numpy as np
import pytest
from hedgehogs import hedgehog

from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.scene.hair_nodes import add_hair_nodes

NODES: dict[str, dict[str, Any]] = {
    "Curl Hair Curves": {"Subdivision": 5, "Radius": 0.005, "Frequency": 12.0},
    "Braid Hair Curves": {"Subdivision": 4, "Radius": 0.02},
    "Roll Hair Curves": {"Subdivision": 5, "Roll Length": 0.06, "Roll Radius": 0.006},
    "Frizz Hair Curves": {"Distance": 0.004},
    "Hair Curves Noise": {"Distance": 0.02, "Scale": 10.0},
}


def made_by_blender(hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> list[np.ndarray]:
    """The points of each curve as Blender evaluates them, in world space."""
    evaluated = hair.evaluated_get(depsgraph)
    curves = evaluated.data
    points = np.empty(len(curves.points) * 3, np.float32)
    curves.points.foreach_get("position", points)
    matrix = np.array(evaluated.matrix_world)
    world = points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    return np.split(world, [each.first_point_index for each in curves.curves][1:])


def length(line: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def farthest_from(points: np.ndarray, line: np.ndarray) -> float:
    """The largest distance of these points from a polyline."""
    start, step = line[:-1], np.diff(line, axis=0)
    along = np.einsum("psi,si->ps", points[:, None] - start, step)
    along = np.clip(along / np.maximum((step * step).sum(axis=1), 1e-20), 0.0, 1.0)
    nearest = start + along[..., None] * step
    return float(np.linalg.norm(points[:, None] - nearest, axis=-1).min(axis=1).max())


@pytest.mark.alike
@pytest.mark.draws(light=False)
@pytest.mark.parametrize("nodes", NODES)
def test_the_result_of_blenders_nodes_is_drawn(
    nodes: str, new_hair: Callable[..., Any], sphere: Any, get_depsgraph: Callable[[], Any]
) -> None:
    short = hedgehog(count=24, points=40)
    roots = np.repeat(short.points[short.offsets[:-1]], 40, axis=0)
    hair = new_hair(sphere, replace(short, points=roots + 3.0 * (short.points - roots)))
    add_hair_nodes(hair, nodes, NODES[nodes])
    bpy.context.view_layer.update()
    expected = made_by_blender(hair, get_depsgraph())
    straight = [np.linalg.norm(each[-1] - each[0]) for each in expected]
    assert sum(straight) < 0.99 * sum(map(length, expected)), "they bend it"
    session = previews.start(hair, get_depsgraph())
    strands = session.rig.strands
    drawn = np.split(strands.points, strands.offsets[1:-1])
    assert len(drawn) == len(expected) and session.warnings == ()
    typical = np.median([length(each) for each in expected])
    for found, wanted in zip(drawn, expected, strict=True):
        assert length(found) == pytest.approx(length(wanted), rel=0.005)
        assert farthest_from(wanted, found) < 8e-4 * typical + 1e-6
