"""Forces between hairs of a groom: against a form without a grid, and their intended effects."""

from dataclasses import replace

import numpy as np
import pytest
from tails import SOFT_STYLE, cell_count, rotation_matrix, squeezed_tail, tail, two_locks
from tiers import few_in_commits

from hairloom.addon.dynamics import hair_grid as grid_module
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.hair_grid import (
    LOOK_AHEAD,
    HairGrid,
    InteractionStrength,
    friction_and_push,
)
from hairloom.addon.dynamics.reference.hair_grid import GroomPoints, friction_and_push_reference
from hairloom.addon.dynamics.reference.step import advance_reference
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import start
from hairloom.addon.dynamics.step import advance

EARTH, DT = np.array([0.0, 0.0, -9.81]), 1.0 / 180.0


def played(grid, settings, seconds=2.0, fps=24.0, state=None):
    state = start(grid) if state is None else state
    for _ in range(round(seconds * fps)):
        state = advance(state, Drive(grid, grid, (), EARTH), settings, 1.0 / fps)
    return state


@pytest.mark.parametrize("volume", few_in_commits([0.4, 1.0]))
def test_as_without_a_grid(volume):
    rest, position, previous, turn, middle = squeezed_tail()
    grid, settings = rest.hair_grid, DynamicsSettings(volume=volume)
    strength = InteractionStrength.of(settings, DT)
    found = friction_and_push(grid, grid.placement(turn, middle), strength, position, previous)
    flat = [rows.transpose(2, 1, 0).reshape(-1, 3).astype(float) for rows in (position, previous)]
    hair = GroomPoints(flat[0], flat[0] - flat[1], turn, middle.astype(float))
    at_rest = rest.position.transpose(2, 1, 0).reshape(-1, 3).astype(float)
    volumes = np.full(len(at_rest), volume)
    expected = friction_and_push_reference(grid, at_rest, hair, volumes, DT, strength.substeps)
    for one, other in zip(found, expected, strict=True):
        one = one.transpose(2, 1, 0).reshape(-1, 3)
        assert (np.abs(other).max(axis=1) > 1e-6).mean() > 0.3  # it acts on many of them
        np.testing.assert_allclose(one, other, atol=2e-5 * np.abs(other).max())


@pytest.mark.slow(instead="test_as_without_a_grid")
def test_a_frame_as_without_a_grid():
    grid = tail(12, 8)
    settings = DynamicsSettings(volume=1.0, length_tolerance=0.0001, **SOFT_STYLE)
    fast = slow = start(grid)
    for frame in range(4):
        target = grid + np.float32([0.01 * frame, 0.0, 0.0])
        drive = Drive(target - np.float32([0.01, 0.0, 0.0]), target, (), EARTH)
        fast = advance(fast, drive, settings, 1.0 / 24.0)
        slow = advance_reference(slow, drive, settings, 1.0 / 24.0)
        np.testing.assert_allclose(fast.position, slow.position, atol=2e-5)
    alone = played(grid, replace(settings, volume=0.0), 4 / 24.0)
    assert np.abs(fast.push).max() > 1e-7
    assert np.abs(fast.position - alone.position).max() > 1e-3


def test_the_order_of_guides_changes_no_bit():
    rest, position, previous, turn, middle = squeezed_tail(60)
    order = np.random.default_rng(6).permutation(60)
    other = replace(rest, position=rest.position[:, :, order], strands=rest.strands[order])
    strength = InteractionStrength.of(DynamicsSettings(volume=1.0), DT)
    place = rest.hair_grid.placement(turn, middle)
    found = friction_and_push(rest.hair_grid, place, strength, position, previous)
    again = friction_and_push(
        replace(other.hair_grid, middle=rest.hair_grid.middle),
        place,
        strength,
        position[:, :, order],
        previous[:, :, order],
    )
    for one, two in zip(found, again, strict=True):
        assert np.array_equal(one[:, :, order], two)


@pytest.mark.parametrize("angle", [0.0, 0.4, 2.0])
def test_at_rest_it_does_nothing_wherever_the_head_is(angle):
    grid, turn, move = tail(300), rotation_matrix(angle), np.array([3.0, -1.0, 0.5])
    rest = start(grid).rest
    here = (grid @ turn.T + move).astype(np.float32)
    rows = np.ascontiguousarray(here.transpose(2, 1, 0))
    place = rest.hair_grid.placement(turn, grid[:, 0].mean(axis=0) @ turn.T + move)
    strength = InteractionStrength.of(DynamicsSettings(volume=1.0), DT)
    slowed, push = friction_and_push(rest.hair_grid, place, strength, rows, rows)
    assert not slowed.any() and not push.any()


def test_hair_at_rest_stays_at_rest():
    """With weight carried by the style, as by default, hair comes to the same rest as without
    volume."""
    grid = tail(200)
    alone, with_volume = (
        played(grid, DynamicsSettings(volume=volume), 4.0) for volume in (0.0, 1.0)
    )
    assert not with_volume.push.any()
    assert np.abs(with_volume.position - alone.position).max() < 5e-6
    assert np.abs(with_volume.position - with_volume.previous).max() / DT < 1e-4


def test_a_ponytail_keeps_its_volume():
    grid = tail(600)
    kept = {
        volume: cell_count(played(grid, DynamicsSettings(volume=volume, **SOFT_STYLE)).grid)
        / cell_count(grid)
        for volume in (0.0, 1.0)
    }
    assert kept[0.0] < 0.5
    assert kept[1.0] > 0.8


def test_it_comes_to_rest_under_its_weight():
    settings = DynamicsSettings(volume=1.0, **SOFT_STYLE)
    state = played(tail(300), settings, 4.0)
    assert state.push.any()  # the push carries hair
    speed = np.linalg.norm(state.position - state.previous, axis=0) / DT
    assert np.quantile(speed, 0.99) < 0.01
    assert speed.max() < 0.05


def test_locks_do_not_swing_through_each_other():
    grid, side = two_locks(100)
    along = np.linspace(0.0, 1.0, grid.shape[1])
    wrong = {}
    for volume in (0.0, 1.0):
        state = start(grid)
        previous = state.position.copy()
        previous[0] += along[:, None] * side * 0.8 * DT  # 0.8 m/s towards the other, at the tips
        state = replace(state, previous=previous, substep=DT)
        worst = 0.0
        for _ in range(24):
            state = played(grid, DynamicsSettings(volume=volume), 1 / 24.0, 24.0, state)
            x = state.grid[:, grid.shape[1] // 2 :, 0].mean(axis=1)
            worst = max(worst, float((x * side < -0.002).mean()))
        wrong[volume] = worst
    assert wrong[0.0] > 0.9
    assert wrong[1.0] <= 0.05


def test_neighbours_move_together():
    """A strand that moves among still ones is slowed down and drags them along."""
    grid = tail(200)
    rest = start(grid).rest
    previous = rest.position.copy()
    previous[0, :, 7] -= 0.001
    place = rest.hair_grid.placement(np.eye(3), rest.hair_grid.middle)
    strength = InteractionStrength.of(DynamicsSettings(volume=1.0), DT)
    slowed, _ = friction_and_push(rest.hair_grid, place, strength, rest.position, previous)
    assert slowed[0, 2:, 7].min() > 0.0 and slowed[0, 2:, 7].max() < 0.001
    others = np.delete(slowed[0], 7, axis=1)
    assert others.max() <= 0.0 and others.min() < 0.0  # and they are dragged along


def test_lengths_are_kept():
    state = played(tail(200), DynamicsSettings(volume=1.0, **SOFT_STYLE), 1.0)
    lengths = np.linalg.norm(np.diff(state.grid, axis=1), axis=2)
    np.testing.assert_allclose(lengths, state.rest.length.T, rtol=0.003)


def test_the_frame_rate_does_not_matter():
    grid, settings = tail(150), DynamicsSettings(volume=1.0, **SOFT_STYLE)
    one, other = (played(grid, settings, 1.0, fps) for fps in (20.0, 60.0))
    assert np.abs(one.position - other.position).max() < 1e-4


def test_a_guide_counts_for_its_strands():
    grid = tail(100)
    even, uneven = (start(grid, strands=strands).rest for strands in (None, np.ones(100)))
    assert np.array_equal(even.hair_grid.rest_density, uneven.hair_grid.rest_density)
    strands = np.ones(100)
    strands[50:] = 3.0
    heavy = start(grid, strands=strands).rest.hair_grid
    assert (heavy.mass[50:] == 3.0 * heavy.mass[:50]).all()


def test_hair_that_is_a_kilometre_apart():
    grid = np.concatenate([tail(50), tail(50) + np.float32([1000.0, 0.0, 0.0])])
    state = played(grid, DynamicsSettings(volume=1.0, **SOFT_STYLE), 0.5)
    assert np.isfinite(state.position).all()
    hair_grid = state.rest.hair_grid
    assert max(hair_grid.counts) <= grid_module.MAX_CELLS_PER_AXIS
    assert hair_grid.cell <= grid_module.MAX_CELL * state.rest.size * 1.001


@pytest.mark.parametrize("grid", [tail(1), tail(3, 2), np.zeros((5, 6, 3), np.float32)])
def test_few_guides_and_guides_without_length(grid):
    state = played(grid, DynamicsSettings(volume=1.0), 0.25)
    assert np.isfinite(state.position).all()


def test_turned_on_in_mid_play():
    grid = tail(100)
    state = played(grid, DynamicsSettings(**SOFT_STYLE), 0.1)
    assert state.push is None
    on = played(grid, DynamicsSettings(volume=1.0, **SOFT_STYLE), 0.1, state=state)
    assert on.push is not None
    assert played(grid, DynamicsSettings(**SOFT_STYLE), 0.1, state=on).push is None


def test_how_far_ahead():
    strength = InteractionStrength.of(DynamicsSettings(volume=0.5), DT)
    assert strength.substeps == 3
    assert strength.look_ahead == LOOK_AHEAD * 3
    assert InteractionStrength.of(DynamicsSettings(), DT) is None
    assert isinstance(start(tail(4)).rest.hair_grid, HairGrid)
