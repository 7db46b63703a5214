"""Lights: Blender's units, and packing for the GPU."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.shading.area_lights import Panel
from hairloom.addon.shading.lights import (
    HARMONIC_COUNT,
    LIGHT_CAPACITY,
    Cone,
    Light,
    brightest_lights,
    light_at,
    light_irradiance,
    pack_lights,
    three_point_lights,
)


def test_point_light_sends_its_whole_power_through_any_sphere() -> None:
    """The irradiance integrated over a sphere around the light is its power, for any radius."""
    random = np.random.default_rng(1)
    directions = random.normal(size=(1000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    light = Light.point((1.0, 2.0, 3.0), (1.0, 0.5, 0.0), 40.0)
    for radius in (0.1, 1.0, 7.0):
        points = np.array(light.vector) + radius * directions
        received = light_irradiance(light, points).mean(axis=0) * 4.0 * np.pi * radius**2
        assert received == pytest.approx([40.0, 20.0, 0.0])
        assert light_at(light, points)[0] == pytest.approx(-directions)


def test_sun_is_the_same_everywhere() -> None:
    sun = Light.sun((0.0, 0.0, -2.0), (1.0, 1.0, 0.5), 3.0)
    points = np.array([[0.0, 0.0, 0.0], [100.0, -5.0, 3.0]])
    assert light_at(sun, points)[0].tolist() == [[0.0, 0.0, 1.0]] * 2
    assert light_irradiance(sun, points).tolist() == [[3.0, 3.0, 1.5]] * 2


def test_sun_without_direction_is_refused() -> None:
    with pytest.raises(HairloomError, match="sun light"):
        Light.sun((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 1.0)


def test_a_point_at_the_light_is_finite() -> None:
    light = Light.point((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 10.0)
    assert np.isfinite(light_irradiance(light, np.zeros(3))).all()
    assert np.isfinite(light_at(light, np.zeros(3))[0]).all()


X, Y, DOWN = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0)
AXES = (X, Y, (0.0, 0.0, 1.0))
WHITE = (1.0, 1.0, 1.0)


def test_a_radius_softens_what_is_near_and_leaves_what_is_far() -> None:
    points = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0], [100.0, 0.0, 0.0]])
    disk = light_irradiance(Light.point((0, 0, 0), WHITE, 4.0 * np.pi, 0.2), points)[:, 0]
    assert disk[:3] == pytest.approx([25.0, 20.0, 12.5])
    ball = light_irradiance(Light.point((0, 0, 0), WHITE, 4.0 * np.pi, 0.2, True), points)[:, 0]
    assert ball[:3] == pytest.approx([25.0, 25.0, 25.0])
    assert (disk[3], ball[3]) == pytest.approx((1e-4, 1e-4), rel=1e-5)


def test_spot_is_a_point_light_inside_of_its_cone() -> None:
    spot = Light.spot((0.0, 0.0, 2.0), WHITE, 30.0, Cone(AXES, np.radians(60.0), 0.5))
    point = Light.point((0.0, 0.0, 2.0), WHITE, 30.0)
    # `middle`: halfway through the rim, the outer half of 1 - cos(30 degrees)
    middle = np.arccos(1.0 - 0.75 * (1.0 - np.cos(np.radians(30.0))))
    angles = np.array([0.0, np.radians(20.0), middle, np.radians(30.01), np.pi / 2.0, np.pi])
    points = 2.0 * np.stack([np.sin(angles), 0.0 * angles, 1.0 - np.cos(angles)], axis=1)
    fraction = light_irradiance(spot, points)[:, 0] / light_irradiance(point, points)[:, 0]
    assert fraction == pytest.approx([1.0, 1.0, 0.5, 0.0, 0.0, 0.0], abs=1e-5)


def panel_light(*sides: float, is_round: bool = False, spread: float = np.pi) -> Light:
    panel = Panel(X, Y, DOWN, *sides, is_round=is_round, spread=spread)
    return Light.area((0.0, 0.0, 0.0), WHITE, 5.0, panel)


PANELS = {
    "rectangle": panel_light(0.5, 0.2),
    "disk": panel_light(0.4, 0.4, is_round=True),
    "ellipse": panel_light(0.5, 0.2, is_round=True),
    "narrow rectangle": panel_light(0.5, 0.2, spread=np.radians(70.0)),
    "narrow disk": panel_light(0.4, 0.4, is_round=True, spread=np.radians(110.0)),
    "speck": panel_light(0.0, 0.0),
    "line": panel_light(0.5, 0.0),
}


@pytest.mark.alike
@pytest.mark.parametrize("light", PANELS.values(), ids=PANELS)
def test_area_light_sends_its_whole_power_to_its_front(light: Light) -> None:
    """Integrated over a plane before it, and over a far hemisphere; none goes behind."""
    across = np.linspace(-1.0, 1.0, 400)
    stretched = np.sinh(7.0 * across) * 0.02
    x, y = np.meshgrid(stretched, stretched)
    area = np.outer(np.gradient(stretched), np.gradient(stretched))
    plane = np.stack([x, y, np.full_like(x, -0.3)], axis=-1)
    facing = light_at(light, plane)[0][..., 2]
    assert (light_irradiance(light, plane)[..., 0] * facing * area).sum() == pytest.approx(
        5.0, rel=0.012
    )
    cosine, around = np.meshgrid((np.arange(200) + 0.5) / 200, np.arange(8) * np.pi / 4.0)
    sine = np.sqrt(1.0 - cosine**2)
    far = 200.0 * np.stack([sine * np.cos(around), sine * np.sin(around), -cosine], axis=-1)
    total = light_irradiance(light, far)[..., 0].mean() * 2.0 * np.pi * 200.0**2
    assert total == pytest.approx(5.0, rel=0.005)
    assert (light_irradiance(light, far * [1.0, 1.0, -1.0]) == 0.0).all()
    assert light_at(light, far)[0] == pytest.approx(-far / 200.0, abs=2e-3)


@pytest.mark.parametrize("name", PANELS)
def test_area_light_against_the_sum_over_its_points(name: str) -> None:
    """Against a sum over 360,000 points of its area, also off its axis and near it."""
    light = PANELS[name]
    panel = light.panel
    assert panel is not None
    step = (np.arange(600) + 0.5) / 300.0 - 1.0
    u, v = np.meshgrid(step, step)
    inside = u * u + v * v < 1.0 if panel.is_round else np.ones_like(u, bool)
    a, b = panel.half_sides
    source = np.stack([a * u, b * v, 0.0 * u], axis=-1)[inside]
    for point in ([0.0, 0.0, -0.5], [0.3, -0.4, -0.25], [1.0, 0.2, -1.0], [0.2, 0.1, -5.0]):
        away = source - point
        squared = np.sum(away * away, axis=1)
        height = -point[2]
        tangent = np.sqrt(np.maximum(squared - height**2, 0.0)) / height
        shade = np.maximum(panel.tangent - tangent, 0.0) * panel.normalizer
        arriving = (shade * height / squared**2)[:, None] * away / np.pi
        expected = 5.0 * arriving.mean(axis=0)
        found = light_irradiance(light, np.array(point))[0] * light_at(light, np.array(point))[0]
        assert np.abs(found - expected).max() < 0.008 * np.linalg.norm(expected) + 1e-12


def test_packed_lanes() -> None:
    lights = (
        Light.sun((-1.0, 0.0, 0.0), (1.0, 0.5, 0.25), 4.0),
        Light.point((5.0, 6.0, 7.0), WHITE, 9.0, 0.5),
        Light.spot((1.0, 2.0, 3.0), WHITE, 8.0, Cone(AXES, np.pi, 0.5)),
        Light.area((4.0, 5.0, 6.0), WHITE, 7.0, Panel(X, Y, DOWN, 0.5, 0.25)),
    )
    block = pack_lights(lights, (0.1, 0.2, 0.3)).reshape(-1, 4)
    assert block.shape == (1 + 5 * LIGHT_CAPACITY + HARMONIC_COUNT, 4)
    assert block.dtype == np.float32 and not block[-HARMONIC_COUNT:].any()
    assert block[0] == pytest.approx([0.1, 0.2, 0.3, 4.0])
    vector, power, across, upward, along = block[1:-HARMONIC_COUNT].reshape(5, LIGHT_CAPACITY, 4)[
        :, :4
    ]
    assert vector.tolist() == [[1, 0, 0, 0], [5, 6, 7, 1], [1, 2, 3, 2], [4, 5, 6, 3]]
    assert power[:2].tolist() == [[4.0, 2.0, 1.0, 0.0], [9.0, 9.0, 9.0, 0.25]]
    assert across[2:] == pytest.approx(np.array([[1, 0, 0, 1e-12], [1, 0, 0, 0.5]]), abs=1e-13)
    assert upward[2:] == pytest.approx(np.array([[0, 1, 0, 0.75], [0, 1, 0, 0.25]]))
    assert along[2:] == pytest.approx(np.array([[0, 0, 1, 0.25], [0, 0, -1, 1e8]]))


def test_the_brightest_lights_come_first_and_the_weakest_are_left_out() -> None:
    """Irradiance counts, not power: a sun of 3 W/m^2 is brighter than lamps of 100 W five metres
    away."""
    lamps = [Light.point((5.0 + n, 0.0, 0.0), WHITE, 100.0) for n in range(9)]
    sun = Light.sun((0.0, 0.0, -1.0), WHITE, 3.0)
    block = pack_lights(brightest_lights((*lamps, sun), np.zeros(3)), (0.0, 0.0, 0.0)).reshape(
        -1, 4
    )
    assert block[0, 3] == LIGHT_CAPACITY
    places = block[1 : 1 + LIGHT_CAPACITY]
    assert places[0].tolist() == [0.0, 0.0, 1.0, 0.0]
    assert places[1:, 0].tolist() == [5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0]


def test_studio_hangs_on_the_camera() -> None:
    """The lights turn with the camera, so that they are fixed in view space."""
    turn = np.eye(4)
    turn[:3, :3] = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    for still, turned in zip(three_point_lights(np.eye(4)), three_point_lights(turn), strict=True):
        assert turn[:3, :3] @ turned.vector == pytest.approx(still.vector)
    key, _fill, rim = three_point_lights(np.eye(4))
    assert key.vector[2] > 0.0 > rim.vector[2]
