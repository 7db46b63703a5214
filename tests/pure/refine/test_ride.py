"""Riding on guides: against the sum written out, exact where it can be."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from hairloom.addon.arrays import Floats
from hairloom.addon.groom.weights import GuideWeights
from hairloom.addon.refine.ride import ride


def scene(strand_count: int, guide_count: int = 20) -> tuple[Floats, Floats, GuideWeights]:
    random = np.random.default_rng(1)
    rest = random.normal(size=(strand_count, 7, 3)).astype(np.float32)
    guide_rest = random.normal(size=(guide_count, 7, 3)).astype(np.float32)
    guide = random.integers(guide_count, size=(strand_count, 3)).astype(np.int32)
    weight = random.dirichlet([1, 1, 1], strand_count).astype(np.float32)
    return rest, guide_rest, GuideWeights(guide, weight)


@pytest.mark.parametrize("strand_count", [0, 1, 511, 512, 513, 1500])
def test_agrees_with_the_sum_written_out(strand_count: int) -> None:
    rest, guide_rest, weights = scene(strand_count)
    guide_now = guide_rest + np.random.default_rng(2).normal(size=guide_rest.shape)
    found = ride(rest, guide_rest, guide_now, weights)
    assert found.dtype == np.float32
    assert found.shape == rest.shape
    for strand in range(strand_count):
        expected = rest[strand].astype(np.float64)
        for guide, weight in zip(weights.guide[strand], weights.weight[strand], strict=True):
            expected = expected + weight * (guide_now - guide_rest)[guide]
        assert found[strand] == pytest.approx(expected, abs=1e-5)


def test_guides_at_rest_leave_every_bit() -> None:
    rest, guide_rest, weights = scene(1000)
    found = ride(rest, guide_rest, guide_rest, weights)
    assert (found == rest).all()
    found += 1.0
    assert (rest == scene(1000)[0]).all()  # the result is no view of the input


def test_a_shift_of_all_guides_shifts_all_strands() -> None:
    rest, guide_rest, weights = scene(1000)
    shift = np.array([0.5, -2.0, 1.0], np.float32)
    assert ride(rest, guide_rest, guide_rest + shift, weights) == pytest.approx(
        rest + shift, abs=2e-6
    )


def test_a_strand_that_is_a_guide_goes_where_the_guide_goes() -> None:
    _, guide_rest, _ = scene(1)
    guide_now = guide_rest + np.random.default_rng(3).normal(size=guide_rest.shape)
    count = len(guide_rest)
    alone = GuideWeights(
        np.repeat(np.arange(count)[:, None], 3, axis=1), np.tile([1.0, 0.0, 0.0], (count, 1))
    )
    assert ride(guide_rest, guide_rest, guide_now, alone) == pytest.approx(guide_now, abs=1e-6)


def test_riding_takes_little_more_memory_than_its_result() -> None:
    """The most that is taken at once grows with the strands, not with three times the strands."""
    for strand_count in (20_000, 60_000):
        rest, guides, weights = scene(strand_count)
        tracemalloc.start()
        size = ride(rest, guides, guides, weights).nbytes
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < 1.2 * size
