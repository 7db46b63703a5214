"""What a card takes from the light, and what of it counts at the card itself."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.shading.volume.card_opacity import MOST_ALPHA, card_optical_depth, own_share
from hairloom.addon.shading.volume.opacity import adds_to, layer_ends, layer_weights
from hairloom.addon.shading.volume.settings import VolumeSettings


def test_depth_of_a_card_is_that_of_strands_at_random() -> None:
    """So many strands that they leave as much open as it does."""
    random, strands = np.random.default_rng(1), 400
    covered = np.zeros(200_000, bool)
    for start in random.random(strands):
        first = int(start * len(covered))
        covered[np.arange(first, first + 700) % len(covered)] = True
    alpha, tau = covered.mean(), strands * 700 / len(covered)
    assert card_optical_depth(alpha) == pytest.approx(tau, rel=0.1)
    assert card_optical_depth(np.ones(1)) == -np.log(1.0 - MOST_ALPHA)


@pytest.mark.parametrize("shadows", ["slices", "deep"])
@pytest.mark.parametrize("bias", [0.0, 0.01, 0.3])
def test_own_share_is_what_a_look_up_finds_of_a_single_card(shadows: str, bias: float) -> None:
    ends = layer_ends(VolumeSettings(shadows=shadows))
    for depth in np.random.default_rng(2).uniform(0.0, 1.0, 200):
        sums = 0.7 * adds_to(np.array(depth), ends)
        found = sums @ layer_weights(np.array(depth - bias), ends)
        assert 0.7 * own_share(np.array(depth), bias, ends) == pytest.approx(found, abs=1e-9)
