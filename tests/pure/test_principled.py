"""Conversion from the inputs of a Principled Hair node to our settings, and back."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hairloom.addon.parameters import ALL_SETTINGS
from hairloom.addon.params.preset import read_any_preset
from hairloom.addon.shading.marschner.look import root_absorption
from hairloom.addon.shading.marschner.pigment import (
    color_absorption,
    melanin_absorption,
    roughness_widths,
)
from hairloom.addon.shading.marschner.principled import (
    PrincipledHair,
    azimuthal_width,
    hair_from,
    settings_from,
)
from hairloom.addon.shading.settings import ShadingSettings

LOOKS = Path(__file__).parents[2] / "presets" / "looks"


@pytest.mark.parametrize("radial", [0.05, 0.3, 0.6])
@pytest.mark.parametrize("color", [(0.2, 0.1, 0.05), (0.9, 0.5, 0.02)])
def test_a_colour_absorbs_as_in_cycles_whatever_the_radial_roughness(
    color: tuple[float, float, float], radial: float
) -> None:
    settings, notes = settings_from(PrincipledHair(color=color, radial_roughness=radial))
    assert (settings.model, settings.pigment, notes) == ("marschner", "color", ())
    expected = color_absorption(np.array(color), radial)
    assert root_absorption(settings) == pytest.approx(expected, rel=1e-3)


def test_melanin_is_taken_over_as_it_is_with_its_variation() -> None:
    hair = PrincipledHair(
        parametrization="MELANIN", melanin=0.4, melanin_redness=0.7, random_color=0.2
    )
    settings, notes = settings_from(hair)
    assert (settings.pigment, settings.melanin, settings.redness) == ("melanin", 0.4, 0.7)
    assert settings.color_variation == 0.2
    assert notes == ()


def test_a_tint_adds_to_the_melanin() -> None:
    tint = (0.8, 0.2, 0.3)
    hair = PrincipledHair(parametrization="MELANIN", melanin=0.4, melanin_redness=0.7, tint=tint)
    settings, (note,) = settings_from(hair)
    expected = melanin_absorption(0.4, 0.7) + color_absorption(np.array(tint))
    assert settings.pigment == "absorption" and "Tint" in note
    assert root_absorption(settings) == pytest.approx(expected)


def test_an_absorption_is_taken_over_as_it_is() -> None:
    hair = PrincipledHair(parametrization="ABSORPTION", absorption_coefficient=(0.1, 0.5, 2.0))
    settings, notes = settings_from(hair)
    assert settings.pigment == "absorption" and notes == ()
    assert settings.absorption == pytest.approx((0.1, 0.5, 2.0))
    assert settings.base_color == pytest.approx((0.1553, 0.0155, 0.0002), abs=1e-3)


def test_roughness_makes_the_widths_and_a_coat_the_first_highlight_narrower() -> None:
    plain, _ = settings_from(PrincipledHair(roughness=0.4))
    coated, notes = settings_from(PrincipledHair(roughness=0.4, coat=0.5))
    widths = (plain.width_r, plain.width_tt, plain.width_trt)
    assert widths == pytest.approx(roughness_widths(0.4))
    assert coated.width_r == pytest.approx(roughness_widths(0.2)[0])
    assert (coated.width_tt, coated.width_trt) == (plain.width_tt, plain.width_trt)
    assert notes == ()


def test_the_width_around_is_that_of_the_gaussian_nearest_to_chiangs_logistic() -> None:
    scale = np.sqrt(np.pi / 8.0) * (0.265 * 0.3 + 1.194 * 0.3**2 + 5.372 * 0.3**22)
    place = np.linspace(-6.0, 6.0, 2001)
    logistic = 1.0 / (1.0 + np.exp(-place))
    widths = np.linspace(1.5, 1.9, 401)
    apart = [
        np.abs([0.5 + 0.5 * math.erf(x / (width * math.sqrt(2.0))) for x in place] - logistic).max()
        for width in widths
    ]
    nearest = scale * widths[int(np.argmin(apart))]
    assert azimuthal_width(0.3) == pytest.approx(nearest, rel=2e-3)
    settings, _ = settings_from(PrincipledHair(radial_roughness=0.3))
    assert settings.azimuthal_width == pytest.approx(nearest, rel=2e-3)


def test_the_offset_is_the_tilt() -> None:
    """The sign was measured against Cycles: in both, a positive offset moves the first highlight
    towards the tip."""
    before = ShadingSettings(offset_r=0.1, offset_trt=-0.1)
    settings, _ = settings_from(PrincipledHair(offset=0.07), before)
    assert settings.cuticle_tilt == pytest.approx(0.07)
    assert (settings.offset_r, settings.offset_tt, settings.offset_trt) == (0.0, 0.0, 0.0)


def test_huangs_lobes_and_cross_section_are_taken_over_with_a_note() -> None:
    hair = PrincipledHair(
        model="HUANG", aspect_ratio=0.7, reflection=0.5, transmission=0.25, secondary_reflection=2.0
    )
    settings, (note,) = settings_from(hair)
    assert "Huang" in note
    assert settings.eccentricity == 0.7
    assert (settings.strength_r, settings.strength_tt, settings.strength_trt) == (0.5, 0.25, 2.0)


def test_what_the_node_does_not_speak_of_stays_and_tips_and_grey_strands_go() -> None:
    before = ShadingSettings(sparkle=0.1, fake_scattering=0.4, tip_tint=1.0, grey_fraction=0.5)
    settings, _ = settings_from(PrincipledHair(), before)
    assert (settings.sparkle, settings.fake_scattering) == (0.1, 0.4)
    assert (settings.tip_tint, settings.grey_fraction) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("hair", "named"),
    [
        (PrincipledHair(ior=900.0), "IOR"),
        (PrincipledHair(ior=0.2), "IOR"),
        (PrincipledHair(offset=1.5), "Separation"),
        (PrincipledHair(radial_roughness=1.0), "Width Around"),
        (PrincipledHair(roughness=1.0), "Width"),
        (
            PrincipledHair(parametrization="ABSORPTION", absorption_coefficient=(1000.0, 0.0, 0.0)),
            "Absorption",
        ),
        (PrincipledHair(random_roughness=0.5), "Random Roughness"),
        (PrincipledHair(model="HUANG", aspect_ratio=0.01), "Eccentricity"),
    ],
)
def test_what_lies_beyond_our_ranges_is_taken_into_them_and_reported(
    hair: PrincipledHair, named: str
) -> None:
    _, notes = settings_from(hair)
    assert any(named in note for note in notes)


def test_colours_outside_the_range_of_hair_are_finite() -> None:
    for color in ((0.0, 0.0, 0.0), (7.0, 1.0, -1.0)):
        settings, _ = settings_from(PrincipledHair(color=color))
        assert np.isfinite(root_absorption(settings)).all()


@pytest.mark.parametrize(
    "hair",
    [
        PrincipledHair(color=(0.2, 0.1, 0.05), radial_roughness=0.5),
        PrincipledHair(parametrization="MELANIN", melanin=0.4, random_color=0.2, roughness=0.15),
        PrincipledHair(parametrization="ABSORPTION", absorption_coefficient=(0.1, 0.5, 2.0)),
        PrincipledHair(color=(0.4, 0.2, 0.1), coat=0.4, offset=0.05, ior=1.4, roughness=0.6),
        PrincipledHair(
            color=(0.4, 0.2, 0.1), model="HUANG", aspect_ratio=0.8, transmission=0.5, roughness=0.4
        ),
    ],
)
def test_a_node_that_became_a_look_becomes_the_same_node(hair: PrincipledHair) -> None:
    found, _ = hair_from(settings_from(hair)[0])
    names = {"model", "parametrization", "roughness", "ior", "offset", "aspect_ratio"}
    names |= {"reflection", "transmission", "secondary_reflection"}
    names |= {"radial_roughness", "coat"} if hair.model == "CHIANG" else set()
    names |= {
        "COLOR": {"color"},
        "MELANIN": {"melanin", "melanin_redness", "random_color"},
        "ABSORPTION": {"absorption_coefficient"},
    }[hair.parametrization]
    for name in names:
        expected = getattr(hair, name)
        if name == "aspect_ratio" and hair.model == "CHIANG":
            continue
        value = getattr(found, name)
        assert value == (
            expected if isinstance(expected, str) else pytest.approx(expected, rel=2e-3)
        ), name


def test_the_highlights_of_kajiya_kay_are_as_wide_as_those_of_the_node() -> None:
    look = ShadingSettings(model="kajiya_kay", primary_exponent=200.0, secondary_exponent=30.0)
    hair, (note,) = hair_from(look)
    again, _ = settings_from(hair)
    angle = np.linspace(0.0, 0.15, 9)
    for exponent, width in ((200.0, again.width_r), (30.0, again.width_trt)):
        np.testing.assert_allclose(
            np.cos(angle) ** exponent, np.exp(-0.5 * (angle / width) ** 2), atol=0.01
        )
    assert again.base_color == pytest.approx(look.base_color, rel=1e-3)
    assert "Kajiya-Kay" in note


def test_what_the_node_cannot_do_is_said() -> None:
    uneven = ShadingSettings(width_tt=math.radians(1.0), width_trt=math.radians(20.0))
    assert any("one Roughness" in note for note in hair_from(uneven)[1])
    assert any("offsets" in note for note in hair_from(ShadingSettings(offset_trt=0.1))[1])
    strong, notes = hair_from(ShadingSettings(strength_trt=1.5))
    assert strong.model == "CHIANG" and any("Strength were set to 1" in note for note in notes)
    weak, notes = hair_from(ShadingSettings(strength_r=1.5, strength_tt=0.4))
    assert weak.model == "HUANG" and (weak.reflection, weak.transmission) == (1.0, 0.4)
    assert any("lowered to 1" in note for note in notes)
    assert hair_from(ShadingSettings())[1] == ()


def test_a_stronger_first_highlight_is_a_higher_index_of_refraction() -> None:
    """Against Fresnel's formula at normal incidence. In Cycles nothing else sets the strength of
    Chiang's first highlight."""

    def reflectance(index: float) -> float:
        return ((index - 1.0) / (index + 1.0)) ** 2

    before = ShadingSettings(index_of_refraction=1.55, strength_r=1.3)
    hair, notes = hair_from(before)
    assert hair.model == "CHIANG" and notes == ()
    assert reflectance(hair.ior) == pytest.approx(1.3 * reflectance(1.55))


@pytest.mark.parametrize("path", sorted(LOOKS.glob("*.json")), ids=lambda path: path.stem)
def test_no_look_that_ships_needs_huangs_model(path: Path) -> None:
    """Huang's hair in Cycles is a third darker than our pictures; Chiang's is as bright."""
    assert hair_from(read_any_preset(path, ALL_SETTINGS).settings)[0].model == "CHIANG"
