"""Strips against bundles of strands whose best strip one knows."""

from __future__ import annotations

import numpy as np

from hairloom.addon.cards.fit import (
    cluster_cards,
    fit_strips,
    segment_counts,
    with_fly_aways,
    with_segments,
)
from hairloom.addon.cards.settings import CardSettings

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


def test_the_spread_turns_a_strip_and_the_head_decides_which_side_is_out() -> None:
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


def test_edges_stay_within_the_error_and_one_segment_less_would_not_do() -> None:
    turn = np.linspace(0.0, np.pi, 33)
    arc = np.stack([0.1 * np.sin(turn), 0.0 * turn, 0.1 * np.cos(turn)], axis=-1)
    grid = arc + np.linspace(-0.005, 0.005, 20)[:, None, None] * [0.0, 1.0, 0.0]
    strips = fitted(grid.astype(np.float32), (0.0, 0.0, 1.0))
    counts = [int(segment_counts(strips, error, 32)[0]) for error in (0.01, 0.002, 0.0005)]
    assert counts == sorted(counts) and len(set(counts)) == 3
    # a chord of an arc of the angle a is off by r (1 - cos a/2)
    for error, count in zip((0.01, 0.002, 0.0005), counts, strict=True):
        sagitta = 0.1 * (1.0 - np.cos(np.pi / count / 2.0))
        assert sagitta < 1.1 * error
    assert with_segments(strips, np.array([0]), 4).width.shape == (1, 5)


def test_straight_strands_need_one_segment() -> None:
    strips = fitted(flat_bundle((1.0, 0.0, 0.0)), (0.0, -1.0, 0.0))
    np.testing.assert_array_equal(segment_counts(strips, 1e-5, 12), [1])


def test_strands_that_stick_out_leave_their_cluster() -> None:
    grid = flat_bundle((1.0, 0.0, 0.0))
    grid[[3, 77]] += np.linspace(0.0, 0.1, 9)[:, None].astype(np.float32)
    label = with_fly_aways(grid, one_cluster(grid), 2)
    assert sorted(np.flatnonzero(label)) == [3, 77] and label.max() == 2
    # each cluster keeps a strand
    np.testing.assert_array_equal(np.bincount(with_fly_aways(grid, one_cluster(grid), 999))[:1], 1)


def test_cards_of_a_groom() -> None:
    random = np.random.default_rng(4)
    normal = random.normal(size=(1500, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    along = np.linspace(0.0, 1.0, 12)[:, None]
    grid = normal[:, None] * (0.1 + 0.05 * np.sqrt(along)) + along**2 * [0.0, 0.0, -0.2]
    settings = CardSettings(card_count=60, error=0.003)
    mesh = cluster_cards(
        grid.astype(np.float32),
        np.full(grid.shape[:2], RADIUS, np.float32),
        np.zeros(len(grid), np.int32),
        normal.astype(np.float32),
        settings,
    )
    assert mesh.card_count == 60
    assert (np.diff(mesh.card) >= 0).all()
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles], 1, 0)
    ahead = np.einsum("ij,ij->i", np.cross(b - a, c - a), mesh.normal[mesh.triangles].mean(axis=1))
    assert (ahead > 0.0).mean() > 0.97  # a strip that is bent sharply may fold
    # root to tip: along the strands, which fall
    assert (mesh.tangent[mesh.along > 0.9, 2] < 0.0).mean() > 0.95
