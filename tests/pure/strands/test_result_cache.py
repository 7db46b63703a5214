"""Cached results equal computed ones."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.strands.nearest import nearest_points
from hairloom.addon.strands.result_cache import NO_CACHE, ResultCache


def cloud(count: int, seed: int, rounded: int | None = None) -> np.ndarray:
    """Random points in a cube, optionally rounded to a grid, where many distances are equal."""
    points = np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 3))
    return (points if rounded is None else np.round(points * rounded) / rounded).astype(np.float32)


def change(points: np.ndarray, kind: str, seed: int) -> np.ndarray:
    """The points with some moved, removed or added, or all shuffled."""
    random = np.random.default_rng(seed)
    some = random.choice(len(points), max(len(points) // 20, 1), replace=False)
    if kind == "moved":
        points = points.copy()
        points[some] += random.normal(0.0, 0.05, (len(some), 3)).astype(np.float32)
    elif kind == "fewer":
        points = np.delete(points, some, axis=0)
    elif kind == "more":
        points = np.insert(points, np.sort(some), cloud(len(some), seed + 1), axis=0)
    elif kind == "shuffled":
        points = points[random.permutation(len(points))]
    return points


CHANGES = ("nothing", "moved", "fewer", "more", "shuffled")


@pytest.mark.parametrize("rounded", [None, 5])
@pytest.mark.parametrize("of_places", CHANGES)
@pytest.mark.parametrize("of_points", CHANGES)
def test_nearest_points_are_those_that_are_found_from_nothing(
    of_places: str, of_points: str, rounded: int | None
) -> None:
    places, among, cache = cloud(300, 1, rounded), cloud(200, 2, rounded), ResultCache()
    for step in range(4):
        found = cache.nearest("here", places, among, 5)
        expected = nearest_points(places, among, 5)
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_array_equal(one, other)
        places, among = (
            change(places, of_places, 10 * step),
            change(among, of_points, 10 * step + 5),
        )


def test_few_places_are_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    from hairloom.addon.strands import result_cache as module

    computed: list[int] = []

    def counted(places: np.ndarray, among: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
        if count > 1:
            computed.append(len(places))
        return nearest_points(places, among, count)

    monkeypatch.setattr(module, "nearest_points", counted)
    places, among, cache = cloud(2000, 1), cloud(2000, 2), ResultCache()
    cache.nearest("here", places, among, 5)
    among = among.copy()
    among[7] += np.float32(0.01)
    cache.nearest("here", places, among, 5)
    assert computed[0] == 2000 and 0 < computed[1] < 30


def test_only_new_rows_are_made() -> None:
    """Rows are found wherever they were before; values of any type are compared bit by bit."""
    cache, computed = ResultCache(), []
    rows = np.random.default_rng(3).normal(size=(50, 4, 3)).astype(np.float32)
    key = np.arange(50, dtype=np.uint64)

    def computed_rows(
        rows: np.ndarray, key: np.ndarray, cache: ResultCache, factor: int = 2
    ) -> np.ndarray:
        def make(some: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            computed.append(some)
            return rows[some].sum(axis=1) * factor, key[some] + 1

        total, after = cache.rows("sums", (factor,), (rows, key), make)
        np.testing.assert_array_equal(total, rows.sum(axis=1) * factor)
        np.testing.assert_array_equal(after, key + 1)
        return computed[-1]

    assert len(computed_rows(rows, key, cache)) == 50
    other = rows.copy()
    other[7, 2, 1] = np.nextafter(other[7, 2, 1], np.float32(9))
    np.testing.assert_array_equal(computed_rows(other, key, cache), [7])
    order = np.random.default_rng(4).permutation(50)[:30]
    count = len(computed)
    computed_rows(other[order], key[order], cache)
    assert len(computed) == count, "all of them are known"
    assert len(computed_rows(rows, key, cache)) == 21, (
        "those that were not asked for last are forgotten"
    )
    key = key.copy()
    key[3] = 1 << 40
    np.testing.assert_array_equal(computed_rows(rows, key, cache), [3])
    assert len(computed_rows(rows, key, cache, factor=3)) == 50
    assert len(computed_rows(rows[:0], key[:0], cache, factor=4)) == 0
    assert len(computed_rows(rows, key, NO_CACHE, factor=3)) == 50
    assert len(computed_rows(rows, key, NO_CACHE, factor=3)) == 50


def test_rows_that_swap_two_numbers_are_distinguished() -> None:
    rows = np.array([[1.0, 2.0], [2.0, 1.0], [1.0, 2.0]], np.float32)
    cache = ResultCache()

    def first(rows: np.ndarray) -> list[float]:
        return cache.rows("first", (), (rows,), lambda some: (rows[some, 0],))[0].tolist()

    assert first(rows) == [1.0, 2.0, 1.0]
    assert first(rows[::-1]) == [1.0, 2.0, 1.0]
    assert first(rows[1:2]) == [2.0]
