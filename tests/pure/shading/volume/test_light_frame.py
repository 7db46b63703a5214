"""The space of a light's map: what it covers, and that it holds still."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.volume.light_frame import Ball, ball_around, light_frame

LIGHTS = {
    "sun": Light.sun((0.3, -1.0, -0.5), (1, 1, 1), 3.0),
    "sun overhead": Light.sun((0.0, 0.0, -1.0), (1, 1, 1), 3.0),
    "near point": Light.point((0.2, 0.1, 0.15), (1, 1, 1), 3.0),
    "far point": Light.point((20.0, -30.0, 10.0), (1, 1, 1), 3.0),
}
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
def test_a_texel_is_as_wide_as_it_says(light: Light) -> None:
    frame = light_frame(light, BALL)
    assert frame is not None
    right = frame.to_map[0, :3] / np.linalg.norm(frame.to_map[0, :3])
    points = on_the_ball(20)
    width = frame.texel_width(points, 256)
    place, _ = frame.places(points)
    beside, _ = frame.places(points + right * width[:, None])
    assert np.allclose((beside - place)[:, 0] * 256, 1.0, rtol=1e-6)


def test_a_light_inside_has_no_map() -> None:
    assert light_frame(Light.point((0.01, -0.02, 0.1), (1, 1, 1), 3.0), BALL) is None


def test_what_is_behind_a_light_is_outside_of_its_map() -> None:
    frame = light_frame(LIGHTS["near point"], BALL)
    assert frame is not None
    place, _ = frame.places(np.array([[0.4, 0.3, 0.3]]))
    assert (place < 0.0).all()


def test_small_motion_moves_the_ball_by_whole_steps_or_not_at_all() -> None:
    """So that texels do not swim: most small moves leave the very same ball."""
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


@pytest.mark.parametrize("points", [np.zeros((1, 3)), np.full((3, 2, 3), 5.0)])
def test_hair_without_extent_still_has_a_ball(points: np.ndarray) -> None:
    ball = ball_around(points)
    assert ball.radius > 0.0 and np.isfinite(ball.center).all()
    frame = light_frame(LIGHTS["sun"], ball)
    assert frame is not None and np.isfinite(frame.to_map).all()
