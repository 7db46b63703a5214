"""Width and colour of strands for bakes, against those with which strands are drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.shading.card_look import DARKEST, card_base, own_absorption
from hairloom.addon.shading.drawn_strands import (
    brightest_look,
    drawn_color,
    drawn_radius,
    look_color,
    mean_look,
    own_colors,
    strand_variation,
)
from hairloom.addon.shading.kajiya_kay import GREY_COLOR, strand_base
from hairloom.addon.shading.marschner.look import strand_absorption
from hairloom.addon.shading.settings import ShadingSettings, StrandSettings
from hairloom.addon.shading.strand_noise import strand_noise
from hairloom.addon.strands.face import BROWS, LASHES

BROWN = (0.4, 0.25, 0.15)


def test_radii_are_scaled_and_taper_evenly() -> None:
    radius = drawn_radius(np.full((2, 5), 1e-4), StrandSettings(fullness=3.0, tip_width=0.2))
    np.testing.assert_allclose(radius, np.tile([3e-4, 2.4e-4, 1.8e-4, 1.2e-4, 0.6e-4], (2, 1)))


@pytest.mark.parametrize("model", ["kajiya_kay", "marschner"])
def test_strands_vary_about_the_mean(model: str) -> None:
    """Around 1 if the colour itself varies; a little above if its absorption varies."""
    shading = ShadingSettings(model=model, base_color=BROWN, color_variation=0.5)
    factor = strand_variation(np.arange(4000), 6, shading)
    assert factor.shape == (4000, 6, 3)
    assert factor.mean() == pytest.approx(1.0, abs=0.01 if model == "kajiya_kay" else 0.05)
    if model == "kajiya_kay":
        assert factor.min() == pytest.approx(0.5, abs=0.01)
        assert factor.max() == pytest.approx(1.5, abs=0.01)
    even = ShadingSettings(model=model, base_color=BROWN, color_variation=0.0, tip_tint=0.7)
    np.testing.assert_allclose(strand_variation(np.arange(9), 6, even), 1.0, rtol=1e-5)


def test_grey_strands_are_grey_on_the_card_as_well() -> None:
    shading = ShadingSettings(
        model="kajiya_kay", base_color=BROWN, color_variation=0.0, grey_fraction=0.25
    )
    factor = strand_variation(np.arange(4000), 3, shading)
    colors = factor * card_base(np.linspace(0.0, 1.0, 3), shading)
    is_grey = np.isclose(colors, GREY_COLOR, rtol=1e-4).all(axis=(1, 2))
    assert is_grey.mean() == pytest.approx(0.25, abs=0.03)
    np.testing.assert_allclose(colors[~is_grey], np.broadcast_to(BROWN, colors[~is_grey].shape))


@pytest.mark.parametrize("model", ["kajiya_kay", "marschner"])
def test_grey_on_black_hair_stays_within_bounds(model: str) -> None:
    shading = ShadingSettings(model=model, base_color=(0.0, 0.0, 0.0), grey_fraction=0.01)
    factor = strand_variation(np.arange(1000), 3, shading)
    assert np.isfinite(factor).all()
    assert 0.0 <= factor.min() <= factor.max() == 4.0


def test_a_base_texture_gives_strands_their_own_absorption() -> None:
    """The mean absorption of the card and the colour factor of a strand give the strand's own
    absorption."""
    shading = ShadingSettings(
        model="marschner", base_color=BROWN, tip_tint=0.8, color_variation=0.5, grey_fraction=0.2
    )
    seeds, along = np.arange(200), np.linspace(0.0, 1.0, 6)[None, :]
    noises = [strand_noise(seeds, channel, np.zeros(1))[:, None] for channel in (2, 3)]
    own = strand_absorption(shading, along, *noises)
    half = np.full_like(along, 0.5)
    colored, grey = (strand_absorption(shading, along, half, half + s) for s in (1.0, -1.0))
    mean = colored + (grey - colored) * shading.grey_fraction
    base = strand_variation(seeds, 6, shading)
    is_bounded = base < 4.0
    assert is_bounded.mean() > 0.75
    found = own_absorption(np.broadcast_to(mean, own.shape), base)
    np.testing.assert_allclose(found[is_bounded], own[is_bounded], rtol=1e-4)


def test_absorption_of_black_and_of_more_than_white_stays_within_bounds() -> None:
    black = own_absorption(np.full(3, 0.5), np.zeros(3))
    assert np.isfinite(black).all()
    np.testing.assert_array_equal(black, own_absorption(np.full(3, 0.5), np.full(3, DARKEST)))
    np.testing.assert_array_equal(own_absorption(np.full(3, 0.01), np.full(3, 4.0)), 0.0)


RED, BLUE, GREEN = (0.8, 0.02, 0.03), (0.01, 0.05, 0.6), (0.02, 0.4, 0.05)


@pytest.mark.parametrize("model", ["kajiya_kay", "marschner"])
def test_a_card_has_the_own_colours_of_its_strands(model: str) -> None:
    """Its look times the factor is each strand's colour, or the look's if the strand has none."""
    shading = ShadingSettings(
        model=model, pigment="melanin", base_color=BROWN, color_variation=0.0, tip_tint=0.0
    )
    color = np.repeat([RED, BLUE, (np.nan,) * 3, RED], 5, axis=0).reshape(4, 5, 3)
    factor = strand_variation(np.arange(4), 5, shading, color)
    card = brightest_look(color, shading)
    expected = np.where(np.isnan(color), look_color(shading), color)
    np.testing.assert_allclose(factor * np.array(card.base_color), expected, rtol=1e-4)
    assert factor.max() <= 1.0 + 1e-5, "an atlas of 8 bits holds it whole"
    if model == "kajiya_kay":
        assert look_color(shading) == pytest.approx(BROWN)
    else:
        assert look_color(shading) != pytest.approx(BROWN), "its pigment is melanin"
    mean = mean_look(color, shading).base_color
    assert mean == pytest.approx(expected.mean(axis=(0, 1)))


def test_color_source_look_ignores_own_colors() -> None:
    shading = ShadingSettings(base_color=BROWN, color_source="look")
    color = np.broadcast_to(RED, (9, 6, 3))
    plain = strand_variation(np.arange(9), 6, shading)
    np.testing.assert_array_equal(strand_variation(np.arange(9), 6, shading, color), plain)
    assert drawn_color(color, shading) is None
    assert mean_look(color, shading) is brightest_look(color, shading) is shading


@pytest.mark.parametrize("model", ["kajiya_kay", "marschner"])
def test_dye_leaves_natural_brows_as_they_are(model: str) -> None:
    """Also at their tips; by default brows have the look's colour as all hair has."""
    dyed = ShadingSettings(
        model=model, base_color=RED, tip_color=BLUE, tip_tint=1.0, color_variation=0.0
    )
    natural = replace(dyed, brow_source="natural", brow_color=BROWN)
    group = np.array([0, BROWS, LASHES, 7])
    seeds = np.arange(4)
    plain = strand_variation(seeds, 6, dyed)
    np.testing.assert_array_equal(strand_variation(seeds, 6, dyed, None, group), plain)
    found = strand_variation(seeds, 6, natural, None, group)
    np.testing.assert_array_equal(found[[0, 3]], plain[[0, 3]])
    assert own_colors(None, np.repeat(group[:, None], 6, axis=1), dyed) is None
    # the factor times the card's mean, which is dyed, is brown everywhere, up to its bound
    if model == "kajiya_kay":
        tints = found[1] / plain[1]
        dye = strand_base(np.linspace(0, 1, 6), np.full(6, 0.5), np.ones(6), dyed)
        is_bounded = found[1] < 4.0
        np.testing.assert_allclose((tints * dye)[is_bounded], np.tile(BROWN, (6, 1))[is_bounded])
    own = own_colors(None, np.repeat(group[:, None], 6, axis=1), natural)
    assert own is not None
    assert np.isnan(own[[0, 3]]).all()
    np.testing.assert_allclose(own[[1, 2]], np.broadcast_to(BROWN, (2, 6, 3)), rtol=1e-6)
    kept = np.broadcast_to(np.float32(GREEN), (4, 6, 3))
    found = own_colors(kept, np.repeat(group[:, None], 6, axis=1), natural)
    np.testing.assert_array_equal(found, kept)
