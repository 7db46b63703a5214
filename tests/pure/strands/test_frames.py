"""Tangents and twist-free normals, against curves with frames in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.strands.frames import strand_tangents, tangents, transported_normals

pytestmark = pytest.mark.portable


def helix(count: int, pitch: float, turns: float = 1.0) -> tuple[Floats, Floats]:
    """Points (count, 3) and unit tangents (count, 3) of a helix of radius 1."""
    angle = np.linspace(0.0, 2.0 * np.pi * turns, count)
    points = np.stack([np.cos(angle), np.sin(angle), pitch * angle], axis=1)
    way = np.stack([-np.sin(angle), np.cos(angle), np.full(count, pitch)], axis=1)
    return points, way / np.linalg.norm(way, axis=1, keepdims=True)


def test_tangents_of_a_helix_are_exact_but_for_the_ends() -> None:
    points, exact = helix(65, 0.3)
    found = tangents(points)
    assert found[1:-1] == pytest.approx(exact[1:-1], abs=2e-3)
    assert found[[0, -1]] == pytest.approx(exact[[0, -1]], abs=0.06)


def test_tangents_are_unit_and_survive_doubled_points() -> None:
    points = np.array([[0, 0, 0], [0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 1, 1]], float)
    found = tangents(points[None])
    assert np.linalg.norm(found, axis=-1) == pytest.approx(np.ones((1, 5)))
    assert found[0, 2] == pytest.approx([0, 0, 1])


def test_in_a_plane_the_binormal_stays_and_the_other_normal_turns_with_the_curve() -> None:
    _, tangent = helix(200, 0.0)
    binormals = transported_normals(tangent, np.array([0.0, 0.0, 1.0]))
    assert binormals == pytest.approx(np.tile([0.0, 0.0, 1.0], (200, 1)), abs=1e-5)
    inward = transported_normals(tangent, np.array([-1.0, 0.0, 0.0]))
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    expected = -np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    assert inward == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("pitch", [0.2, 1.0, 3.0])
def test_on_a_helix_the_frame_lags_by_the_total_torsion(pitch: float) -> None:
    """Bishop 1975: the twist-free frame turns against Frenet's by the integral of torsion."""
    turns = 1.5
    points, tangent = helix(2000, pitch, turns)
    frenet_normal = -points * [1.0, 1.0, 0.0]
    normals = transported_normals(tangent, frenet_normal[0])
    speed = np.sqrt(1.0 + pitch**2)
    torsion, arc = pitch / speed**2, speed * 2.0 * np.pi * turns
    binormal = np.cross(tangent[-1], frenet_normal[-1])
    lag = np.arctan2(normals[-1] @ binormal, normals[-1] @ frenet_normal[-1])
    difference = np.angle(np.exp(1j * (lag + torsion * arc)))
    assert difference == pytest.approx(0.0, abs=2e-3)


def test_normals_are_unit_and_perpendicular_on_any_curve() -> None:
    random = np.random.default_rng(1)
    tangent = tangents(random.normal(size=(50, 20, 3)))
    normals = transported_normals(tangent, random.normal(size=(50, 3)))
    assert np.linalg.norm(normals, axis=-1) == pytest.approx(np.ones((50, 20)), abs=1e-5)
    assert np.abs((normals * tangent).sum(axis=-1)).max() < 1e-5


def test_reversal_and_parallel_root_normal_stay_finite() -> None:
    tangent = np.array([[0, 0, 1], [0, 0, -1], [0, 0, 1]], float)
    normals = transported_normals(tangent, np.array([0.0, 0.0, 1.0]))
    assert np.isfinite(normals).all()
    assert np.linalg.norm(normals, axis=-1) == pytest.approx(np.ones(3))


def test_tangents_of_strands_one_after_the_other() -> None:
    """Against those of each strand alone."""
    grid = np.random.default_rng(4).normal(size=(20, 5, 3))
    found = strand_tangents(grid.reshape(-1, 3).T, np.arange(21) * 5).T
    assert found.reshape(20, 5, 3) == pytest.approx(tangents(grid))
