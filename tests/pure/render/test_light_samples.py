"""Sample points of lights: their mean is the whole light, and they fill it evenly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.render.light_samples import disk_place, lights_at
from hairloom.addon.shading.area_lights import Panel
from hairloom.addon.shading.lights import Cone, Light, light_at, light_irradiance

WHITE = (1.0, 1.0, 1.0)
AXES = (1.0, 0.0, 0.0), (0.0, 0.6, 0.8), (0.0, 0.8, -0.6)
#: a spot that shines down
TURNED = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
LIGHTS = {
    "sun": Light.sun((0.3, 0.2, -1.0), WHITE, 3.0, np.radians(20.0)),
    "lamp": Light.point((0.4, -0.9, 1.2), WHITE, 40.0, 0.3),
    "ball": Light.point((0.4, -0.9, 1.2), WHITE, 40.0, 0.1, is_ball=True),
    "spot": Light.spot((0.0, 0.0, 1.0), WHITE, 40.0, Cone(TURNED, 1.5, 0.0), 0.1),
    "panel": Light.area((0.0, -1.0, 1.0), WHITE, 40.0, Panel(*AXES, 0.5, 0.25)),
    "ellipse": Light.area((0.0, -1.0, 1.0), WHITE, 40.0, Panel(*AXES, 0.5, 0.25, True)),
    "narrow": Light.area(
        (0.0, -1.0, 1.0), WHITE, 40.0, Panel(*AXES, 0.3, 0.3, spread=np.radians(120.0))
    ),
}
POINTS = np.array([[0.0, 0.0, 0.0], [0.3, -0.2, 0.1], [-0.2, 0.1, -0.4]])


def arriving(light: Light) -> np.ndarray:
    """The vector irradiance of a light at POINTS."""
    towards, irradiance = light_at(light, POINTS)
    return towards * irradiance[:, :1]


@pytest.mark.alike
@pytest.mark.parametrize("name", LIGHTS)
def test_the_mean_of_all_points_is_the_whole_light(name: str) -> None:
    light = LIGHTS[name]
    parts = [lights_at((light,), sample, np.zeros(3))[0] for sample in range(1024)]
    found = np.mean([arriving(part) for part in parts], axis=0)
    assert np.linalg.norm(found - arriving(light), axis=1) == pytest.approx(
        0.0, abs=0.02 * np.linalg.norm(arriving(light), axis=1).max()
    )
    assert len({part.vector for part in parts}) == len(parts)


def test_the_first_sample_is_the_middle() -> None:
    for name, light in LIGHTS.items():
        (first,) = lights_at((light,), 0, np.zeros(3))
        assert first.vector == pytest.approx(light.vector), name


@pytest.mark.parametrize("name", LIGHTS)
def test_each_sample_turns_the_shadow_map_by_another_angle(name: str) -> None:
    """Over a quarter turn, after which a square map is the same, and evenly: no gap of the first 16
    is wider than twice their mean. The first one is not turned."""
    rolls = [lights_at((LIGHTS[name],), sample, np.zeros(3))[0].map_roll for sample in range(16)]
    assert rolls[0] == 0.0
    gaps = np.diff([*np.sort(rolls), 0.5 * np.pi])
    assert gaps.min() > 0.0 and gaps.max() < 2.0 * 0.5 * np.pi / 16


def test_the_map_of_a_light_without_a_size_stays_as_it_is() -> None:
    hard = Light.sun((0.3, 0.2, -1.0), WHITE, 3.0)
    assert lights_at((hard,), 5, np.zeros(3)) == (hard,)


@pytest.mark.parametrize("name", ["lamp", "ball", "spot"])
def test_every_point_of_a_lamp_gives_the_hair_as_much(name: str) -> None:
    light, hair = LIGHTS[name], np.zeros((1, 3))
    for sample in range(8):
        (part,) = lights_at((light,), sample, hair[0])
        assert light_irradiance(part, hair) == pytest.approx(light_irradiance(light, hair))


@pytest.mark.parametrize("is_ball", [False, True])
def test_the_rim_of_a_spot_is_as_wide_as_its_lamp_makes_it(is_ball: bool) -> None:
    """Against the fraction of the lamp's points that light a place through a sharp cone."""
    cone = Cone(TURNED, np.radians(60.0), 0.0)
    light = Light.spot((0.0, 0.0, 2.0), WHITE, 40.0, cone, 0.3, is_ball)
    points = np.linspace([0.0, 0.0, 0.0], [2.0, 0.0, 0.0], 400)

    def let_through(parts: Sequence[Light]) -> np.ndarray:
        every = [light_irradiance(replace(part, cone=None), points) for part in parts]
        seen = [light_irradiance(part, points) for part in parts]
        return np.mean(np.divide(seen, every)[..., 0], axis=0)

    side = (np.arange(40) + 0.5) / 40
    disk = [disk_place(np.array([x, y])) for x in side for y in side]
    of_disk = [replace(light, radius=0.0, vector=(*(0.3 * place), 2.0)) for place in disk]
    found = let_through([lights_at((light,), n, np.zeros(3))[0] for n in range(1024)])
    assert np.abs(found - let_through(of_disk)).max() < 0.02


def test_a_sun_fills_its_angle() -> None:
    """Uniform over the disk: half of the samples lie within sqrt(0.5) of its radius."""
    light = LIGHTS["sun"]
    found = np.array([lights_at((light,), sample, np.zeros(3))[0].vector for sample in range(512)])
    angles = np.arccos(np.clip(found @ np.array(light.vector), -1.0, 1.0))
    assert np.degrees(angles.max()) == pytest.approx(10.0, abs=0.3)
    assert np.degrees(np.median(angles)) == pytest.approx(10.0 * np.sqrt(0.5), abs=0.3)


def test_lights_without_a_size_are_left_alone() -> None:
    lights = (Light.sun((0.0, 0.0, -1.0), WHITE, 1.0), Light.point((1.0, 0.0, 0.0), WHITE, 1.0))
    assert lights_at(lights, 7, np.zeros(3)) == lights


def test_hair_inside_a_lamp_sees_no_side_of_it() -> None:
    light = Light.point((0.0, 0.0, 0.1), WHITE, 1.0, 0.3)
    assert lights_at((light,), 5, np.zeros(3)) == (light,)


def test_the_disk_keeps_areas() -> None:
    side = (np.arange(200) + 0.5) / 200
    places = np.array([disk_place(np.array([x, y])) for x in side for y in side])
    radius = np.linalg.norm(places, axis=1)
    assert radius.max() <= 1.0
    assert (radius < 0.5).mean() == pytest.approx(0.25, abs=0.01)
    assert ((places[:, 0] > 0.0) & (places[:, 1] > 0.0)).mean() == pytest.approx(0.25, abs=0.01)
