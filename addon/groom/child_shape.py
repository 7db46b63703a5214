"""The shape of children at rest: mixed from guides, cut to their lengths, bent, curled, frizzed."""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..params.curve import sample_curve
from ..strands.arc_length import first_point_at_arc_length
from ..strands.catmull_rom import even_parameters, even_points_on_curve, points_on_curve
from ..strands.frames import tangents, transported_normals
from ..strands.vectors import dot, unit
from .children_settings import ChildrenSettings
from .counter_random import key_of, uniform
from .weights import GuideWeights

_TURN = 2.0 * np.pi
#: Children shaped at once, so that they stay in the processor's cache.
_CHUNK = 2048
#: Minimum segments of a strand in one wave of frizz: it cannot show shorter waves.
_SEGMENTS_PER_WAVE = 3.0
#: A child keeps at least this fraction of its length: without length it has no direction.
_SHORTEST = 0.001
#: Streams of a child's random numbers, beside that of its place (`children`).
_LENGTH, _WAVES = 2, 3
#: Streams up to 4 also decide where children grow; by these fly-aways would come in patches.
_STRAYS, _STRAY_WAVES, _CURLS, _BABIES, _BABY_LENGTHS = 5, 6, 7, 8, 9
#: Length of the shortest and the longest baby hair over that of other children.
_SHORTEST_BABY, _LONGEST_BABY = 0.04, 0.3
#: How far the calmest and the wildest fly-aways turn from their path at their tips, as a tangent;
#: and the number of waves along one, as few as in real stray hair.
_CALM, _WILD, _STRAY_TURNS = 0.2, 0.55, 0.8
#: Points in a turn of a curl that keep its shape, and the fewest that show that it turns.
_POINTS_PER_TURN, _FEWEST_PER_TURN = 24, 6


def mix_guides(root: Floats, guide_grid: Floats, weights: GuideWeights) -> Floats:
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


def are_baby_hair(key: Ints, settings: ChildrenSettings, border: Floats) -> Bools:
    """Which children are baby hair, (child_count,); raising the setting only adds to them.

    Args:
        key: (child_count,) of their random numbers.
        border: (child_count,) how near each is to where the hair ends, 0 to 1.
    """
    return np.asarray(uniform(key, _BABIES) < settings.baby_hair * border**2)


def shorten(
    grid: Floats, key: Ints, settings: ChildrenSettings, painted: Floats, is_baby: Bools
) -> None:
    """Cut each strand to its length along its curve, in place, and space its CVs as before.

    Args:
        grid: (child_count, cv_count, 3) float32 [m].
        key: (child_count,) of their random numbers.
        painted: (child_count,) factor on lengths.
        is_baby: (child_count,) see `are_baby_hair`.
    """
    whole = settings.length * painted
    if not settings.length_variation and (whole >= 1.0).all() and not is_baby.any():
        return
    kept = whole * (1.0 - settings.length_variation * uniform(key, _LENGTH))
    of_babies = _LONGEST_BABY * (_SHORTEST_BABY / _LONGEST_BABY) ** uniform(key, _BABY_LENGTHS)
    kept = np.clip(np.where(is_baby, of_babies * kept, kept), _SHORTEST, 1.0)
    for start in range(0, len(grid), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        grid[chunk] = _cut(grid[chunk], kept[chunk])


def _cut(grid: Floats, kept: Floats) -> Floats:
    """Strands (n, cv_count, 3) cut to this fraction of their length, (n,)."""
    reached = grid_arc_lengths(grid)
    wanted = reached * kept[:, None]
    offsets = np.arange(len(grid) + 1) * grid.shape[1]
    right = first_point_at_arc_length(reached.ravel(), offsets, wanted)
    left = np.maximum(right - 1, offsets[:-1, None])
    before = reached.take(left)
    span = reached.take(left + 1) - before
    inside = np.divide(wanted - before, span, out=np.zeros_like(span), where=span > 0.0)
    left -= offsets[:-1, None]
    return points_on_curve(grid, left, np.clip(inside, 0.0, 1.0).astype(np.float32))


def add_frizz(
    grid: Floats, key: Ints, settings: ChildrenSettings, size: float, painted: Floats
) -> None:
    """Let each strand stray from its path in waves, in place; roots stay.

    Two waves across each other, with each child's own direction, phase and pitch, and together no
    further than `settings.frizz`.

    Args:
        grid: (child_count, cv_count, 3) float32 [m].
        key: (child_count,) of their random numbers.
        size: the median length of the guides [m], of which frizz is a fraction.
        painted: (child_count,) factor on frizz.
    """
    if not settings.frizz:
        return
    own = uniform(key_of(key[:, None], np.arange(8)), _WAVES).reshape(-1, 2, 4)
    strayed = settings.frizz * sample_curve(
        settings.frizz_along, np.linspace(0.0, 1.0, grid.shape[1])
    )
    strayed *= size
    strayed[0] = 0.0
    for start in range(0, len(grid), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        reached = grid_arc_lengths(grid[chunk])
        shortest = _SEGMENTS_PER_WAVE / (grid.shape[1] - 1) * reached[:, -1:]
        wave_length = np.maximum(settings.frizz_length * size, shortest)
        turns = np.divide(reached, wave_length, out=np.zeros_like(reached), where=wave_length > 0.0)
        for wave in range(2):
            height, around, phase, pitch = own[chunk, wave].T
            swing = np.sin(_TURN * (turns * (0.75 + 0.5 * pitch)[:, None] + phase[:, None]))
            swing *= 0.5 * strayed * painted[chunk, None]
            for axis, part in enumerate(_on_sphere(height, around).T):
                grid[chunk, :, axis] += swing * part[:, None]


def add_fly_aways(
    grid: Floats, key: Ints, settings: ChildrenSettings, painted: Floats, is_baby: Bools
) -> None:
    """Let fly-aways wander off their path, in place, and all baby hair like the calmest of them;
    roots and lengths stay.

    Each segment turns from its direction towards a vector across it that wanders slowly along the
    strand and grows towards its tip. Raising the setting only adds to the fly-aways.

    Args:
        grid: (child_count, cv_count, 3) float32 [m].
        key: (child_count,) of their random numbers.
        painted: (child_count,) factor on the fraction of fly-aways.
        is_baby: (child_count,) see `are_baby_hair`.
    """
    if not settings.fly_aways and not is_baby.any():
        return
    strayed = np.flatnonzero((uniform(key, _STRAYS) < settings.fly_aways * painted) | is_baby)
    along = np.linspace(0.0, 1.0, grid.shape[1])[1:, None]
    for start in range(0, len(strayed), _CHUNK):
        chunk = strayed[start : start + _CHUNK]
        own = uniform(key_of(key[chunk, None], np.arange(6)), _STRAY_WAVES)
        step = np.diff(grid[chunk].astype(np.float64), axis=1)
        size = np.linalg.norm(step, axis=2, keepdims=True)
        swing = np.sin(_TURN * (_STRAY_TURNS * along + own[:, None, 5:6]))
        aside = _on_sphere(own[:, 0], own[:, 1])[:, None]
        aside = aside + swing * _on_sphere(own[:, 2], own[:, 3])[:, None]
        wild = np.where(is_baby[chunk], 0.0, own[:, 4])[:, None, None]
        wildness = _CALM + (_WILD - _CALM) * wild
        direction = unit(step)
        aside = aside - direction * dot(aside, direction)[..., None]
        turned = size * unit(direction + wildness * along * aside)
        grid[chunk, 1:] = grid[chunk, :1] + np.cumsum(turned, axis=1)


def curl_points(longest: float, settings: ChildrenSettings, size: float) -> int:
    """How many points a child needs to show its curls; 0 without any.

    Args:
        longest: length of the longest guide [m]. size: the median of these.
    """
    if not (settings.curl and size):
        return 0
    turns = min(longest / (settings.curl_length * size), 1.0e6)
    return _POINTS_PER_TURN * math.ceil(turns) + 1


def curl_strands(
    grid: Floats, lock: Ints, settings: ChildrenSettings, size: float, count: int, painted: Floats
) -> Floats:
    """Strands that wind around their paths as helices, of `count` points each; roots stay.

    The point at arc length s of the path is displaced by r (cos a e1 + sin a e2) with a = 2 pi s /
    length of a turn, where e1 and e2 span frames that do not twist along the path. To keep the
    helix's length, points lie outside of it: r is multiplied by (d / 2) / sin(d / 2), where d is
    the angle from one point to the next.

    Args:
        grid: (child_count, cv_count, 3) float32 [m].
        lock: (child_count,) keys of the random numbers of curls: children of one key wind alike.
        size: the median length of the guides [m], of which curls' sizes are fractions.
        painted: (child_count,) factor on the radius.
    """
    result = np.empty((len(grid), count, 3), np.float32)
    radius = settings.curl * size * sample_curve(settings.curl_along, np.linspace(0.0, 1.0, count))
    radius[0] = 0.0
    left, part = even_parameters(grid.shape[1], count)
    random = uniform(key_of(lock[:, None], np.arange(2)), _CURLS)
    for start in range(0, len(grid), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        coarse = transported_normals(
            tangents(grid[chunk]), _on_sphere(*random[chunk].T).astype(np.float32)
        )
        path = even_points_on_curve(grid[chunk], count)
        normal = coarse[:, left] + part[:, None] * (coarse[:, left + 1] - coarse[:, left])
        tangent = tangents(path)
        across: Floats = unit(normal - tangent * dot(normal, tangent)[..., None])
        reached = grid_arc_lengths(path)
        shortest = _FEWEST_PER_TURN / (count - 1) * reached[:, -1:]
        turn = np.maximum(settings.curl_length * size, shortest)
        angle = _TURN * np.divide(reached, turn, out=np.zeros_like(reached), where=turn > 0.0)
        half = np.maximum(angle[:, -1:] / (2 * (count - 1)), 1.0e-9)
        wide = painted[chunk, None] * radius * half / np.sin(half)
        aside = (wide * np.cos(angle))[..., None] * across
        aside += (wide * np.sin(angle))[..., None] * np.cross(tangent, across)
        result[chunk] = path + aside
    return result


def grid_arc_lengths(grid: Floats) -> Floats:
    """Arc length from the root to each CV, (n, cv_count) [m]."""
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
