"""Shafts of light: polar coordinates, the radial blur, and positions of lights on the screen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.render.camera import look_at, orthographic, perspective
from hairloom.addon.shading.lights import Light
from hairloom.addon.shading.shafts import (
    LightOnScreen,
    PolarGrid,
    from_polar,
    light_shafts,
    lights_on_screen,
    radial_blur,
    to_polar,
)
from hairloom.addon.shading.shafts_settings import ShaftSettings

WIDTH, HEIGHT = 160, 120
ON = ShaftSettings(use_shafts=True, strength=1.0)
VIEW = look_at((0.0, -2.0, 0.0), (0.0, 0.0, 0.0))
PROJECTION = perspective(np.radians(40.0), WIDTH / HEIGHT, 0.1, 10.0)
NOTHING = np.zeros((HEIGHT, WIDTH)), np.ones((HEIGHT, WIDTH))


def smooth_picture() -> np.ndarray:
    """Waves that pixels resolve, (height, width, 3) in [0, 1]."""
    y, x = np.mgrid[:HEIGHT, :WIDTH] / 12.0
    return 0.5 + 0.5 * np.stack([np.sin(x), np.cos(y), np.sin(x + y)], axis=-1)


@pytest.mark.parametrize(
    "center",
    [(80.0, 60.0), (80.5, 60.5), (0.0, 60.0), (0.0, 0.0), (160.0, 13.3), (-40.0, 60.0)]
    + [(200.0, -70.0), (80.0, 120.0), (80.0, 121.0), (-900.0, 2000.0)],
)
def test_to_polar_coordinates_and_back_is_the_same_picture(center: tuple[float, float]) -> None:
    picture = smooth_picture()
    grid = PolarGrid.over(center, WIDTH, HEIGHT)
    again = from_polar(to_polar(picture, grid), grid, WIDTH, HEIGHT)
    assert np.abs(again - picture).mean() < 1.0 / 255.0
    assert np.abs(again - picture).max() < 0.05


def test_a_ray_of_the_grid_runs_straight_away_from_the_light() -> None:
    """In polar coordinates of a picture of x and y, each ray is a line from the centre."""
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    grid = PolarGrid.over((50.0, 40.0), WIDTH, HEIGHT, 64)
    away = to_polar(np.stack([x, y], axis=-1), grid) - (50.0, 40.0)
    radius = (np.arange(64) + 0.5) * grid.step
    is_within = radius < 39.0
    found = np.linalg.norm(away[:, is_within], axis=-1)
    assert found == pytest.approx(np.tile(radius[is_within], (grid.angles, 1)), abs=1e-6)
    angles = np.arctan2(away[:, 10, 1], away[:, 10, 0])
    assert np.diff(np.unwrap(angles)) == pytest.approx(2.0 * np.pi / grid.angles)


def test_the_blur_is_its_formula() -> None:
    """Behind an edge where V falls from 1 to 0, the blur falls as exp(-s / l), normalized by the
    weights of the way to the light.
    """
    grid = PolarGrid.over((0.0, 60.0), WIDTH, HEIGHT, 2000)
    rays = np.ones((grid.angles, grid.radii, 1))
    radius = (np.arange(grid.radii) + 0.5) * grid.step
    rays[:, radius > 50.0] = 0.0
    blurred = radial_blur(rays, grid, 20.0)[0, :, 0]
    counted = -np.expm1(-50.0 / 20.0) / -np.expm1(-radius / 20.0)
    expected = np.where(radius > 50.0, np.exp(-(radius - 50.0) / 20.0) * counted, 1.0)
    assert blurred == pytest.approx(expected, abs=grid.step / 20.0)


def test_haze_without_anything_in_it_is_the_formula() -> None:
    """At strength 1, the brightness at a light of irradiance pi is that of matt white."""
    light = Light.sun((0.0, -1.0, 0.0), (1.0, 0.5, 0.25), np.pi)
    (seen,) = lights_on_screen([light], VIEW, PROJECTION, WIDTH, HEIGHT, ON)
    assert seen.center == pytest.approx((80.0, 60.0))
    assert seen.radiance == pytest.approx((1.0, 0.5, 0.25))
    picture = light_shafts(np.zeros((HEIGHT, WIDTH, 4)), *NOTHING, [seen], ON.samples)
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    length = np.tan(ON.length) / np.tan(np.radians(20.0)) * HEIGHT / 2.0
    fall = np.exp(-np.hypot(x - 80.0, y - 60.0) / (2.0 * length))
    assert picture[..., 0] == pytest.approx(fall, rel=1e-5)
    assert picture[..., 2] == pytest.approx(0.25 * fall, rel=1e-5)
    assert not picture[..., 3].any()


def test_a_bar_throws_its_shaft_away_from_the_light_and_only_there() -> None:
    light = LightOnScreen((30.0, 60.0), (1.0, 1.0, 1.0), 1.0, 36.0)
    alpha, depth = NOTHING[0].copy(), NOTHING[1].copy()
    alpha[50:70, 60:64], depth[50:70, 60:64] = 1.0, 0.5
    black = np.zeros((HEIGHT, WIDTH, 4))
    open_picture = light_shafts(black, *NOTHING, [light], ON.samples)[..., 0]
    fraction = light_shafts(black, alpha, depth, [light], ON.samples)[..., 0] / open_picture
    assert fraction[60, 66] < 0.92 and fraction[60, 66] < fraction[60, 90] < fraction[60, 130] < 1.0
    assert fraction[60, :58].min() > 0.999 and fraction[90, 66:108].min() > 0.999
    # at twice the bar's distance from the light, the shaft is twice as wide
    assert fraction[60 + 16, 90] < 0.999 and fraction[60 + 24, 90] > 0.999


def test_only_what_is_nearer_than_the_light_throws_a_shaft() -> None:
    alpha, depth = np.ones((HEIGHT, WIDTH)), np.full((HEIGHT, WIDTH), 0.8)
    black = np.zeros((HEIGHT, WIDTH, 4))
    sums = [
        light_shafts(
            black, alpha, depth, [LightOnScreen((80.0, 60.0), (1, 1, 1), z, 36.0)], 256
        ).sum()
        for z in (0.7, 0.9, 1.0)
    ]
    assert sums[0] > 2.0 * sums[1] and sums[1] == sums[2]


def test_strength_is_a_factor_and_length_0_changes_nothing() -> None:
    light = Light.point((0.1, 0.4, 0.2), (1.0, 1.0, 1.0), 300.0)
    picture = np.random.default_rng(1).random((HEIGHT, WIDTH, 4)).astype(np.float32)

    def added(**changes: float) -> np.ndarray:
        settings = replace(ON, **changes)
        seen = lights_on_screen([light], VIEW, PROJECTION, WIDTH, HEIGHT, settings)
        return light_shafts(picture, *NOTHING, seen, settings.samples) - picture

    assert added().max() > 0.1
    assert added(strength=0.5) == pytest.approx(0.5 * added(), abs=1e-6)
    for nothing in ({"strength": 0.0}, {"length": 0.0}, {"length": 1e-40}, {"use_shafts": False}):
        assert not added(**nothing).any()


@pytest.mark.parametrize(
    ("light", "place"),
    [
        (Light.sun((0.0, -1.0, 0.0), (1, 1, 1), 4.0), (80.0, 60.0)),  # ahead
        (Light.sun((0.0, 1.0, 0.0), (1, 1, 1), 4.0), None),  # behind
        (Light.sun((1.0, 0.0, 0.0), (1, 1, 1), 4.0), None),  # beside
        (Light.point((0.0, 1.0, 0.0), (1, 1, 1), 99.0), (80.0, 60.0)),
        (Light.point((0.0, -3.0, 0.0), (1, 1, 1), 99.0), None),
        (Light.point((0.0, -2.0, 0.0), (1, 1, 1), 99.0), None),  # in the eye
        (Light.point((0.0, -2.0 + 1e-9, 0.0), (1, 1, 1), 99.0), (80.0, 60.0)),
        (Light.point((0.0, 0.0, 2.0 * np.tan(np.radians(20.0))), (1, 1, 1), 99.0), (80.0, 120.0)),
        (Light.point((0.0, 0.0, 1.0), (1, 1, 1), 99.0), (80.0, 60.0 + 60.0 / 0.72794)),
        (Light.sun((-1.0, -0.001, 0.0), (1, 1, 1), 4.0), None),  # ahead, but much too far aside
    ],
)
def test_where_a_light_is_on_the_screen(light: Light, place: tuple[float, float] | None) -> None:
    seen = lights_on_screen([light], VIEW, PROJECTION, WIDTH, HEIGHT, ON)
    if place is None:
        assert seen == []
        return
    assert seen[0].center == pytest.approx(place, abs=0.01)
    picture = light_shafts(np.zeros((HEIGHT, WIDTH, 4)), *NOTHING, seen, ON.samples)
    assert np.isfinite(picture).all() and picture.max() > 0.0


def test_the_picture_has_no_jump_as_a_light_leaves_it() -> None:
    """From just inside the border to just outside, where another grid is used."""
    alpha, depth = np.zeros((HEIGHT, WIDTH)), np.ones((HEIGHT, WIDTH))
    alpha[40:80:8, 20:], depth[40:80:8, 20:] = 1.0, 0.5
    black = np.zeros((HEIGHT, WIDTH, 4))
    inside, outside = (
        light_shafts(black, alpha, depth, [LightOnScreen((x, 60.0), (1, 1, 1), 1.0, 36.0)], 256)
        for x in (0.001, -0.001)
    )
    assert np.abs(inside - outside).max() < 0.02
    assert np.abs(inside - outside).mean() < 0.001


def test_a_part_of_a_picture_is_as_it_is_in_the_whole() -> None:
    """Drawn alone with its own projection, in a scene where nothing outside it throws shafts."""
    light = Light.point((0.05, 0.2, 0.03), (1.0, 0.8, 0.6), 200.0)
    alpha, depth = np.zeros((HEIGHT, WIDTH)), np.ones((HEIGHT, WIDTH))
    alpha[50:80:6, 60:120], depth[50:80:6, 60:120] = 0.7, 0.5
    part = np.s_[40:100, 50:130]
    # clip space of the part: x from 50 to 130 of 160 pixels, y from 40 to 100 of 120
    crop = np.eye(4)
    crop[0, 0], crop[1, 1] = 160 / 80, 120 / 60
    crop[0, 3], crop[1, 3] = -(50 + 130 - 160) / 80, -(40 + 100 - 120) / 60
    pictures = []
    for view, place in ((PROJECTION, np.s_[:, :]), (crop @ PROJECTION, part)):
        shown = alpha[place], depth[place]
        height, width = shown[0].shape
        seen = lights_on_screen([light], VIEW, view, width, height, ON)
        black = np.zeros((height, width, 4))
        pictures.append(light_shafts(black, *shown, seen, 4096)[..., :3])
    difference = np.abs(pictures[0][part] - pictures[1])
    assert difference.max() < 0.03 and difference.mean() < 1e-3
    assert np.ptp(pictures[1]) > 0.1


def test_an_orthographic_view_has_no_shafts() -> None:
    light = Light.point((0.0, 0.0, 0.0), (1, 1, 1), 99.0)
    assert lights_on_screen([light], VIEW, orthographic(1.0, 1.0, 0.0, 5.0), 9, 9, ON) == []


def test_a_spot_that_shines_elsewhere_gives_nothing() -> None:
    from hairloom.addon.shading.lights import Cone

    to_viewer = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))  # shines along its -z: -y
    away = ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, -1.0, 0.0))
    counts = []
    for axes in (to_viewer, away):
        spot = Light.spot((0.0, 1.0, 0.0), (1, 1, 1), 99.0, Cone(axes, 1.0, 0.1))
        counts.append(len(lights_on_screen([spot], VIEW, PROJECTION, WIDTH, HEIGHT, ON)))
    assert counts == [1, 0]
