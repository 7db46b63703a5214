"""Work in several threads gives what one thread gives, in the same order."""

from __future__ import annotations

import numpy as np
import pytest

from hairloom.addon.strands import nearest, parallel
from hairloom.addon.strands.result_cache import ResultCache


@pytest.mark.parametrize("count", [0, 1, 9, 10, 11, 1000])
def test_parts_are_all_rows_in_order(count: int) -> None:
    parts = parallel.even_slices(count, min_size=10)
    assert 1 <= len(parts) <= parallel.THREADS
    np.testing.assert_array_equal(
        np.concatenate([np.arange(count)[p] for p in parts]), range(count)
    )
    sizes = [part.stop - part.start for part in parts]
    assert len(sizes) == 1 or min(sizes) >= 10


def test_answers_come_in_order_and_errors_come_through(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel, "THREADS", 3)
    assert parallel.parallel_map(lambda x: x * x, range(50)) == [x * x for x in range(50)]
    with pytest.raises(ZeroDivisionError):
        parallel.parallel_map(lambda x: 1 / x, range(3))


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_nearest_points_are_the_same_in_several_threads(
    threads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against all distances; of coincident points the first counts."""
    monkeypatch.setattr(nearest, "THREADS", threads)
    random = np.random.default_rng(1)
    places = random.random((nearest._MAX_PLACES_PER_PART + 501, 3))
    among = np.round(random.random((300, 3)), 1)
    index, distance = nearest.nearest_points(places, among, 4)
    far = np.sqrt(((places[:, None] - among) ** 2).sum(axis=2))
    np.testing.assert_array_equal(index, np.argsort(far, axis=1, kind="stable")[:, :4])
    np.testing.assert_allclose(distance, np.sort(far, axis=1)[:, :4], rtol=1e-12)


@pytest.mark.parametrize("forgets", [True, False])
def test_rows_are_made_in_order(forgets: bool) -> None:
    rows = np.random.default_rng(2).random((9000, 2)).astype(np.float32)
    sums, places = ResultCache(is_disabled=forgets).rows(
        "sums", (), (rows,), lambda some: (rows[some].sum(axis=1), some)
    )
    np.testing.assert_array_equal(sums, rows.sum(axis=1))
    np.testing.assert_array_equal(places, np.arange(9000))
