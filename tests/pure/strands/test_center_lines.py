"""Centre lines: the part of a curl's shape that few CVs can represent."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.center_lines import center_lines
from hairloom.addon.strands.join import join_strands
from hairloom.addon.strands.resample import resample


def coils(turns: tuple[int, ...], cv_count: int = 800, radius: float = 0.008) -> StrandSet:
    """A coil for each number of turns, 25 cm long, along -Z."""
    along = np.linspace(0.0, 1.0, cv_count)
    grid = [
        np.stack(
            [radius * np.cos(angle), radius * np.sin(angle), -0.25 * along],
            axis=1,
        )
        for angle in (2.0 * np.pi * count * along for count in turns)
    ]
    return strand_set(np.array(grid))


def strand_set(grid: Floats) -> StrandSet:
    count, cv_count, _ = grid.shape
    return StrandSet(
        grid.reshape(-1, 3),
        np.arange(count + 1) * cv_count,
        np.full(count * cv_count, 1e-4),
        np.zeros(count),
    )


def test_tight_coils_become_their_axis() -> None:
    lines = center_lines(coils((12, 20, 60)), 16).grid
    away = np.hypot(lines[:, 1:-1, 0], lines[:, 1:-1, 1])
    assert away.max() < 0.1 * 0.008
    assert lines[:, 1:-1, 2] == pytest.approx(
        np.tile(-0.25 * np.arange(1, 15) / 15, (3, 1)), abs=1e-3
    )


def test_roots_and_tips_stay_where_they_are() -> None:
    strands = coils((3, 12))
    lines = center_lines(strands, 16).grid
    ends = strands.grid[:, [0, -1]]
    assert np.array_equal(lines[:, [0, -1]], ends)


def test_what_cvs_can_follow_is_merely_resampled() -> None:
    strands = coils((0, 1, 20))
    lines, plain = center_lines(strands, 16), resample(strands, 16)
    assert np.array_equal(lines.grid[:2], plain.grid[:2])
    assert not np.array_equal(lines.grid[2], plain.grid[2])


def test_strands_of_that_many_points_become_even_too() -> None:
    """As strands of any other count, since strands ride by their place along their guides."""
    place = np.linspace(0.0, 1.0, 16) ** 2
    straight = strand_set(place[None, :, None] * np.array([0.0, 0.0, -0.25]))
    lines = center_lines(straight, 16).grid
    np.testing.assert_allclose(lines[0, :, 2], -0.25 * np.linspace(0.0, 1.0, 16), atol=1e-7)


def test_the_mean_is_that_of_the_strand_around_each_cv() -> None:
    """Against a brute-force integral weighted by a tent function."""
    strands, cv_count = coils((9,)), 10
    lines = center_lines(strands, cv_count).grid[0]
    dense = resample(strands, 9 * 5000 + 1).grid[0].astype(np.float64)
    place = np.linspace(0.0, 9.0, len(dense))
    for cv in range(1, 9):
        tent = np.maximum(1.0 - np.abs(place - cv), 0.0)
        assert lines[cv] == pytest.approx((tent / tent.sum()) @ dense, abs=1e-6)


def test_a_line_does_not_depend_on_other_strands() -> None:
    """Bit for bit, whatever points others have, since cached lines are compared bit by bit."""
    coil, other = coils((9,)), coils((5, 7), cv_count=120)
    both = center_lines(join_strands(other, coil), 10)
    assert np.array_equal(both.grid[2], center_lines(coil, 10).grid[0])
    assert np.array_equal(both.grid[:2], center_lines(other, 10).grid)
