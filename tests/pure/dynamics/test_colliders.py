"""Balls, capsules and sets of balls against their formulas, posed, and in contact with hair."""

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.dynamics.colliders import (
    CapsuleCollider,
    DistanceField,
    PosedCollider,
    SphereCollider,
    SphereSetCollider,
)
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.measure import deepest_penetration
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import start
from hairloom.addon.dynamics.step import advance
from hairloom.addon.errors import HairloomError

BALL = SphereCollider(np.array([0.02, -0.01, 0.03]), 0.05)
ROD = CapsuleCollider(np.array([-0.03, 0.0, 0.01]), np.array([0.05, 0.02, -0.02]), 0.03)


def balls(count=60, seed=5):
    """Balls of very different sizes, some inside others."""
    random = np.random.default_rng(seed)
    centers = random.uniform(-0.12, 0.12, (count, 3))
    return SphereSetCollider(centers, random.uniform(0.004, 0.06, count))


def scattered(count=5000, reach=0.3, seed=1):
    points = np.random.default_rng(seed).uniform(-reach, reach, (3, count))
    return points.astype(np.float32)


def rod_distance(rod, points):
    """Distance to a capsule, by brute force over many points of its axis."""
    share = np.linspace(0.0, 1.0, 4001)[:, None]
    axis = rod.start + share * (rod.end - rod.start)
    gap = np.linalg.norm(points.T[:, None].astype(np.float64) - axis, axis=2)
    return gap.min(axis=1) - rod.radius


def set_distance(balls, points):
    """Distance to a set of balls, by brute force over all balls."""
    gap = np.linalg.norm(points.T[:, None].astype(np.float64) - balls.centers, axis=2)
    return (gap - balls.radii).min(axis=1)


def test_capsule_by_trying_every_place_of_its_axis():
    points = scattered(400, 0.15)
    np.testing.assert_allclose(ROD.distance(points)[0], rod_distance(ROD, points), atol=1e-6)


def test_a_capsule_without_length_is_a_ball():
    rod, points = CapsuleCollider(BALL.center, BALL.center, BALL.radius), scattered(300)
    for one, other in zip(rod.distance(points), BALL.distance(points), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6)


@pytest.mark.parametrize("count", [1, 2, 60, 400])
def test_set_is_the_nearest_of_all_balls(count):
    """Against brute force, also far outside the set and deep inside many balls at once."""
    collider = balls(count, seed=count)
    for points in (scattered(), scattered(500, 5.0)):
        distance, _ = collider.distance(points)
        np.testing.assert_allclose(distance, set_distance(collider, points), rtol=1e-6, atol=2e-7)


@pytest.mark.parametrize("collider", [BALL, ROD, balls()], ids=["ball", "rod", "set"])
def test_gradient_is_the_slope(collider):
    points, step = scattered(500, 0.2).astype(np.float64), 1e-5
    _, gradient = collider.distance(points)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=0), 1.0, atol=1e-5)
    for axis in range(3):
        way = np.zeros((3, 1))
        way[axis] = step
        ahead, behind = (collider.distance(points + sign * way)[0] for sign in (1.0, -1.0))
        slope = (ahead.astype(np.float64) - behind) / (2.0 * step)
        error = np.abs(gradient[axis] - slope)
        # between two balls the slope jumps: few of the points lie there
        assert np.quantile(error, 0.98) < 0.02


@pytest.mark.parametrize("collider", [BALL, ROD, balls()], ids=["ball", "rod", "set"])
def test_at_the_very_middle_the_gradient_still_leads_out(collider):
    name = next(name for name in ("center", "start", "centers") if hasattr(collider, name))
    point = np.atleast_2d(getattr(collider, name))[:1].T.copy()
    distance, gradient = collider.distance(point)
    assert distance[0] < 0.0
    assert np.linalg.norm(gradient) == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("collider", [BALL, ROD, balls()], ids=["ball", "rod", "set"])
def test_near_misses_none_and_bounds_hold_all(collider):
    points = scattered(20000, 0.4)
    distance, _ = collider.distance(points)
    center, radius = collider.bounds
    from_center = np.linalg.norm(points - center[:, None], axis=0)
    for reach in (0.0005, 0.006, 0.05):
        within = np.flatnonzero(distance < reach)
        assert len(within)
        assert np.isin(within, collider.near(points, reach)).all()
        assert from_center[within].max() < radius + reach


def test_a_set_leaves_out_what_is_far():
    points, collider = scattered(20000, 0.4), balls()
    distance = set_distance(collider, points)
    chosen = collider.near(points, 0.006)
    assert distance[chosen].max() < 0.006 + 2.0 * 0.01 * np.sqrt(3.0)


def test_no_points():
    none = np.zeros((3, 0), np.float32)
    for collider in (BALL, ROD, balls()):
        distance, gradient = collider.distance(none)
        assert (distance.shape, gradient.shape) == ((0,), (3, 0))
        assert not len(collider.near(none, 0.01))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SphereCollider(np.zeros(3), 0.0), "no volume"),
        (lambda: SphereCollider(np.zeros(2), 1.0), "shape"),
        (lambda: SphereCollider(np.array([0.0, np.nan, 0.0]), 1.0), "no volume"),
        (lambda: CapsuleCollider(np.zeros(3), np.ones(3), -1.0), "no volume"),
        (lambda: CapsuleCollider(np.zeros(3), np.full(3, np.inf), 1.0), "no volume"),
        (lambda: CapsuleCollider(np.zeros((3, 1)), np.ones(3), 1.0), "shape"),
        (lambda: SphereSetCollider(np.zeros((0, 3)), np.zeros(0)), "not a set of balls"),
        (lambda: SphereSetCollider(np.zeros((2, 3)), np.ones(3)), "not a set of balls"),
        (lambda: SphereSetCollider(np.zeros((2, 3)), 1.0), "not a set of balls"),
        (lambda: SphereSetCollider(np.zeros((2, 3)), np.array([1.0, 0.0])), "no volume"),
        (lambda: SphereSetCollider(np.full((1, 3), np.nan), np.ones(1)), "no volume"),
    ],
)
def test_bad_shapes_are_named(make, message):
    with pytest.raises(HairloomError, match=message):
        make()


def test_a_scaled_and_turned_ball_is_as_deep_as_geometry_says(kit):
    """A ball of 5 cm, scaled by 2, turned and moved: a CV 3 cm below its surface is 3 cm deep."""
    matrix = kit.translation(0.3, 0.2, 0.1) @ kit.rotation(1, 0.8) @ np.diag([2.0, 2.0, 2.0, 1.0])
    middle = matrix[:3, :3] @ BALL.center + matrix[:3, 3]
    grid = np.repeat(middle[None, None], 4, axis=1) + np.array([0.0, 0.0, 0.07])
    posed = PosedCollider(BALL, matrix, matrix)
    assert deepest_penetration(start(grid), (posed,)) == pytest.approx(0.03, abs=1e-6)


def test_a_stretched_and_mirrored_ball_is_measured_along_its_own_axes():
    """Scaled by -2 along x: on its axes the depth is exact."""
    matrix = np.diag([-2.0, 1.0, 1.0, 1.0])
    posed = PosedCollider(SphereCollider(np.zeros(3), 0.1), matrix, matrix)
    for place, depth in (((0.17, 0.0, 0.0), 0.03), ((0.0, 0.09, 0.0), 0.01)):
        grid = np.repeat(np.array(place)[None, None], 3, axis=1)
        assert deepest_penetration(start(grid), (posed,)) == pytest.approx(depth, abs=1e-6)


@pytest.fixture(scope="module")
def kinds(kit):
    """A collider of each kind that fits into a head of 10 cm, and how deep hair may get [m]."""
    around = np.unique(kit.icosphere(0.06, 1).positions.round(6), axis=0)
    ends = np.array([[0.0, 0.0, -0.03], [0.0, 0.0, 0.03]])
    return {
        "ball": (SphereCollider(np.zeros(3), 0.098), 1e-4),
        "rod": (CapsuleCollider(*ends, 0.068), 1e-4),
        "set": (SphereSetCollider(around, np.full(len(around), 0.038)), 1e-4),
        "mesh": (DistanceField.from_surface(kit.icosphere(0.098), DynamicsSettings()), 1e-3),
    }


@pytest.mark.parametrize("kind", few_in_commits(["mesh", "set", "ball", "rod"]))
def test_hair_on_a_shaking_head_stays_out_of_it(kit, shake, kinds, kind):
    collider, allowed = kinds[kind]
    scene = kit.Scene(kit.curly(150, 16), DynamicsSettings(), shake, on_head=(collider,))
    states = scene.play(1.5)
    depth = [
        deepest_penetration(state, scene.colliders(frame / 60.0, frame / 60.0))
        for frame, state in enumerate(states)
    ]
    assert max(depth) < allowed


@pytest.mark.parametrize("kind", ["ball", "rod", "set", "mesh"])
def test_a_turned_and_scaled_collider_sweeps_through_hair(kit, kinds, kind):
    """Scaled by 0.5 and turning, at 1 m/s into hanging hair, which is swept along."""
    collider, allowed = kinds[kind]
    curtain = kit.straight(40, 16, 0.3)
    state, settings = start(curtain), DynamicsSettings(style_root=0.5, style_tip=0.2)
    half = np.diag([0.5, 0.5, 0.5, 1.0])

    def matrix(frame):
        place = kit.translation(0.2, -0.25 + frame / 60.0, -0.2)
        return place @ kit.rotation(0, frame * 0.05) @ half

    depth = []
    for frame in range(24):
        posed = PosedCollider(collider, matrix(frame), matrix(frame + 1))
        state = advance(state, Drive(curtain, curtain, (posed,), kit.EARTH), settings, 1.0 / 60.0)
        depth.append(deepest_penetration(state, (posed,)))
    assert max(depth) < allowed
    assert np.ptp(state.position[1]) > 0.05
