"""Strands stored by root UV and shape: restored on the same surface, and transferred to others."""

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.groom.bound_strands import bound_strands
from hairloom.addon.strands import StrandSet, Surface
from hairloom.addon.strands.rooted_shapes import RootedShapes

RANDOM = np.random.default_rng(5)


def dome(side: int = 9, *, mirrored: bool = False) -> Surface:
    """A bulge over the unit square, whose UVs are x and y."""
    across = np.linspace(0.0, 1.0, side)
    u, v = (part.ravel() for part in np.meshgrid(across, across))
    positions = np.stack([u, v, 0.3 * np.sin(3.0 * u) + 0.2 * v * v], axis=1)
    first = (np.arange(side - 1) + side * np.arange(side - 1)[:, None]).ravel()
    triangles = np.concatenate(
        [
            np.stack([first, first + 1, first + side + 1], axis=1),
            np.stack([first, first + side + 1, first + side], axis=1),
        ]
    )
    uv = np.stack([1.0 - u if mirrored else u, v], axis=1)
    return Surface(positions, triangles, uv[triangles])


def strands_on(surface: Surface, count: int = 40) -> StrandSet:
    triangle = RANDOM.integers(0, len(surface.triangles), count)
    weight = RANDOM.dirichlet((1.0, 1.0, 1.0), count)
    root = np.einsum("nk,nkj->nj", weight, surface.corners[triangle])
    steps = RANDOM.normal(0.0, 0.02, (count, 6, 3))
    steps[:, 0] = 0.0
    return bound_strands(root[:, None] + np.cumsum(steps, axis=1), triangle, weight, surface)


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_same_strands_come_back_on_the_same_surface(mirrored: bool) -> None:
    surface = dome(mirrored=mirrored)
    strands = strands_on(surface)
    again = RootedShapes.of(strands, surface).on(surface)
    assert np.abs(again.points - strands.points).max() < 2e-5
    assert np.array_equal(again.offsets, strands.offsets)


def test_a_turned_and_larger_surface_carries_them_as_one() -> None:
    """Against the matrix itself."""
    surface = dome()
    strands = strands_on(surface)
    angle, scale = 0.7, 2.5
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    turn = turn @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = scale * turn, (0.3, -2.0, 1.0)
    moved = RootedShapes.of(strands, surface).on(surface.transformed(matrix), scale)
    expected = strands.points @ matrix[:3, :3].T + matrix[:3, 3]
    assert np.abs(moved.points - expected).max() < 1e-4


def test_a_finer_mesh_of_the_same_map_has_the_roots_in_the_same_place() -> None:
    surface, finer = dome(9), dome(33)
    strands = strands_on(surface)
    carried = RootedShapes.of(strands, surface).on(finer)
    assert np.linalg.norm(carried.roots - strands.roots, axis=1).max() < 0.02, (
        "the bulge is rounder"
    )
    assert carried.lengths() == pytest.approx(strands.lengths(), rel=1e-3)


def test_a_mesh_without_the_map_is_refused() -> None:
    surface = dome()
    shapes = RootedShapes.of(strands_on(surface), surface)
    with pytest.raises(HairloomError, match="no UVs"):
        shapes.on(replace(surface, corner_uv=None))
    assert surface.corner_uv is not None
    with pytest.raises(HairloomError, match="no face where hair is to grow"):
        shapes.on(replace(surface, corner_uv=surface.corner_uv + np.float32(2.0)))
