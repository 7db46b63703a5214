"""Lengths: kept exactly, without a push from nowhere, and along what is touched."""

import numpy as np
import pytest

from hairloom.addon.dynamics.constraints import PINNED, directions, finish_lengths, keep_lengths


@pytest.fixture
def disturbed(kit):
    """Guides as rows, pushed about by up to 3 mm, and the lengths they had."""
    rows = np.ascontiguousarray(kit.curly(40, 16).transpose(2, 1, 0))
    length = np.linalg.norm(np.diff(rows, axis=1), axis=0)
    noise = np.random.default_rng(1).uniform(-0.003, 0.003, rows.shape).astype(np.float32)
    noise[:, :PINNED] = 0.0
    return rows + noise, length


def error(position, length):
    return np.abs(directions(position)[1] / length - 1.0)[1:].max()


def test_newton_converges_quadratically(disturbed):
    position, length = disturbed
    errors = [error(position, length)]
    for _ in range(4):
        keep_lengths(position, length, None)
        errors.append(error(position, length))
    assert errors[0] > 0.5
    assert errors[2] < 0.03
    assert errors[3] < 5.0 * errors[2] ** 2
    assert errors[4] < 2e-5


def test_pinned_cvs_stay(disturbed):
    position, length = disturbed
    before = position.copy()
    keep_lengths(position, length, None)
    np.testing.assert_array_equal(position[:, :PINNED], before[:, :PINNED])


def test_momentum_comes_only_through_the_root(disturbed):
    """Inner forces cancel: what is left of all corrections pulls along the first free segment."""
    position, length = disturbed
    before = position.copy()
    direction, _ = directions(position)
    keep_lengths(position, length, None)
    total = (position - before).astype(np.float64).sum(axis=1)
    across = np.cross(total, direction[:, PINNED - 1], axis=0)
    assert np.linalg.norm(total, axis=0).max() > 1e-3
    assert np.linalg.norm(across, axis=0).max() < 1e-6


def test_contact_slides(disturbed):
    """With a normal, a CV moves along the surface ten times more easily than across it."""
    position, length = disturbed
    normal = np.zeros_like(position[:, PINNED:])
    normal[2, 5] = 1.0
    free, held = position.copy(), position.copy()
    keep_lengths(free, length, None)
    keep_lengths(held, length, normal)
    cv = 5 + PINNED
    rise = np.abs(held[2, cv] - position[2, cv]).mean()
    assert rise < 0.3 * np.abs(free[2, cv] - position[2, cv]).mean()
    before = error(position, length)
    assert error(held, length) < before


def test_finish_reaches_the_tolerance_only_where_needed(disturbed):
    position, length = disturbed
    good = position[:, :, :3].copy()
    for _ in range(5):
        keep_lengths(good, length[:, :3], None)
    position[:, :, :3] = good
    finish_lengths(position, length, None, 0.002, 8)
    np.testing.assert_array_equal(position[:, :, :3], good)
    assert error(position, length) <= 0.002 * 1.001


def test_finish_never_gives_up_on_lengths(disturbed):
    """One Newton step cannot mend this; laying the guide out anew does."""
    position, length = disturbed
    position[:, PINNED:] *= np.random.default_rng(2).uniform(-30, 30, position[:, PINNED:].shape)
    finish_lengths(position, length, None, 0.002, 1)
    assert error(position, length) <= 0.002 * 1.001


def test_coincident_cvs_stay_finite():
    position = np.zeros((3, 6, 2), np.float32)
    keep_lengths(position, np.zeros((5, 2), np.float32), None)
    assert np.isfinite(position).all()
