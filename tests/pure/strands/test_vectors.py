"""Unit vectors, dot and cross products, in both layouts."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.strands.vectors import cross_rows, dot, dot_rows, unit, unit_or, unit_rows


def some(dtype: type = np.float32) -> Floats:
    vectors = np.random.default_rng(1).normal(size=(50, 3)).astype(dtype)
    vectors[7] = 0.0
    return vectors


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_unit_vectors_keep_direction_and_dtype_and_zero_stays_zero(dtype: type) -> None:
    vectors = some(dtype)
    for found in (unit(vectors), unit_rows(vectors.T).T):
        assert found.dtype == dtype
        length = np.linalg.norm(found, axis=1)
        assert np.delete(length, 7) == pytest.approx(1.0, abs=1e-6)
        assert (found[7] == 0.0).all()
        assert np.abs(np.cross(found, vectors)).max() < 1e-5 and (dot(found, vectors) >= 0.0).all()


def test_what_is_too_short_falls_back() -> None:
    vectors = some()
    vectors[3] = [0.0, 1.0e-3, 0.0]
    found = unit_or(vectors, (0.0, 0.0, 1.0), 1.0e-2)
    assert found[[3, 7]].tolist() == [[0.0, 0.0, 1.0]] * 2
    others = np.delete(np.arange(50), [3, 7])
    assert found[others] == pytest.approx(unit(vectors)[others])


def test_products_of_rows_are_those_of_vectors() -> None:
    one, two = some(np.float64), some(np.float64)[::-1]
    assert dot_rows(one.T, two.T) == pytest.approx(dot(one, two))
    assert cross_rows(one.T, two.T) == pytest.approx(np.cross(one, two).T)
