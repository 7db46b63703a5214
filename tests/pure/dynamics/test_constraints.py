"""Lengths are kept, without external momentum, and CVs in contact slide along the surface."""

import numpy as np
import pytest

from hairloom.addon.dynamics.constraints import (
    CONTACT_WEIGHT,
    PINNED_COUNT,
    TouchingCvs,
    directions,
    finish_lengths,
    hold_within_reach,
    keep_lengths,
    pin,
    relax_lengths,
)


@pytest.fixture
def disturbed(kit):
    """Guides as rows, disturbed by up to 3 mm, and the lengths that they had before."""
    rows = np.ascontiguousarray(kit.curly(40, 16).transpose(2, 1, 0))
    length = np.linalg.norm(np.diff(rows, axis=1), axis=0)
    noise = np.random.default_rng(1).uniform(-0.003, 0.003, rows.shape).astype(np.float32)
    noise[:, :PINNED_COUNT] = 0.0
    return rows + noise, length


def tips(is_held=True):
    """Tips of the 40 guides, or of some, as rows of held CVs."""
    held = np.zeros((16, 40), np.float32)
    held[-1] = is_held
    return held


def error(position, length):
    return np.abs(directions(position)[1] / length - 1.0)[1:].max()


def test_newton_converges_quadratically(disturbed):
    position, length = disturbed
    errors = [error(position, length)]
    for _ in range(4):
        keep_lengths(position, length, None, None)
        errors.append(error(position, length))
    assert errors[0] > 0.5
    assert errors[2] < 0.03
    assert errors[3] < 5.0 * errors[2] ** 2
    assert errors[4] < 2e-5


def test_pinned_cvs_stay(disturbed):
    position, length = disturbed
    before = position.copy()
    keep_lengths(position, length, None, None)
    np.testing.assert_array_equal(position[:, :PINNED_COUNT], before[:, :PINNED_COUNT])


def test_momentum_comes_only_through_the_root(disturbed):
    """Internal forces cancel: the sum of all corrections points along the first free segment."""
    position, length = disturbed
    before = position.copy()
    direction, _ = directions(position)
    keep_lengths(position, length, None, None)
    total = (position - before).astype(np.float64).sum(axis=1)
    across = np.cross(total, direction[:, PINNED_COUNT - 1], axis=0)
    assert np.linalg.norm(total, axis=0).max() > 1e-3
    assert np.linalg.norm(across, axis=0).max() < 1e-6


def test_contact_slides(disturbed):
    """A CV in contact moves ten times more easily along the surface than along its normal."""
    position, length = disturbed
    cv, guides = 5 + PINNED_COUNT, np.arange(40)
    touched = TouchingCvs(cv * 40 + guides, np.float32([[0.0], [0.0], [1.0]]) + 0.0 * guides)
    free, held = position.copy(), position.copy()
    keep_lengths(free, length, None, None)
    keep_lengths(held, length, touched, None)
    rise = np.abs(held[2, cv] - position[2, cv]).mean()
    assert rise < 0.3 * np.abs(free[2, cv] - position[2, cv]).mean()
    before = error(position, length)
    assert error(held, length) < before


def touching(position, seed=5):
    """A third of the free CVs, tips among them, in contact with random normals, as Touched and as a
    grid."""
    random = np.random.default_rng(seed)
    normal = random.normal(size=position.shape).astype(np.float32)
    normal /= np.linalg.norm(normal, axis=0)
    normal *= random.random(position.shape[1:]) < 1.0 / 3.0
    normal[:, :PINNED_COUNT] = 0.0
    index = np.flatnonzero(normal.any(axis=0))
    return TouchingCvs(index, normal.reshape(3, -1)[:, index]), normal


def test_a_step_with_contacts_is_newtons(disturbed):
    """Against x - W J^T (J W J^T)^-1 C with each guide's dense matrices."""
    position, length = disturbed
    touched, normal = touching(position)
    before = position.astype(np.float64)
    keep_lengths(position, length, touched, None)
    for guide in range(40):
        x, n = before[:, :, guide].T, normal[:, :, guide].T.astype(np.float64)
        way = np.diff(x, axis=0)[PINNED_COUNT - 1 :]
        now = np.linalg.norm(way, axis=1)
        jacobian = np.zeros((len(way), len(x), 3))
        for j, direction in enumerate(way / now[:, None]):
            jacobian[j, j + PINNED_COUNT - 1], jacobian[j, j + PINNED_COUNT] = -direction, direction
        mobility = np.eye(3) - float(CONTACT_WEIGHT) * n[:, :, None] * n[:, None]
        mobility[:PINNED_COUNT] = 0.0
        moved = np.einsum("cab,jcb->jca", mobility, jacobian)
        matrix = np.einsum("jca,kca->jk", jacobian, moved)
        pull = np.linalg.solve(matrix, now - length[PINNED_COUNT - 1 :, guide])
        expected = x - np.einsum("jca,j->ca", moved, pull)
        np.testing.assert_allclose(position[:, :, guide].T, expected, atol=2e-6)


def test_contacts_of_some_guides_are_those_of_all(disturbed):
    position, length = disturbed
    touched, _ = touching(position)
    some = np.array([0, 3, 4, 17, 39])
    part = position[:, :, some].copy()
    keep_lengths(position, length, touched, None)
    keep_lengths(part, length[:, some], touched.part(some, 40), None)
    np.testing.assert_array_equal(part, position[:, :, some])


def test_finish_reaches_the_tolerance_only_where_needed(disturbed):
    position, length = disturbed
    good = position[:, :, :3].copy()
    for _ in range(5):
        keep_lengths(good, length[:, :3], None, None)
    position[:, :, :3] = good
    finish_lengths(position, length, None, None, 0.002, 8, 0.2)
    np.testing.assert_array_equal(position[:, :, :3], good)
    assert error(position, length) <= 0.002 * 1.001


def test_finish_never_gives_up_on_lengths(disturbed):
    """Where one Newton step is not enough, guides are laid out again, so that lengths hold."""
    position, length = disturbed
    position[:, PINNED_COUNT:] *= np.random.default_rng(2).uniform(
        -30, 30, position[:, PINNED_COUNT:].shape
    )
    finish_lengths(position, length, None, None, 0.002, 1, 0.2)
    assert error(position, length) <= 0.002 * 1.001


def test_relaxation_converges(disturbed):
    position, length = disturbed
    errors = []
    for _ in range(5):
        relax_lengths(position, length, None, 20)
        errors.append(error(position, length))
    assert errors[-1] < 0.01
    assert errors[-1] < 0.3 * errors[0]


def test_relaxation_leaves_held_tips_where_they_are(disturbed):
    position, length = disturbed
    before, held = position.copy(), np.arange(40) % 2 == 0
    relax_lengths(position, length, tips(held), 8)
    np.testing.assert_array_equal(position[:, -1, held], before[:, -1, held])
    assert np.abs(position[:, -1, ~held] - before[:, -1, ~held]).max() > 1e-4


def test_long_range_attachment_bounds_the_way_from_the_root(disturbed):
    position, length = disturbed
    position[:, PINNED_COUNT:] *= 3.0
    hold_within_reach(position, length, None)
    away = np.linalg.norm(
        position[:, PINNED_COUNT:] - position[:, PINNED_COUNT - 1 : PINNED_COUNT], axis=0
    )
    reach = np.cumsum(length[PINNED_COUNT - 1 :], axis=0)
    assert (away <= reach * 1.00001).all()
    assert (away > 0.99 * reach).any()


@pytest.mark.parametrize("held", [False, True])
def test_long_range_attachment_leaves_no_zigzag(disturbed, held):
    """A zigzag near the root is within reach of the attachment, and yet too long."""
    position, length = disturbed
    to_and_fro = (np.arange(position.shape[1]) % 2 * 0.05).astype(np.float32)
    position[0, PINNED_COUNT:] = position[0, PINNED_COUNT - 1] + to_and_fro[PINNED_COUNT:, None]
    position[1:, PINNED_COUNT:] = position[1:, PINNED_COUNT - 1 : PINNED_COUNT]
    assert (directions(position)[1][1:].sum(axis=0) > 2.0 * length[1:].sum(axis=0)).any()
    hold_within_reach(position, length, tips() if held else None)
    assert (directions(position)[1][1:] <= length[1:] * 1.00001).all()


def test_long_range_attachment_leaves_what_is_near(disturbed):
    position, length = disturbed
    position[:, PINNED_COUNT:] = position[:, PINNED_COUNT - 1 : PINNED_COUNT] + 0.2 * (
        position[:, PINNED_COUNT:] - position[:, PINNED_COUNT - 1 : PINNED_COUNT]
    )
    before = position.copy()
    hold_within_reach(position, length, None)
    np.testing.assert_allclose(position, before, atol=1e-7)


@pytest.mark.parametrize("far", [1.0, 5.0])
def test_a_held_tip_is_held_as_far_as_the_strand_reaches(disturbed, far):
    position, length = disturbed
    carried = position.copy()
    root = carried[:, PINNED_COUNT - 1]
    direction = np.array([0.0, 0.6, 0.8], np.float32)[:, None]
    reach = length[PINNED_COUNT - 1 :].sum(axis=0)
    carried[:, -1] = root + direction * reach * np.float32(0.5 * far)
    pin(position, carried, length, tips())
    expected = root + direction * reach * min(0.5 * far, 1.0)
    np.testing.assert_allclose(position[:, -1], expected, atol=1e-6)


def test_newton_keeps_a_held_tip_and_all_lengths(disturbed):
    position, length = disturbed
    tip = position[:, -1].copy()
    for _ in range(8):
        keep_lengths(position, length, None, tips())
    np.testing.assert_array_equal(position[:, -1], tip)
    assert error(position, length) < 1e-3


def test_finish_lays_guides_with_held_tips_out_towards_them(disturbed):
    """Where Newton's steps fail, lengths still hold, and a held tip ends nearer to its place than a
    free one."""
    position, length = disturbed
    tip = position[:, -1].copy()
    noise = np.random.default_rng(2).normal(0.0, 0.02, position[:, 3:].shape).astype(np.float32)
    position[:, PINNED_COUNT:-1] += noise
    away = {}
    for held in (None, tips()):
        laid_out = position.copy()
        finish_lengths(laid_out, length, None, held, 0.002, 1, 0.2)
        assert error(laid_out, length) <= 0.002 * 1.02
        away[held is None] = np.median(np.linalg.norm(laid_out[:, -1] - tip, axis=0))
    assert away[False] < away[True]


def test_coincident_cvs_stay_finite():
    position = np.zeros((3, 6, 2), np.float32)
    keep_lengths(position, np.zeros((5, 2), np.float32), None, None)
    assert np.isfinite(position).all()
