"""Held CVs: their indices, and values that are spread from one to the next."""

import numpy as np

from hairloom.addon.dynamics.constraints import PINNED_COUNT, directions, pin
from hairloom.addon.dynamics.held import HeldCvs
from hairloom.addon.dynamics.settings import DynamicsSettings


def test_pinned_cvs_count_for_nothing():
    rows = HeldCvs(np.ones((2, 6), bool)).rows
    assert (rows[:PINNED_COUNT] == 0.0).all()
    assert (rows[PINNED_COUNT:] == 1.0).all()


def test_values_change_evenly_between_held_cvs(kit):
    held = HeldCvs(kit.tied([True, False], 9, 5))
    values = np.zeros((2, 9, 3))
    values[:, 1], values[:, 5], values[:, 6] = 1.0, 5.0, 7.0
    spread = held.interpolated(values)
    np.testing.assert_allclose(spread[0, :, 1], [0, 1, 2, 3, 4, 5, 7, 7, 7])
    np.testing.assert_allclose(spread[1, :, 1], [0, 1, 1, 1, 1, 1, 1, 1, 1])


def test_neighbours_keep_their_distance_wherever_their_tie_goes(kit):
    """A tie that is torn off, or that shrinks to a point, leaves every length as it was."""
    rows = np.ascontiguousarray(kit.straight(3, 8).transpose(2, 1, 0))
    length = np.linalg.norm(np.diff(rows, axis=1), axis=0)
    held = HeldCvs(kit.tied([True] * 3, 8, 4)).rows
    carried = rows.copy()
    carried[:, 4:6, 0] += np.array([[5.0], [0.0], [0.0]])  # far away
    carried[:, 4:6, 1] = 0.9 * carried[:, 4:5, 1] + 0.1 * carried[:, 4:6, 1]  # shrunk
    carried[:, 4:6, 2] = carried[:, 4:5, 2]  # without size
    pinned = rows.copy()
    pin(pinned, carried, length, held)
    np.testing.assert_allclose(directions(pinned)[1][4, :2], length[4, :2], rtol=1e-5)
    away = np.linalg.norm(pinned[:, 4] - pinned[:, 1], axis=0)
    assert (away <= length[1:4].sum(axis=0) * 1.00001).all()
    assert np.isfinite(pinned).all()


def test_a_ponytail_through_a_ring_that_turns_with_the_head_stays_in_it(kit, shake):
    """Within 0.1 mm, with all lengths kept, also at frames between two substeps."""
    from hairloom.addon.dynamics.measure import max_stretch
    from hairloom.addon.dynamics.step import advance, grid_at_frame_end

    grid = kit.curly(12, 16)
    held = kit.tied([True] * 12, 16, 6)
    scene = kit.Scene(grid, DynamicsSettings(), shake, held=held, bowed=True)
    state = scene.start()
    for frame in range(48):  # at 24 frames a second, every other one ends in mid-substep
        drive = scene.drive(frame / 24.0, (frame + 1) / 24.0)
        state = advance(state, drive, scene.settings, 1.0 / 24.0)
        shown = grid_at_frame_end(state, drive, DynamicsSettings(), 1.0 / 24.0)
        assert np.abs((shown - drive.target_now)[held]).max() < 1e-4
        assert max_stretch(state) < 0.0025
    assert np.abs(shown - drive.target_now)[:, -1].max() > 0.005  # the tail does swing
