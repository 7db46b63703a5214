"""Random numbers by name: those of SplitMix64, uniform and independent."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.groom.counter_random import key_of, normal, uniform


def test_mixing_is_that_of_splitmix64() -> None:
    """Against the first outputs of the published generator for the seed 0."""
    step = 0x9E3779B97F4A7C15
    states = np.array([0, step, 2 * step % 2**64], np.uint64)
    expected = [0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F]
    assert key_of(states, 0).tolist() == expected


def test_a_name_is_built_up_in_steps() -> None:
    parts = key_of(key_of(np.arange(5), 7), 3)
    assert (parts == key_of(np.arange(5), 7, 3)).all()
    assert (parts != key_of(np.arange(5), 3, 7)).any()


def test_numbers_are_even_normal_and_independent() -> None:
    keys = key_of(np.arange(100_000), 4)
    one, other = uniform(keys, 0), uniform(keys, 1)
    counts = np.histogram(one, 100, (0.0, 1.0))[0]
    assert ((counts - 1000.0) ** 2 / 1000.0).sum() < 150.0  # chi-square of 99 degrees: 99 +- 14
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.01
    assert abs(np.corrcoef(one[:-1], one[1:])[0, 1]) < 0.01
    bell = normal(keys, 2)
    assert bell.mean() == pytest.approx(0.0, abs=0.01) and bell.std() == pytest.approx(
        1.0, abs=0.01
    )
    assert (np.abs(bell) > 1.96).mean() == pytest.approx(0.05, abs=0.004)
