"""Place and colour of the highlights along a strand, for the shipped looks.

The strand lies on a ball, from its top over its front down to the lower pole. Eye and light are
before the ball by default; places are degrees from the middle towards the tip. Document 001: blond
hair has three visible highlights, R, TRT and, against the light, TT; black hair has one. Kajiya-Kay
has no transmitted light, so its blond hair has two.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.params.preset import read_any_preset
from hairloom.addon.shading.kajiya_kay import kajiya_kay, strand_base
from hairloom.addon.shading.marschner.look import fibre_of, marschner_light, strand_absorption
from hairloom.addon.shading.marschner.tables import marschner_tables, shape_of
from hairloom.addon.shading.settings import ShadingSettings

LOOKS = Path(__file__).parents[3] / "presets" / "looks"
MODELS = ("kajiya_kay", "marschner")
PLACES = np.linspace(-75.0, 75.0, 601)
TO_EYE = np.array([0.0, -1.0, 0.0])
#: a maximum counts as visible from this fraction of the highest one
LEAST = 0.1


def look(name: str, model: str) -> ShadingSettings:
    """A look without noise and without fake scattering between strands."""
    shipped = read_any_preset(LOOKS / f"{name}.json", ALL_SETTINGS).settings
    return replace(
        shipped,
        model=model,
        shift_noise=0.0,
        color_variation=0.0,
        grey_fraction=0.0,
        fake_scattering=0.0,
    )


def profile(settings: ShadingSettings, to_light: np.ndarray = TO_EYE) -> np.ndarray:
    """Light towards the eye along the strand, (601, 3)."""
    polar = np.radians(PLACES + 90.0)
    nought, half = np.zeros_like(polar), np.full_like(polar, 0.5)
    normal = np.stack([nought, -np.sin(polar), np.cos(polar)], axis=-1)
    tangent = np.stack([nought, -np.cos(polar), -np.sin(polar)], axis=-1)
    return shaded(settings, tangent, normal, to_light, half)


def shaded(
    settings: ShadingSettings,
    tangent: np.ndarray,
    normal: np.ndarray,
    to_light: np.ndarray,
    half: np.ndarray,
) -> np.ndarray:
    lit = np.broadcast_to(to_light, tangent.shape)
    seen = np.broadcast_to(TO_EYE, tangent.shape)
    sparkle = np.ones_like(half)
    if settings.model == "marschner":
        tables = marschner_tables(shape_of(fibre_of(settings)))
        absorption = strand_absorption(settings, np.zeros_like(half), half, half)
        return marschner_light(
            tables, tangent, normal, lit, seen, half, sparkle, absorption, settings
        )
    light = kajiya_kay(tangent, normal, lit, seen, half, sparkle, settings)
    return light * strand_base(np.zeros_like(half), half, half, settings) / np.pi


def highlights(light: np.ndarray) -> list[tuple[float, float]]:
    """Place and warmth (red over blue) of each maximum, from the root on."""
    bright = light.mean(axis=-1)
    inner = bright[1:-1]
    is_top = (inner > bright[:-2]) & (inner >= bright[2:]) & (inner > LEAST * bright.max())
    return [(PLACES[i], light[i, 0] / light[i, 2]) for i in np.flatnonzero(is_top) + 1]


@pytest.mark.parametrize("model", MODELS)
def test_blond_has_a_coloured_highlight_to_the_root_and_a_paler_one_to_the_tip(model: str) -> None:
    (second, second_warmth), (first, first_warmth) = highlights(profile(look("blond", model)))
    assert -20.0 < second < -5.0
    assert 3.0 < first < 10.0
    assert second_warmth > 1.3 * first_warmth


def test_the_first_highlight_is_white_in_marschner() -> None:
    """Its light has not been inside the hair. Kajiya-Kay tints both highlights."""
    _, (_, warmth) = highlights(profile(look("blond", "marschner")))
    assert warmth == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("model", MODELS)
def test_black_has_one_highlight_to_the_tip(model: str) -> None:
    ((place, warmth),) = highlights(profile(look("black", model)))
    assert 1.0 < place < 10.0
    assert warmth == pytest.approx(1.0, abs=0.25)


def test_separation_moves_the_first_by_itself_and_the_second_by_twice_as_much() -> None:
    blond = look("blond", "marschner")
    more = replace(blond, cuticle_tilt=blond.cuticle_tilt + np.radians(2.0))
    (second, _), (first, _) = highlights(profile(blond))
    (second_more, _), (first_more, _) = highlights(profile(more))
    assert first_more - first == pytest.approx(2.0, abs=0.4)
    assert second_more - second == pytest.approx(-4.0, abs=0.4)


@pytest.mark.parametrize("model", MODELS)
def test_light_from_above_moves_both_highlights_up(model: str) -> None:
    """To where the strand is across the half vector: by half the angle by which the light rises."""
    raised = np.radians(30.0)
    above = np.array([0.0, -np.cos(raised), np.sin(raised)])
    before = highlights(profile(look("blond", model)))
    after = highlights(profile(look("blond", model), above))
    assert len(before) == len(after) == 2
    for (place, _), (moved, _) in zip(before, after, strict=True):
        assert moved - place == pytest.approx(-15.0, abs=2.5)


def rim(settings: ShadingSettings) -> np.ndarray:
    """A strand at the ball's outline, the light behind it, (3,)."""
    behind = np.radians(150.0)
    to_light = np.array([np.sin(behind), -np.cos(behind), 0.0])
    upright, outward = np.array([[0.0, 0.0, -1.0]]), np.array([[1.0, 0.0, 0.0]])
    return shaded(settings, upright, outward, to_light, np.array([0.5]))[0]


def test_blond_has_a_third_highlight_against_the_light_and_black_has_none() -> None:
    blond, black = look("blond", "marschner"), look("black", "marschner")
    brightest = profile(blond).mean(axis=-1).max()
    assert rim(blond).mean() > 1.5 * brightest
    assert rim(blond)[0] > 1.1 * rim(blond)[2]
    assert rim(replace(blond, strength_tt=0.0)).mean() < 0.2 * rim(blond).mean()
    assert rim(replace(black, strength_r=0.0)).mean() < 0.02 * rim(blond).mean()


def test_kajiya_kay_has_no_light_that_passes_through() -> None:
    blond = look("blond", "kajiya_kay")
    assert rim(blond).mean() < profile(blond).mean(axis=-1).max()
