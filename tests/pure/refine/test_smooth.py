"""Smoothing: against polynomials, shared ends, continuous tangents; mixing before is as after."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.groom.weights import GuideWeights
from hairloom.addon.refine.interpolate import interpolate
from hairloom.addon.refine.smooth import bezier, points_at, smoothed, smoothed_at


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
    """At root and tip the tangent is that of the first and last segment."""
    grid = grid_of(20, 5)
    control = bezier(grid)
    assert 3.0 * (control[:, 0, 1] - control[:, 0, 0]) == pytest.approx(
        grid[:, 1] - grid[:, 0], abs=5e-6
    )
    assert 3.0 * (control[:, -1, 3] - control[:, -1, 2]) == pytest.approx(
        grid[:, -1] - grid[:, -2], abs=5e-6
    )


@pytest.mark.parametrize("pieces", [1, 3, 64])
def test_even_pieces_hold_the_cvs_bit_for_bit(exact: Any, pieces: int) -> None:
    grid = grid_of(150, 7)
    points = smoothed(grid, pieces)
    assert points.dtype == np.float32
    assert points.shape == (150, 6 * pieces + 1, 3)
    assert (points[:, ::pieces] == grid).all()
    for strand in (0, 149):
        for segment, coefficients in enumerate(exact.power_basis(grid[strand])):
            expected = exact.curve(coefficients, np.arange(pieces + 1) / pieces)
            part = points[strand, segment * pieces : (segment + 1) * pieces + 1]
            assert part == pytest.approx(expected, abs=5e-6)


@pytest.mark.parametrize("cv_count", [2, 3, 16])
def test_thirty_points_even_over_the_whole_strand(exact: Any, cv_count: int) -> None:
    grid = grid_of(1000, cv_count)
    along = np.linspace(0.0, 1.0, 30)
    points = smoothed_at(grid, along)
    assert points.shape == (1000, 30, 3)
    assert (points[:, 0] == grid[:, 0]).all() and (points[:, -1] == grid[:, -1]).all()
    for strand in (0, 421, 999):
        parts = exact.power_basis(grid[strand])
        for place, point in zip(along * (cv_count - 1), points[strand], strict=True):
            segment = min(int(place), cv_count - 2)
            expected = exact.curve(parts[segment], np.array([place - segment]))[0]
            assert point == pytest.approx(expected, abs=1e-5)


def test_places_beyond_the_ends_are_the_ends_and_no_strands_are_none() -> None:
    grid = grid_of(3, 4)
    assert (smoothed_at(grid, np.array([-1.0, 2.0])) == grid[:, [0, -1]]).all()
    assert smoothed_at(grid[:0], np.array([0.5])).shape == (0, 1, 3)
    assert smoothed(grid[:0], 2).shape == (0, 7, 3)


def test_single_points_are_those_of_the_whole_curve() -> None:
    grid = grid_of(40, 6)
    whole = smoothed(grid, 4).astype(np.float64)
    strand, station = (index.ravel() for index in np.indices((40, 20)))
    points = points_at(grid, strand, station // 4, (station % 4) / 4.0)
    assert points == pytest.approx(whole[strand, station], abs=2e-6)
    tips = points_at(grid, np.arange(40), np.full(40, 4), np.ones(40))
    assert (tips == grid[:, -1]).all()


def test_interpolation_after_smoothing_is_smoothing_after_interpolation() -> None:
    random = np.random.default_rng(3)
    guides = grid_of(50, 16) * np.float32(0.01)
    weights = GuideWeights(
        random.integers(50, size=(700, 3)).astype(np.int32),
        random.dirichlet([1, 1, 1], 700).astype(np.float32),
    )
    along = np.linspace(0.0, 1.0, 30)
    after = interpolate(smoothed_at(guides, along), weights)
    before = smoothed_at(interpolate(guides, weights), along)
    assert after == pytest.approx(before, abs=2e-7)
