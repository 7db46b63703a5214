"""Noise of hair textures: it varies fast across the strands and slowly along them, and tiles.

A texture stands on its root: rows run along the hair, columns across it.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats

#: Octaves of stretched noise, strands and their fibres: factor of the cells across and along, and
#: strength.
_OCTAVES = ((1, 1, 1.0), (3, 2, 0.5))
#: Cells of the drift of strands: across a strip, along it.
_DRIFT_CELLS = (2, 3)


def stretched_noise(random: np.random.Generator, drift: Floats, across: int, along: int) -> Floats:
    """Noise that lies along drifting strands, (height, width), uniformly distributed over [0, 1].

    It tiles across and along where the drift does.

    Args:
        drift: (height, width), how far each strand strays sideways, in widths of the texture.
        across, along: cells of the coarser of its two octaves.
    """
    noise = np.zeros(drift.shape)
    for more_across, more_along, strength in _OCTAVES:
        cells = across * more_across, along * more_along
        noise += strength * _value_noise(random, drift, *cells)
    rank = np.empty(noise.size)
    rank[np.argsort(noise, axis=None, kind="stable")] = np.arange(noise.size)
    return (rank / max(noise.size - 1, 1)).reshape(noise.shape)


def strand_drift(random: np.random.Generator, shape: tuple[int, int], wander: float) -> Floats:
    """How far strands of one strip stray to the sides, (height, width), in widths of the strip.

    0 at both sides, so that strips tile side by side, and the same at root and tip. Across the
    strip its slope is below 9.2 `wander`, so that no two strands meet up to a `wander` of 0.1.
    """
    sway = 2.0 * _value_noise(random, np.zeros(shape), *_DRIFT_CELLS) - 1.0
    across = (np.arange(shape[1]) + 0.5) / shape[1]
    return wander * sway * np.sin(np.pi * across) ** 2


def strand_slope(drift: Floats, columns: int) -> Floats:
    """How many columns a strand moves to the side in one row, (height, width).

    A strand keeps its place u + drift(u, v), so that du (1 + drift_u) + dv drift_v = 0.

    Args:
        drift: of `columns` strips side by side, in widths of one strip.
    """
    moved = drift * (drift.shape[1] / columns)
    along = 0.5 * (np.roll(moved, -1, axis=0) - np.roll(moved, 1, axis=0))
    across = 0.5 * (np.roll(moved, -1, axis=1) - np.roll(moved, 1, axis=1))
    return -along / (1.0 + across)


def _value_noise(random: np.random.Generator, drift: Floats, across: int, along: int) -> Floats:
    """Random values on a grid that wraps both ways, blended smoothly."""
    values = random.random((along, across))
    height, width = drift.shape
    column = ((np.arange(width) + 0.5) / width + drift) * across
    row = (np.arange(height) + 0.5) / height * along
    left, below = np.floor(column).astype(np.int64), row.astype(np.int64)[:, None]
    blend_across, blend_along = smooth(column - left), smooth(row[:, None] - below)
    low, high = (
        values[line, left % across] * (1.0 - blend_across)
        + values[line, (left + 1) % across] * blend_across
        for line in (below, (below + 1) % along)
    )
    return low * (1.0 - blend_along) + high * blend_along


def smooth(t: Floats) -> Floats:
    """Smooth step from 0 to 1, for t in [0, 1]."""
    return t * t * (3.0 - 2.0 * t)
