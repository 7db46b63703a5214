"""Which lights cast shadows, and the messages about those that do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.shading.area_lights import Panel
from hairloom.addon.shading.lights import Cone, Light, light_irradiance
from hairloom.addon.shading.volume.light_frame import Ball
from hairloom.addon.shading.volume.settings import VolumeSettings
from hairloom.addon.shading.volume.shadow_lights import shadow_frames, shadow_warnings

BALL = Ball(np.array([0.1, 0.0, 1.5]), 0.2)
SUN = Light.sun((0.0, 0.0, -1.0), (1, 1, 1), 3.0)
#: labels in the panel
LABELS = {each.name: each.label for each in VolumeSettings.parameters()}
DEEP = VolumeSettings(shadows="deep", max_lights=2)
#: shines along +x
CONE = Cone(((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (-1.0, 0.0, 0.0)), 1.0, 0.1)


def point(*place: float, power: float = 10.0) -> Light:
    return replace(Light.point(place, (1, 1, 1), power), name="Lamp")


def spot(*place: float, size: float = 1.0) -> Light:
    cone = replace(CONE, size=size)
    return replace(Light.spot(place, (1, 1, 1), 10.0, cone), name="Spot")


def warnings_of(
    *lights: Light, settings: VolumeSettings = DEEP, ball: Ball = BALL
) -> tuple[str, ...]:
    found = shadow_warnings(lights, ball, settings)
    for warning in found:
        place, rest = warning.split(": ", 1)
        assert place and rest[0].islower() and warning.endswith(".")
        assert warning.count(". ") >= 1, "what to do"
    return found


def test_lights_that_cast_all_their_shadow_give_no_warning() -> None:
    assert warnings_of(SUN) == () and warnings_of(SUN, point(1.0, 0.0, 1.5)) == ()
    assert warnings_of(spot(-1.0, 0.0, 1.5)) == () and warnings_of(spot(0.05, 0.0, 1.5)) == ()
    assert warnings_of(point(0.1, 0.0, 1.5), settings=VolumeSettings(shadows="none")) == ()


def test_a_light_amidst_the_hair_is_reported_by_its_name() -> None:
    (warning,) = warnings_of(SUN, point(0.1, 0.02, 1.5))
    assert warning.startswith("Lamp: it stands inside the hair") and "0.21 m" in warning
    assert shadow_frames([SUN, point(0.1, 0.02, 1.5)], BALL, DEEP)[1] is None


def test_of_a_light_as_near_as_hair_reaches_a_part_has_no_shadow() -> None:
    (warning,) = warnings_of(point(0.1, 0.12, 1.5))
    assert warning.startswith("Lamp: it stands within reach of the hair")
    assert shadow_frames([point(0.1, 0.12, 1.5)], BALL, DEEP)[0] is not None
    assert warnings_of(spot(0.1, 0.12, 1.5, size=3.1))[0].startswith("Spot: ")


@pytest.mark.parametrize("place", [(0.31, 0.0, 1.5), (1.0, 0.0, 1.5), (-1.0, 0.9, 1.5)])
def test_a_spot_that_misses_the_hair_is_reported(place: tuple[float, float, float]) -> None:
    (warning,) = warnings_of(spot(*place))
    assert warning.startswith("Spot: it shines past the hair")


def test_a_spot_of_a_scaled_object_lights_as_far_as_its_cone_is_squeezed() -> None:
    """A spot just misses the hair; with a cone that is scaled by three it lights the hair."""
    lamp, place = spot(-1.0, 0.9, 1.5), np.array([BALL.center])
    assert lamp.cone is not None and not light_irradiance(lamp, place).any()
    axes = tuple(tuple(row) for row in np.array(CONE.axes) / np.array([[3.0], [3.0], [1.0]]))
    wide = replace(lamp, cone=replace(lamp.cone, axes=axes))
    assert light_irradiance(wide, place).all() and warnings_of(wide) == ()


def test_a_panel_with_its_back_to_the_hair_is_reported() -> None:
    panel = Panel((0, 1, 0), (0, 0, 1), (1.0, 0.0, 0.0), 0.1, 0.1, False, np.pi)
    lamp = replace(Light.area((1.0, 0.0, 1.5), (1, 1, 1), 9.0, panel), name="Area")
    assert warnings_of(lamp)[0].startswith("Area: it shines past the hair")
    assert warnings_of(replace(lamp, vector=(-1.0, 0.0, 1.5))) == ()


def test_lights_beyond_those_that_throw_shadows_are_reported_where_they_are_much() -> None:
    lights = [point(np.cos(turn), np.sin(turn), 1.5) for turn in range(20)]
    (warning,) = warnings_of(*lights)
    assert "the 2 strongest of 20" in warning and f"Raise {LABELS['max_lights']}," in warning
    assert warnings_of(*lights[:2], point(0.0, 2.0, 1.5, power=1.0)) == ()


@pytest.mark.parametrize(
    ("name", "value", "word"),
    [
        ("extinction", 0.0, "casts none"),
        ("extinction", 1000.0, "this high"),
        ("max_lights", 0, "is 0"),
    ],
)
def test_settings_that_leave_no_shadow_are_reported(name: str, value: float, word: str) -> None:
    (warning,) = warnings_of(SUN, settings=replace(DEEP, **{name: value}))
    assert word in warning and LABELS[name] in warning


def test_hair_without_extent_is_reported() -> None:
    assert "no extent" in warnings_of(SUN, ball=Ball(np.zeros(3), 1.2e-9))[0]
