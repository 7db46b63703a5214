"""The card texture's promises: opaque inside, clear at the sides, seeded, stretched, tiling."""

from __future__ import annotations

import numpy as np

from hairloom.addon.shading.textures import (
    TextureSettings,
    card_texture,
    envelope,
    stretched_noise,
)

SETTINGS = TextureSettings(variant_width=64, height=256)


def columns(texture: np.ndarray, count: int) -> list[np.ndarray]:
    return np.split(texture, count, axis=1)


def test_shape_range_and_seed() -> None:
    texture = card_texture(SETTINGS, 3)
    assert texture.shape == (256, 192, 4)
    assert texture.dtype == np.float32
    assert texture.min() >= 0.0 and texture.max() <= 1.0
    np.testing.assert_array_equal(texture, card_texture(SETTINGS, 3))
    other = card_texture(TextureSettings(variant_width=64, height=256, seed=1), 3)
    assert np.abs(texture - other).mean() > 0.05
    first, second, _ = columns(texture, 3)
    assert np.abs(first - second).mean() > 0.05


def test_alpha_is_opaque_inside_and_gone_at_sides_and_tip() -> None:
    for strip in columns(card_texture(SETTINGS, 3), 3):
        alpha = strip[..., 3]
        np.testing.assert_array_equal(alpha[:, [0, -1]], 0.0)
        np.testing.assert_array_equal(alpha[-1], 0.0)
        np.testing.assert_array_equal(alpha[40:90, 24:40], 1.0)
        rows = alpha[100:].mean(axis=1)  # thins out from the middle to the tip
        assert (np.diff(rows.reshape(-1, 13).mean(axis=1)) < 0.0).all()


def test_mean_alpha_follows_the_envelope() -> None:
    texture = card_texture(SETTINGS, 16)
    mean = np.mean([strip[..., 3] for strip in columns(texture, 16)], axis=0)
    inside = slice(1, -1)
    difference = mean[:, inside] - envelope(SETTINGS)[:, inside]
    assert abs(difference.mean()) < 0.05
    assert np.sqrt((difference**2).mean()) < 0.2


def test_colour_goes_on_where_alpha_is_zero() -> None:
    texture = card_texture(SETTINGS, 2)
    assert texture[..., :3].min() >= 1.0 - SETTINGS.contrast - 1e-6


def test_noise_is_even_stretched_and_tiles_across() -> None:
    noise = stretched_noise(np.random.default_rng(0), (256, 128), 16)
    counts, _ = np.histogram(noise, bins=16, range=(0.0, 1.0))
    np.testing.assert_array_equal(counts, noise.size // 16)
    across = np.abs(np.diff(noise, axis=1)).mean()
    along = np.abs(np.diff(noise, axis=0)).mean()
    assert across > 5.0 * along
    seam = np.abs(noise[:, 0] - noise[:, -1]).mean()
    assert seam < 2.0 * across
