"""The stage: the same brightness at any size, the positions of its lights, and a soft backdrop."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.render.camera import look_at
from hairloom.addon.shading.lights import light_at
from hairloom.addon.shading.stage import backdrop, over_backdrop, stage_lights
from hairloom.addon.shading.stage_settings import StageSettings
from hairloom.addon.shading.volume.light_frame import Ball

VIEW = look_at((1.0, -2.0, 0.5), (0.0, 0.0, 0.0))
NEUTRAL = StageSettings(warmth=0.0)


@pytest.mark.parametrize("radius", [1e-4, 0.1, 100.0])
def test_lights_are_as_strong_as_set_where_the_hair_is(radius: float) -> None:
    ball = Ball(np.array([0.3, -0.2, 1.5]) * radius, radius)
    lights = stage_lights(NEUTRAL, VIEW, ball)
    found = [float(light_at(light, ball.center[None])[1][0, 0]) for light in lights]
    np.testing.assert_allclose(found, [NEUTRAL.key, NEUTRAL.fill, NEUTRAL.rim], rtol=1e-6)


def test_lights_stand_where_the_angles_say_and_fall_off() -> None:
    ball = Ball(np.zeros(3), 0.2)
    key, fill, rim = stage_lights(NEUTRAL, VIEW, ball)
    places = [VIEW[:3, :3] @ np.array(light.vector) for light in (key, fill, rim)]
    np.testing.assert_allclose([np.linalg.norm(each) for each in places], NEUTRAL.distance * 0.2)
    assert places[0][0] > 0.0 > places[1][0] and places[2][2] < 0.0 < places[0][2]
    assert np.arcsin(places[0][1] / 1.0) == pytest.approx(NEUTRAL.key_height)
    towards = np.array(key.vector)
    near, far = (light_at(key, sign * 0.2 * towards[None])[1][0, 0] for sign in (1.0, -1.0))
    assert near > 1.5 * far


def test_what_shines_not_at_all_is_no_light() -> None:
    assert len(stage_lights(StageSettings(fill=0.0), VIEW, Ball(np.zeros(3), 1.0))) == 2


def test_warmth_turns_the_lights_against_each_other() -> None:
    key, fill, rim = stage_lights(StageSettings(warmth=1.0), VIEW, Ball(np.zeros(3), 1.0))
    assert key.power[0] > key.power[2]
    assert fill.power[0] < fill.power[2] and rim.power[0] < rim.power[2]


def test_the_backdrop_fades_evenly_from_its_centre() -> None:
    stage = StageSettings(backdrop_center=(0.5, 0.4, 0.3), backdrop_edge=(0.1, 0.1, 0.1))
    picture = backdrop(stage, 61, 41)
    np.testing.assert_allclose(picture[20, 30], stage.backdrop_center, atol=1e-5)
    assert (np.diff(picture[20, 30:, 0]) < 0.0).all()
    np.testing.assert_array_equal(picture, picture[::-1])
    corner, center = picture[0, 0, 0], stage.backdrop_center[0]
    assert 0.1 < corner < 0.1 + 0.08 * center
    # the same picture at any resolution
    np.testing.assert_allclose(backdrop(stage, 183, 123)[1::3, 1::3], picture, atol=1e-6)


def test_a_picture_lies_over_the_backdrop() -> None:
    picture = np.array([[[0.2, 0.0, 0.0, 0.5], [0.0, 0.0, 0.0, 0.0], [0.7, 0.7, 0.7, 1.0]]])
    behind = np.full((1, 3, 3), 0.4)
    found = over_backdrop(picture, behind)
    np.testing.assert_allclose(found[0, :, 0], [0.4, 0.4, 0.7])
    assert (found[..., 3] == 1.0).all()
