"""Trajectories within a frame: exact for parabolas, and close to the arcs of a turning head."""

import numpy as np
import pytest

from hairloom.addon.dynamics.colliders import PosedCollider, SphereCollider
from hairloom.addon.dynamics.rigid_path import CarriedPath, Carrier
from hairloom.addon.dynamics.trajectory import curvature, value_at


@pytest.mark.parametrize("ratio", [0.25, 0.5, 1.0, 1.7, 4.0])
def test_three_moments_give_their_parabola(ratio):
    """The trajectory equals the parabola everywhere; the frame before lasted `ratio` of this
    one."""
    place, speed, bend = np.random.default_rng(1).normal(size=(3, 5, 3))

    def parabola(share):
        return place + speed * share + bend * share**2

    before, now = parabola(0.0), parabola(1.0)
    bent = curvature(parabola(-ratio), before, now, ratio)
    for share in (0.0, 0.2, 0.5, 1.0):
        np.testing.assert_allclose(
            value_at(before, now - before, bent, share), parabola(share), atol=1e-13
        )


def test_an_even_way_is_straight():
    one, way = np.ones((2, 3)), np.full((2, 3), 0.25)
    np.testing.assert_array_equal(curvature(one - way, one, one + way, 1.0), 0.0)
    np.testing.assert_array_equal(value_at(one, way, None, 0.5), one + way / 2)


def test_a_hiccup_does_not_throw_the_way_about():
    """A previous frame of almost no time would give a huge speed, so the ratio is limited."""
    before, now = np.zeros(3), np.array([0.01, 0.0, 0.0])
    bent = curvature(before - 0.02, before, now, 1e-6)
    assert np.abs(bent).max() < 0.1


@pytest.mark.parametrize("degrees", [5.0, 20.0])
def test_roots_stay_on_a_turning_head(kit, degrees):
    """The largest distance of a point at 0.1 m from its true circle, against the error terms of
    linear and quadratic interpolation."""
    turn = np.radians(degrees)
    point = np.array([[0.1, 0.0, 0.0]], np.float64)
    earlier, before, now = (
        point @ kit.rotation(2, share * turn)[:3, :3].T for share in (-1.0, 0.0, 1.0)
    )

    def error(bent):
        shares = np.linspace(0.0, 1.0, 21)
        away = [
            np.linalg.norm(
                value_at(before, now - before, bent, s)
                - point @ kit.rotation(2, s * turn)[:3, :3].T
            )
            for s in shares
        ]
        return max(away)

    smooth, straight = error(curvature(earlier, before, now, 1.0)), error(None)
    assert straight == pytest.approx(0.1 * turn**2 / 8.0, rel=0.05)
    assert smooth < 0.1 * turn**3 / 15.0  # the third derivative: s (s - 1) (s + 1) / 6
    assert smooth < straight


def test_roots_and_colliders_go_the_same_way(kit):
    """A point fixed to a collider stays fixed to it within the frame."""
    matrices = [kit.translation(0.1 * k * k, 0.0, 0.0) @ kit.rotation(0, 0.3 * k) for k in range(3)]
    point = np.array([0.02, 0.1, -0.03])
    posed = PosedCollider(SphereCollider((0, 0, 0), 0.1), *matrices[1:], matrices[0])
    places = point + np.random.default_rng(5).normal(0.0, 0.1, (20, 3))
    earlier, before, now = (places @ m[:3, :3].T + m[:3, 3] for m in matrices)
    carrier = Carrier.through(before.T, now.T, earlier.T)
    path = CarriedPath.through(before.T, now.T, earlier.T, 1.0, carrier)
    for share in (0.0, 0.3, 1.0):
        matrix = posed.matrix_at(share)
        expected = places @ matrix[:3, :3].T + matrix[:3, 3]
        np.testing.assert_allclose(path.at(share).T, expected, atol=1e-6)
