"""Flow: hair near strokes follows them, against the formulas of circles and straight lines."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from flat_ground import guides_at, sheet

from hairloom.addon.arrays import Floats
from hairloom.addon.groom.flow import comb_along_strokes
from hairloom.addon.groom.flow_settings import FlowSettings
from hairloom.addon.groom.roots import bind_roots
from hairloom.addon.strands import StrandSet, Surface

SURFACE = sheet()
#: all hair within reach follows completely, lying flat
WHOLE: dict[str, Any] = {"amount": 1.0, "reach": 1.0, "falloff": 0.0, "lift": 0.0}


def comb(strands: StrandSet, *lines: Any, surface: Surface = SURFACE, **values: Any) -> Floats:
    settings = FlowSettings(**(WHOLE | values))
    found = comb_along_strokes(
        strands, tuple(np.array(each, float) for each in lines), surface, settings
    )
    return found.reshape(strands.strand_count, -1, 3)


def standing(root: Any, length: float = 0.2, cv_count: int = 9) -> StrandSet:
    root = np.atleast_2d(root)
    return guides_at(SURFACE, root, np.tile([0.0, 0.0, length], (len(root), 1)), cv_count=cv_count)


def test_hair_beside_a_straight_stroke_goes_its_direction() -> None:
    strands = standing([[0.3, 0.5, 0.0], [0.5, 0.45, 0.0]])
    combed = comb(strands, [[0.1, 0.5, 0.0], [0.9, 0.5, 0.0]])
    expected = strands.roots[:, None] + np.linspace(0.0, 0.2, 9)[:, None] * [1.0, 0.0, 0.0]
    assert np.abs(combed - expected).max() < 1e-6
    back = comb(strands, [[0.9, 0.5, 0.0], [0.1, 0.5, 0.0]])
    assert (back[:, -1, 0] < strands.roots[:, 0] - 0.19).all()


@pytest.mark.parametrize(("cv_count", "off"), [(9, 2e-3), (33, 1.5e-4)])
def test_hair_beside_a_circle_runs_around_it(cv_count: int, off: float) -> None:
    """A strand with its root on a circular stroke lies on the circle, with an error in the square
    of the segment length."""
    angle, radius = np.linspace(0.0, 1.9 * np.pi, 4000), 0.2
    circle = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1) * radius
    circle += [0.5, 0.5, 0.0]
    strands = standing(circle[200], length=0.4, cv_count=cv_count)
    combed = comb(strands, circle, reach=0.1)
    away = np.linalg.norm(combed[0] - [0.5, 0.5, 0.0], axis=1) - radius
    assert np.abs(away).max() < off
    turned = np.arctan2(*(combed[0, -1, :2] - 0.5)[::-1]) - angle[200]
    assert turned % (2.0 * np.pi) == pytest.approx(0.4 / radius, rel=0.01)


def test_lift_and_strokes_that_rise_lift_hair_by_their_slope() -> None:
    strands = standing([0.3, 0.5, 0.0])
    lifted = comb(strands, [[0.1, 0.5, 0.0], [0.9, 0.5, 0.0]], lift=0.5, reach=10.0)
    slope = lifted[0, -1, 2] / (lifted[0, -1, 0] - 0.3)
    assert slope == pytest.approx(0.5, rel=1e-5)
    rising = comb(strands, [[0.1, 0.5, 0.0], [0.9, 0.5, 0.4]], reach=10.0)
    slope = rising[0, -1, 2] / (rising[0, -1, 0] - 0.3)
    assert slope == pytest.approx(0.5, rel=1e-5)


def test_it_fades_with_the_distance_and_ends_at_the_reach() -> None:
    """Against the smooth step, for hair so short that it is as far away as its root."""
    line = [[0.0, 0.5, 0.0], [1.0, 0.5, 0.0]]
    y = np.array([0.53, 0.55, 0.6, 0.64, 0.7])
    strands = standing(np.stack([0.0 * y + 0.4, y, 0.0 * y], axis=1), length=2e-3, cv_count=2)
    combed = comb(strands, line, reach=100.0, falloff=1.0, amount=0.5)
    along = (combed[:, 1] - combed[:, 0])[:4]
    x = (y[:4] - 0.5) / 0.2
    weight = 0.5 * (1.0 - x * x * (3.0 - 2.0 * x))
    assert along[:, 0] / along[:, 2] == pytest.approx(weight / (1.0 - weight), rel=0.02)
    assert combed[-1].tobytes() == strands.grid[-1].tobytes()
    sharp = comb(strands, line, reach=45.0, falloff=0.0)
    assert np.abs(sharp[:2, 1, 2]).max() < 1e-6
    assert (sharp[2:] == strands.grid[2:]).all()


def test_lengths_are_kept_or_become_the_strokes() -> None:
    strands = standing([[0.3, 0.5, 0.0], [0.3, 0.99, 0.0]], cv_count=20)
    line = [[0.1, 0.5, 0.0], [0.5, 0.5, 0.0]]

    def lengths(points: Floats) -> Floats:
        return np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)

    assert lengths(comb(strands, line)) == pytest.approx(0.2, rel=1e-5)
    assert lengths(comb(strands, line, length=1.0)) == pytest.approx([0.4, 0.2], rel=1e-5)
    assert lengths(comb(strands, line, length=0.5)) == pytest.approx([0.3, 0.2], rel=1e-5)


def test_two_strokes_meet_in_their_mean() -> None:
    lines = [[0.0, 0.45, 0.0], [1.0, 0.45, 0.0]], [[0.5, 0.0, 0.0], [0.5, 1.0, 0.0]]
    strands = standing([0.45, 0.5, 0.0], length=0.02, cv_count=3)
    combed = comb(strands, *lines, reach=100.0)
    direction = combed[0, -1] - combed[0, 0]
    assert direction / np.linalg.norm(direction) == pytest.approx([0.5**0.5, 0.5**0.5, 0], abs=1e-5)


def test_hair_stays_on_a_sphere_that_it_follows(egg: Surface) -> None:
    """Along the egg's equator at z = 0, an ellipse with half-axes of 8 and 10 cm."""
    angle = np.linspace(0.0, 1.5 * np.pi, 400)
    around = np.stack([0.08 * np.cos(angle), 0.1 * np.sin(angle), 0.0 * angle], axis=1)
    root = around[[40]]
    grid = root[:, None] * np.linspace(1.0, 2.0, 33)[:, None]
    bare = StrandSet(grid.reshape(-1, 3), np.array([0, 33]), np.full(33, 1e-4), np.zeros(1, int))
    strands = bind_roots(bare, egg, place="test").strands
    combed = comb(strands, around, surface=egg, reach=0.5)[0]
    assert np.abs(combed[:, 2]).max() < 1e-3
    height = (combed[:, 0] / 0.08) ** 2 + (combed[:, 1] / 0.1) ** 2
    assert np.abs(height - 1.0).max() < 0.04


def test_a_direction_turns_with_the_surface_between_stroke_and_hair(egg: Surface) -> None:
    """Hair a sixth of the equator away from a stroke along it follows the ellipse there."""
    angle = np.linspace(-0.02, 0.02, 9)
    stroke = np.stack([0.08 * np.cos(angle), 0.1 * np.sin(angle), 0.0 * angle], axis=1)
    there = np.pi / 3.0
    root = np.array([0.08 * np.cos(there), 0.1 * np.sin(there), 0.0])
    grid = root * np.array([1.0, 1.03])[:, None]
    bare = StrandSet(grid, np.array([0, 2]), np.full(2, 1e-4), np.zeros(1, int))
    strands = bind_roots(bare, egg, place="test").strands
    combed = comb(strands, stroke, surface=egg, reach=80.0)[0]
    tangent = np.array([-0.08 * np.sin(there), 0.1 * np.cos(there), 0.0])
    cosine = (combed[1] - combed[0]) @ tangent
    cosine /= np.linalg.norm(combed[1] - combed[0]) * np.linalg.norm(tangent)
    assert cosine > np.cos(0.12)  # the egg has flat faces


def test_nothing_near_changes_nothing() -> None:
    strands = standing([0.1, 0.1, 0.0])
    far = comb(strands, [[0.8, 0.9, 0.0], [0.9, 0.9, 0.0]], reach=0.5, length=1.0)
    assert far.tobytes() == strands.grid.tobytes()
