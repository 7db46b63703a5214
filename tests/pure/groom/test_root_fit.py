"""The unit and axes that would make a groom fit its head."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.groom.root_fit import RootFit, better_fit
from hairloom.addon.strands import Surface
from hairloom.addon.strands.closest_point import ClosestPointSearch

#: a box of 20 x 30 x 40 cm that stands 1.5 m above the ground
LOW, HIGH = np.array([-0.1, -0.15, 1.5]), np.array([0.1, 0.15, 1.9])


@pytest.fixture(scope="module")
def search() -> ClosestPointSearch:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return ClosestPointSearch(Surface(LOW + corners * (HIGH - LOW), np.array(triangles)))


@pytest.fixture
def roots() -> np.ndarray:
    """Points a millimetre above the top of the box."""
    random = np.random.default_rng(2).uniform(LOW, HIGH, (700, 3))
    random[:, 2] = HIGH[2] + 0.001
    return random.astype(np.float32)


def turned(roots: np.ndarray) -> np.ndarray:
    return np.stack([roots[:, 0], -roots[:, 2], roots[:, 1]], axis=1)


@pytest.mark.parametrize("unit", [0.001, 0.0254, 100.0])
def test_another_unit_is_found(search: ClosestPointSearch, roots: np.ndarray, unit: float) -> None:
    found = better_fit({"": roots * unit, "turned": turned(roots) * unit}, search)
    assert found is not None
    assert (found.name, found.factor) == ("", pytest.approx(1.0 / unit))


@pytest.mark.parametrize("unit", [1.0, 100.0])
def test_other_axes_are_found(search: ClosestPointSearch, roots: np.ndarray, unit: float) -> None:
    found = better_fit({"": turned(roots) * unit, "as modelled": roots * unit}, search)
    assert found == RootFit("as modelled", 1.0 / unit, pytest.approx(0.001 / 0.36, rel=0.1))


def test_a_groom_that_fits_has_nothing_better(
    search: ClosestPointSearch, roots: np.ndarray
) -> None:
    assert better_fit({"": roots, "turned": turned(roots)}, search) is None


def test_roots_on_the_surface_itself_have_nothing_better(search: ClosestPointSearch) -> None:
    corners = np.array([LOW, HIGH], np.float32)
    assert better_fit({"": corners, "again": corners}, search) is None


def test_a_groom_that_nothing_makes_fit_has_nothing_better(
    search: ClosestPointSearch, roots: np.ndarray
) -> None:
    assert better_fit({"": roots + np.float32(40.0)}, search) is None
