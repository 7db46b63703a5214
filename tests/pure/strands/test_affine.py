"""Transformed points against float64 matrix products."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.strands.affine import (
    mean_scale,
    rotation_about,
    transform_points,
    without_scale,
)


@pytest.mark.parametrize("count", [0, 1, 8192, 20_001])
def test_points_go_where_the_product_says(count: int) -> None:
    random = np.random.default_rng(count)
    points = random.normal(0.0, 1.0, (count, 3)).astype(np.float32)
    matrix = np.vstack([random.normal(0.0, 1.0, (3, 4)), [0, 0, 0, 1]])
    expected = points.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose(transform_points(points, matrix), expected, atol=2e-6)


def test_no_motion_copies_nothing_and_broken_points_stay_broken() -> None:
    points = np.array([[np.nan, np.inf, 0.0], [1.0, 2.0, 3.0]], np.float32)
    assert transform_points(points, np.eye(4)) is points
    shifted = np.eye(4)
    shifted[0, 3] = 1.0
    result = transform_points(points, shifted)
    assert not np.isfinite(result[0]).all() and result[1].tolist() == [2.0, 2.0, 3.0]


def test_the_mean_scale_keeps_volume() -> None:
    assert mean_scale(np.diag([2.0, 4.0, 1.0, 1.0])) == pytest.approx(2.0)
    assert mean_scale(np.diag([-1.0, 1.0, 1.0, 1.0])) == pytest.approx(1.0)


@pytest.mark.parametrize("scale", [(2.0, 2.0, 2.0), (0.5, 0.5, 3.0), (-2.0, -2.0, -2.0)])
def test_without_scale_a_motion_is_rigid_and_moves_its_origin_alike(
    scale: tuple[float, float, float],
) -> None:
    origin, rotation = np.array([1.0, 2.0, 3.0]), rotation_about(np.array([3.0, -1.0, 0.0]), 0.7)
    motion = rotation @ np.diag([*scale, 1.0])
    rigid = without_scale(motion, origin)
    np.testing.assert_allclose(rigid[:3, :3] @ rigid[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rigid[:3, :3]) == pytest.approx(1.0)
    point = np.array([*origin, 1.0])
    np.testing.assert_allclose(rigid @ point, motion @ point, atol=1e-12)
    if min(scale) > 0.0:
        np.testing.assert_allclose(rigid[:3, :3], rotation[:3, :3], atol=1e-12)


def test_a_rigid_motion_and_a_flat_one_stay_to_the_bit() -> None:
    rotation = rotation_about(np.array([3.0, -1.0, 0.0]), 0.7).astype(np.float32)
    assert without_scale(rotation, np.ones(3)) is rotation
    flat = np.diag([1.0, 1.0, 0.0, 1.0])
    assert without_scale(flat, np.ones(3)) is flat
