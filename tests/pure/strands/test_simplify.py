"""Points by need against brute force: distances from every point, and the fewest there can be."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.refine.smooth import points_at
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.simplify import simplify

STRAY = 2.0e-4


def set_of(*strands: np.ndarray, **more: np.ndarray) -> StrandSet:
    points = np.concatenate(strands)
    offsets = np.concatenate([[0], np.cumsum([len(each) for each in strands])])
    values = {"radius": np.full(len(points), 4e-5), "group": np.zeros(len(strands))} | more
    return StrandSet(points, offsets, **values)


def helix(turns: float, count: int, radius: float = 0.008, length: float = 0.25) -> np.ndarray:
    along = np.linspace(0.0, 1.0, count)
    angle = 2.0 * np.pi * turns * along
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), length * along], axis=1)


def straight(count: int = 50, length: float = 0.2) -> np.ndarray:
    return np.linspace(0.0, 1.0, count)[:, None] * np.array([0.0, 0.0, length])


def half_curled() -> np.ndarray:
    """Straight, then tight waves."""
    along = np.linspace(0.0, 1.0, 300)
    wave = np.where(along > 0.6, 0.001 * np.sin(400.0 * (along - 0.6)), 0.0)
    return np.stack([wave, 0.0 * along, 0.2 * along], axis=1)


def wandering(seed: int, count: int = 120) -> np.ndarray:
    random = np.random.default_rng(seed)
    turn = np.cumsum(random.normal(0.0, random.choice([0.02, 0.1, 0.3]), (count, 3)), axis=0)
    step = turn + [0.0, 0.0, 1.0]
    step *= random.uniform(2e-4, 3e-3, (count, 1)) / np.linalg.norm(step, axis=1, keepdims=True)
    return np.cumsum(step, axis=0)


def away_from(points: np.ndarray, line: np.ndarray) -> float:
    """The largest distance of any point to a polyline."""
    origin, chord = line[:-1], np.diff(line, axis=0)
    size = np.maximum(np.einsum("ij,ij->i", chord, chord), 1e-30)
    away = points[:, None] - origin
    part = np.clip(np.einsum("pij,ij->pi", away, chord) / size, 0.0, 1.0)
    return float(np.linalg.norm(away - part[..., None] * chord, axis=2).min(axis=1).max())


def length_of(line: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(line.astype(float), axis=0), axis=1).sum())


def curve_of(line: np.ndarray) -> np.ndarray:
    """The drawn curve in ten places of each segment."""
    segment = np.repeat(np.arange(len(line) - 1), 10)
    u = np.tile(np.arange(10) / 10.0, len(line) - 1)
    return points_at(line[None], np.zeros_like(segment), segment, u)


CURVES = [helix(4, 300), helix(11, 700), half_curled(), *(wandering(seed) for seed in range(6))]


@pytest.mark.parametrize("fewest", [2, 16])
def test_no_strand_strays_or_loses_length(fewest: int) -> None:
    found = simplify(set_of(*CURVES), STRAY, fewest=fewest)
    assert not found.is_limited.any()
    for before, after in zip(CURVES, found.strands.strands(), strict=True):
        assert fewest - 2 <= len(after) < len(before) or len(after) == len(before)
        np.testing.assert_allclose(after[[0, -1]], before[[0, -1]], atol=1e-7)
        assert away_from(before, after.astype(float)) < 1.001 * STRAY
        assert length_of(after) > 0.995 * length_of(before) - 1e-6
        # looked at in three places of a segment, so a little more in between
        assert away_from(curve_of(after), before) < 1.2 * STRAY


def test_points_are_about_as_few_as_can_be() -> None:
    """Against the fewest that keep to the tolerance, by trying all pairs of ends."""
    for seed in range(4):
        line = wandering(seed, 40)
        found = simplify(set_of(line), STRAY, loss=1.0).strands.point_count
        assert fewest_of(line) <= found <= 1.7 * fewest_of(line) + 2
    assert simplify(set_of(straight()), STRAY).strands.point_count == 2


def fewest_of(line: np.ndarray) -> int:
    need = np.full(len(line), 10**6)
    need[0] = 1
    for last in range(1, len(line)):
        for first in range(last):
            between = line[first + 1 : last]
            if not len(between) or away_from(between, line[[first, last]]) <= STRAY:
                need[last] = min(need[last], need[first] + 1)
    return int(need[-1])


def test_strands_do_not_know_of_each_other() -> None:
    together = simplify(set_of(*CURVES), STRAY, fewest=5).strands.strands()
    alone = [simplify(set_of(each), STRAY, fewest=5).strands.points for each in CURVES]
    for one, other in zip(together, alone, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-7)


def test_size_and_place_do_not_matter() -> None:
    strands = set_of(*CURVES)
    large = simplify(set_of(*(1000.0 * each for each in CURVES)), 1000.0 * STRAY).strands
    counts = simplify(strands, STRAY).strands.point_counts
    assert np.abs(large.point_counts - counts).max() <= 2
    far = set_of(*(each + [3.0, -2.0, 5.0] for each in CURVES[:3]))
    assert (simplify(far, STRAY).strands.point_counts <= 1.3 * counts[:3] + 4).all()


def test_a_strand_that_needs_too_many_is_limited_and_still_the_best_of_them() -> None:
    strands = set_of(helix(20, 3000), helix(2, 300), straight())
    found = simplify(strands, STRAY)
    assert found.is_limited.tolist() == [True, False, False]
    assert 200 <= found.strands.point_counts[0] <= 256
    assert found.strands.lengths()[0] > 0.985 * strands.lengths()[0]
    few = simplify(strands, STRAY, most=8)
    assert few.strands.point_counts.max() <= 8 and few.is_limited.tolist() == [True, True, False]


def test_widths_and_colours_are_kept() -> None:
    along = np.linspace(0.0, 1.0, 50)
    radius = np.where(along < 0.5, 4e-5, 4e-5 * (1.5 - along))
    color = np.where(along[:, None] < 0.3, [0.8, 0.1, 0.1], [0.1, 0.1, 0.8])
    found = simplify(set_of(straight(), radius=radius, color=color), STRAY).strands
    assert found.point_count < 12 and found.color is not None
    way = found.points[:, 2] / 0.2
    assert np.abs(np.interp(along, way, found.radius) - radius).max() < 0.1 * 4e-5
    for channel in range(3):
        shown = np.interp(along, way, found.color[:, channel])
        assert np.abs(shown - color[:, channel]).max() < 0.031


def test_strands_with_few_points_get_more_for_what_bends_them_later() -> None:
    line = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.01], [0.0, 0.1, 0.1]])
    found = simplify(set_of(line, straight(2)), STRAY, fewest=16).strands
    assert (found.point_counts >= 16).all() and found.point_counts.max() <= 20
    for before, after in zip((line, straight(2)), found.strands(), strict=True):
        assert away_from(after, before) < 1e-7
        longest = np.linalg.norm(np.diff(after, axis=0), axis=1).max()
        assert longest <= 1.001 * length_of(before) / 15
    spaced = set_of(straight(16), straight(16))
    assert simplify(spaced, STRAY, fewest=16).strands is spaced, "they are as they should be"


def test_what_is_no_shape_survives() -> None:
    point = np.zeros((5, 3))
    doubled = np.repeat(helix(2, 100), 2, axis=0)
    back = np.concatenate([straight(), straight()[::-1]])
    found = simplify(set_of(point, doubled, back, straight(2)), STRAY, fewest=4)
    assert np.isfinite(found.strands.points).all()
    assert length_of(list(found.strands.strands())[2]) == pytest.approx(0.4, rel=1e-3)
    none = StrandSet(np.zeros((0, 3)), [0], [], [])
    assert simplify(none, STRAY, fewest=16).strands.strand_count == 0
