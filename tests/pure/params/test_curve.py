"""Curves along the strand: through their values, smooth, and within their range."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from hairloom.addon.params.curve import KNOT_POSITIONS, sample_curve

CURVES = [
    (1.0, 0.75, 0.5, 0.25, 0.0),
    (0.0, 0.0, 1.0, 0.0, 0.0),
    (0.3, 0.3, 0.3, 0.3, 0.3),
    (0.0, 0.1, 0.9, 1.0, 0.2),
    (1.0, 0.0, 1.0, 0.0, 1.0),
]
EVERYWHERE = np.linspace(0.0, 1.0, 4001)


@pytest.mark.parametrize("curve", CURVES)
def test_it_goes_through_its_values(curve: tuple[float, ...]) -> None:
    np.testing.assert_allclose(sample_curve(curve, np.array(KNOT_POSITIONS)), curve, atol=1e-15)


@pytest.mark.parametrize("curve", CURVES)
def test_it_is_monotone_between_two_values(curve: tuple[float, ...]) -> None:
    """So it stays within their range as well (Fritsch and Carlson 1980)."""
    for (left, right), (one, other) in zip(pairwise(KNOT_POSITIONS), pairwise(curve), strict=True):
        piece = sample_curve(curve, np.linspace(left, right, 1001))
        steps = np.diff(piece) * np.sign(other - one)
        assert (steps >= -1e-15).all()
        assert piece.min() >= min(one, other) - 1e-15
        assert piece.max() <= max(one, other) + 1e-15


@pytest.mark.parametrize("curve", CURVES)
def test_its_slope_has_no_jumps(curve: tuple[float, ...]) -> None:
    """Slopes that are 1/4000 apart differ little; a jump would not shrink with the step."""
    slope = np.diff(sample_curve(curve, EVERYWHERE)) * 4000.0
    assert np.abs(np.diff(slope)).max() < 0.04


def test_a_line_stays_a_line() -> None:
    np.testing.assert_allclose(sample_curve(CURVES[0], EVERYWHERE), 1.0 - EVERYWHERE, atol=1e-14)


def test_places_beyond_the_ends_are_the_ends() -> None:
    np.testing.assert_array_equal(sample_curve(CURVES[3], np.array([-1.0, 2.0])), [0.0, 0.2])
