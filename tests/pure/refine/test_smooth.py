"""Smoothing: against polynomials, shared ends, continuous tangents."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.refine.smooth import bezier, points_at


def grid_of(strand_count: int, cv_count: int, seed: int = 1) -> Floats:
    random = np.random.default_rng(seed)
    return np.cumsum(random.normal(size=(strand_count, cv_count, 3)), axis=1).astype(np.float32)


def de_casteljau(control: Floats, t: float) -> Floats:
    points = control.astype(np.float64)
    while len(points) > 1:
        points = (1.0 - t) * points[:-1] + t * points[1:]
    return points[0]


@pytest.mark.parametrize("cv_count", [2, 3, 4, 16])
def test_the_bezier_form_is_the_curve(exact: Any, cv_count: int) -> None:
    grid = grid_of(5, cv_count)
    control = bezier(grid)
    assert control.shape == (5, cv_count - 1, 4, 3)
    for strand in range(5):
        for segment, coefficients in enumerate(exact.power_basis(grid[strand])):
            for t in np.linspace(0.0, 1.0, 7):
                expected = exact.curve(coefficients, np.array([t]))[0]
                assert de_casteljau(control[strand, segment], t) == pytest.approx(
                    expected, abs=5e-6
                )


def test_segments_share_their_ends_and_tangents() -> None:
    grid = grid_of(20, 9)
    control = bezier(grid)
    assert (control[:, 1:, 0] == control[:, :-1, 3]).all()
    assert (control[:, :, 0] == grid[:, :-1]).all() and (control[:, :, 3] == grid[:, 1:]).all()
    leaving, arriving = (
        control[:, 1:, 1] - control[:, 1:, 0],
        control[:, :-1, 3] - control[:, :-1, 2],
    )
    assert leaving == pytest.approx(arriving, abs=3e-6)


def test_the_ends_go_straight_on() -> None:
    """At root and tip, tangents are those of the first and last segment."""
    grid = grid_of(20, 5)
    control = bezier(grid)
    assert 3.0 * (control[:, 0, 1] - control[:, 0, 0]) == pytest.approx(
        grid[:, 1] - grid[:, 0], abs=5e-6
    )
    assert 3.0 * (control[:, -1, 3] - control[:, -1, 2]) == pytest.approx(
        grid[:, -1] - grid[:, -2], abs=5e-6
    )


@pytest.mark.parametrize("cv_count", [2, 3, 16])
def test_points_are_on_the_curve_and_cvs_are_held_bit_for_bit(exact: Any, cv_count: int) -> None:
    grid = grid_of(40, cv_count)
    steps = np.linspace(0.0, 1.0, 8)
    for strand in (0, 39):
        for segment, coefficients in enumerate(exact.power_basis(grid[strand])):
            index = np.full(len(steps), strand), np.full(len(steps), segment)
            points = points_at(grid, *index, steps)
            assert points.dtype == np.float32
            assert points == pytest.approx(exact.curve(coefficients, steps), abs=5e-6)
            assert (points[[0, -1]] == grid[strand, segment : segment + 2]).all()
