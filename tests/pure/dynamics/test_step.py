"""A frame of motion against what physics says, and against bad input."""

import numpy as np
import pytest

from hairloom.addon.dynamics.forces import best_rotation, predict, weight_on_style
from hairloom.addon.dynamics.measure import max_stretch
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import rows_of, start
from hairloom.addon.dynamics.step import Drive, advance, grid_at_frame_end
from hairloom.addon.errors import HairloomError


def period_of(signal, interval):
    """Mean time between upward zero crossings, interpolated."""
    signal = np.asarray(signal, np.float64)
    up = np.flatnonzero((signal[:-1] < 0.0) & (signal[1:] >= 0.0))
    crossing = up + signal[up] / (signal[up] - signal[up + 1])
    assert len(crossing) >= 3
    return np.diff(crossing).mean() * interval


def tip(states):
    return np.array([state.position[:, -1, 0] for state in states])


# --- physics -------------------------------------------------------------------------------------


def test_free_fall_is_exact():
    """Verlet reproduces x0 + v t + g t^2 / 2 for constant acceleration, whatever the step."""
    dt, speed, gravity = 0.01, 0.7, -9.81

    def fall(time):
        return np.full((3, 2, 1), speed * time + gravity * time**2 / 2.0)

    previous, position, out = fall(0.0), fall(dt), np.empty((3, 2, 1))
    for number in range(2, 80):
        predict(position, previous, np.float64(gravity * dt * dt), 1.0, out=out)
        previous, position, out = position, out, previous
        np.testing.assert_allclose(position, fall(number * dt), rtol=1e-5)


def test_a_falling_head_leaves_hair_weightless(kit):
    """Hair on a freely falling head keeps its shape without any stiffness."""
    settings = DynamicsSettings(**kit.LIMP)
    dt = 1.0 / settings.substep_rate

    def fall(time):  # as Verlet starts from rest: n (n + 1) / 2 steps
        number = time / dt
        return kit.translation(0.0, 0.0, -9.81 * dt * dt * number * (number + 1.0) / 2.0)

    grid = kit.curly(20, 12)
    scene = kit.Scene(grid, settings, fall)
    states = scene.play(0.25, fps=settings.substep_rate)
    np.testing.assert_allclose(states[-1].grid, kit.moved(fall(0.25), grid), atol=3e-4)


def test_pendulum_swings_in_its_period(kit):
    """One free CV is a mathematical pendulum: T = 2 pi sqrt(L / g)."""
    length, angle = 0.25, np.radians(4.0)
    grid = kit.straight(1, 3, 2 * length)
    grid[0, 2] = [length * np.sin(angle), 0.0, -length - length * np.cos(angle)]
    states = kit.Scene(grid, DynamicsSettings(**kit.LIMP)).play(6.0)
    expected = 2.0 * np.pi * np.sqrt(length / 9.81)
    assert period_of(tip(states)[:, 0], 1 / 60) == pytest.approx(expected, rel=0.005)


def test_hanging_chain_swings_in_its_period(kit):
    """A uniform chain: omega = j0 / 2 sqrt(g / L), j0 the first zero of Bessel's J0."""
    length, cv_count = 0.3, 34
    grid = kit.straight(1, cv_count, length)
    segment = length / (cv_count - 1)
    free = length - segment + segment / 2  # half a segment's mass is missing at the tip
    angle = np.linspace(0.0, 1.0, cv_count) * 0.03
    grid[0, 2:, 0] += (angle * np.linspace(0, length, cv_count))[2:]
    states = kit.Scene(grid, DynamicsSettings(**kit.LIMP)).play(8.0)
    expected = 2.0 * np.pi / (2.404826 / 2.0 * np.sqrt(9.81 / free))
    assert period_of(tip(states)[:, 0], 1 / 60) == pytest.approx(expected, rel=0.02)


def test_bend_stiffness_is_swings_a_second(kit):
    """A straight strand without gravity swings as a cantilever of the frequency that was set."""
    settings = DynamicsSettings(**kit.LIMP | {"bend": 2.0, "substep_rate": 1000})
    scene = kit.Scene(kit.straight(1, 24), settings, gravity=np.zeros(3))
    state = scene.start()
    share = np.linspace(0.0, 1.0, 24)
    position = state.position.copy()
    position[0, :, 0] += 0.004 * share**2 * (3.0 - share) / 2.0
    state = type(state)(position, position.copy(), state.rest)
    swing = []
    for _ in range(150):
        state = advance(state, scene.drive(0, 0), settings, 1 / 60)
        swing.append(state.position[0, -1, 0])
    assert period_of(swing, 1 / 60) == pytest.approx(0.5, rel=0.1)


def test_style_stiffness_is_swings_a_second(kit):
    settings = DynamicsSettings(**kit.LIMP | {"style_tip": 2.0, "substep_rate": 2000})
    scene = kit.Scene(kit.straight(1, 3), settings, gravity=np.zeros(3))
    state = scene.start()
    position = state.position.copy()
    position[0, 2, 0] += 0.003
    state = type(state)(position, position.copy(), state.rest)
    swing = []
    for _ in range(150):
        state = advance(state, scene.drive(0, 0), settings, 1 / 60)
        swing.append(state.position[0, -1, 0])
    assert period_of(swing, 1 / 60) == pytest.approx(0.5, rel=0.02)


def test_air_damping_is_per_second(kit):
    """The speed falls as exp(-damping t), whatever the substep."""
    for rate in (60.0, 240.0, 1000.0):
        settings = DynamicsSettings(**kit.LIMP | {"damping": 3.0, "substep_rate": rate})
        scene = kit.Scene(kit.straight(1, 3, 2e3), settings, gravity=np.zeros(3))
        state = scene.start()
        previous = state.position.copy()
        previous[0, 2] -= np.float32(1.0 / rate)  # 1 m/s across a strand that hardly turns
        state = type(state)(state.position, previous, state.rest, 1.0 / rate)
        state = advance(state, scene.drive(0, 0), settings, 0.25)
        speed = (state.position - state.previous)[0, 2, 0] * rate
        assert speed == pytest.approx(np.exp(-0.75), rel=0.01)


def test_energy_never_grows_without_input(kit):
    """Released from the side, undamped: kinetic and potential energy together only fall."""
    settings = DynamicsSettings(**kit.LIMP)
    grid = kit.straight(6, 16, 0.2, (1.0, 0.0, 0.0))
    states = kit.Scene(grid, settings).play(4.0)
    dt = 1.0 / settings.substep_rate
    energy = []
    for state in states:
        moved = (state.position - state.previous).astype(np.float64)
        height = (state.position + state.previous)[2].sum() / 2.0
        energy.append(((moved / dt) ** 2).sum() / 2.0 + 9.81 * height)
    start_energy = 9.81 * states[0].position[2].sum()
    drop = 9.81 * 0.1 * 6 * 16
    assert max(energy) - start_energy < 0.01 * drop
    assert np.diff(energy).max() < 0.01 * drop


# --- style ---------------------------------------------------------------------------------------


def test_a_groom_at_rest_does_not_sag(kit):
    grid = kit.curly(50, 16)
    states = kit.Scene(grid, DynamicsSettings()).play(2.0)
    assert np.abs(states[-1].grid - grid).max() < 0.01 * 0.2


def test_without_held_weight_it_sags(kit):
    grid = kit.curly(50, 16)
    states = kit.Scene(grid, DynamicsSettings(weight_held=0.0)).play(2.0)
    assert np.abs(states[-1].grid - grid).max() > 0.02


def test_tilted_hair_falls(kit):
    """Held weight turns with the head: bent forward, hair hangs below its style."""
    grid = kit.straight(5, 16, 0.2, (0.0, 0.6, 0.8))

    def tilt(time):
        return kit.rotation(0, -np.pi / 2 * min(time, 1.0))

    states = kit.Scene(grid, DynamicsSettings(), tilt).play(4.0)
    way = states[-1].grid - kit.moved(tilt(4.0), grid)
    assert (way[:, -1, 2] < -0.005).all()


def test_style_comes_back(kit, shake):
    grid = kit.curly(50, 16)

    def motion(time):
        return shake(time) if time < 2.0 else np.eye(4)

    states = kit.Scene(grid, DynamicsSettings(), motion).play(5.0)
    away = [np.abs(s.grid - kit.moved(motion(k / 60), grid)).max() for k, s in enumerate(states)]
    assert max(away) > 0.02
    assert away[-1] < 0.003


def test_infinite_stiffness_is_rigid(kit, shake):
    grid = kit.curly(30, 16)
    settings = DynamicsSettings(style_root=1000, style_tip=1000, bend=0.0, substep_rate=2000)
    states = kit.Scene(grid, settings, shake).play(0.5)
    np.testing.assert_allclose(states[-1].grid, kit.moved(shake(0.5), grid), atol=5e-4)


def test_roots_follow_exactly(kit, shake):
    grid = kit.curly(30, 16)
    states = kit.Scene(grid, DynamicsSettings(), shake).play(0.5)
    expected = kit.moved(shake(0.5), grid)[:, :2]
    np.testing.assert_allclose(states[-1].grid[:, :2], expected, atol=1e-6)


def test_lengths_are_kept(kit, shake):
    states = kit.Scene(kit.curly(100, 16), DynamicsSettings(), shake).play(1.0)
    assert max(max_stretch(state) for state in states) < 0.005


def test_weight_on_style_leaves_no_pull_along_segments(kit):
    carried = start(kit.curly(20, 12)).position
    gravity = np.array([0.0, 0.0, -9.81], np.float32)
    held = weight_on_style(gravity, carried)
    whole = np.concatenate([np.zeros_like(held[:, :1]), held], axis=1)
    segment = np.diff(carried[:, 1:], axis=1)
    unit = segment / np.linalg.norm(segment, axis=0)
    np.testing.assert_allclose((np.diff(whole, axis=1) * unit).sum(axis=0), 0.0, atol=2e-4)


def test_hanging_hair_holds_its_own_weight(kit):
    gravity = np.array([0.0, 0.0, -9.81], np.float32)
    held = weight_on_style(gravity, start(kit.straight(3, 12)).position)
    np.testing.assert_allclose(held, 0.0, atol=1e-5)


def test_best_rotation_is_the_heads(kit):
    turn = kit.rotation(0, 0.7) @ kit.rotation(2, -1.9)
    grid = kit.curly(40, 8)
    found = best_rotation(rows_of(grid, ""), rows_of(kit.moved(turn, grid), ""))
    np.testing.assert_allclose(found, turn[:3, :3], atol=1e-5)


def test_best_rotation_of_one_straight_guide_is_the_smallest(kit):
    grid = kit.straight(1, 8, 0.2, (0.0, 0.0, 1.0))
    turn = kit.rotation(0, 0.5)
    found = best_rotation(rows_of(grid, ""), rows_of(kit.moved(turn, grid), ""))
    np.testing.assert_allclose(found, turn[:3, :3], atol=1e-3)


# --- time ----------------------------------------------------------------------------------------


def end_at(kit, motion, fps, seconds=1.0):
    grid = kit.curly(40, 16)
    return kit.Scene(grid, DynamicsSettings(), motion).play(seconds, fps)[-1].grid


@pytest.mark.parametrize("fps", [24, 30, 144])
def test_even_motion_gives_the_same_at_any_frame_rate(kit, fps):
    """A head at constant speed is drawn exactly by linear blending: only rounding may differ."""

    def motion(time):
        return kit.translation(0.8 * time, 0.0, 0.3 * time)

    expected = end_at(kit, motion, 60)
    np.testing.assert_allclose(end_at(kit, motion, fps), expected, atol=1e-4)


@pytest.mark.parametrize("fps", [24, 30, 144])
def test_a_shake_gives_nearly_the_same_at_any_frame_rate(kit, shake, fps):
    """Under 2 % of the hair's length at the tips."""
    expected = end_at(kit, shake, 240, 2.0)[:, -1]
    away = np.linalg.norm(end_at(kit, shake, fps, 2.0)[:, -1] - expected, axis=1)
    assert away.max() < 0.02 * 0.2


def test_time_is_not_lost(kit):
    """100 frames that are no whole number of substeps take as many substeps as their sum."""
    settings = DynamicsSettings()
    scene = kit.Scene(kit.curly(3, 8), settings)
    state, count = scene.start(), 0
    for _ in range(100):
        before = state
        state = advance(state, scene.drive(0, 0), settings, 0.0137)
        assert 0.0 <= state.time_left < 1.0 / 240.0
        count += round((before.time_left + 0.0137 - state.time_left) * 240.0)
    assert count == int(1.37 * 240.0)


def test_a_long_pause_is_cut(kit):
    settings = DynamicsSettings()
    scene = kit.Scene(kit.curly(3, 8), settings, lambda time: kit.translation(0.05 * time, 0, 0))
    drive = scene.drive(0.0, 10.0)
    state = advance(scene.start(), drive, settings, 10.0)
    np.testing.assert_allclose(state.grid[:, :2], drive.target_now[:, :2], atol=1e-6)
    assert max_stretch(state) < 0.01


def test_no_time_changes_nothing(kit):
    scene = kit.Scene(kit.curly(3, 8), DynamicsSettings())
    state = scene.start()
    again = advance(state, scene.drive(0, 0), DynamicsSettings(), 0.0)
    np.testing.assert_array_equal(again.position, state.position)


def test_grid_at_frame_end_reaches_the_moved_roots(kit):
    """At 25 frames a second 9.6 substeps fit: the left time is bridged without a stretch."""
    settings = DynamicsSettings()
    scene = kit.Scene(kit.curly(5, 8), settings, lambda time: kit.translation(time, 0, 0))
    drive = scene.drive(0.0, 1 / 25)
    state = advance(scene.start(), drive, settings, 1 / 25)
    assert state.time_left > 0.0
    shown = grid_at_frame_end(state, drive)
    np.testing.assert_allclose(shown[:, 0], drive.target_now[:, 0], atol=1e-6)
    np.testing.assert_allclose(np.diff(shown, axis=1), np.diff(state.grid, axis=1), atol=1e-6)


def test_a_changed_substep_keeps_the_speed(kit):
    """Time correction: the strand swings on when the rate is changed in flight."""
    fast, slow = (DynamicsSettings(**kit.LIMP | {"substep_rate": r}) for r in (480.0, 120.0))
    scene = kit.Scene(kit.straight(1, 3, 2e3), fast, gravity=np.zeros(3))
    state = scene.start()
    previous = state.position.copy()
    previous[0, 2] -= np.float32(1.0 / 480.0)
    state = type(state)(state.position, previous, state.rest, 1.0 / 480.0)
    state = advance(state, scene.drive(0, 0), slow, 0.1)
    assert (state.position - state.previous)[0, 2, 0] * 120.0 == pytest.approx(1.0, rel=0.01)


# --- what must hold always -----------------------------------------------------------------------


def test_the_same_twice(kit, shake):
    scene = kit.Scene(kit.curly(60, 16), DynamicsSettings(), shake)
    one, other = scene.play(0.5)[-1], scene.play(0.5)[-1]
    np.testing.assert_array_equal(one.position, other.position)
    np.testing.assert_array_equal(one.previous, other.previous)


def test_a_state_stays_as_it_is(kit, shake):
    scene = kit.Scene(kit.curly(5, 8), DynamicsSettings(), shake)
    state = scene.play(0.1)[-1]
    copies = [state.position.copy(), state.previous.copy()]
    advance(state, scene.drive(0.1, 0.2), scene.settings, 0.1)
    np.testing.assert_array_equal(state.position, copies[0])
    np.testing.assert_array_equal(state.previous, copies[1])
    with pytest.raises(ValueError, match="read-only"):
        state.position[0, 0, 0] = 1.0


def test_start_does_not_hold_on_to_the_callers_array(kit):
    grid = kit.curly(5, 8)
    state = start(grid)
    grid += 1.0
    assert np.abs(state.grid - grid).min() > 0.5


@pytest.mark.parametrize("shape", [(0, 16, 3), (7, 2, 3), (7, 3, 3), (1, 64, 3)])
def test_odd_sizes(kit, shake, shape):
    rng = np.random.default_rng(0)
    grid = np.cumsum(rng.normal(size=shape) * 0.01, axis=1).astype(np.float32)
    states = kit.Scene(grid, DynamicsSettings(), shake).play(0.2)
    assert states[-1].grid.shape == shape
    assert np.isfinite(states[-1].grid).all()
    assert max_stretch(states[-1]) < 0.01


def test_guides_without_length_stay_finite(kit, shake):
    grid = kit.curly(6, 10)
    grid[1] = grid[1, :1]
    grid[2, 4:] = grid[2, 4:5]
    grid[3, 5] = grid[3, 3]  # folds back by 180 degrees
    states = kit.Scene(grid, DynamicsSettings(), shake).play(0.5)
    assert np.isfinite(states[-1].grid).all()


@pytest.mark.parametrize("seed", range(12))
def test_any_settings_stay_finite_and_short(kit, seed):
    """Hard ranges at random, half of them at an end, with a violent head and colliders."""
    from hairloom.addon.dynamics.colliders import SphereCollider

    rng = np.random.default_rng(seed)
    values = {}
    for parameter in DynamicsSettings.parameters():
        low, high = parameter.hard_range
        value = rng.choice([low, high, rng.uniform(low, high), parameter.default])
        values[parameter.name] = round(value) if parameter.kind == "integer" else float(value)
    values["substep_rate"] = min(values["substep_rate"], 300.0)
    values["length_tolerance"] = min(values["length_tolerance"], 0.01)
    settings = DynamicsSettings(**values)
    way = rng.normal(size=(4, 3))

    def motion(time):
        turn = kit.rotation(0, way[0, 0] * 20 * time) @ kit.rotation(2, way[0, 1] * 20 * time)
        return kit.translation(*(way[1] * np.sin(20 * way[2] * time))) @ turn

    scene = kit.Scene(
        kit.curly(20, 16, seed=seed),
        settings,
        motion,
        on_head=(SphereCollider((0, 0, 0), 0.1), SphereCollider((0.1, 0, 0.2), 0.05)),
        standing=(SphereCollider((0.3, 0, 0.0), 0.2),),
    )
    for state in scene.play(0.5)[1:]:
        assert np.isfinite(state.position).all()
        assert max_stretch(state) <= 0.0101


def bad_drive(kit, **changes):
    grid = kit.curly(4, 8)
    values = {
        "target_before": grid, "target_now": grid, "colliders": (), "gravity": kit.EARTH,
    }  # fmt: skip
    return start(grid), Drive(**values | changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"target_now": np.full((4, 8, 3), np.nan, np.float32)}, "not a finite number"),
        ({"target_before": np.zeros((3, 8, 3), np.float32)}, "Start the simulation again"),
        ({"target_now": np.zeros((4, 9, 3), np.float32)}, "Start the simulation again"),
        ({"target_now": np.zeros((4, 24), np.float32)}, "shape"),
        ({"gravity": np.array([0.0, np.inf, 0.0])}, "gravity"),
    ],
)
def test_a_bad_drive_is_named(kit, changes, message):
    state, drive = bad_drive(kit, **changes)
    with pytest.raises(HairloomError, match=message):
        advance(state, drive, DynamicsSettings(), 1 / 60)


@pytest.mark.parametrize("duration", [-0.1, np.nan, np.inf])
def test_a_bad_duration_is_named(kit, duration):
    state, drive = bad_drive(kit)
    with pytest.raises(HairloomError, match="frame rate"):
        advance(state, drive, DynamicsSettings(), duration)


def test_bad_guides_are_named(kit):
    grid = kit.curly(4, 8)
    grid[2, 3, 1] = np.nan
    with pytest.raises(HairloomError, match="not a finite number"):
        start(grid)
    with pytest.raises(HairloomError, match="at least two CVs"):
        start(grid[:, :1] * 0.0)
