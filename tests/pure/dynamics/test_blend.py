"""Guides between their style and their simulation."""

import numpy as np
import pytest

from hairloom.addon.dynamics.blend import blended


def arc(turn: float, length: float = 0.2, cv_count: int = 9) -> np.ndarray:
    """A guide whose segments turn evenly, all in one plane, (1, cv_count, 3)."""
    angle = turn * np.arange(cv_count - 1)
    steps = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1) * length / (cv_count - 1)
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])[None].astype(np.float32)


def test_halfway_lies_the_arc_that_bends_half_as_much() -> None:
    found = blended(arc(0.2), arc(0.0), np.array([0.5]))
    np.testing.assert_allclose(found, arc(0.1), atol=1e-6)


@pytest.mark.parametrize("fraction", [0.1, 0.5, 0.9])
def test_lengths_are_kept_where_places_would_shorten(fraction: float) -> None:
    long, short = arc(0.35, 0.3), arc(0.0, 0.2)
    found = blended(long, short, np.array([fraction]))
    length = np.linalg.norm(np.diff(found, axis=1), axis=2).sum()
    assert length == pytest.approx(0.2 + 0.1 * fraction, rel=1e-5)


def test_a_segment_against_its_style_stays_simulated() -> None:
    found = blended(-arc(0.0), arc(0.0), np.array([0.5]))
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found, -arc(0.0), atol=1e-6)
