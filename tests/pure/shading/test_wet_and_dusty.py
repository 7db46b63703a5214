"""Wet and dusty hair, against light that is followed through a film of water."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.shading.drawn_strands import look_color, strand_colors
from hairloom.addon.shading.kajiya_kay import strand_specular
from hairloom.addon.shading.marschner.look import fibre_of
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.wet_and_dusty import (
    FILM_REFLECTANCE,
    FILM_WIDTH,
    wet_and_dusty_color,
    wet_and_dusty_look,
)

DRY = ShadingSettings(cuticle_tilt=0.05, width_r=0.1, width_tt=0.06, dust_color=(0.3, 0.2, 0.1))
SEEDS, ROOT = np.arange(4000)[:, None], np.zeros((1, 1))
WET, DUSTY = replace(DRY, wetness=1.0), replace(DRY, dust=0.6)


def reflected(index: float, cosine: np.ndarray) -> np.ndarray:
    """Reflectance by Fresnel's equations for light from index 1 into a medium of this index."""
    sine = np.sqrt(1.0 - cosine**2) / index
    inner = np.sqrt(np.maximum(1.0 - sine**2, 0.0))
    across = (cosine - index * inner) / (cosine + index * inner)
    along = (index * cosine - inner) / (index * cosine + inner)
    return np.where(sine >= 1.0, 1.0, 0.5 * (across**2 + along**2))


def test_a_film_keeps_what_fresnel_has_of_diffuse_light() -> None:
    """Against water's internal reflectance, averaged over the half sphere, weighted by the
    cosine."""
    cosine = np.sqrt((np.arange(200_000) + 0.5) / 200_000)
    assert pytest.approx(reflected(1.0 / 1.333, cosine).mean(), abs=2e-3) == FILM_REFLECTANCE


def test_wet_colour_is_that_of_light_followed_through_the_film() -> None:
    """Against a series: hair reflects the fraction c of its light; the film lets some of that out
    and reflects the rest back into the hair."""
    color = np.array([[0.02, 0.2, 0.5], [0.9, 0.99, 1e-4]])
    light, out = np.ones(color.shape), np.zeros(color.shape)
    for _ in range(2000):
        light = light * color
        out, light = out + light * (1.0 - FILM_REFLECTANCE), light * FILM_REFLECTANCE
    np.testing.assert_allclose(wet_and_dusty_color(color, WET), out, rtol=1e-9)


def test_wet_hair_is_darker_and_more_saturated_but_white_stays_white() -> None:
    brown = np.array([0.3, 0.15, 0.07])
    wet = wet_and_dusty_color(brown, WET)
    assert (wet < brown).all()
    assert wet[0] / wet[2] > 1.1 * brown[0] / brown[2]
    assert wet_and_dusty_color(np.ones(3), WET) == pytest.approx(1.0)


def test_dust_has_its_colour_and_water_darkens_that_too() -> None:
    black = np.full(3, 0.01)
    whole = replace(DRY, dust=1.0)
    np.testing.assert_allclose(wet_and_dusty_color(black, whole), DRY.dust_color)
    assert (wet_and_dusty_color(black, replace(whole, wetness=1.0)) < DRY.dust_color).all()


@pytest.mark.parametrize(
    ("model", "fraction", "off"),
    [("kajiya_kay", 0.5, 0.007), ("kajiya_kay", 1.0, 0.007), ("marschner", 0.5, 0.06)],
)
def test_dust_covers_grey_strands_too(model: str, fraction: float, off: float) -> None:
    """The mean colour of all strands approaches dust's as dust covers them; under full dust no
    strand stays grey."""
    dry = replace(DRY, model=model, grey_fraction=fraction, color_variation=0.0, tip_tint=0.0)
    for dust in (0.0, 0.1, 0.5, 0.9, 1.0):
        drawn = strand_colors(SEEDS, ROOT, wet_and_dusty_look(replace(dry, dust=dust)))
        expected = wet_and_dusty_color(strand_colors(SEEDS, ROOT, dry), replace(DRY, dust=dust))
        np.testing.assert_allclose(drawn.mean(axis=0), expected.mean(axis=0), atol=off)
    np.testing.assert_allclose(drawn, np.broadcast_to(DRY.dust_color, drawn.shape), atol=1e-6)


def test_hair_without_either_is_the_same_object() -> None:
    color = np.ones((4, 3), np.float32)
    assert wet_and_dusty_look(DRY) is DRY
    assert wet_and_dusty_color(color, DRY) is color


def test_a_look_in_water_has_the_colour_of_wet_hair_and_the_highlight_of_a_film() -> None:
    for dry in (DRY, replace(DRY, pigment="melanin", melanin=0.4)):
        wet = wet_and_dusty_look(replace(dry, wetness=1.0))
        expected = wet_and_dusty_color(look_color(dry), replace(dry, wetness=1.0))
        np.testing.assert_allclose(look_color(wet), expected, rtol=1e-5)
        assert wet.width_r == pytest.approx(FILM_WIDTH)
        assert fibre_of(wet).highlight_shifts[0] == pytest.approx(0.0, abs=1e-9)
        assert wet.width_tt < 0.5 * dry.width_tt
    half = wet_and_dusty_look(replace(DRY, wetness=0.5))
    assert FILM_WIDTH < half.width_r < DRY.width_r


def test_a_look_in_dust_is_dull() -> None:
    dusty = wet_and_dusty_look(DUSTY)
    assert dusty.strength_r == pytest.approx(0.4 * DRY.strength_r)
    assert dusty.width_r > 2.0 * DRY.width_r


def half_width(exponent: float) -> float:
    """Half width at half maximum of Kajiya-Kay's highlight [rad]."""
    angle = np.linspace(0.0, 1.5, 15001)
    half_vectors = np.stack([np.sin(angle), np.cos(angle), 0.0 * angle], axis=-1)
    left = strand_specular(np.array([1.0, 0.0, 0.0]), half_vectors, exponent)
    return float(angle[np.argmax(left < 0.5)])


def test_kajiya_kays_highlights_lie_and_widen_as_marschners_do() -> None:
    dusty, wet = wet_and_dusty_look(DUSTY), wet_and_dusty_look(WET)
    wider = dusty.width_r / DRY.width_r
    for name in ("primary_exponent", "secondary_exponent"):
        before, after = (half_width(getattr(look, name)) for look in (DRY, dusty))
        assert after / before == pytest.approx(wider, rel=0.06), name
    assert DRY.primary_shift != 0.0 == wet.primary_shift
    assert wet.secondary_shift == DRY.secondary_shift


def test_colours_that_are_missing_stay_so() -> None:
    found = wet_and_dusty_color(np.array([[np.nan] * 3, [0.2] * 3], np.float32), WET)
    assert np.isnan(found[0]).all()
    assert found.dtype == np.float32


@pytest.mark.parametrize("amounts", [(1.0, 1.0), (0.0, 1.0), (1.0, 0.0)])
def test_extremes_are_settings(amounts: tuple[float, float]) -> None:
    widest = ShadingSettings(
        wetness=amounts[0],
        dust=amounts[1],
        width_r=float(np.radians(60.0)),
        width_tt=float(np.radians(60.0)),
        primary_exponent=1.0,
        cuticle_tilt=float(np.radians(30.0)),
        offset_r=float(np.radians(-45.0)),
        base_color=(0.0, 1.0, 0.0),
    )
    wet_and_dusty_look(widest)
