"""Some of the seeded runs of bench/endurance.py: all values stay finite, and lengths are kept."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from extension_loader import REPOSITORY
from tiers import few_in_commits

from hairloom.addon.dynamics.state import DynamicsState, start
from hairloom.addon.dynamics.step import advance

sys.path.append(str(REPOSITORY / "bench"))
from _random_runs import promises_length, random_run, reach_of, shaken

#: Quick ones, with two to 24 CVs, all kinds of colliders, both length solvers, held tips. In the
#: first two relaxation with long-range attachment used to leave zigzags of 1.4 times their length.
SEEDS = (10, 15, 4, 1, 5, 7, 9, 12, 14, 17, 20, 32, 36)


@pytest.mark.parametrize("seed", few_in_commits(SEEDS))
def test_no_settings_and_colliders_break_the_hair(seed: int) -> None:
    run = random_run(seed)
    state = run.begin()
    for drive in run.drives(0.5):
        state = advance(state, drive, run.settings, 1.0 / run.fps)
        reach = reach_of(state, run.settings)
        assert reach.is_finite
        assert reach.along <= 1.02 or not promises_length(run.settings)


def test_a_shaken_head_leaves_the_hair_its_length() -> None:
    run = shaken(guide_count=30)
    state = run.begin()
    for drive in run.drives(1.0):
        state = advance(state, drive, run.settings, 1.0 / run.fps)
        assert reach_of(state).along < 1.005


def test_the_runs_are_what_they_say() -> None:
    """The random runs cover the whole range, without which the tests above would show little."""
    runs = [random_run(seed) for seed in range(60)]
    settings = [run.settings for run in runs]
    assert {run.grid.shape[1] for run in runs} == {2, 3, 4, 8, 16, 24}
    kinds = {type(solid).__name__ for run in runs for solid, _ in run.colliders}
    assert len(kinds) == 4
    assert any(run.held is not None for run in runs)
    assert 15 < sum(run.room is not None for run in runs) < 45
    assert {one.length_solver for one in settings} == {"direct", "relaxation"}
    assert max(one.wind_speed for one in settings) == 200.0
    assert min(one.gravity for one in settings) == -10.0
    again = random_run(7)
    np.testing.assert_array_equal(again.grid, random_run(7).grid)
    assert again.settings == random_run(7).settings


def test_what_stretches_or_breaks_is_seen(kit) -> None:
    """The measure can fail: a strand pulled to 1.1 of its length, and one with a NaN."""
    state = start(kit.straight(2, 8))
    pulled = state.position * np.float32([[[1.0]], [[1.0]], [[1.1]]])
    reach = reach_of(DynamicsState(pulled, pulled, state.rest))
    assert reach.straight == pytest.approx(1.1, rel=1e-5)
    assert reach.along == pytest.approx(1.1, rel=1e-5)
    broken = state.position.copy()
    broken[0, 5, 1] = np.nan
    assert not reach_of(DynamicsState(broken, broken, state.rest)).is_finite
