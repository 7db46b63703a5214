"""Clusters of strands against known bundles, and against moves of single strands."""

from __future__ import annotations

import numpy as np

from hairloom.addon.cards.clusters import (
    cluster_of_guides,
    cluster_strands,
    is_at_rim,
    proportional_parts,
)
from hairloom.addon.strands.face import BROWS, LASHES


def bundles(count: int, strands: int, spread: float = 0.002) -> tuple[np.ndarray, np.ndarray]:
    """Straight strands (n, 8, 3) in bundles 5 cm apart, and the bundle of each."""
    random = np.random.default_rng(5)
    owner = random.permutation(np.repeat(np.arange(count), strands))
    roots = np.stack([owner % 4, owner // 4, np.zeros(len(owner))], axis=1) * 0.05
    roots += random.normal(size=roots.shape) * spread
    along = np.linspace(0.0, 0.2, 8)[:, None] * [0.1, 0.0, -1.0]
    return (roots[:, None] + along).astype(np.float32), owner


def spread_within(grid: np.ndarray, label: np.ndarray) -> float:
    """The objective of k-means: squared distances from the cluster's mean, over all CVs."""
    means = np.stack([grid[label == each].mean(axis=0) for each in range(label.max() + 1)])
    return float(((grid - means[label]) ** 2).sum())


def test_bundles_that_lie_apart_are_found() -> None:
    grid, owner = bundles(12, 30)
    label = cluster_strands(grid, np.zeros(len(grid), np.int32), 12)
    pairs = {(int(a), int(b)) for a, b in zip(label, owner, strict=True)}
    assert len(pairs) == 12 == label.max() + 1


def test_strands_lie_along_the_nearest_guide_of_their_group() -> None:
    grid, owner = bundles(12, 20)
    guides = np.unique(owner, return_index=True)[1]
    same = np.zeros(len(grid), np.int32)
    np.testing.assert_array_equal(cluster_of_guides(grid, same, guides), owner)
    # two groups side by side, each with the guides of half of the bundles
    group = (np.arange(len(grid)) % 2).astype(np.int32)
    group[guides[6:]], group[guides[:6]] = 0, 1
    found = cluster_of_guides(grid, group, guides)
    np.testing.assert_array_equal(group[guides][found], group)
    np.testing.assert_array_equal(found[guides], np.arange(12))
    # a group without guides uses those of others
    alone = np.where(np.isin(np.arange(len(grid)), guides), 0, 1)
    np.testing.assert_array_equal(cluster_of_guides(grid, alone, guides), owner)


def test_coinciding_guides_keep_their_own_clusters() -> None:
    grid = np.tile(bundles(1, 1)[0], (3, 1, 1))
    same = np.zeros(3, np.int32)
    np.testing.assert_array_equal(cluster_of_guides(grid, same, np.array([0, 2]))[[0, 2]], [0, 1])


def test_strands_that_diverge_from_touching_roots_are_separated() -> None:
    random = np.random.default_rng(2)
    side = np.repeat([-1.0, 1.0], 50)
    along = np.linspace(0.0, 0.2, 8)
    grid = random.normal(size=(100, 1, 3)) * 0.001 + np.stack(
        [side[:, None] * along, 0.0 * side[:, None] + 0.0 * along, -along + 0.0 * side[:, None]],
        axis=-1,
    )
    label = cluster_strands(grid.astype(np.float32), np.zeros(100, np.int32), 2)
    np.testing.assert_array_equal(label, np.where(np.arange(100) < 50, label[0], 1 - label[0]))


def test_no_cluster_holds_two_groups_and_each_gets_clusters_in_proportion() -> None:
    grid, _ = bundles(8, 50, spread=0.03)
    group = np.where(np.arange(len(grid)) < 300, 7, -2).astype(np.int32)
    label = cluster_strands(grid, group, 40)
    in_first, in_second = set(label[:300].tolist()), set(label[300:].tolist())
    assert not in_first & in_second
    assert (len(in_first), len(in_second)) == (30, 10)


def test_no_single_strand_could_move_to_a_much_better_cluster() -> None:
    """A local optimum of k-means: hardly any strand is nearer to another mean, and no start gives
    a much better one."""
    grid = np.random.default_rng(3).normal(size=(400, 6, 3)).astype(np.float32)
    group = np.zeros(400, np.int32)
    found = [spread_within(grid, cluster_strands(grid, group, 20, seed)) for seed in range(8)]
    assert max(found) < 1.1 * min(found)
    random = np.random.default_rng(0).integers(20, size=400)
    assert max(found) < 0.95 * spread_within(grid, random)


def test_clusters_depend_on_the_seed_alone() -> None:
    grid = np.random.default_rng(3).normal(size=(300, 6, 3)).astype(np.float32)
    group = np.zeros(300, np.int32)
    first = cluster_strands(grid, group, 20, seed=4)
    np.testing.assert_array_equal(first, cluster_strands(grid, group, 20, seed=4))
    assert (first != cluster_strands(grid, group, 20, seed=5)).any()


def test_as_many_clusters_as_strands_and_more_leave_each_strand_alone() -> None:
    grid, _ = bundles(3, 4)
    for count in (12, 500):
        label = cluster_strands(grid, np.zeros(12, np.int32), count)
        np.testing.assert_array_equal(np.sort(label), np.arange(12))


def test_strands_that_coincide_are_one_cluster() -> None:
    grid = np.ones((9, 4, 3), np.float32)
    np.testing.assert_array_equal(cluster_strands(grid, np.zeros(9, np.int32), 3), np.zeros(9))


def test_strands_beyond_the_sampled_ones_find_their_bundle() -> None:
    grid, owner = bundles(10, 2_500)
    label = cluster_strands(grid, np.zeros(len(grid), np.int32), 10)
    pairs = {(int(a), int(b)) for a, b in zip(label, owner, strict=True)}
    assert len(pairs) == 10


def test_parts_are_proportional_to_sizes() -> None:
    np.testing.assert_array_equal(proportional_parts(10, np.array([50, 30, 20])), [5, 3, 2])
    np.testing.assert_array_equal(proportional_parts(2, np.array([1000, 1, 1])), [2, 1, 1])
    np.testing.assert_array_equal(proportional_parts(100, np.array([3, 5])), [3, 5])


def test_cards_of_brows_and_lashes_hold_few_strands() -> None:
    """In proportion to all cards they would get one or two, which look like blocks."""
    grid, _ = bundles(12, 60)
    group = np.repeat([0, BROWS, LASHES], [600, 80, 40]).astype(np.int32)
    label = cluster_strands(grid, group, 20)
    cards = {name: len(np.unique(label[group == name])) for name in (0, BROWS, LASHES)}
    assert cards[BROWS] == 10 and cards[LASHES] == 5 and cards[0] <= 20
    few = cluster_strands(grid[:603], np.repeat([0, BROWS], [600, 3]), 20)
    assert len(np.unique(few[600:])) == 1


def parted(count: int = 4000, lift: float = 0.2) -> tuple[np.ndarray, np.ndarray]:
    """Strands (n, 8, 3) on a square of 10 cm, combed away from its middle line, and normals."""
    roots = np.random.default_rng(6).uniform(-0.05, 0.05, (count, 3)) * [1.0, 1.0, 0.0]
    way = np.stack([np.sign(roots[:, 0]), 0.0 * roots[:, 0], np.full(count, lift)], axis=1)
    grid = roots[:, None] + np.linspace(0.0, 0.1, 8)[:, None] * way[:, None]
    return grid.astype(np.float32), np.tile(np.float32([0.0, 0.0, 1.0]), (count, 1))


def test_the_rim_lies_along_the_parting_only() -> None:
    grid, normal = parted()
    is_rim, away = is_at_rim(grid, normal, 40.0), np.abs(grid[:, 0, 0])
    # an average card is a square of 1 cm
    assert is_rim[away < 0.001].all()
    assert 0.001 < np.median(away[is_rim]) < 0.004 and away[is_rim].max() < 0.01
    # upright hair covers no roots
    assert not is_at_rim(parted(lift=9.0)[0], normal, 40.0).any()
    # a hairline: no roots on one side
    half = grid[:, 0, 0] > 0.0
    is_rim = is_at_rim(grid[half], normal[half], 40.0)
    assert is_rim[away[half] < 0.0005].all() and away[half][is_rim].max() < 0.01


def test_cards_along_a_parting_hold_fewer_strands() -> None:
    grid, normal = parted()
    same = np.zeros(len(grid), np.int32)
    found = cluster_strands(grid, same, 100, 0, normal)
    assert found.max() == 99
    is_rim = is_at_rim(grid, normal, 40.0)
    assert 3.0 < 40.0 / (is_rim.sum() / len(np.unique(found[is_rim]))) < 5.0
    # and no strands from elsewhere
    assert not set(found[is_rim].tolist()) & set(found[~is_rim].tolist())
