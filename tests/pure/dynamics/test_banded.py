"""The banded solves against dense ones."""

import numpy as np
import pytest

from hairloom.addon.dynamics.banded import SharedBand, solve_tridiagonal


@pytest.mark.parametrize("count", [1, 2, 3, 14, 62])
def test_tridiagonal_equals_dense(count):
    rng = np.random.default_rng(count)
    diagonal = rng.uniform(1.5, 2.5, (count, 7))
    beside = rng.uniform(-0.7, 0.7, (count - 1, 7))
    right = rng.normal(size=(count, 7))
    expected = [
        np.linalg.solve(np.diag(d) + np.diag(b, 1) + np.diag(b, -1), r)
        for d, b, r in zip(diagonal.T, beside.T, right.T, strict=True)
    ]
    solve_tridiagonal(diagonal, beside, right)
    np.testing.assert_allclose(right.T, expected, rtol=1e-10)


@pytest.mark.parametrize("count", [1, 2, 3, 14, 62])
def test_shared_band_equals_dense(count):
    second = np.eye(count) - 2.0 * np.eye(count, k=-1) + np.eye(count, k=-2)
    matrix = np.diag(np.linspace(1.0, 3.0, count)) + 11.0 * second.T @ second
    right = np.random.default_rng(count).normal(size=(3, count, 5)).astype(np.float32)
    expected = np.linalg.solve(matrix, right.astype(np.float64))
    SharedBand(matrix).solve(right)
    np.testing.assert_allclose(right, expected, atol=1e-5)


def test_nothing_to_solve():
    SharedBand(np.zeros((0, 0))).solve(np.zeros((3, 0, 4), np.float32))
    solve_tridiagonal(np.zeros((0, 4)), np.zeros((0, 4)), np.zeros((0, 4)))
