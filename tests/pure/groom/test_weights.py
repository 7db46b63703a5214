"""Weights: against a slow search, never across groups or partings, and without jumps."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.groom.weights import guide_weights


def square(count: int, seed: int) -> Floats:
    flat = np.random.default_rng(seed).random((count, 2))
    return np.concatenate([flat, np.zeros((count, 1))], axis=1).astype(np.float32)


def slow_weights(root: Floats, guide_root: Floats) -> dict[int, float]:
    """Franke and Little for one strand among the guides of its group, as in the paper."""
    distance = np.linalg.norm(guide_root.astype(float) - root.astype(float), axis=1)
    nearest = np.argsort(distance)[:4]
    reach = distance[nearest[3]]
    raw = [(reach - distance[g]) / (reach * distance[g]) for g in nearest[:3]]
    return {int(g): value / sum(raw) for g, value in zip(nearest[:3], raw, strict=True)}


def test_agrees_with_a_slow_search_and_stays_in_its_group() -> None:
    root, guide_root = square(300, 1), square(40, 2)
    group, guide_group = np.arange(300) % 3 * 5, np.arange(40) % 3 * 5
    found = guide_weights(root, group, guide_root, guide_group)
    assert found.weight.sum(axis=1) == pytest.approx(np.ones(300))
    assert (guide_group[found.guide] == group[:, None]).all()
    for strand in range(300):
        own = np.flatnonzero(guide_group == group[strand])
        expected = slow_weights(root[strand], guide_root[own])
        assert set(found.guide[strand].tolist()) == {int(own[g]) for g in expected}
        for guide, weight in zip(found.guide[strand], found.weight[strand], strict=True):
            assert weight == pytest.approx(expected[int(np.flatnonzero(own == guide)[0])], abs=1e-4)


def test_a_guide_rides_on_itself_alone() -> None:
    root = square(500, 3)
    guides = np.arange(0, 500, 9)
    group = np.zeros(500, np.int64)
    found = guide_weights(root, group, root[guides], group[guides])
    assert found.guide[guides, 0].tolist() == list(range(len(guides)))
    assert (found.weight[guides] == [1.0, 0.0, 0.0]).all()


def test_weights_have_no_jumps() -> None:
    """Each guide's weight along a line of roots changes in proportion to the step."""
    guide_root = square(30, 4)
    guide_group = np.zeros(30, np.int64)

    def largest_step(count: int) -> float:
        line = np.linspace([0.1, 0.2, 0.0], [0.9, 0.7, 0.0], count).astype(np.float32)
        found = guide_weights(line, np.zeros(count, np.int64), guide_root, guide_group)
        dense = np.zeros((count, 30))
        np.add.at(dense, (np.arange(count)[:, None], found.guide), found.weight)
        return float(np.abs(np.diff(dense, axis=0)).max())

    coarse, fine = largest_step(1000), largest_step(8000)
    assert fine < coarse / 4.0


@pytest.mark.parametrize("guide_count", [1, 2, 3, 4])
def test_small_groups_repeat_a_guide_with_weight_zero(guide_count: int) -> None:
    root, guide_root = square(50, 5), square(guide_count, 6)
    found = guide_weights(root, np.zeros(50), guide_root, np.zeros(guide_count))
    assert found.weight.sum(axis=1) == pytest.approx(np.ones(50))
    assert (found.weight >= 0.0).all()
    used = min(guide_count, 3)
    assert (found.weight[:, used:] == 0.0).all()
    assert (found.guide[:, used:] == found.guide[:, used - 1 : used]).all()
    assert found.weight[:, : min(used, 3)].max(axis=0) == pytest.approx(1.0, abs=0.9)


def test_guides_do_not_reach_across_a_parting() -> None:
    """Hair left of x = 0.5 falls to the left, right of it to the right."""

    def fallen(root: Floats) -> Floats:
        side = np.where(root[:, :1] < 0.5, -1.0, 1.0) * np.array([[1.0, 0.0, 0.0]])
        along = np.linspace(0.0, 0.3, 8)[None, :, None]
        return (root[:, None] + along * (side + np.array([0.0, 0.0, -0.3]))[:, None]).astype(
            np.float32
        )

    root, guide_root = square(2000, 7), square(60, 8)
    group, guide_group = np.zeros(2000, np.int64), np.zeros(60, np.int64)

    def weight_across(**grids: Floats) -> Floats:
        found = guide_weights(root, group, guide_root, guide_group, **grids)
        is_across = (guide_root[found.guide, 0] < 0.5) != (root[:, :1] < 0.5)
        return (found.weight * is_across).sum(axis=1)

    assert weight_across().max() > 0.5
    grids = {"strand_grid": fallen(root), "guide_grid": fallen(guide_root)}
    assert weight_across(**grids).max() == 0.0


def test_a_strand_that_goes_where_no_guide_goes_takes_one_guide() -> None:
    guide_root = square(10, 9)
    along = np.linspace(0.0, 0.1, 6)[None, :, None]
    guide_grid = guide_root[:, None] + along * np.array([0.0, 0.0, 1.0])
    root = square(5, 10)
    strand_grid = root[:, None] + along * np.array([0.0, 0.0, -1.0])
    found = guide_weights(
        root,
        np.zeros(5),
        guide_root,
        np.zeros(10),
        strand_grid=strand_grid.astype(np.float32),
        guide_grid=guide_grid.astype(np.float32),
    )
    assert (found.weight == [1.0, 0.0, 0.0]).all()


def test_all_guides_in_one_point_and_no_strands() -> None:
    found = guide_weights(square(20, 11), np.zeros(20), np.zeros((6, 3)), np.zeros(6))
    assert np.isfinite(found.weight).all()
    assert found.weight.sum(axis=1) == pytest.approx(np.ones(20))
    none = guide_weights(np.zeros((0, 3)), np.zeros(0), np.zeros((2, 3)), np.zeros(2))
    assert none.guide.shape == none.weight.shape == (0, 3)
