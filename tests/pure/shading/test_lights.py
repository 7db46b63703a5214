"""Lights: Blender's units, and how they are packed for the GPU."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.shading.lights import (
    LIGHT_CAPACITY,
    Light,
    light_direction,
    light_irradiance,
    pack_lights,
    three_point_lights,
)


def test_point_light_sends_its_whole_power_through_any_sphere() -> None:
    """Irradiance summed over a sphere around the light is its power, whatever the radius."""
    random = np.random.default_rng(1)
    directions = random.normal(size=(1000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    light = Light.point((1.0, 2.0, 3.0), (1.0, 0.5, 0.0), 40.0)
    for radius in (0.1, 1.0, 7.0):
        points = np.array(light.vector) + radius * directions
        received = light_irradiance(light, points).mean(axis=0) * 4.0 * np.pi * radius**2
        assert received == pytest.approx([40.0, 20.0, 0.0])
        assert light_direction(light, points) == pytest.approx(-directions)


def test_sun_is_the_same_everywhere() -> None:
    sun = Light.sun((0.0, 0.0, -2.0), (1.0, 1.0, 0.5), 3.0)
    points = np.array([[0.0, 0.0, 0.0], [100.0, -5.0, 3.0]])
    assert light_direction(sun, points).tolist() == [[0.0, 0.0, 1.0]] * 2
    assert light_irradiance(sun, points).tolist() == [[3.0, 3.0, 1.5]] * 2


def test_sun_without_direction_is_refused() -> None:
    with pytest.raises(HairloomError, match="sun light"):
        Light.sun((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 1.0)


def test_a_point_at_the_light_is_finite() -> None:
    light = Light.point((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 10.0)
    assert np.isfinite(light_irradiance(light, np.zeros(3))).all()
    assert np.isfinite(light_direction(light, np.zeros(3))).all()


def test_packed_lanes() -> None:
    lights = (
        Light.sun((-1.0, 0.0, 0.0), (1.0, 0.5, 0.25), 4.0),
        Light.point((5.0, 6.0, 7.0), (1.0, 1.0, 1.0), 9.0),
    )
    block = pack_lights(lights, (0.1, 0.2, 0.3)).reshape(-1, 4)
    assert block.shape == (1 + 2 * LIGHT_CAPACITY, 4) and block.dtype == np.float32
    assert block[0] == pytest.approx([0.1, 0.2, 0.3, 2.0])
    assert block[1].tolist() == [1.0, 0.0, 0.0, 0.0]
    assert block[2].tolist() == [5.0, 6.0, 7.0, 1.0]
    assert block[1 + LIGHT_CAPACITY].tolist() == [4.0, 2.0, 1.0, 0.0]
    assert block[2 + LIGHT_CAPACITY].tolist() == [9.0, 9.0, 9.0, 0.0]


def test_the_weakest_lights_are_left_out() -> None:
    suns = [Light.sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0), strength) for strength in range(1, 12)]
    block = pack_lights(suns, (0.0, 0.0, 0.0)).reshape(-1, 4)
    assert block[0, 3] == LIGHT_CAPACITY
    assert sorted(block[1 + LIGHT_CAPACITY :, 0]) == list(range(4, 12))


def test_studio_hangs_on_the_camera() -> None:
    """Turning the camera turns the lights: in view space they stay where they are."""
    turn = np.eye(4)
    turn[:3, :3] = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    for still, turned in zip(three_point_lights(np.eye(4)), three_point_lights(turn), strict=True):
        assert turn[:3, :3] @ turned.vector == pytest.approx(still.vector)
    key, _fill, rim = three_point_lights(np.eye(4))
    assert key.vector[2] > 0.0 > rim.vector[2]
