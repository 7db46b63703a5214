"""The banded solves against dense ones."""

import numpy as np
import pytest

from hairloom.addon.dynamics.banded import PentadiagonalSystem, solve_tridiagonal


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
    PentadiagonalSystem(*diagonals(matrix)).solve(right)
    np.testing.assert_allclose(right, expected, atol=1e-5)


@pytest.mark.parametrize("count", [1, 3, 14])
def test_each_guide_may_have_a_matrix_of_its_own(count):
    second = np.eye(count) - 2.0 * np.eye(count, k=-1) + np.eye(count, k=-2)
    matrices = [np.eye(count) + stiff * second.T @ second for stiff in (0.0, 1.0, 30.0, 4.0, 9.0)]
    right = np.random.default_rng(count).normal(size=(3, count, 5)).astype(np.float32)
    expected = [np.linalg.solve(one, right[:, :, g].T).T for g, one in enumerate(matrices)]
    each = [diagonals(one) for one in matrices]
    band = PentadiagonalSystem(*(np.concatenate(rows, axis=1) for rows in zip(*each, strict=True)))
    part = right[:, :, 2:4].copy()
    band.solve(right)
    np.testing.assert_allclose(right.transpose(2, 0, 1), expected, atol=1e-5)
    band.part(slice(2, 4)).solve(part)
    np.testing.assert_array_equal(part, right[:, :, 2:4])


def diagonals(matrix):
    """The main diagonal and the two below it, (n, 1) each."""
    return (
        np.append(np.diagonal(matrix, -away), np.zeros(min(away, len(matrix))))[:, None]
        for away in range(3)
    )


def test_nothing_to_solve():
    PentadiagonalSystem(*np.zeros((3, 0, 1))).solve(np.zeros((3, 0, 4), np.float32))
    solve_tridiagonal(np.zeros((0, 4)), np.zeros((0, 4)), np.zeros((0, 4)))
