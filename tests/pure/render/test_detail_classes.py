"""Strands in classes by number of pieces: all are drawn, little is wasted, and the order is
fixed."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.render.detail_classes import MAX_CLASSES, capacities, detail_classes


def test_capacities_grow_by_a_sixteenth_at_most() -> None:
    series = capacities(63 * 64, 16)
    assert series[0] == 0 and series[:33].tolist() == list(range(33))
    assert series[-1] >= 63 * 64 > series[-2]
    assert (np.diff(series) <= np.maximum(series[:-1] // 16, 1)).all()


@pytest.mark.parametrize("by_depth", [True, False])
@pytest.mark.parametrize("most", [1, 2, 40, 63 * 64])
def test_each_strand_is_in_the_class_that_just_holds_it(most: int, by_depth: bool) -> None:
    random = np.random.default_rng(most)
    totals, depths = random.integers(0, most + 1, 3000), random.random(3000)
    order, classes = detail_classes(totals, depths if by_depth else None)
    assert len(classes) <= MAX_CLASSES
    assert sorted(order) == np.flatnonzero(totals).tolist()
    assert sum(c.count for c in classes) == len(order)
    held = sorted({drawn.capacity for drawn in classes})
    slab = 1.0 / min(max(MAX_CLASSES // len(held), 1), 16)
    before, first = dict(zip(held, [0, *held], strict=False)), 0
    for drawn in classes:
        assert drawn.first == first
        own = order[first : first + drawn.count]
        assert (np.diff(own) > 0).all(), "strands of a class keep their order"
        assert (totals[own] <= drawn.capacity).all()
        assert (totals[own] > before[drawn.capacity]).all()
        if by_depth:
            assert np.ptp(depths[own]) <= slab
        first += drawn.count
    if by_depth:
        assert (np.diff(depths[order]) > -slab).all(), "from near to far"


def test_strands_of_one_class_are_finely_sorted_by_depth() -> None:
    depths = np.random.default_rng(2).random(3000)
    order, classes = detail_classes(np.full(3000, 7), depths)
    assert len(classes) == 16 and (np.diff(depths[order]) > -1.0 / 16.0).all()


def test_strands_that_are_not_drawn_change_no_others_place() -> None:
    random = np.random.default_rng(5)
    totals, depths = random.integers(1, 50, 2000), random.random(2000)
    everyone, _ = detail_classes(totals, depths)
    totals[::3] = 0
    some, _ = detail_classes(totals, depths)
    assert some.tolist() == [strand for strand in everyone if strand % 3]


def test_few_vertices_are_wasted() -> None:
    random = np.random.default_rng(1)
    for totals, wasted in (
        (random.integers(15, 34, 20_000), 1.03),
        (random.integers(15, 500, 20_000), 1.25),
    ):
        _, classes = detail_classes(totals)
        needed = 2 * (totals + 1).sum()
        assert needed <= sum(c.vertex_count for c in classes) <= wasted * needed


@pytest.mark.parametrize("depth", [2.0, np.nan, np.inf])
def test_depths_that_are_all_the_same_or_none(depth: float) -> None:
    totals, depths = np.array([3, 0, 3, 4]), np.array([2.0, 2.0, depth, 2.0])
    order, classes = detail_classes(totals, depths)
    assert sorted(order) == [0, 2, 3]
    assert sum(c.count for c in classes) == 3


def test_no_strands_have_no_classes() -> None:
    for totals in (np.zeros(0, np.int64), np.zeros(5, np.int64)):
        order, classes = detail_classes(totals, np.ones(len(totals)))
        assert not len(order) and classes == ()
