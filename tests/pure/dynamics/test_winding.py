"""Winding numbers against the exact sum over all triangles, and against known solid angles."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.dynamics.colliders.winding import triangle_angle, winding_number
from hairloom.addon.strands import Surface


def globe(rows: int = 24, columns: int = 48, radius: float = 0.1) -> Surface:
    """A closed sphere of longitudes and latitudes, counter-clockwise from outside."""
    polar, around = np.linspace(0, np.pi, rows + 1), np.arange(columns) * 2 * np.pi / columns
    sphere = np.stack(
        [
            np.sin(polar)[:, None] * np.cos(around),
            np.sin(polar)[:, None] * np.sin(around),
            np.repeat(np.cos(polar)[:, None], columns, axis=1),
        ],
        axis=-1,
    )
    corner = np.arange((rows + 1) * columns).reshape(rows + 1, columns)
    here, below = corner[:-1], corner[1:]
    right, below_right = np.roll(here, -1, axis=1), np.roll(below, -1, axis=1)
    faces = [np.stack([here, below, right], -1), np.stack([right, below, below_right], -1)]
    return Surface(sphere.reshape(-1, 3) * radius, np.concatenate(faces).reshape(-1, 3))


def exact(points: np.ndarray, surface: Surface) -> np.ndarray:
    corners = surface.corners.astype(np.float64).transpose(1, 2, 0)
    return np.array([triangle_angle(p[:, None], corners).sum() for p in points]) / (4.0 * np.pi)


def test_one_octant_is_an_eighth_of_the_sky() -> None:
    """The triangle between the three axes, seen from the origin, covers 4 pi / 8."""
    angle = triangle_angle(np.zeros((3, 1)), np.eye(3)[..., None])
    assert angle == pytest.approx(np.pi / 2)


def test_inside_is_one_and_outside_zero() -> None:
    points = np.random.default_rng(1).uniform(-0.2, 0.2, (500, 3))
    distance = np.linalg.norm(points, axis=1)
    clear = np.abs(distance - 0.1) > 0.002
    winding = winding_number(points[clear], globe())
    np.testing.assert_allclose(winding, distance[clear] < 0.1, atol=0.05)


def test_right_at_the_surface_it_is_as_the_exact_sum() -> None:
    """Where points share cells with many others, for some of which triangles are near."""
    points = np.random.default_rng(2).normal(0.0, 1.0, (400, 3))
    points *= 0.1 / np.linalg.norm(points, axis=1, keepdims=True)
    points *= np.linspace(0.97, 1.03, 400)[:, None]
    np.testing.assert_allclose(winding_number(points, globe()), exact(points, globe()), atol=0.05)


def test_a_number_does_not_depend_on_other_points() -> None:
    points = np.random.default_rng(3).uniform(-0.11, 0.11, (300, 3))
    alone = [winding_number(point[None], globe())[0] for point in points[:20]]
    np.testing.assert_allclose(winding_number(points, globe())[:20], alone, atol=1e-5)


def test_a_mesh_turned_inside_out_gives_minus_one() -> None:
    surface = globe()
    turned = Surface(surface.positions, surface.triangles[:, ::-1])
    assert winding_number(np.zeros((1, 3)), turned)[0] == pytest.approx(-1.0, abs=0.05)


@pytest.mark.parametrize("triangle_count", [1, 3, 5, 700])
def test_as_the_exact_sum_for_any_soup(triangle_count: int) -> None:
    """With counts that do not fill the tree's leaves, a triangle counted twice would show."""
    random = np.random.default_rng(triangle_count)
    corners = random.normal(0.0, 1.0, (triangle_count, 1, 3)) + random.normal(
        0.0, 0.2, (triangle_count, 3, 3)
    )
    soup = Surface(
        corners.reshape(-1, 3).astype(np.float32), np.arange(3 * triangle_count).reshape(-1, 3)
    )
    points = random.normal(0.0, 1.5, (200, 3))
    np.testing.assert_allclose(winding_number(points, soup), exact(points, soup), atol=0.05)


def test_a_head_with_its_neck_cut_off_still_has_an_inside() -> None:
    surface = globe()
    open_below = surface.triangles[surface.corners[:, :, 2].mean(axis=1) > -0.085]
    winding = winding_number(
        np.array([[0.0, 0.0, 0.03], [0.0, 0.0, 0.2]]), Surface(surface.positions, open_below)
    )
    assert winding[0] > 0.5 > winding[1]


def test_no_points() -> None:
    assert winding_number(np.zeros((0, 3)), globe()).shape == (0,)
