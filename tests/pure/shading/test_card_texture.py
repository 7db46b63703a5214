"""Card textures: opaque inside, clear at the sides, seeded, stretched, seamless."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.errors import HairloomError
from hairloom.addon.shading.card_look import mapped_tangent
from hairloom.addon.shading.kajiya_kay import shifted_tangent
from hairloom.addon.shading.texture_noise import strand_drift, strand_slope, stretched_noise
from hairloom.addon.shading.texture_settings import TextureSettings
from hairloom.addon.shading.textures import (
    TEXTURES,
    HairTextures,
    envelope,
    hair_textures,
    picture_as,
    tangent_map,
)

SETTINGS = TextureSettings(variant_width=64, height=256)


def columns(texture: np.ndarray, count: int) -> list[np.ndarray]:
    return np.split(texture, count, axis=1)


@pytest.mark.parametrize(("width", "height", "count"), [(64, 256, 3), (9, 8, 1), (100, 33, 5)])
def test_shape_range_and_seed(width: int, height: int, count: int) -> None:
    settings = TextureSettings(variant_width=width, height=height, strand_count=8)
    made = hair_textures(settings, count)
    hair_textures.cache_clear()
    again = hair_textures(settings, count)
    other = hair_textures(replace(settings, seed=1), count)
    for name in TEXTURES:
        texture = getattr(made, name)
        assert texture.shape[:2] == (height, count * width)
        assert texture.ndim == (3 if name in ("base", "tangent") else 2)
        assert texture.dtype == np.float32
        assert texture.min() >= 0.0 and texture.max() <= 1.0
        np.testing.assert_array_equal(texture, getattr(again, name))
        assert np.abs(texture - getattr(other, name)).mean() > 0.01
    assert made.card.shape == (height, count * width, 4)
    np.testing.assert_array_equal(made.card[..., 3], made.alpha)


def test_variants_differ() -> None:
    for name in ("base", "alpha", "shift", "noise"):
        first, second, _ = columns(getattr(hair_textures(SETTINGS, 3), name), 3)
        assert np.abs(first - second).mean() > 0.05


def test_alpha_is_opaque_inside_and_gone_at_sides_and_tip() -> None:
    for alpha in columns(hair_textures(SETTINGS, 3).alpha, 3):
        np.testing.assert_array_equal(alpha[:, [0, -1]], 0.0)
        np.testing.assert_array_equal(alpha[-1], 0.0)
        np.testing.assert_array_equal(alpha[40:90, 24:40], 1.0)
        rows = alpha[100:].mean(axis=1)  # thins out from the middle to the tip
        assert (np.diff(rows.reshape(-1, 13).mean(axis=1)) < 0.0).all()


def test_mean_alpha_follows_the_envelope() -> None:
    mean = np.mean(columns(hair_textures(SETTINGS, 16).alpha, 16), axis=0)
    inside = slice(1, -1)
    difference = mean[:, inside] - envelope(SETTINGS)[:, inside]
    assert abs(difference.mean()) < 0.05
    assert np.sqrt((difference**2).mean()) < 0.2


def test_colour_goes_on_where_alpha_is_zero() -> None:
    assert hair_textures(SETTINGS, 2).base.min() >= 1.0 - SETTINGS.contrast - 1e-6


@pytest.mark.parametrize("along", [2, 3, 24])
def test_noise_is_even_and_stretched(along: int) -> None:
    noise = stretched_noise(np.random.default_rng(0), np.zeros((512, 128)), 16, along)
    counts, _ = np.histogram(noise, bins=16, range=(0.0, 1.0))
    np.testing.assert_array_equal(counts, noise.size // 16)
    across, down = (np.abs(np.diff(noise, axis=axis)).mean() for axis in (1, 0))
    stretch = (512 / along) / (128 / 16)  # a cell is this many times as long as wide
    assert across / down == pytest.approx(stretch, rel=0.35)


@pytest.mark.parametrize("name", ["shift", "noise", "base"])
@pytest.mark.parametrize("wander", [0.0, 0.1])
def test_seams_are_no_larger_than_differences_within(name: str, wander: float) -> None:
    """At the seams of shift and noise in both directions, and of base across each column."""
    texture = getattr(hair_textures(replace(SETTINGS, wander=wander), 3), name)
    texture = texture.mean(axis=-1) if texture.ndim == 3 else texture
    parts = columns(texture, 3) if name == "base" else [texture]
    for part in parts:
        seam = np.abs(part[:, 0] - part[:, -1])
        within = np.abs(np.diff(part, axis=1))
        assert seam.mean() < 1.5 * within.mean() and seam.max() <= 1.5 * within.max()
    if name != "base":
        seam, within = np.abs(texture[0] - texture[-1]), np.abs(np.diff(texture, axis=0))
        assert seam.mean() < 1.5 * within.mean() and seam.max() <= 1.5 * within.max()


def test_strands_never_meet() -> None:
    """Even at the largest wander, strands keep their order from left to right in every row."""
    drift = strand_drift(np.random.default_rng(3), (256, 512), 0.1)
    place = (np.arange(512) + 0.5) / 512 + drift
    assert (np.diff(place, axis=1) > 0.0).all()
    assert np.abs(drift).max() > 0.03
    assert np.abs(drift[:, [0, -1]]).max() < 1e-5


def test_the_slope_leads_along_the_strands() -> None:
    """The name of a strand hardly changes along the slope, but does straight up."""
    random = np.random.default_rng(5)
    drift = strand_drift(random, (512, 256), 0.1)
    slope = strand_slope(drift, 1)
    assert np.abs(slope).max() > 0.2
    place = (np.arange(256) + 0.5) / 256 + drift  # identifies the strand

    def gone_astray(step: np.ndarray) -> float:
        column = np.arange(256) + step[100]
        onward = np.array([np.interp(column, np.arange(256), place[row]) for row in (101,)])
        return float(np.abs(onward - place[100])[:, 8:-8].max())

    assert gone_astray(slope) < 0.02 * gone_astray(np.zeros_like(slope))


def test_the_tangent_map_moves_highlights_as_the_shift_does() -> None:
    """To first order, without wander; the map stores unit vectors."""
    shift = np.linspace(0.0, 1.0, 11)
    texel = tangent_map(np.zeros(11), shift)
    np.testing.assert_allclose(np.linalg.norm(2.0 * texel - 1.0, axis=-1), 1.0, atol=1e-12)
    tangent, normal = np.tile([0.0, 1.0, 0.0], (11, 1)), np.tile([0.0, 0.0, 1.0], (11, 1))
    for strength, primary in ((0.2, 0.1), (0.2, -0.14), (1.0, 0.0)):
        mapped = mapped_tangent(texel, tangent, normal, strength)
        found = shifted_tangent(mapped, normal, primary)
        expected = shifted_tangent(tangent, normal, primary + strength * (shift - 0.5))
        # the second-order error: a map stores a normalized vector
        np.testing.assert_allclose(found, expected, atol=2e-3)


def test_x_of_the_map_turns_strands_across_the_card() -> None:
    tangent, normal = np.array([0.0, 0.0, -1.0]), np.array([0.0, -1.0, 0.0])
    texel = tangent_map(np.array(1.0), np.array(0.5))
    side = np.cross(tangent, normal)
    expected = (tangent + side) / np.sqrt(2.0)
    np.testing.assert_allclose(mapped_tangent(texel, tangent, normal, 0.7), expected, atol=1e-12)
    nothing = np.full(3, 0.5)
    np.testing.assert_array_equal(mapped_tangent(nothing, tangent, normal, 0.7), tangent)


def picture(channels: int) -> np.ndarray:
    return np.random.default_rng(1).random((5, 7, channels)).astype(np.float32)


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_pictures_take_the_place_of_textures(channels: int) -> None:
    found = picture(channels)
    has_alpha = channels in (2, 4)
    base, alpha = (picture_as(name, found, place="x") for name in ("base", "alpha"))
    grey = np.repeat(found[..., :1], 3, axis=-1)
    np.testing.assert_array_equal(base, grey if channels < 3 else found[..., :3])
    np.testing.assert_array_equal(alpha, found[..., -1 if has_alpha else 0])
    made = hair_textures(SETTINGS, 1)
    changed = made.with_pictures({"alpha": alpha})
    np.testing.assert_array_equal(changed.alpha, alpha)
    assert changed.base is made.base


def test_a_constant_alpha_is_ignored() -> None:
    found = picture(4)
    found[..., 3] = 1.0
    np.testing.assert_array_equal(picture_as("shift", found, place="x"), found[..., 0])


@pytest.mark.parametrize("name", TEXTURES)
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_pictures_that_are_no_numbers_are_refused(name: str, value: float) -> None:
    found = picture(3)
    found[2, 3, 1] = value
    with pytest.raises(HairloomError, match=f"my.exr: .*{name}.*not finite"):
        picture_as(name, found, place="my.exr")
    with pytest.raises(HairloomError, match="no pixels"):
        picture_as(name, found[:0], place="my.exr")


def test_values_outside_are_clipped() -> None:
    found = np.array([[[-1.0, 0.5, 7.0]]], np.float32)
    assert picture_as("base", found, place="x").tolist() == [[[0.0, 0.5, 1.0]]]


def test_base_and_alpha_of_different_sizes_become_one() -> None:
    shape = (2, 4)
    textures = HairTextures(
        np.arange(6, dtype=np.float32).reshape(1, 2, 3),
        np.arange(8, dtype=np.float32).reshape(shape),
        *(np.zeros(shape, np.float32),) * 2,
        np.zeros((*shape, 3), np.float32),
    )
    assert textures.card.shape == (2, 4, 4)
    np.testing.assert_array_equal(textures.card[..., 3], textures.alpha)
    np.testing.assert_array_equal(textures.card[..., 0], [[0, 0, 3, 3]] * 2)
