"""The shape of children at rest: mixed from guides, cut to their lengths, and frizzed."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..params.curve import along
from ..strands.arc_length import first_as_far
from ..strands.catmull_rom import on_curve
from .children_settings import ChildrenSettings
from .counter_random import named, uniform
from .weights import GuideWeights

_TURN = 2.0 * np.pi
#: Children shaped at once, so that they stay in the processor's cache.
_CHUNK = 2048
#: Segments of a strand in one wave of frizz, at least: shorter ones it could not show.
_SEGMENTS_PER_WAVE = 3.0
#: Random numbers of a child's own, beside that of its place (`children`).
_LENGTH, _WAVES = 2, 3


def mixed(root: Floats, guide_grid: Floats, weights: GuideWeights) -> Floats:
    """root + sum over k of w_k (guide_k - root of guide_k), (child_count, cv_count, 3) float32.

    Three-guide interpolation of rest shapes (Nguyen and Donnelly 2005, GPU Gems 2, chapter 23),
    taken from each root so that children start on the surface. A child of one guide runs beside
    it, everywhere as far from it as at the root.

    Args:
        root: (child_count, 3) float32 [m].
        guide_grid: (guide_count, cv_count, 3) float32 [m].
    """
    cv_count = guide_grid.shape[1]
    offset = (guide_grid - guide_grid[:, :1]).reshape(len(guide_grid), 3 * cv_count)
    grid = np.tile(np.asarray(root, np.float32), (1, cv_count))
    for start in range(0, len(grid), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        for guide, weight in zip(weights.guide[chunk].T, weights.weight[chunk].T, strict=True):
            grid[chunk] += offset[guide] * weight[:, None]
    return grid.reshape(len(grid), cv_count, 3)


def shorten(grid: Floats, key: Ints, settings: ChildrenSettings) -> None:
    """Cut each strand to a random length along its curve, in place, and space its CVs as before.

    Args:
        grid: (child_count, cv_count, 3) float32 [m].
        key: (child_count,) what is random about each depends on.
    """
    if not settings.length_variation:
        return
    kept = 1.0 - settings.length_variation * uniform(key, _LENGTH)
    for start in range(0, len(grid), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        grid[chunk] = _cut(grid[chunk], kept[chunk])


def _cut(grid: Floats, kept: Floats) -> Floats:
    """Strands (n, cv_count, 3) cut to this part of their length, (n,)."""
    reached = arc_length(grid)
    wanted = reached * kept[:, None]
    offsets = np.arange(len(grid) + 1) * grid.shape[1]
    right = first_as_far(reached.ravel(), offsets, wanted)
    left = np.maximum(right - 1, offsets[:-1, None])
    before = reached.take(left)
    span = reached.take(left + 1) - before
    inside = np.divide(wanted - before, span, out=np.zeros_like(span), where=span > 0.0)
    left -= offsets[:-1, None]
    return on_curve(grid, left, np.clip(inside, 0.0, 1.0).astype(np.float32))


def frizz(grid: Floats, key: Ints, settings: ChildrenSettings, size: float) -> None:
    """Let each strand stray from its path in waves, in place; roots stay.

    Two waves across each other, with each child's own direction, phase and pitch, and together no
    further than `settings.frizz` says.

    Args:
        grid: (child_count, cv_count, 3) float32 [m].
        key: (child_count,) what is random about each depends on.
        size: the median length of the guides [m], in which frizz is given.
    """
    if not settings.frizz:
        return
    own = uniform(named(key[:, None], np.arange(8)), _WAVES).reshape(-1, 2, 4)
    strayed = settings.frizz * along(settings.frizz_along, np.linspace(0.0, 1.0, grid.shape[1]))
    strayed *= size
    strayed[0] = 0.0
    for start in range(0, len(grid), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        reached = arc_length(grid[chunk])
        shortest = _SEGMENTS_PER_WAVE / (grid.shape[1] - 1) * reached[:, -1:]
        wave_length = np.maximum(settings.frizz_length * size, shortest)
        turns = np.divide(reached, wave_length, out=np.zeros_like(reached), where=wave_length > 0.0)
        for wave in range(2):
            height, around, phase, pitch = own[chunk, wave].T
            swing = np.sin(_TURN * (turns * (0.75 + 0.5 * pitch)[:, None] + phase[:, None]))
            swing *= 0.5 * strayed
            for axis, part in enumerate(_on_sphere(height, around).T):
                grid[chunk, :, axis] += swing * part[:, None]


def arc_length(grid: Floats) -> Floats:
    """From the root to each CV, (n, cv_count) [m]."""
    reached = np.zeros(grid.shape[:2])
    step = np.diff(grid, axis=1)
    squared = step[..., 0] ** 2 + step[..., 1] ** 2 + step[..., 2] ** 2
    np.cumsum(np.sqrt(squared), axis=1, out=reached[:, 1:])
    return reached


def _on_sphere(height: Floats, around: Floats) -> Floats:
    """Uniform unit vectors (n, 3) from two uniform numbers each (Archimedes)."""
    z = 2.0 * height - 1.0
    flat = np.sqrt(np.maximum(1.0 - z * z, 0.0))
    angle = _TURN * around
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), z], axis=1)
