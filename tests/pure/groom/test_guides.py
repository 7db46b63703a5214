"""Guides: fair numbers per group, even spread, and the same ones for the same seed."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.arrays import Floats, Ints
from hairloom.addon.groom.guides import choose_guides, guide_counts
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.strands import StrandSet
from hairloom.addon.strands.face import BROWS, LASHES


def strands_at(root: Floats, group: Ints) -> StrandSet:
    points = np.stack([root, root + np.array([0.0, 0.0, 0.1])], axis=1).reshape(-1, 3)
    return StrandSet(points, np.arange(len(root) + 1) * 2, np.full(len(points), 4e-5), group)


def square(count: int, seed: int = 1) -> Floats:
    flat = np.random.default_rng(seed).random((count, 2))
    return np.concatenate([flat, np.zeros((count, 1))], axis=1)


@pytest.mark.parametrize(
    ("sizes", "guide_count", "expected"),
    [
        ([100], 10, [10]),
        ([60, 30, 10], 10, [5, 3, 2]),
        ([1000, 1, 1], 10, [8, 1, 1]),
        ([5, 5], 100, [5, 5]),
        ([5, 5, 5], 2, [1, 1, 1]),
        ([1, 1, 1], 3, [1, 1, 1]),
        ([3, 500], 500, [3, 497]),
        ([], 10, []),
    ],
)
def test_each_group_gets_the_expected_number_of_guides(
    sizes: list[int], guide_count: int, expected: list[int]
) -> None:
    assert guide_counts(np.array(sizes, np.int64), guide_count).tolist() == expected


def test_guide_counts_of_random_groups_are_proportional() -> None:
    random = np.random.default_rng(1)
    for _ in range(300):
        sizes = random.integers(1, 200, random.integers(1, 20))
        guide_count = int(random.integers(1, 400))
        expected = guide_counts(sizes, guide_count)
        assert expected.sum() == max(min(guide_count, sizes.sum()), len(sizes))
        assert (expected >= 1).all()
        assert (expected <= sizes).all()
        order = np.argsort(sizes, kind="stable")
        assert (np.diff(expected[order])[np.diff(sizes[order]) > 0] >= 0).all()


def test_guides_spread_over_each_group() -> None:
    """Farthest-point sampling is a 2-approximation: guides are no closer to each other than the
    largest distance of a root from its guide (Gonzalez 1985)."""
    root = square(4000)
    group = (root[:, 0] > 0.7).astype(np.int64)
    strands = strands_at(root, group)
    guides = choose_guides(strands, GuideSettings(guide_count=100))
    assert len(guides) == len(set(guides.tolist())) == 100
    assert np.bincount(group[guides]) == pytest.approx(100 * np.bincount(group) / 4000, abs=1)
    for name in (0, 1):
        own, chosen = root[group == name], root[guides[group[guides] == name]]
        cover = np.linalg.norm(own[:, None] - chosen[None], axis=2).min(axis=1).max()
        between = np.linalg.norm(chosen[:, None] - chosen[None], axis=2)
        assert between[between > 0].min() >= cover * (1.0 - 1e-6)


def test_the_seed_decides_and_nothing_else_does() -> None:
    strands = strands_at(square(5000), np.zeros(5000, np.int64))
    settings = GuideSettings(guide_count=20, seed=3)
    guides = choose_guides(strands, settings)
    assert (guides == choose_guides(strands, settings)).all()
    other = choose_guides(strands, GuideSettings(guide_count=20, seed=4))
    assert set(guides.tolist()) != set(other.tolist())


def test_more_guides_than_strands_takes_them_all_and_none_of_none() -> None:
    strands = strands_at(square(30), np.arange(30) % 3)
    assert choose_guides(strands, GuideSettings()).tolist() == list(range(30))
    none = strands.take(np.zeros(0, np.int64))
    assert choose_guides(none, GuideSettings()).tolist() == []


def test_roots_in_one_point_still_give_different_guides() -> None:
    strands = strands_at(np.zeros((50, 3)), np.zeros(50, np.int64))
    assert len(set(choose_guides(strands, GuideSettings(guide_count=10)).tolist())) == 10


def test_brows_and_lashes_leave_the_guides_to_the_scalp() -> None:
    sizes = {0: 8000, BROWS: 1000, LASHES: 420}
    group = np.repeat(list(sizes), list(sizes.values()))
    guides = choose_guides(strands_at(square(len(group)), group), GuideSettings())
    of_face = {name: int((group[guides] == name).sum()) for name in sizes}
    assert len(guides) == GuideSettings().guide_count
    assert of_face[0] >= 0.99 * len(guides)
    assert of_face[BROWS] >= 1 and of_face[LASHES] >= 1
    # other groups have guides in proportion to their size
    plain = choose_guides(strands_at(square(9420), np.minimum(group, 2)), GuideSettings())
    assert (np.minimum(group, 2)[plain] == 0).sum() < 0.9 * len(plain)
