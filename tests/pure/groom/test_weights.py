"""Weights: against a slow search, not across groups or partings, and without jumps."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.groom.weights import child_weights, guide_weights
from hairloom.addon.strands.nearest import nearest_points


def square(count: int, seed: int) -> Floats:
    flat = np.random.default_rng(seed).random((count, 2))
    return np.concatenate([flat, np.zeros((count, 1))], axis=1).astype(np.float32)


def slow_weights(root: Floats, guide_root: Floats) -> dict[int, float]:
    """Franke and Little's weights of one strand among the guides of its group, as in the paper."""
    distance = np.linalg.norm(guide_root.astype(float) - root.astype(float), axis=1)
    nearest = np.argsort(distance)[:4]
    reach = distance[nearest[3]]
    raw = [(reach - distance[g]) / (reach * distance[g]) for g in nearest[:3]]
    return {int(g): value / sum(raw) for g, value in zip(nearest[:3], raw, strict=True)}


def test_agrees_with_a_slow_search_and_stays_in_its_group() -> None:
    root, guide_root = square(300, 1), square(40, 2)
    group, guide_group = np.arange(300) % 3 * 5, np.arange(40) % 3 * 5
    weights = guide_weights(root, group, guide_root, guide_group)
    assert weights.weight.sum(axis=1) == pytest.approx(np.ones(300))
    assert (guide_group[weights.guide] == group[:, None]).all()
    for strand in range(300):
        group_guides = np.flatnonzero(guide_group == group[strand])
        expected = slow_weights(root[strand], guide_root[group_guides])
        assert set(weights.guide[strand].tolist()) == {int(group_guides[g]) for g in expected}
        for guide, weight in zip(weights.guide[strand], weights.weight[strand], strict=True):
            assert weight == pytest.approx(
                expected[int(np.flatnonzero(group_guides == guide)[0])], abs=1e-4
            )


def test_a_guide_rides_on_itself_alone() -> None:
    root = square(500, 3)
    guides = np.arange(0, 500, 9)
    group = np.zeros(500, np.int64)
    weights = guide_weights(root, group, root[guides], group[guides])
    assert weights.guide[guides, 0].tolist() == list(range(len(guides)))
    assert (weights.weight[guides] == [1.0, 0.0, 0.0]).all()


def test_weights_have_no_jumps() -> None:
    """Along a line of roots, the change of each guide's weight is proportional to the step."""
    guide_root = square(30, 4)
    guide_group = np.zeros(30, np.int64)

    def largest_step(count: int) -> float:
        line = np.linspace([0.1, 0.2, 0.0], [0.9, 0.7, 0.0], count).astype(np.float32)
        weights = guide_weights(line, np.zeros(count, np.int64), guide_root, guide_group)
        dense = np.zeros((count, 30))
        np.add.at(dense, (np.arange(count)[:, None], weights.guide), weights.weight)
        return float(np.abs(np.diff(dense, axis=0)).max())

    coarse, fine = largest_step(1000), largest_step(8000)
    assert fine < coarse / 4.0


@pytest.mark.parametrize("guide_count", [1, 2, 3, 4])
def test_small_groups_repeat_a_guide_with_weight_zero(guide_count: int) -> None:
    root, guide_root = square(50, 5), square(guide_count, 6)
    weights = guide_weights(root, np.zeros(50), guide_root, np.zeros(guide_count))
    assert weights.weight.sum(axis=1) == pytest.approx(np.ones(50))
    assert (weights.weight >= 0.0).all()
    used = min(guide_count, 3)
    assert (weights.weight[:, used:] == 0.0).all()
    assert (weights.guide[:, used:] == weights.guide[:, used - 1 : used]).all()
    assert weights.weight[:, : min(used, 3)].max(axis=0) == pytest.approx(1.0, abs=0.9)


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
        weights = guide_weights(root, group, guide_root, guide_group, **grids)
        is_across = (guide_root[weights.guide, 0] < 0.5) != (root[:, :1] < 0.5)
        return (weights.weight * is_across).sum(axis=1)

    assert weight_across().max() > 0.5
    grids = {"strand_grid": fallen(root), "guide_grid": fallen(guide_root)}
    assert weight_across(**grids).max() == 0.0


def test_a_strand_that_goes_where_no_guide_goes_takes_one_guide() -> None:
    guide_root = square(10, 9)
    along = np.linspace(0.0, 0.1, 6)[None, :, None]
    guide_grid = guide_root[:, None] + along * np.array([0.0, 0.0, 1.0])
    root = square(5, 10)
    strand_grid = root[:, None] + along * np.array([0.0, 0.0, -1.0])
    weights = guide_weights(
        root,
        np.zeros(5),
        guide_root,
        np.zeros(10),
        strand_grid=strand_grid.astype(np.float32),
        guide_grid=guide_grid.astype(np.float32),
    )
    assert (weights.weight == [1.0, 0.0, 0.0]).all()


def test_all_guides_in_one_point_and_no_strands() -> None:
    weights = guide_weights(square(20, 11), np.zeros(20), np.zeros((6, 3)), np.zeros(6))
    assert np.isfinite(weights.weight).all()
    assert weights.weight.sum(axis=1) == pytest.approx(np.ones(20))
    none = guide_weights(np.zeros((0, 3)), np.zeros(0), np.zeros((2, 3)), np.zeros(2))
    assert none.guide.shape == none.weight.shape == (0, 3)


# --- of children ---------------------------------------------------------------------------------

UP = np.array([0.0, 0.0, 1.0])


def straight(root: Floats, direction: Floats) -> Floats:
    """Straight strands of six CVs from these roots, (n, 6, 3)."""
    return (root[:, None] + np.linspace(0.0, 0.1, 6)[:, None] * direction[:, None]).astype(
        np.float32
    )


def test_children_of_parallel_guides_are_weighed_by_their_roots_alone() -> None:
    root, guide_root = square(300, 1), square(40, 2)
    grid = straight(guide_root, np.tile(UP, (40, 1)))
    of_children = child_weights(root, guide_root, np.zeros(40), grid, np.radians(60.0))
    of_strands = guide_weights(root, np.zeros(300), guide_root, np.zeros(40))
    assert (of_children.guide == of_strands.guide).all()
    assert of_children.weight == pytest.approx(of_strands.weight, abs=1e-4)


def test_children_take_the_group_of_their_nearest_guide() -> None:
    root, guide_root = square(300, 3), square(40, 4)
    group = np.arange(40) % 3
    grid = straight(guide_root, np.tile(UP, (40, 1)))
    weights = child_weights(root, guide_root, group, grid, np.radians(60.0))
    nearest = np.linalg.norm(root[:, None] - guide_root[None], axis=2).argmin(axis=1)
    assert (group[weights.guide] == group[nearest][:, None]).all()
    of_strands = guide_weights(root, group[nearest], guide_root, group)
    assert (weights.guide == of_strands.guide).all()


@pytest.mark.parametrize("parting", [20.0, 60.0, 100.0])
def test_all_guides_of_a_child_go_together(parting: float) -> None:
    """Any two of them are within the parting angle, and the nearest guide is one of them."""
    random = np.random.default_rng(5)
    root, guide_root = square(2000, 6), square(200, 7)
    direction = random.normal(size=(200, 3)) * [0.6, 0.6, 0.1] + UP
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    grid = straight(guide_root, direction)
    weights = child_weights(root, guide_root, np.zeros(200), grid, np.radians(parting))
    nearest = np.linalg.norm(root[:, None] - guide_root[None], axis=2).argmin(axis=1)
    assert (weights.guide[:, 0] == nearest).mean() > 0.9
    used = weights.weight > 0.0
    assert (used & (weights.guide == nearest[:, None])).any(axis=1).all()
    for one, two in ((0, 1), (0, 2), (1, 2)):
        both = used[:, one] & used[:, two]
        cosine = np.einsum(
            "nj,nj->n", direction[weights.guide[both, one]], direction[weights.guide[both, two]]
        )
        assert cosine.min(initial=1.0) > np.cos(np.radians(parting)) - 1e-6
    assert used.all(axis=1).any()


def test_a_child_between_two_guides_of_its_side_mixes_both() -> None:
    """Although both guides beyond the parting are nearer than the second one of its own side."""
    guide_root = np.array([[0.0, 0, 0], [3, 0, 0], [0, 1.5, 0], [1, 1.5, 0]])
    side = np.array([[-1.0, 0, 0], [-1, 0, 0], [1, 0, 0], [1, 0, 0]])
    root = np.array([[0.7, 0.0, 0.0]])
    grid = straight(guide_root, side)
    weights = child_weights(root, guide_root, np.zeros(4), grid, np.radians(60.0))
    assert weights.guide[0, :2].tolist() == [0, 1]
    assert weights.weight[0, 2] == 0.0
    # Franke and Little; without a fourth guide R is twice the distance of the farthest one
    raw = np.array([(4.6 - 0.7) / 0.7, (4.6 - 2.3) / 2.3])
    assert weights.weight[0, :2] == pytest.approx(raw / raw.sum(), abs=1e-5)


@pytest.mark.parametrize("guide_count", [1, 2, 3, 4])
def test_children_of_few_guides(guide_count: int) -> None:
    root, guide_root = square(50, 8), square(guide_count, 9)
    grid = straight(guide_root, np.tile(UP, (guide_count, 1)))
    weights = child_weights(root, guide_root, np.zeros(guide_count), grid, np.radians(60.0))
    assert weights.weight.sum(axis=1) == pytest.approx(np.ones(50))
    assert (weights.weight >= 0.0).all()
    assert (weights.weight[:, min(guide_count, 3) :] == 0.0).all()


@pytest.mark.parametrize(("place_count", "point_count"), [(0, 5), (1, 1), (7, 3), (3000, 900)])
def test_nearest_points_are_those_of_a_slow_search(place_count: int, point_count: int) -> None:
    random = np.random.default_rng(10)
    places = random.random((place_count, 3)) * [1.0, 2.0, 0.1] + 100.0
    points = (random.random((point_count, 3)) * [1.0, 2.0, 0.1]).round(1) + 100.0  # with ties
    index, distance = nearest_points(places, points, 4)
    slow = np.linalg.norm(places[:, None] - points[None], axis=2)
    count = min(4, point_count)
    assert index.shape == distance.shape == (place_count, count)
    assert distance == pytest.approx(np.sort(slow, axis=1)[:, :count], abs=1e-12)
    assert distance == pytest.approx(np.take_along_axis(slow, index, axis=1), abs=1e-12)
    some = np.arange(0, place_count, 3)
    fewer_index, fewer_distance = nearest_points(places[some], points, 4)
    assert (fewer_index == index[some]).all()
    assert (fewer_distance == distance[some]).all()
