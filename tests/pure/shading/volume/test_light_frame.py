"""The space of a light's map: its coverage, and its stability."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.shading.lights import Cone, Light
from hairloom.addon.shading.volume.light_frame import MAX_HALF_ANGLE, Ball, ball_around, light_frame

LIGHTS = {
    "sun": Light.sun((0.3, -1.0, -0.5), (1, 1, 1), 3.0),
    "sun overhead": Light.sun((0.0, 0.0, -1.0), (1, 1, 1), 3.0),
    "near point": Light.point((0.2, 0.1, 0.15), (1, 1, 1), 3.0),
    "far point": Light.point((20.0, -30.0, 10.0), (1, 1, 1), 3.0),
}
LIGHTS |= {f"turned {name}": replace(light, map_roll=0.6) for name, light in LIGHTS.items()}
BALL = Ball(np.array([0.01, -0.02, 0.03]), 0.15)


def on_the_ball(count: int = 2000) -> np.ndarray:
    away = np.random.default_rng(1).normal(size=(count, 3))
    return BALL.center + BALL.radius * away / np.linalg.norm(away, axis=1, keepdims=True)


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
def test_a_map_holds_the_ball_and_fits_it(light: Light) -> None:
    frame = light_frame(light, BALL)
    assert frame is not None
    place, depth = frame.places(on_the_ball())
    assert place.min() >= -1e-6 and place.max() <= 1.0 + 1e-6
    assert place.min() < 0.02 and place.max() > 0.98
    assert depth.min() == pytest.approx(0.0, abs=0.01) and depth.max() == pytest.approx(
        1.0, abs=0.01
    )


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
def test_all_points_of_a_ray_share_a_place_and_get_deeper(light: Light) -> None:
    frame = light_frame(light, BALL)
    assert frame is not None
    start = on_the_ball(50)
    away = np.asarray(light.vector) - start * float(light.kind != "sun")
    away = away / np.linalg.norm(away, axis=-1, keepdims=True)
    ray = np.linspace(0.0, 0.05, 9)[:, None]
    place, depth = frame.places(start[:, None] - away[:, None] * ray)
    assert np.abs(place - place[:, :1]).max() < 1e-9
    assert (np.diff(depth, axis=1) > 0.0).all()


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
def test_a_turned_map_is_the_same_map_about_the_middle_of_the_ball(light: Light) -> None:
    """Against a rotation of the places by the difference of two turns."""
    frames = [light_frame(replace(light, map_roll=roll), BALL) for roll in (0.2, 0.9)]
    (first, depth), (second, same_depth) = (
        frame.places(on_the_ball(50)) for frame in frames if frame is not None
    )
    cosine, sine = np.cos(0.7), np.sin(0.7)
    turned = (first - 0.5) @ np.array([[cosine, -sine], [sine, cosine]])
    assert second - 0.5 == pytest.approx(turned, abs=1e-9)
    assert same_depth == pytest.approx(depth, abs=1e-12)


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
def test_a_strand_is_as_broad_as_its_outline(light: Light) -> None:
    """A strand's width in the map, for any direction and place, against the two rays that touch
    it."""
    frame = light_frame(light, BALL)
    assert frame is not None
    random, thin = np.random.default_rng(3), 1e-6
    points, along = on_the_ball(200), 1e-5 * random.normal(size=(200, 3))
    rays = np.asarray(light.vector) - points * float(light.kind != "sun")
    side = np.cross(along, rays)
    side *= thin / np.linalg.norm(side, axis=1, keepdims=True)
    left, right = frame.places(points - side)[0], frame.places(points + side)[0]
    course = frame.places(points + along)[0] - frame.places(points)[0]
    apart = right - left
    covered = np.abs(apart[:, 0] * course[:, 1] - apart[:, 1] * course[:, 0])
    assert frame.strand_area(points, along) * 2.0 * thin == pytest.approx(covered, rel=1e-2)


def spot(place: tuple[float, float, float], along: tuple[float, float, float]) -> Light:
    """A spot with a cone of 1 rad."""
    back = -np.asarray(along) / np.linalg.norm(along)
    right = np.cross([0.1, 0.7, 0.3], back)
    right /= np.linalg.norm(right)
    axes = tuple(tuple(row) for row in (right, np.cross(back, right), back))
    return Light.spot(place, (1, 1, 1), 3.0, Cone(axes, 1.0, 0.1))


def test_a_point_light_amidst_the_hair_has_no_map() -> None:
    assert light_frame(Light.point((0.01, -0.02, 0.04), (1, 1, 1), 3.0), BALL) is None


@pytest.mark.parametrize("along", [(0.0, 0.0, -1.0), (1.0, 0.2, 0.0), (-0.3, 0.4, 0.9)])
def test_a_map_of_a_light_within_the_ball_opens_the_way_it_shines(
    along: tuple[float, float, float],
) -> None:
    """Along a spot's own axis, or from a point light to the middle of the ball; all places within
    the widest cone are in the map."""
    place = np.array([0.01, -0.02, 0.13])
    for light in (spot(tuple(place), along), Light.point(tuple(place), (1, 1, 1), 3.0)):
        frame = light_frame(light, BALL)
        assert frame is not None
        axis = np.asarray(along) if light.kind == "spot" else BALL.center - place
        axis = axis / np.linalg.norm(axis)
        points = BALL.center + np.random.default_rng(2).uniform(-0.15, 0.15, size=(4000, 3))
        points = points[np.linalg.norm(points - BALL.center, axis=1) < BALL.radius]
        ahead = (points - place) @ axis / np.linalg.norm(points - place, axis=1)
        found, depth = frame.places(points)
        is_in = (np.abs(found - 0.5) <= 0.5).all(axis=1)
        assert is_in[ahead > np.cos(MAX_HALF_ANGLE)].all()
        assert not is_in[ahead < 0.0].any()
        assert (depth[is_in] >= 0.0).all() and (depth[is_in] <= 1.0).all()


def test_a_spot_at_the_rim_that_shines_away_has_no_map() -> None:
    edge = (0.01, -0.02, 0.03 + 0.1499)
    assert light_frame(spot(edge, (0.0, 0.0, 1.0)), BALL) is None
    assert light_frame(spot(edge, (0.0, 0.0, -1.0)), BALL) is not None


def test_a_light_that_nears_the_ball_changes_its_map_without_a_jump() -> None:
    """Where the cone around the ball would get too wide, the widest cone replaces it."""
    rim = BALL.radius / np.sin(MAX_HALF_ANGLE)
    frames = [
        light_frame(Light.point(BALL.center + [0.0, 0.0, rim + step], (1, 1, 1), 3.0), BALL)
        for step in (-1e-7, 1e-7)
    ]
    assert frames[0] is not None and frames[1] is not None
    assert np.allclose(frames[0].to_map, frames[1].to_map, atol=1e-4)


def test_what_is_behind_a_light_is_outside_of_its_map() -> None:
    frame = light_frame(LIGHTS["near point"], BALL)
    assert frame is not None
    place, _ = frame.places(np.array([[0.4, 0.3, 0.3]]))
    assert (place < 0.0).all()


def test_small_motion_moves_the_ball_by_whole_steps_or_not_at_all() -> None:
    """Most small motions keep the same ball, so that texels do not swim."""
    random = np.random.default_rng(2)
    points = random.normal(size=(500, 3)) * 0.1
    balls = [ball_around(points + np.array([1e-4 * step, 0.0, 0.0])) for step in range(60)]
    centers = np.array([ball.center for ball in balls])
    assert len({ball.radius for ball in balls}) == 1
    moved = np.abs(np.diff(centers[:, 0])) > 0.0
    assert moved.sum() <= 3
    for step, ball in enumerate(balls):
        shifted = points + np.array([1e-4 * step, 0.0, 0.0])
        assert (np.linalg.norm(shifted - ball.center, axis=1) <= ball.radius).all()


@pytest.mark.parametrize("factor", [1e-6, 1e-3, 0.1, 10.0, 1e3])
def test_hair_in_another_unit_has_the_same_ball(factor: float) -> None:
    random = np.random.default_rng(5)
    for _ in range(20):
        points = random.normal(size=(50, 3)) * random.uniform(0.05, 0.5) + random.normal(size=3)
        ball, other = ball_around(points), ball_around(factor * points)
        assert other.radius == pytest.approx(factor * ball.radius, rel=1e-9)
        assert other.center == pytest.approx(factor * ball.center, abs=1e-9 * other.radius)


@pytest.mark.parametrize("points", [np.zeros((1, 3)), np.full((3, 2, 3), 5.0)])
def test_hair_without_extent_still_has_a_ball(points: np.ndarray) -> None:
    ball = ball_around(points)
    assert ball.radius > 0.0 and np.isfinite(ball.center).all()
    frame = light_frame(LIGHTS["sun"], ball)
    assert frame is not None and np.isfinite(frame.to_map).all()
