"""From settings to light: pigment, tints, grey strands, noise, and the ends of every range."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.shading.marschner.fibre import Fibre
from hairloom.addon.shading.marschner.look import (
    GREY_ABSORPTION,
    fibre_of,
    marschner_light,
    pack_fibre,
    scattered_color,
    strand_absorption,
    strand_color,
)
from hairloom.addon.shading.marschner.pigment import color_absorption, melanin_absorption
from hairloom.addon.shading.marschner.tables import MarschnerTables, marschner_tables
from hairloom.addon.shading.settings import ShadingSettings
from hairloom.addon.shading.tint import tip_fraction

ALONG = np.linspace(0.0, 1.0, 101)
HALF = np.full(101, 0.5)
PLAIN = ShadingSettings(color_variation=0.0)


@pytest.fixture(scope="module")
def tables() -> MarschnerTables:
    return marschner_tables(fibre_of(ShadingSettings()), 64)


def light(tables: MarschnerTables, settings: ShadingSettings, count: int = 300) -> Floats:
    """Light from random strands, with random directions to light and eye."""
    random = np.random.default_rng(4)
    directions = random.normal(size=(4, count, 3))
    tangent, normal, to_light, to_eye = directions / np.linalg.norm(directions, axis=-1)[..., None]
    along, color, grey, shift, sparkle = random.random((5, count))
    absorption = strand_absorption(settings, along, color, grey)
    ways = (tangent, normal, to_light, to_eye)
    return marschner_light(tables, *ways, shift, sparkle, absorption, settings)


def test_pigment_says_what_absorbs() -> None:
    by_color = replace(PLAIN, pigment="color", base_color=(0.3, 0.2, 0.1))
    assert fibre_of(by_color).absorption == pytest.approx(
        color_absorption(np.array([0.3, 0.2, 0.1]))
    )
    by_melanin = replace(PLAIN, pigment="melanin", melanin=0.4, redness=0.6)
    assert fibre_of(by_melanin).absorption == pytest.approx(melanin_absorption(0.4, 0.6))
    outright = replace(PLAIN, pigment="absorption", absorption=(0.1, 0.2, 0.3))
    assert fibre_of(outright).absorption == pytest.approx((0.1, 0.2, 0.3))
    for settings in (by_color, by_melanin, outright):
        at_root = strand_absorption(settings, np.array(0.0), np.array(0.5), np.array(0.5))
        assert at_root == pytest.approx(fibre_of(settings).absorption)


def test_the_fibre_has_all_that_the_settings_share_with_it() -> None:
    odd = {
        name: getattr(ShadingSettings(), name) * 1.5 + 0.01
        for name in Fibre.__dataclass_fields__
        if name not in ("absorption", "glint_fade")
    }
    fibre = fibre_of(replace(ShadingSettings(), **odd))
    assert {name: getattr(fibre, name) for name in odd} == odd


def test_tips_turn_from_the_roots_pigment_to_their_own() -> None:
    settings = replace(PLAIN, pigment="melanin", tip_tint=0.7, tint_start=0.2, tint_end=0.8)
    found = strand_absorption(settings, ALONG, HALF, HALF)
    root = np.array(fibre_of(settings).absorption)
    tip = color_absorption(np.array(settings.tip_color))
    assert found[ALONG <= 0.2] == pytest.approx(np.broadcast_to(root, found[ALONG <= 0.2].shape))
    assert found[-1] == pytest.approx(root + 0.7 * (tip - root))
    assert (np.diff(found, axis=0) * np.sign(tip - root) >= 0.0).all()
    assert found[50] == pytest.approx(root + 0.35 * (tip - root))


@pytest.mark.parametrize(("start", "end"), [(0.5, 0.5), (0.7, 0.2), (0.0, 0.0), (1.0, 0.0)])
def test_a_tint_that_ends_where_it_begins_is_a_step(start: float, end: float) -> None:
    settings = replace(PLAIN, tip_tint=1.0, tint_start=start, tint_end=end)
    between = ALONG[:-1] + 0.005
    assert tip_fraction(between, settings).tolist() == np.where(between > start, 1.0, 0.0).tolist()


def test_strands_differ_in_pigment_and_the_grey_ones_have_hardly_any() -> None:
    settings = replace(PLAIN, color_variation=0.5, grey_fraction=0.25)
    noise = np.linspace(0.0, 1.0, 11)
    found = strand_absorption(settings, np.zeros(11), noise, np.ones(11))
    assert (np.diff(found, axis=0) < 0.0).all()  # more noise is brighter, as with Kajiya-Kay
    root = np.array(fibre_of(settings).absorption)
    assert found[[0, 5, 10]] == pytest.approx(np.outer([1.5, 1.0, 0.5], root))
    grey = strand_absorption(settings, np.zeros(11), np.full(11, 0.5), noise)
    neutral = np.full(3, GREY_ABSORPTION * root.mean())
    assert grey == pytest.approx(np.where((noise < 0.25)[:, None], neutral, root))
    assert strand_color(grey[0]).min() > 0.4
    none, everyone = replace(settings, grey_fraction=0.0), replace(settings, grey_fraction=1.0)
    lowest, highest = np.array(0.0), np.array(1.0 - 2.0**-24)
    at = (np.array(0.0), np.array(0.5))
    assert strand_absorption(none, *at, lowest) == pytest.approx(root)
    assert strand_absorption(everyone, *at, highest) == pytest.approx(neutral)


def test_more_pigment_is_never_brighter(tables: MarschnerTables) -> None:
    amounts = [light(tables, replace(PLAIN, pigment="melanin", melanin=m)) for m in (0.1, 0.5, 0.9)]
    assert (np.diff(amounts, axis=0) <= 1e-9).all()
    assert (amounts[0] > 1.5 * amounts[2]).mean() > 0.5


def test_color_of_a_mass_is_the_color_asked_for() -> None:
    settings = replace(PLAIN, base_color=(0.4, 0.2, 0.05))
    root = strand_absorption(settings, np.array(0.0), np.array(0.5), np.array(0.5))
    assert strand_color(root) == pytest.approx((0.4, 0.2, 0.05))


def test_light_hangs_linearly_on_each_strength(tables: MarschnerTables) -> None:
    names = ("strength_r", "strength_tt", "strength_trt", "strength_higher", "fake_scattering")
    dark = replace(ShadingSettings(), **dict.fromkeys(names, 0.0))
    assert (light(tables, dark) == 0.0).all()
    parts = [light(tables, replace(dark, **{name: 1.0})) for name in names]
    whole = light(tables, replace(dark, **dict.fromkeys(names, 1.0)))
    assert all(part.max() > 0.0 for part in parts)
    assert np.sum(parts, axis=0) == pytest.approx(whole, rel=1e-9, abs=1e-12)
    trt = replace(dark, strength_trt=2.0)
    assert (
        light(tables, replace(trt, sparkle=1.0)) <= light(tables, replace(trt, sparkle=0.0))
    ).all()


def test_the_side_away_from_the_light_is_in_the_dark(tables: MarschnerTables) -> None:
    x, _, z = np.eye(3)
    ways = (z, x, x)  # tangent, to the light, to the eye
    absorption, half = np.array([0.2, 0.3, 0.5]), np.array(0.5)

    def seen(normal: Floats, settings: ShadingSettings) -> Floats:
        return marschner_light(
            tables, ways[0], normal, ways[1], ways[2], half, half, absorption, settings
        )

    settings = ShadingSettings(shift_noise=0.0, fake_scattering=0.0)
    assert (seen(-x, settings) == 0.0).all()
    bare = replace(settings, volume_shadow=0.0)
    assert seen(-x, bare) == pytest.approx(seen(x, bare))
    assert seen(x, bare) == pytest.approx(seen(x, settings))
    only_scattered = replace(
        settings,
        fake_scattering=1.0,
        **dict.fromkeys(("strength_r", "strength_tt", "strength_trt", "strength_higher"), 0.0),
    )
    assert seen(x, only_scattered) == pytest.approx(scattered_color(absorption) / np.pi)


def test_the_packed_fibre_is_what_the_struct_says() -> None:
    settings = replace(PLAIN, strength_tt=0.5, strength_higher=2.0)
    packed = pack_fibre(settings)
    assert packed.dtype == np.float32 and packed.shape == (20,)
    assert packed[:3] == pytest.approx(fibre_of(settings).absorption)
    assert np.exp(-np.sqrt(packed[:3]) * packed[3]) == pytest.approx(settings.base_color, rel=1e-5)
    assert packed[4:7] == pytest.approx(color_absorption(np.array(settings.tip_color)))
    assert packed[7] == pytest.approx(GREY_ABSORPTION)
    assert packed[8:12] == pytest.approx([1.0, 0.5, 1.0, 2.0])
    assert packed[12:16] == pytest.approx(fibre_of(settings).lobe_widths)
    assert packed[16:] == pytest.approx(fibre_of(settings).lobe_shifts)


def ends() -> list[tuple[str, object]]:
    """Each parameter at both ends of its hard range, or at each of its choices."""
    found: list[tuple[str, object]] = []
    for parameter in ShadingSettings.parameters():
        found += [(parameter.name, identifier) for identifier, _, _ in parameter.choices]
        for end in parameter.hard_range or ():
            found.append((parameter.name, (end,) * 3 if parameter.kind == "color" else end))
    return found


@pytest.mark.alike
@pytest.mark.parametrize(("name", "value"), ends())
def test_no_end_of_a_range_gives_anything_but_numbers(name: str, value: object) -> None:
    for pigment in ("color", "melanin", "absorption"):
        settings = ShadingSettings(tip_tint=0.5, grey_fraction=0.3, pigment=pigment)
        settings = replace(settings, **{name: value})
        found = light(marschner_tables(fibre_of(settings), 24), settings, 60)
        assert np.isfinite(found).all() and (found >= 0.0).all()
        assert np.isfinite(pack_fibre(settings)).all()
