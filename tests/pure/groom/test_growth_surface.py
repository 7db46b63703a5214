"""The grid by which growing hair keeps out of the skin."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.groom.growth_surface import GrowthSurface
from hairloom.addon.strands import Surface
from hairloom.addon.strands.closest_point import ClosestPointSearch, search_of

CELL, REACH = 0.004, 0.05


def around(egg: Surface, seed: int, count: int = 2000) -> np.ndarray:
    """Points up to 2 cm inside and outside of its skin."""
    random = np.random.default_rng(seed)
    direction = random.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    scale = 1.0 + random.uniform(-0.2, 0.2, (count, 1))
    return np.asarray(direction * [0.08, 0.1, 0.12] * scale)


def again(egg: Surface) -> Surface:
    """The same surface without cached results."""
    return Surface(egg.positions, egg.triangles)


def test_points_are_lifted_as_by_the_exact_closest_points(egg: Surface) -> None:
    points, clearance = around(egg, 1), np.full(2000, 0.003)
    lifted = GrowthSurface(again(egg), REACH, CELL).outside(points, clearance)
    exact = search_of(egg).closest(lifted)
    far = np.linalg.norm(points / [0.08, 0.1, 0.12], axis=1) > 1.06
    assert np.array_equal(lifted[far], points[far]), "what is far from the skin is moved"
    radius = np.linalg.norm(lifted / [0.08, 0.1, 0.12], axis=1)
    assert (radius >= 1.0).all(), "a point is left inside"
    assert np.quantile(np.abs(exact.distance[~far] - 0.003), 0.5) < 2e-4


def test_what_was_asked_for_before_changes_nothing(egg: Surface) -> None:
    points, clearance = around(egg, 1), np.full(2000, 0.003)
    one = GrowthSurface(again(egg), REACH, CELL).outside(points, clearance)
    known = again(egg)
    for seed in (2, 3):  # another reach, another length: an edit before this one
        GrowthSurface(known, 0.9 * REACH, CELL).outside(around(egg, seed), clearance)
    other = GrowthSurface(known, REACH, CELL).outside(points, clearance)
    np.testing.assert_array_equal(one, other)


def test_edits_find_what_was_searched(egg: Surface, monkeypatch: pytest.MonkeyPatch) -> None:
    surface, points, clearance = again(egg), around(egg, 1), np.full(2000, 0.003)
    GrowthSurface(surface, REACH, CELL).outside(points, clearance)

    def search(*_: object) -> None:
        raise AssertionError("it searches what it knows")

    monkeypatch.setattr(ClosestPointSearch, "nearest", search)
    GrowthSurface(surface, 0.9 * REACH, CELL).outside(points, clearance)
    with pytest.raises(AssertionError, match="what it knows"):
        GrowthSurface(surface, REACH, CELL).outside(around(egg, 2), clearance)
