"""`Surface`: invalid input, normals in closed form, and mirroring."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.strands import Surface

CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def cube() -> Surface:
    """A cube whose faces are counter-clockwise from outside, each split along one diagonal."""
    triangles = [q[:3] for q in QUADS] + [(q[0], q[2], q[3]) for q in QUADS]
    uv = np.random.default_rng(1).random((12, 3, 2))
    return Surface(CORNERS, triangles, uv)


def test_triangle_normals_point_out_of_the_cube() -> None:
    surface = cube()
    normals = surface.triangle_normals()
    assert np.abs(normals).sum(axis=1) == pytest.approx(np.ones(12))
    assert (np.einsum("ij,ij->i", normals, surface.corners.mean(axis=1)) > 0.9).all()


def test_vertex_normals_do_not_see_the_diagonals() -> None:
    """Weighted by angle, they are the cube's diagonals, however its faces are split."""
    assert cube().vertex_normals() == pytest.approx(CORNERS / np.sqrt(3.0), abs=1e-6)


def split(surface: Surface, is_split: Any) -> Surface:
    """A surface in which these triangles have their own vertices, as in files along seams."""
    positions, triangles = list(surface.positions), surface.triangles.copy()
    for triangle in np.flatnonzero(is_split):
        triangles[triangle] = len(positions) + np.arange(3)
        positions += list(surface.corners[triangle])
    return Surface(np.array(positions), triangles)


def test_vertex_normals_do_not_see_seams_but_hard_edges() -> None:
    """A tube of 24 sides with one half split has the normals of the whole tube; a fully split box
    has those of its faces."""
    angle = 2.0 * np.pi * np.arange(24) / 24
    rings = [np.stack([np.cos(angle), np.sin(angle), np.full(24, z)], axis=1) for z in (0, 1, 2)]
    one = np.arange(48)
    right = one - one % 24 + (one + 1) % 24
    quads = np.stack([one, right, right + 24, one + 24], axis=1)
    tube = Surface(
        np.concatenate(rings), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    )
    parted = split(tube, tube.corners.mean(axis=1)[:, 0] > 0.0)
    expected = tube.vertex_normals()[tube.triangles]
    np.testing.assert_allclose(parted.vertex_normals()[parted.triangles], expected, atol=1e-6)
    box = split(cube(), np.ones(12, bool))
    faces = np.repeat(cube().triangle_normals(), 3, axis=0)
    np.testing.assert_allclose(box.vertex_normals()[8:], faces, atol=1e-6)


def test_triangle_without_area_has_no_normal() -> None:
    surface = Surface([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    assert (surface.triangle_normals() == 0).all()
    assert (surface.vertex_normals() == 0).all()


@pytest.mark.parametrize("scale", [(2.0, 1.0, 0.5), (-1.0, 1.0, 1.0), (-1.0, -2.0, -3.0)])
def test_transformed_keeps_the_outside_outside(scale: tuple[float, float, float]) -> None:
    surface, matrix = cube(), np.diag([*scale, 1.0])
    matrix[:3, 3] = (5.0, 6.0, 7.0)
    moved = surface.transformed(matrix)
    outward = moved.corners.mean(axis=1) - [5.0, 6.0, 7.0]
    assert (np.einsum("ij,ij->i", moved.triangle_normals(), outward) > 0.0).all()


def test_mirroring_keeps_each_uv_at_its_corner() -> None:
    surface = cube()
    mirrored = surface.transformed(np.diag([-1.0, 1.0, 1.0, 1.0]))
    assert surface.corner_uv is not None
    assert mirrored.corner_uv is not None

    def uv_by_corner(mesh: Surface, uv: Any, sign: float) -> dict[tuple[float, ...], list[float]]:
        keys = np.concatenate(
            [
                mesh.corners * [sign, 1, 1],
                np.repeat((mesh.corners * [sign, 1, 1]).mean(axis=1)[:, None], 3, axis=1),
            ],
            axis=2,
        )
        pairs = zip(keys.reshape(-1, 6).round(4).tolist(), uv.reshape(-1, 2).tolist(), strict=True)
        return {tuple(key): value for key, value in pairs}

    before = uv_by_corner(surface, surface.corner_uv, 1.0)
    assert uv_by_corner(mirrored, mirrored.corner_uv, -1.0) == before


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"positions": np.zeros((8, 2))}, "shape"),
        ({"triangles": [[0, 1, 8]]}, "does not exist"),
        ({"triangles": [[0, 1, -1]]}, "does not exist"),
        ({"positions": np.full((8, 3), np.inf)}, "not finite"),
        ({"corner_uv": np.zeros((1, 3, 2))}, "corner_uv"),
    ],
)
def test_what_does_not_fit_is_refused(changes: dict[str, Any], problem: str) -> None:
    surface = cube()
    values = {"positions": surface.positions, "triangles": surface.triangles}
    with pytest.raises(HairloomError, match=problem):
        Surface(**(values | changes))
