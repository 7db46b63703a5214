"""Shafts from bright regions: their threshold, their centres, and the light that is added."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.render.camera import orthographic, perspective
from hairloom.addon.shading.bright_shafts import (
    BRIGHTEST,
    KNEE,
    BrightRegions,
    bright_cells,
    bright_part,
    bright_regions,
    bright_shafts,
    wants_bright,
)
from hairloom.addon.shading.shafts import shaft_length
from hairloom.addon.shading.shafts_settings import ShaftSettings

WIDTH, HEIGHT = 160, 120
ON = ShaftSettings(use_shafts=True, source="bright", bright_strength=0.5)
LENGTH = 30.0


def black() -> np.ndarray:
    return np.zeros((HEIGHT, WIDTH, 4))


def window(*corners: int, light: float = 5.0) -> np.ndarray:
    """A dark picture with a bright rectangle; corners: bottom, top, left, right."""
    picture = np.full((HEIGHT, WIDTH, 4), 0.1)
    bottom, top, left, right = corners or (40, 80, 60, 100)
    picture[bottom:top, left:right, :3] = light
    return picture


def added(seen: np.ndarray, settings: ShaftSettings = ON) -> np.ndarray:
    height, width = seen.shape[:2]
    picture = np.zeros((height, width, 4))
    return bright_shafts(picture, seen, LENGTH, settings)[0]


def regions_of(seen: np.ndarray) -> BrightRegions:
    height, width = seen.shape[:2]
    return bright_regions(bright_cells(bright_part(seen, 1.0)), width, height)


def test_the_bright_part_is_that_of_the_formula() -> None:
    """Nothing up to the threshold, half of the excess one knee above it, nearly all far above."""
    grey = np.array([0.0, 0.999, 1.0, 1.5, 11.0])[:, None] * np.ones(3)
    kept = bright_part(grey, 1.0)
    assert kept[:, 0] == pytest.approx([0.0, 0.0, 0.0, 0.25, 100.0 / 10.5])
    assert kept[:, 3] == pytest.approx([0.0, 0.0, 0.0, 1.0, 1.0])
    assert KNEE == 0.5
    assert bright_part(grey, 0.0)[:, 0] == pytest.approx(grey[:, 0])


def test_brightness_begins_softly_and_keeps_its_colour() -> None:
    grey = np.linspace(0.9, 1.3, 401)[:, None] * np.array([1.0, 0.8, 0.5])
    luminance = bright_part(grey, 1.0)[:, :3] @ np.array([0.2126, 0.7152, 0.0722])
    slope = np.diff(luminance) / 0.001
    assert slope.max() < 1.0 and np.abs(np.diff(slope)).max() < 0.02
    kept = bright_part(np.array([4.0, 2.0, 1.0]), 1.0)
    assert kept[:3] / kept[0] == pytest.approx([1.0, 0.5, 0.25])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e6, 3e38, -5.0])
def test_broken_pixels_harm_nothing(value: float) -> None:
    seen = window()
    seen[10, 10, :3], seen[60, 80, 1] = value, value
    found = added(seen)
    assert np.isfinite(found).all()
    assert found.max() <= ON.bright_strength * BRIGHTEST / 0.0722
    assert found[60, 110, 0] == pytest.approx(added(window())[60, 110, 0], rel=0.6)


def test_one_window_is_one_region_around_its_middle() -> None:
    found = regions_of(window())
    assert len(found.regions) == 1 and found.scale == 1.0
    assert found.regions[0].center == pytest.approx((80.0, 60.0), abs=0.5)


def test_a_head_before_a_window_leaves_it_one_region() -> None:
    seen = window(20, 100, 30, 130)
    seen[:85, 65:95, :3] = 0.0
    found = regions_of(seen)
    assert len(found.regions) == 1
    assert found.regions[0].center == pytest.approx((80.0, 64.0), abs=6.0)


def test_two_windows_far_apart_each_throw_their_own() -> None:
    seen = np.maximum(window(50, 70, 10, 26), window(50, 70, 134, 150))
    found = regions_of(seen)
    assert sorted(round(each.center[0]) for each in found.regions) == [18, 142]
    light = added(seen)[..., 0]
    # each window shines towards the other
    assert light[60, 30] > 0.1 and light[60, 130] > 0.1
    assert np.abs(light - light[:, ::-1]).max() < 0.02


def test_all_that_is_bright_belongs_to_regions_in_full() -> None:
    random = np.random.default_rng(4)
    seen = np.where(random.random((HEIGHT, WIDTH, 1)) < 0.1, 9.0 * random.random(3), 0.0)
    fractions = [each.weights for each in regions_of(seen).regions]
    assert len(fractions) <= 6
    assert (np.sum(fractions, axis=0) == 1.0).all()


def test_light_that_moves_moves_its_shafts_without_a_jump() -> None:
    """The centre of a window that crosses the lattice pixel by pixel moves continuously."""
    before = None
    for left in range(20, 60, 1):
        now = np.array(regions_of(window(50, 70, left, left + 30)).regions[0].center)
        assert now == pytest.approx((left + 15.0, 60.0), abs=0.2)
        assert before is None or np.hypot(*(now - before)) < 1.3
        before = now


def test_beside_a_window_its_light_falls_by_the_formula() -> None:
    """On a line from its middle outwards; the edge is 20 pixels away."""
    light = added(window())[60, 80:, 0] / (ON.bright_strength * (16.0 / 4.5))
    radius = np.arange(80) + 0.5
    inside = -np.expm1(-np.minimum(radius, 20.0) / LENGTH)
    expected = inside * np.exp(-np.maximum(radius - 20.0, 0.0) / LENGTH)
    expected /= -np.expm1(-radius / LENGTH)
    # pixels at the edge are half covered
    assert np.abs(light - expected)[2:].max() < 0.03


def test_a_strand_before_a_window_cuts_a_shaft_behind_itself_alone() -> None:
    seen = window()
    seen[58:62, 85:100, :3] = 0.0
    fraction = added(seen)[..., 0] / added(window())[..., 0]
    assert fraction[60, 104] < 0.6 and fraction[60, 104] == pytest.approx(
        fraction[60, 130], abs=0.1
    )
    assert fraction[60, 56] > 0.99 and fraction[100, 80] > 0.98 and fraction[75, 120] > 0.98


def test_half_a_cover_cuts_half_of_it() -> None:
    def at(light: float) -> float:
        seen = window(light=6.0)
        seen[:, 90:100, :3] = np.minimum(seen[:, 90:100, :3], light)
        return float(added(seen)[60, 110, 0])

    assert at(0.0) < at(3.0) < at(6.0)


def test_a_white_world_throws_no_shafts_and_half_of_one_throws_them_in_full() -> None:
    white = np.full((HEIGHT, WIDTH, 3), 5.0)
    assert regions_of(white).scale == 0.0 and not added(white).any()
    assert not added(np.full((HEIGHT, WIDTH, 3), 1.0)).any()
    assert added(np.full((HEIGHT, WIDTH, 3), 1e6)).max() == 0.0
    half = white.copy()
    half[: HEIGHT // 2] = 0.0
    assert regions_of(half).scale == 1.0


@pytest.mark.parametrize("size", [(64, 64), (1, 1), (3, 200), (640, 20)])
def test_small_and_narrow_pictures_have_shafts(size: tuple[int, int]) -> None:
    seen = np.full((size[1], size[0], 4), 0.1)
    seen[: size[1] // 3 + 1, : size[0] // 3 + 1, :3] = 6.0
    found = added(seen, replace(ON, samples=64))
    assert np.isfinite(found).all()
    assert size == (1, 1) or found.max() > 0.5


def test_strength_tint_threshold_and_source_change_shafts() -> None:
    full = added(window())
    assert added(window(), replace(ON, bright_strength=0.25)) == pytest.approx(0.5 * full)
    tinted = added(window(), replace(ON, tint=(1.0, 0.5, 0.0)))
    assert tinted[..., 1] == pytest.approx(0.5 * full[..., 1]) and not tinted[..., 2].any()
    assert not added(window(), replace(ON, bright_threshold=6.0)).any()
    assert not full[..., 3].any()
    wants = [wants_bright(replace(ON, source=source)) for source in ("lights", "bright", "both")]
    assert wants == [False, True, True]
    assert not wants_bright(replace(ON, use_shafts=False))
    assert not wants_bright(replace(ON, bright_strength=0.0))


def test_an_orthographic_view_has_a_length_too() -> None:
    of_view = perspective(2.0 * np.arctan(0.36), 1.0, 0.1, 10.0)
    flat = orthographic(1.0, 1.0, 0.0, 5.0)
    lengths = [shaft_length(each, HEIGHT, 0.2) for each in (of_view, flat)]
    assert lengths[0] == pytest.approx(lengths[1]) and lengths[0] > 10.0
