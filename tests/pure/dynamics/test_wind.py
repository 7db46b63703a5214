"""Gusts: of the set strength, free of divergence, carried by the wind, the same at any frame
rate."""

import numpy as np
import pytest

from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.wind import air_from_settings, sine

GUSTY = DynamicsSettings(wind_speed=8.0, gusts=0.5, gust_size=0.4, wind_direction=0.7)


def anywhere(count, size=20.0):
    return np.random.default_rng(2).uniform(-size, size, (3, count))


def test_the_sine_is_a_sine():
    """Far from zero, float32 rounds the angle itself, by a relative 6e-8."""
    angle = np.linspace(-40.0, 40.0, 100_001).astype(np.float32)
    away = np.abs(sine(angle) - np.sin(angle.astype(np.float64)))
    assert away[np.abs(angle) < 7.0].max() < 1e-6
    assert away.max() < 6e-6


def test_still_air_is_none():
    assert air_from_settings(DynamicsSettings()) is None


@pytest.mark.parametrize(
    ("turn", "rise", "expected"),
    [(0.0, 0.0, (3, 0, 0)), (np.pi / 2, 0.0, (0, 3, 0)), (0.4, np.pi / 2, (0, 0, 3))],
)
def test_direction(turn, rise, expected):
    settings = DynamicsSettings(wind_speed=3.0, wind_direction=turn, wind_elevation=rise, gusts=0.0)
    air = air_from_settings(settings)
    np.testing.assert_allclose(air.at(anywhere(4), 1.3).T, np.tile(expected, (4, 1)), atol=1e-6)


def test_gusts_are_as_strong_as_they_say():
    """Mean and standard deviation over space equal the settings."""
    air = air_from_settings(GUSTY)
    speed = air.at(anywhere(200_000), 0.0).astype(np.float64)
    mean = speed.mean(axis=1)
    np.testing.assert_allclose(mean, air.velocity, atol=0.05)
    deviation = np.sqrt(((speed - mean[:, None]) ** 2).sum(axis=0).mean())
    assert deviation == pytest.approx(8.0 * 0.5, rel=0.02)


@pytest.mark.parametrize("seed", [1, 7])
def test_gusts_are_free_of_divergence(seed):
    air = air_from_settings(DynamicsSettings(**GUSTY.as_dict() | {"gust_seed": seed}))
    points, step = anywhere(500, 1.0), 2e-3
    slope = np.empty((3, 3, 500))  # of component i along axis j
    for axis in range(3):
        aside = np.zeros((3, 1))
        aside[axis] = step
        slope[:, axis] = (air.at(points + aside, 0.3) - air.at(points - aside, 0.3)) / (2 * step)
    divergence = slope[0, 0] + slope[1, 1] + slope[2, 2]
    assert np.abs(divergence).max() < 0.01 * np.abs(slope).max()


def test_gusts_drift_with_the_wind():
    """Taylor's frozen turbulence: a second later, the same gusts are found downwind."""
    air = air_from_settings(GUSTY)
    points = anywhere(100, 1.0)
    later = air.at(points + air.velocity[:, None], 1.0)
    np.testing.assert_allclose(later, air.at(points, 0.0), atol=2e-3)


def test_another_seed_gives_other_gusts():
    other = air_from_settings(DynamicsSettings(**GUSTY.as_dict() | {"gust_seed": 2}))
    away = air_from_settings(GUSTY).at(anywhere(10), 0.0) - other.at(anywhere(10), 0.0)
    assert np.abs(away).max() > 0.5


def test_a_long_time_keeps_its_gusts():
    """After a day the phase is as exact as at the start."""
    air = air_from_settings(GUSTY)
    points, day = anywhere(50, 1.0), 86_400.0
    swing, wave = air.amplitude.astype(np.float64), air.wave_vector.astype(np.float64)
    turns = wave @ points + (air.phase - air.angular_frequency * day)[:, None]
    exact = air.velocity[:, None] + swing.T @ np.sin(turns)
    np.testing.assert_allclose(air.at(points, day), exact, atol=1e-4)


@pytest.mark.parametrize("fps", [24.0, 30.0, 120.0])
def test_hair_in_gusts_does_not_feel_the_frame_rate(kit, fps):
    """The same substeps at the same times: only rounding may differ."""
    settings = DynamicsSettings(**GUSTY.as_dict() | {"drag": 1.0})
    scene = kit.Scene(kit.curly(10, 12), settings)
    expected = scene.play(1.0, 60.0)[-1].grid
    assert np.abs(expected - scene.grid).max() > 0.02
    np.testing.assert_allclose(scene.play(1.0, fps)[-1].grid, expected, atol=1e-4)
