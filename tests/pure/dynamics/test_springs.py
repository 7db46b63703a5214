"""Curls that stretch, against the physics of springs and against hair that does not stretch."""

from dataclasses import replace

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.dynamics.constraints import PINNED_COUNT
from hairloom.addon.dynamics.measure import max_stretch
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.springs import MAX_STRETCH

LENGTH = 0.2


def settings_of(kit, **values):
    return DynamicsSettings(**kit.LIMP | {"curl_stretch": 1.0} | values)


def hanging(kit, settings, cv_count, gravity, room=2.0, guide_count=1):
    return kit.Scene(
        kit.straight(guide_count, cv_count, LENGTH),
        settings,
        gravity=np.array([0.0, 0.0, gravity]),
        room=np.full((guide_count, cv_count - 1), room),
    )


def longer(states):
    """Growth of the first guide since the first state [m]."""
    return np.array([states[0].position[2, -1, 0] - state.position[2, -1, 0] for state in states])


@pytest.mark.parametrize("cv_count", [3, 16])
@pytest.mark.parametrize("frequency", few_in_commits([3.0, 1.0]))
def test_a_curl_bobs_as_often_as_the_setting_says(kit, frequency, cv_count):
    """Small motion has the set frequency for any number of CVs, around the mean length of a chain
    of springs under its own weight: g n (n + 1) / (2 kappa)."""
    gravity = -0.02 * frequency**2
    settings = settings_of(kit, curl_bounce=frequency, substep_rate=240.0)
    states = hanging(kit, settings, cv_count, gravity).play(4.0 / frequency, 60.0 * frequency)
    free = cv_count - PINNED_COUNT
    kappa = (np.pi * frequency / np.sin(np.pi / (4.0 * free + 2.0))) ** 2
    expected = -gravity * free * (free + 1) / (2.0 * kappa)
    swing = longer(states) - expected
    up = np.flatnonzero((swing[:-1] < 0.0) & (swing[1:] >= 0.0))
    crossing = up + swing[up] / (swing[up] - swing[up + 1])
    assert np.diff(crossing).mean() / 60.0 == pytest.approx(1.0, rel=0.01)
    one_period = longer(states)[-60:]
    assert one_period.mean() == pytest.approx(expected, rel=0.03)


def test_weight_draws_a_curl_to_where_its_tension_balances(kit):
    """At rest, the tension kappa e / (1 - (e / E)^2) of each segment equals the weight below it."""
    settings = settings_of(kit, curl_bounce=1.5, damping=8.0)
    state = hanging(kit, settings, 10, -9.81, room=0.5).play(4.0)[-1]
    rest = LENGTH / 9.0
    free = 8
    kappa = (np.pi * 1.5 / np.sin(np.pi / (4.0 * free + 2.0))) ** 2
    most = 0.5 * MAX_STRETCH * rest
    extension = -np.diff(state.position[2, PINNED_COUNT - 1 :, 0].astype(float)) - rest
    weight = 9.81 * np.arange(free, 0, -1)
    tension = kappa * extension / (1.0 - (extension / most) ** 2)
    np.testing.assert_allclose(tension, weight, rtol=0.02)
    assert extension[0] > 0.5 * most


def test_it_comes_back_when_the_weight_is_gone(kit):
    settings = settings_of(kit, damping=8.0)
    scene = hanging(kit, settings, 12, -9.81)
    state = scene.play(2.0)[-1]
    drawn = float(longer([scene.start(), state])[1])
    for frame in range(180):
        drive = replace(scene.drive(frame / 60.0, (frame + 1) / 60.0), gravity=np.zeros(3))
        state = scene.advance(state, drive, settings, 1.0 / 60.0)
    left = float(longer([scene.start(), state])[1])
    assert drawn > 0.02 and abs(left) < 1e-3 * LENGTH


def test_what_curls_give_counts_as_no_stretch(kit):
    scene = hanging(kit, settings_of(kit), 12, -9.81, guide_count=2)
    scene.room[1] = 0.0
    states = scene.play(0.3)
    assert longer(states).max() > 0.05 * LENGTH
    assert max(max_stretch(state) for state in states) < 0.003


def test_a_groom_at_rest_is_as_long_as_it_was_combed(kit):
    """Weight that the style carries stretches nothing."""
    scene = hanging(kit, DynamicsSettings(), 12, -9.81)
    assert np.abs(longer(scene.play(1.0))).max() < 2e-5 * LENGTH


@pytest.mark.parametrize("solver", ["direct", "relaxation"])
def test_nothing_given_and_nothing_curled_change_no_bit(kit, shake, solver):
    grid, room = kit.curly(12, 10), np.full((12, 9), 0.8)
    room[6:] = 0.0
    values = {"length_solver": solver}

    def end(curl_stretch, room):
        settings = DynamicsSettings(curl_stretch=curl_stretch, **values)
        return kit.Scene(grid, settings, shake, room=room).play(0.3)[-1].position

    plain, stiff, given = end(0.25, None), end(0.0, room), end(0.25, room)
    np.testing.assert_array_equal(stiff, plain)
    np.testing.assert_array_equal(given[:, :, 6:], plain[:, :, 6:])
    assert np.abs(given[:, :, :6] - plain[:, :, :6]).max() > 1e-3


@pytest.mark.parametrize("factor", [2.0**-10, 2.0**10])
def test_it_moves_the_same_at_any_size(kit, shake, factor):
    def ends(factor):
        def motion(time):
            matrix = shake(time).copy()
            matrix[:3, 3] *= factor
            return matrix

        grid = kit.curly(20, 12) * np.float32(factor)
        room = np.full((20, 11), 0.8)
        scene = kit.Scene(grid, DynamicsSettings(), motion, gravity=kit.EARTH * factor, room=room)
        return np.array([state.grid for state in scene.play(0.5)]) / factor

    assert np.abs(ends(factor) - ends(1.0)).max() < 1e-4 * LENGTH


@pytest.mark.parametrize("rate", [120.0, 480.0])
def test_substeps_hardly_matter(kit, shake, rate):
    def tips(rate):
        settings = DynamicsSettings(substep_rate=rate)
        scene = kit.Scene(kit.straight(1, 12), settings, shake, room=np.full((1, 11), 1.0))
        return np.array([state.position[:, -1, 0] for state in scene.play(1.0)])

    assert np.abs(tips(rate) - tips(240.0)).max() < 0.05 * LENGTH


@pytest.mark.parametrize("seed", few_in_commits(range(12), 3))
def test_any_settings_stay_finite_and_within_what_is_given(kit, seed):
    """Segments stay within the stretch that they allow, in both directions by the same factor."""
    random = np.random.default_rng(seed)
    count, cv_count = 12, int(random.choice([2, 3, 5, 16]))
    settings = kit.random_settings(random, length_solver="direct", gravity=1.0)
    grid = kit.curly(count, cv_count)
    grid[0] = grid[0, :1]  # without any length
    room = random.uniform(-1.0, 3.0, (count, cv_count - 1)).clip(0.0, None)
    held = kit.tips(np.arange(count) % 4 == 1, cv_count) if cv_count > PINNED_COUNT else None

    def jerk(time):
        return kit.translation(0.3 * np.sin(40.0 * time), 0.0, 0.2 * np.cos(31.0 * time) - 0.2)

    scene = kit.Scene(grid, settings, jerk, held=held, room=room)
    rest = np.linalg.norm(np.diff(grid, axis=1), axis=2)[:, PINNED_COUNT - 1 :].astype(float)
    given = 1.0 + MAX_STRETCH * settings.curl_stretch * room[:, PINNED_COUNT - 1 :]
    rounding = 1e-5 * LENGTH
    for state in scene.play(0.4):
        assert np.isfinite(state.position).all()
        length = np.linalg.norm(np.diff(state.grid, axis=1), axis=2)[:, PINNED_COUNT - 1 :]
        off = settings.length_tolerance + 2e-4
        assert (length <= rest * given * (1.0 + off) + rounding).all()
        assert (length >= rest / given * (1.0 - off) - rounding).all()
