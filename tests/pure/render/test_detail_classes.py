"""Strands in classes of pieces: nothing is lost, little is wasted, the order is always the same."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.render.detail_classes import capacities, detail_classes


def test_capacities_grow_by_a_sixteenth_at_most() -> None:
    series = capacities(63 * 64)
    assert series[0] == 0 and series[:33].tolist() == list(range(33))
    assert series[-1] >= 63 * 64 > series[-2]
    assert (np.diff(series) <= np.maximum(series[:-1] // 16, 1)).all()


@pytest.mark.parametrize("most", [1, 2, 40, 63 * 64])
def test_each_strand_is_in_the_class_that_just_holds_it(most: int) -> None:
    random = np.random.default_rng(most)
    totals, depths = random.integers(0, most + 1, 3000), random.random(3000)
    order, classes = detail_classes(totals, depths)
    assert sorted(order) == np.flatnonzero(totals).tolist()
    assert sum(c.count for c in classes) == len(order)
    series, first = capacities(most).tolist(), 0
    for drawn in classes:
        assert drawn.first == first
        own = order[first : first + drawn.count]
        assert (np.diff(own) > 0).all(), "strands of a class keep their order"
        assert (totals[own] <= drawn.capacity).all()
        assert (totals[own] > series[series.index(drawn.capacity) - 1]).all()
        assert np.ptp(depths[own]) <= 1.0 / 16.0
        first += drawn.count
    assert (np.diff(depths[order]) > -1.0 / 16.0).all(), "from near to far"


def test_strands_that_are_not_drawn_change_no_others_place() -> None:
    random = np.random.default_rng(5)
    totals, depths = random.integers(1, 50, 2000), random.random(2000)
    everyone, _ = detail_classes(totals, depths)
    totals[::3] = 0
    some, _ = detail_classes(totals, depths)
    assert some.tolist() == [strand for strand in everyone if strand % 3]


def test_few_vertices_are_wasted() -> None:
    random = np.random.default_rng(1)
    totals = random.integers(1, 2000, 20_000)
    _, classes = detail_classes(totals, random.random(20_000))
    needed = 2 * (totals + 1).sum()
    assert needed <= sum(c.vertex_count for c in classes) < 1.05 * needed
    assert len(classes) < 16 * 128


@pytest.mark.parametrize("depth", [2.0, np.nan, np.inf])
def test_depths_that_are_all_the_same_or_none(depth: float) -> None:
    totals, depths = np.array([3, 0, 3, 4]), np.array([2.0, 2.0, depth, 2.0])
    order, classes = detail_classes(totals, depths)
    assert sorted(order) == [0, 2, 3]
    assert sum(c.count for c in classes) == 3


def test_none_and_none_drawn() -> None:
    for totals in (np.zeros(0, np.int64), np.zeros(5, np.int64)):
        order, classes = detail_classes(totals, np.ones(len(totals)))
        assert not len(order) and classes == ()
