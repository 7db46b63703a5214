"""Resampling against walking along the polyline step by step."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.resample import resample


def strand_set(curves: list[Floats]) -> StrandSet:
    offsets = np.concatenate([[0], np.cumsum([len(curve) for curve in curves])])
    radius = np.linspace(1e-4, 1e-5, int(offsets[-1]))
    return StrandSet(np.concatenate(curves), offsets, radius, np.arange(len(curves)))


def walked(curve: Floats, values: Floats, cv_count: int) -> Floats:
    """Values at equal arc lengths, by numpy's own one-dimensional interpolation."""
    steps = np.linalg.norm(np.diff(curve.astype(np.float64), axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    places = np.linspace(0.0, along[-1], cv_count)
    return np.stack([np.interp(places, along, column) for column in values.T], axis=1)


@pytest.mark.parametrize("cv_count", [4, 16, 64])
def test_agrees_with_interpolation_strand_by_strand(cv_count: int) -> None:
    random = np.random.default_rng(1)
    curves = [random.normal(size=(count, 3)).cumsum(axis=0) for count in (2, 3, 7, 40, 2, 100)]
    strands = strand_set(curves)
    result = resample(strands, cv_count)
    radii = np.split(strands.radius, strands.offsets[1:-1])
    for index, curve in enumerate(strands.iter_strands()):
        assert result.grid[index] == pytest.approx(walked(curve, curve, cv_count), abs=1e-5)
        expected = walked(curve, radii[index][:, None], cv_count)[:, 0]
        assert result.radius.reshape(-1, cv_count)[index] == pytest.approx(expected, rel=1e-4)
    assert (result.group == strands.group).all()


def test_roots_and_tips_stay_exactly() -> None:
    random = np.random.default_rng(2)
    strands = strand_set([random.normal(size=(count, 3)) for count in (5, 8, 3)])
    grid = resample(strands, 16).grid
    assert (grid[:, 0] == strands.roots).all()
    assert (grid[:, -1] == strands.points[strands.offsets[1:] - 1]).all()


def test_doubled_points_give_finite_even_spacing() -> None:
    doubled = np.array(
        [[0, 0, 0], [0, 0, 0], [0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 3], [0, 0, 3]]
    )
    grid = resample(strand_set([doubled]), 4).grid
    assert grid[0, :, 2] == pytest.approx([0.0, 1.0, 2.0, 3.0])


def test_an_own_spacing_of_the_right_count_survives() -> None:
    strands = strand_set([np.array([[0, 0, 0], [0, 0, 1], [0, 0, 10], [0, 0, 11]])] * 2)
    assert resample(strands, 4) is strands


def test_bindings_come_along_and_no_strands_stay_none() -> None:
    strands = StrandSet(np.eye(3), [0, 3], np.ones(3), [7], [[0.25, 0.5]], [3], [[0.2, 0.3, 0.5]])
    result = resample(strands, 8)
    assert result.root_triangle is not None
    assert result.root_triangle.tolist() == [3]
    assert result.is_bound
    assert resample(strands.take(np.zeros(0, np.int64)), 8).strand_count == 0
