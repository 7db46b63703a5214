"""The strands' noise: its hash against integer arithmetic, and properties that shading needs."""

from __future__ import annotations

import numpy as np

from hairloom.addon.shading.strand_noise import SEED_LIMIT, hash_integer, hash_unit, strand_noise


def wellons(value: int) -> int:
    """lowbias32 in Python's unbounded integers."""
    value ^= value >> 16
    value = value * 0x7FEB352D % 2**32
    value ^= value >> 15
    value = value * 0x846CA68B % 2**32
    return value ^ value >> 16


def test_hash_is_the_published_one() -> None:
    values = [0, 1, 2, 77, 2**24 - 1, 2**31, 2**32 - 1]
    assert hash_integer(np.array(values, np.uint32)).tolist() == [wellons(v) for v in values]


def test_hash_does_not_touch_its_input() -> None:
    values = np.arange(5, dtype=np.uint32)
    hash_integer(values)
    assert values.tolist() == [0, 1, 2, 3, 4]


def test_unit_is_even_and_below_one() -> None:
    numbers = hash_unit(np.arange(100_000), np.uint32(3))
    assert numbers.min() >= 0.0 and numbers.max() < 1.0
    counts = np.histogram(numbers, bins=20, range=(0, 1))[0]
    assert np.abs(counts - 5000).max() < 350  # five standard deviations


def test_noise_is_continuous_and_passes_through_its_cells() -> None:
    along = np.linspace(0.0, 6.0, 6001)
    noise = strand_noise(np.array(12), 0, along)
    assert np.abs(np.diff(noise)).max() < 0.0016  # the steepest slope of smoothstep is 1.5
    assert np.ptp(noise) > 0.2
    own = np.uint32(12 * 4)
    assert np.allclose(noise[::1000], hash_unit(own, np.arange(7)))


def test_channels_and_seeds_differ() -> None:
    along = np.linspace(0.0, 50.0, 2000)
    noises = [
        strand_noise(np.array(seed), channel, along)
        for seed in (0, 1, SEED_LIMIT - 1)
        for channel in range(4)
    ]
    correlation = np.corrcoef(noises) - np.eye(len(noises))
    assert np.abs(correlation).max() < 0.5
