"""Clumps: neighbouring strands draw together towards the tip, swing alike, and stray a little."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from .settings import GrowSettings

_TURN = 2.0 * np.pi
#: A clump draws no CV aside by more than this fraction of the arc length from its root.
_MAX_PULL = 0.25
#: Strands assigned to clumps at once, to bound the memory.
_CHUNK = 1024


def assign_clumps(
    root: Floats, settings: GrowSettings, random: np.random.Generator, side: Ints | None = None
) -> Ints:
    """The strand in the middle of each strand's clump, (strand_count,); for a middle, itself.

    Args:
        side: (strand_count,) of the parting, -1 or 1; a clump keeps to the side of its middle, or
            it would draw strands through the head. None: there is no parting.
    """
    if not len(root):
        return np.zeros(0, np.int64)
    clump_count = max(1, round(len(root) / settings.clump_size))
    # strands come in an order that follows the scalp, so every n-th one is spread over it
    middles = np.linspace(0, len(root) - 1, clump_count).round().astype(np.int64)
    scattered = root + random.normal(0.0, 0.3, root.shape) * _clump_size(root, clump_count)
    if side is not None and len(np.unique(side[middles])) > 1:
        apart = 10.0 * np.linalg.norm(np.ptp(root, axis=0))
        scattered[:, 0] += apart * side
    center = scattered[middles] - root.mean(axis=0)
    nearest = np.empty(len(root), np.int64)
    for start in range(0, len(root), _CHUNK):
        chunk = scattered[start : start + _CHUNK] - root.mean(axis=0)
        table = (center**2).sum(axis=1) - 2.0 * chunk @ center.T  # squared distance less |chunk|^2
        nearest[start : start + _CHUNK] = table.argmin(axis=1)
    clump = middles[nearest]
    clump[middles] = middles
    return clump


def style_clumps(
    grid: Floats, clump: Ints, settings: GrowSettings, random: np.random.Generator
) -> Floats:
    """The strands drawn into clumps, waved and frizzed, (strand_count, cv_count, 3) [m].

    Roots stay; lengths change a little.
    """
    fraction = np.linspace(0.0, 1.0, grid.shape[1])[None, :, None]
    pull = settings.clump * fraction**0.8 * (0.75 + 0.25 * random.random((len(grid), 1, 1)))
    along = _arc_length(grid)
    styled = grid + _limited(pull * (grid[clump] - grid), _MAX_PULL * along)
    # hair shorter than a wave has only a part of it
    fade = np.minimum(np.minimum(fraction * 3.0, along[..., None] / settings.wave_length), 1.0)
    swing = _swing(along / settings.wave_length, clump, random) * settings.wave
    stray = _swing(along / (0.6 * settings.wave_length), np.arange(len(grid)), random)
    return styled + fade * (swing + stray * settings.frizz * (0.5 + fraction))


def _swing(turns: Floats, owner: Ints, random: np.random.Generator) -> Floats:
    """Displacements of about unit length that all strands of one owner share, (n, cv_count, 3).

    Two waves across each other, each with the phase, direction and pitch of its owner.
    """
    total = np.zeros((*turns.shape, 3))
    for _ in range(2):
        direction = random.normal(size=(len(owner), 3))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        phase, pitch = random.random(len(owner)), 0.75 + 0.5 * random.random(len(owner))
        wave = np.sin(_TURN * (turns * pitch[owner, None] + phase[owner, None]))
        total += wave[..., None] * direction[owner, None] / np.sqrt(2.0)
    return total


def _limited(offset: Floats, longest: Floats) -> Floats:
    """Offsets (n, cv_count, 3), shortened to at most `longest`, (n, cv_count)."""
    length = np.linalg.norm(offset, axis=-1)
    factor = np.minimum(1.0, longest / np.maximum(length, 1e-30))
    return offset * factor[..., None]


def _arc_length(grid: Floats) -> Floats:
    """Arc length from the root to each CV, (strand_count, cv_count) [m]."""
    along = np.zeros(grid.shape[:2])
    along[:, 1:] = np.linalg.norm(np.diff(grid, axis=1), axis=2).cumsum(axis=1)
    return along


def _clump_size(root: Floats, clump_count: int) -> float:
    """About the distance from one clump to the next [m]."""
    return float(np.linalg.norm(np.ptp(root, axis=0))) / np.sqrt(clump_count) / 2.0
