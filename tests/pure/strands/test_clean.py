"""Untrusted curves: each fault is dropped, counted once, and named."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.strands.clean import clean

STRAIGHT = [[0, 0, 0], [0, 0, 1]]
CURVES = [
    STRAIGHT,
    [[1, 1, 1]],
    [],
    [[2, 2, 2], [np.nan, 2, 3], [2, 2, 4]],
    [[3, 3, 3], [3, np.inf, 3]],
    [[4, 4, 4], [4, 4, 4], [4, 4, 4]],
    [[5, 5, 5], [5, 5, 5], [5, 5, 6]],
    [[np.nan, 0, 0]],
    [[8, 8, 8], [8, -1e30, 8]],
]


def flat(curves: list[list[list[float]]]) -> tuple[np.ndarray, np.ndarray]:
    points = np.array([point for curve in curves for point in curve], float).reshape(-1, 3)
    return points, np.concatenate([[0], np.cumsum([len(curve) for curve in curves])])


def test_each_fault_is_counted_once_and_named() -> None:
    cleaned = clean(*flat(CURVES))
    assert cleaned.dropped == {
        "fewer than two points": 3,
        "a point that is not finite": 2,
        "a point farther than 1,000 km away": 1,
        "no length": 1,
    }
    assert cleaned.curve_indices.tolist() == [0, 6]
    assert [points.tolist() for points in cleaned.strands.iter_strands()] == [CURVES[0], CURVES[6]]


@pytest.mark.parametrize("factor", [1e-6, 1e-3, 1e3])
def test_hair_of_any_size_is_kept(factor: float) -> None:
    """Stubble of a millimetre on a face two metres up is kept; a strand of no length is not."""
    roots = np.random.default_rng(1).uniform(-0.1, 0.1, (50, 1, 3)) + [0.0, 0.0, 2.0]
    curves = roots + np.linspace(0.0, 1e-3, 5)[:, None] * [0.0, -1.0, 0.0]
    curves[7] = curves[7, 0]
    cleaned = clean(factor * curves.reshape(-1, 3), np.arange(51) * 5)
    assert cleaned.dropped == {"no length": 1} and 7 not in cleaned.curve_indices


def test_what_belongs_to_a_curve_stays_with_it() -> None:
    points, offsets = flat(CURVES)
    uv = np.arange(18.0).reshape(9, 2)
    uv[6] = (np.nan, 0.5)
    radius = np.full(len(points), 1e-4)
    radius[[0, 1]] = (np.nan, -1.0)
    strands = clean(points, offsets, radius=radius, group=np.arange(9), root_uv=uv).strands
    assert strands.group.tolist() == [0, 6]
    assert strands.root_uv is not None
    assert strands.root_uv.tolist() == [[0.0, 1.0], [0.0, 0.5]]
    assert strands.radius == pytest.approx([1e-4] * 5)


@pytest.mark.parametrize("curves", [[], [[]], [[[0, 0, 0]]]])
def test_nothing_usable_gives_an_empty_set(curves: list[list[list[float]]]) -> None:
    cleaned = clean(*flat(curves))
    assert cleaned.strands.strand_count == 0
    assert sum(cleaned.dropped.values()) == len(curves)


def test_an_empty_curve_at_the_end_is_dropped_and_spares_its_neighbour() -> None:
    cleaned = clean(*flat([STRAIGHT, []]))
    assert cleaned.strands.strand_count == 1
    assert cleaned.dropped == {"fewer than two points": 1}


def test_a_strand_that_ends_in_a_point_stays_pointed() -> None:
    """At its tip, or at both ends. Invalid widths become as wide as most of the hair."""
    points = np.zeros((20, 3))
    points[:, 2] = np.arange(20)
    tapered, spindle = np.linspace(1e-2, 0.0, 5), np.float64([0.0, 2e-3, 1e-2, 2e-3, 0.0])
    broken = np.float64([1e-2, -1.0, np.nan, 1e3, 0.0])
    radius = np.concatenate([tapered, spindle, np.zeros(5), broken])
    cleaned = clean(points, np.arange(5) * 5, radius=radius).strands.radius.reshape(4, 5)
    median = 7.5e-3
    assert (np.diff(cleaned[0]) < 0.0).all()
    np.testing.assert_allclose(cleaned[0, :-1], tapered[:-1])
    np.testing.assert_allclose(cleaned[1, 1:-1], spindle[1:-1])
    assert (cleaned > 0.0).all()
    assert cleaned[[0, 1, 1, 3], [4, 0, 4, 4]].max() < 1e-2 * median
    np.testing.assert_allclose(cleaned[2], median)
    np.testing.assert_allclose(cleaned[3, 1:4], median)
