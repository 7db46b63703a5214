"""Transformed points against float64 matrix products."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.strands.affine import mean_scale, transform_points


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
