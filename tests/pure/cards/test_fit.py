"""Strips fitted to bundles of strands whose best strip is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairloom.addon.cards.fit import (
    cluster_of_strands,
    fit_strips,
    root_slopes,
    with_fly_aways,
)
from hairloom.addon.cards.segments import fewest_segments, segment_errors, with_segments
from hairloom.addon.cards.settings import CardSettings
from hairloom.addon.cards.strip import Strips

BREADTH = 0.02
RADIUS = 4e-5


def flat_bundle(across: tuple[float, float, float], strands: int = 200) -> np.ndarray:
    """Strands that hang straight down, evenly spread over a breadth, (strands, 9, 3)."""
    place = np.linspace(-0.5, 0.5, strands)[:, None] * BREADTH * np.array(across)
    along = np.linspace(0.0, 0.3, 9)[:, None] * [0.0, 0.0, -1.0]
    return (place[:, None] + along).astype(np.float32)


def one_cluster(grid: np.ndarray) -> np.ndarray:
    return np.zeros(len(grid), np.int32)


def fitted(grid: np.ndarray, outwards: tuple[float, float, float], **changed: object):
    radius = np.full(grid.shape[:2], RADIUS, np.float32)
    normals = np.tile(np.array(outwards, np.float32), (len(grid), 1))
    settings = CardSettings(**changed)  # type: ignore[arg-type]
    return fit_strips(grid, radius, one_cluster(grid), normals, settings)


def test_a_flat_bundle_gets_the_strip_that_holds_it() -> None:
    strips = fitted(flat_bundle((1.0, 0.0, 0.0)), (0.0, -1.0, 0.0))
    np.testing.assert_allclose(np.abs(strips.frames.side[0, :, 0]), 1.0, atol=1e-3)
    np.testing.assert_allclose(strips.frames.normal[0, :, 1], -1.0, atol=1e-3)
    # evenly spread strands have a deviation of breadth / sqrt(12)
    np.testing.assert_allclose(strips.width, 1.8 / np.sqrt(3.0) * BREADTH, rtol=0.02)


def test_a_strip_lies_along_the_spread_and_faces_away_from_the_head() -> None:
    slanted = (np.cos(0.6), np.sin(0.6), 0.0)
    for outwards in ((0.0, -1.0, 0.0), (0.0, 1.0, 0.0)):
        strips = fitted(flat_bundle(slanted), outwards)
        aligned = np.abs(strips.frames.side[0] @ np.array(slanted))
        assert aligned.min() > np.cos(np.radians(12.0))
        assert (strips.frames.normal[0] @ np.array(outwards) > 0.0).all()


def test_a_round_bundle_faces_away_from_the_head() -> None:
    random = np.random.default_rng(1)
    place = random.normal(size=(500, 1, 3)) * [0.005, 0.005, 0.0]
    along = np.linspace(0.0, 0.3, 9)[:, None] * [0.0, 0.0, -1.0]
    strips = fitted((place + along).astype(np.float32), (0.6, -0.8, 0.0))
    assert (strips.frames.normal[0] @ np.array([0.6, -0.8, 0.0])).min() > 0.99


def test_a_crossed_strip_stands_at_a_right_angle_on_the_first() -> None:
    grid = np.concatenate([flat_bundle((1.0, 0.0, 0.0)), 0.5 * flat_bundle((0.0, 1.0, 0.0))])
    grid[200:, :, 2] *= 2.0
    strips = fitted(grid, (0.0, -1.0, 0.0), crossed=True)
    first, second = strips.frames.side
    assert np.abs(np.einsum("ri,ri->r", first, second)).max() < 1e-5
    np.testing.assert_allclose(strips.width[1], 0.5 * strips.width[0], rtol=0.02)


def segments_within(strips: Strips, error: float, most: int) -> list[int]:
    return fewest_segments(segment_errors(strips, most), error, most).tolist()


def test_segments_are_the_fewest_within_the_error() -> None:
    turn = np.linspace(0.0, np.pi, 33)
    arc = np.stack([0.1 * np.sin(turn), 0.0 * turn, 0.1 * np.cos(turn)], axis=-1)
    grid = arc + np.linspace(-0.005, 0.005, 20)[:, None, None] * [0.0, 1.0, 0.0]
    strips = fitted(grid.astype(np.float32), (0.0, 0.0, 1.0))
    counts = [segments_within(strips, error, 32)[0] for error in (0.01, 0.002, 0.0005)]
    assert counts == sorted(counts) and len(set(counts)) == 3
    # the sagitta of a chord over the angle a is r (1 - cos a/2)
    for error, count in zip((0.01, 0.002, 0.0005), counts, strict=True):
        sagitta = 0.1 * (1.0 - np.cos(np.pi / count / 2.0))
        assert sagitta < 1.1 * error
    assert with_segments(strips, np.array([0]), 4).width.shape == (1, 5)


def test_straight_strands_need_one_segment() -> None:
    strips = fitted(flat_bundle((1.0, 0.0, 0.0)), (0.0, -1.0, 0.0))
    assert segments_within(strips, 1e-5, 12) == [1]


def test_strands_that_stick_out_leave_their_cluster() -> None:
    grid = flat_bundle((1.0, 0.0, 0.0))
    grid[[3, 77]] += np.linspace(0.0, 0.1, 9)[:, None].astype(np.float32)
    label = with_fly_aways(grid, one_cluster(grid), 2)
    assert sorted(np.flatnonzero(label)) == [3, 77] and label.max() == 2
    # each cluster keeps a strand
    np.testing.assert_array_equal(np.bincount(with_fly_aways(grid, one_cluster(grid), 999))[:1], 1)


def test_a_card_reaches_to_where_most_of_its_strands_end() -> None:
    """Strands whose lengths have a standard deviation of 3 cm: the card is 1.3 deviations longer
    than their mean, so that nine of ten end on it."""
    random = np.random.default_rng(2)
    grid = flat_bundle((1.0, 0.0, 0.0), 400)
    grid *= 1.0 + random.normal(scale=0.1, size=(400, 1, 1)).astype(np.float32) * [0.0, 0.0, 1.0]
    strips = fitted(grid.astype(np.float32), (0.0, -1.0, 0.0))
    held = (grid[:, -1, 2] >= strips.frames.center[0, -1, 2]).mean()
    assert 0.85 < held < 0.95
    np.testing.assert_allclose(strips.frames.center[0, 0], 0.0, atol=1e-3)


def test_a_card_reaches_back_to_its_rearmost_roots_along_the_head() -> None:
    """Roots spread along the head, with hair that rises at 45 or 63 degrees. The card of upright
    hair is not lengthened."""
    spread, order = 0.02 / 3.0**0.5, np.random.default_rng(0).permutation(400)
    for lean, begins in ((1.0, -1.7 * spread), (0.5, -0.85 * spread), (0.0, 0.0)):
        grid = flat_bundle((8.0, 0.0, 0.0), 400)
        grid[..., 1] -= np.linspace(-0.02, 0.02, 400, dtype=np.float32)[order, None] * lean
        grid[..., 1] += lean * grid[..., 2]
        strips = fitted(grid, (0.0, 0.0, -1.0))
        np.testing.assert_allclose(strips.frames.center[0, 0, 1], -begins, atol=4e-4)
        np.testing.assert_allclose(strips.frames.center[0, 0, [0, 2]], 0.0, atol=2e-4)


@pytest.mark.parametrize("slope", [-1.5, 0.0, 0.6, 9.0])
def test_a_slanted_line_of_roots_slants_the_card_and_does_not_lengthen_it(slope: float) -> None:
    """Steeper lines than 2 are slanted by 2, and the card reaches back for the rest."""
    grid = flat_bundle((1.0, 0.0, 0.0), 400)
    grid[..., 2] -= slope * grid[:, :1, 0]
    strips = fitted(grid, (0.0, -1.0, 0.0))
    along = strips.frames.side[0, 0] @ np.array([1.0, 0.0, 0.0])
    found = root_slopes(strips.frames, grid, one_cluster(grid))
    np.testing.assert_allclose(found, np.clip(slope, -2.0, 2.0) * along, atol=1e-3)
    tiny = replace(strips.frames, center=1e-6 * strips.frames.center)
    np.testing.assert_allclose(root_slopes(tiny, 1e-6 * grid, one_cluster(grid)), found, atol=1e-3)
    beyond = 1.7 * max(abs(slope) - 2.0, 0.0) * BREADTH / 12.0**0.5
    np.testing.assert_allclose(strips.frames.center[0, 0, 2], beyond, atol=2e-4)


def test_nineteen_of_twenty_places_of_a_groom_lie_on_their_card() -> None:
    """The points of wavy strands that hang from a head lie within the width of their card."""
    random = np.random.default_rng(4)
    normal = random.normal(size=(3000, 3))
    normal[:, 2] = np.abs(normal[:, 2])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    along = np.linspace(0.0, 1.0, 16)[:, None]
    grid = normal[:, None] * (0.1 + 0.05 * np.sqrt(along)) + along**2 * [0.0, 0.0, -0.2]
    grid += 0.004 * np.sin(along * 9.0 + random.random((3000, 1, 1)) * 6.0) * [1.0, 0.0, 0.0]
    grid = grid.astype(np.float32)
    settings = CardSettings(card_count=120, fly_aways=0.0)
    cluster = cluster_of_strands(grid, np.zeros(3000, np.int32), settings)
    radius = np.full(grid.shape[:2], RADIUS, np.float32)
    strips = fit_strips(grid, radius, cluster, normal.astype(np.float32), settings)
    away = grid - strips.frames.center[cluster]
    aside = np.abs(np.einsum("sri,sri->sr", away, strips.frames.side[cluster]))
    assert (aside <= strips.width[cluster] / 2.0).mean() > 0.93
    # half of all points are nearer to the card's plane than half a card's width
    ahead = np.abs(np.einsum("sri,sri->sr", away, strips.frames.normal[cluster]))
    assert np.median(ahead) < 0.5 * np.median(strips.width)
    facing = np.einsum("cri,ci->cr", strips.frames.normal, _mean_normals(normal, cluster))
    assert (facing.mean(axis=1) > 0.0).all()


def _mean_normals(normal: np.ndarray, cluster: np.ndarray) -> np.ndarray:
    return np.stack([normal[cluster == each].mean(axis=0) for each in range(cluster.max() + 1)])


def test_more_cards_than_strands_and_two_strands_give_a_card_each() -> None:
    grid = flat_bundle((1.0, 0.0, 0.0), 2)
    for count in (1, 2, 800):
        settings = CardSettings(card_count=count, fly_aways=0.0)
        cluster = cluster_of_strands(grid, np.zeros(2, np.int32), settings)
        assert cluster.max() + 1 == min(count, 2)
        radius = np.full(grid.shape[:2], RADIUS, np.float32)
        normal = np.tile(np.float32([0.0, -1.0, 0.0]), (2, 1))
        strips = fit_strips(grid, radius, cluster, normal, settings)
        assert np.isfinite(strips.width).all() and (strips.width > 0.0).all()
        assert np.isfinite(strips.frames.normal).all()
