"""Motion against analytic physics: periods, energy, drag, wind, hanging shapes."""

import numpy as np
import pytest
from tiers import few_by_name, few_in_commits

from hairloom.addon.dynamics.forces import predict
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.step import advance
from hairloom.addon.dynamics.style import style_system


def period_of(signal, interval):
    """Mean time between upward zero crossings, interpolated."""
    signal = np.asarray(signal, np.float64)
    up = np.flatnonzero((signal[:-1] < 0.0) & (signal[1:] >= 0.0))
    crossing = up + signal[up] / (signal[up] - signal[up + 1])
    assert len(crossing) >= 3
    return np.diff(crossing).mean() * interval


def tip(states):
    return np.array([state.position[:, -1, 0] for state in states])


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
    """Without gravity, a straight strand swings as a cantilever of the set frequency."""
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
    """The speed decays as exp(-damping t), whatever the substep."""
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


# --- energy --------------------------------------------------------------------------------------


def energies(states, settings, style, gravity=9.81):
    """Kinetic, potential and elastic energy of all CVs together, of mass 1, for each state.

    Speeds are those at the end of the substep, as in backward Euler, whose energy decreases for any
    convex potential. The bend energy of a straight strand is that of its second differences. A curl
    has no bend energy, since its rest curvature turns with the strand.
    """
    dt = 1.0 / settings.substep_rate
    band = style_system(settings, style.shape[1], dt)
    pull, bend = (
        values.astype(np.float64) / dt**2
        for values in (band.global_stiffness, band.local_stiffness)
    )

    def stored(position):
        away = (position - style)[:, 2:]
        second = np.diff(position, n=2, axis=1)
        springs = (pull * away**2).sum() + (bend * second**2).sum()
        return gravity * position[2].sum() + springs / 2.0

    found = []
    for state in states:
        position, previous = (rows.astype(np.float64) for rows in (state.position, state.previous))
        speed = (position - previous) / dt
        found.append((speed**2).sum() / 2.0 + stored(position))
    return np.array(found)


@pytest.mark.parametrize("seed", range(4))
def test_energy_of_limp_hair_never_grows(kit, seed):
    """Released from any shape, without damping: the sum of kinetic and potential energy never
    grows."""
    settings = DynamicsSettings(**kit.LIMP)
    grid = kit.curly(6, 16, seed=seed)
    grid[:3] = kit.straight(3, 16, 0.2, (1.0, 0.0, 0.0))
    states = kit.Scene(grid, settings).play(3.0)
    energy = energies(states, settings, states[0].position.astype(np.float64))
    drop = 9.81 * 0.1 * 6 * 16
    assert np.diff(energy).max() < 1e-4 * drop
    assert energy[-1] < energy[0] - 0.1 * drop


@pytest.mark.parametrize(
    "stiffness",
    [{"style_root": 4.0, "style_tip": 1.2}, {"bend": 2.0}, {"style_tip": 1.0, "bend": 3.0}],
    ids=["place", "bend", "both"],
)
def test_energy_of_styled_hair_never_grows(kit, stiffness):
    """Straight hair, bent aside and released: the sum including elastic energy never grows."""
    settings = DynamicsSettings(**kit.LIMP | stiffness)
    scene = kit.Scene(kit.straight(6, 16), settings)
    state = scene.start()
    angle = np.linspace(0.0, 1.2, 15)  # of each segment, so that lengths are right
    way = np.stack([0.8 * np.sin(angle), 0.6 * np.sin(angle), -np.cos(angle)]) * 0.2 / 15
    bent = state.position.copy()
    bent[:, 1:] = bent[:, :1] + np.cumsum(way, axis=1)[:, :, None]
    states = [type(state)(bent, bent.copy(), state.rest)]
    for _ in range(240):
        states.append(advance(states[-1], scene.drive(0, 0), settings, 1 / 60))
    energy = energies(states, settings, state.position.astype(np.float64))
    released = energy[0] - energy.min()
    assert np.diff(energy).max() < 1e-4 * released


# --- air and water -------------------------------------------------------------------------------


def along_wind(kit, settings, seconds, fps=60.0, gravity=0.0, direction=(0.0, 0.0, -1.0)):
    """Speeds (frames, 3) and times of one free CV on an arm that is so long that it hardly
    turns."""
    grid = kit.straight(1, 3, 2e3, direction)
    scene = kit.Scene(grid, settings, gravity=np.array([0.0, 0.0, -gravity]))
    states = scene.play(seconds, fps)[1:]
    speed = [(s.position - s.previous)[:, 2, 0] * settings.substep_rate for s in states]
    return np.array(speed), np.arange(1, len(states) + 1) / fps


def test_damped_hair_takes_on_the_speed_of_the_wind(kit):
    """Against v = w (1 - exp(-c t))."""
    values = {"damping": 3.0, "wind_speed": 5.0, "wind_direction": np.pi / 2, "gusts": 0.0}
    speed, time = along_wind(kit, DynamicsSettings(**kit.LIMP | values), 1.0)
    np.testing.assert_allclose(speed[:, 1], 5.0 * (1.0 - np.exp(-3.0 * time)), rtol=0.01, atol=0.01)
    np.testing.assert_allclose(speed[:, 0], 0.0, atol=0.01)


def test_drag_closes_up_to_the_wind(kit):
    """Against w - v = w / (1 + k w t)."""
    values = {"drag": 0.5, "wind_speed": 6.0, "gusts": 0.0}
    speed, time = along_wind(kit, DynamicsSettings(**kit.LIMP | values), 2.0)
    expected = 6.0 - 6.0 / (1.0 + 0.5 * 6.0 * time)
    np.testing.assert_allclose(speed[:, 0], expected, rtol=0.01, atol=0.01)


def test_drag_and_weight_settle_at_the_terminal_speed(kit):
    """Against v = sqrt(g / k) tanh(t sqrt(g k))."""
    settings = DynamicsSettings(**kit.LIMP | {"drag": 2.0, "substep_rate": 240.0})
    speed, time = along_wind(kit, settings, 1.0, gravity=9.81, direction=(1.0, 0.0, 0.0))
    terminal = np.sqrt(9.81 / 2.0)
    expected = terminal * np.tanh(time * np.sqrt(9.81 * 2.0))
    np.testing.assert_allclose(-speed[:, 2], expected, rtol=0.02)
    assert -speed[-1, 2] == pytest.approx(terminal, rel=0.01)


@pytest.mark.parametrize("buoyancy", [0.0, 0.5, 1.0, 1.5])
def test_buoyancy_carries_its_share_of_the_weight(kit, buoyancy):
    settings = DynamicsSettings(**kit.LIMP | {"buoyancy": buoyancy})
    speed, time = along_wind(kit, settings, 0.5, gravity=9.81, direction=(1.0, 0.0, 0.0))
    expected = -9.81 * (1.0 - buoyancy) * time
    np.testing.assert_allclose(speed[:, 2], expected, rtol=0.02, atol=0.02)


def test_floating_hair_feels_no_weight(kit):
    grid = kit.curly(12, 12)
    settings = DynamicsSettings(**kit.LIMP | {"buoyancy": 1.0})
    states = kit.Scene(grid, settings).play(1.0)
    np.testing.assert_allclose(states[-1].grid, grid, atol=1e-5)


def test_under_water_the_style_lifts_the_hair(kit):
    """The style carries hair's weight in air; where water carries it, hair rises above its
    style."""
    grid = kit.straight(5, 16, 0.2, (0.8, 0.0, -0.6))
    states = kit.Scene(grid, DynamicsSettings(buoyancy=1.0, drag=4.0)).play(3.0)
    assert (states[-1].grid[:, -1, 2] > grid[:, -1, 2] + 0.01).all()


# --- hanging shapes ------------------------------------------------------------------------------


def catenary(start_point, end_point, length, share):
    """Points (n, 2) at these fractions of the length of a chain between two points in the plane x,
    z."""
    (x0, z0), (x1, z1) = start_point, end_point
    span, rise = x1 - x0, z1 - z0
    low, high = 1e-3, 1e3  # a: sqrt(L^2 - rise^2) = 2 a sinh(span / 2 a), falling in a
    for _ in range(200):
        a = np.sqrt(low * high)
        is_short = 2 * a * np.sinh(min(span / (2 * a), 500.0)) < np.sqrt(length**2 - rise**2)
        low, high = (low, a) if is_short else (a, high)
    middle = a * np.arctanh(rise / length)  # of both ends, from the lowest point
    left = middle - span / 2
    x = a * np.arcsinh(np.sinh(left / a) + share * length / a)
    return np.stack([x0 + x - left, z0 + a * (np.cosh(x / a) - np.cosh(left / a))], axis=1)


@pytest.mark.alike
@pytest.mark.parametrize("solver", few_in_commits(["direct", "relaxation"]))
@pytest.mark.parametrize("rise", [0.0, 0.06])
@pytest.mark.parametrize("by", ["tip", "tie"])
def test_a_strand_held_at_both_ends_hangs_as_a_catenary(kit, solver, rise, by):
    """Against the analytic catenary. A tie holds two successive CVs, beyond which a tail hangs."""
    cv_count, length, span = 32, 0.3, 0.18
    segment = length / (cv_count - 1)
    # any shape of that length between the ends: here an arch of two straight halves, upwards
    reach = length - segment
    tip = np.array([span, rise])
    half = np.hypot(*tip) / 2
    across = np.array([-rise, span]) / (2 * half)
    top = tip / 2 + across * np.sqrt((reach / 2) ** 2 - half**2)
    share = np.linspace(0.0, 1.0, cv_count - 1)[:, None]
    arch = np.where(share < 0.5, 2 * share * top, top + (2 * share - 1) * (tip - top))
    grid = np.zeros((1, cv_count, 3), np.float32)
    grid[0, 1:, 0], grid[0, 1:, 2] = arch.T
    grid[0, 0] = [-segment, 0.0, 0.0]
    settings = DynamicsSettings(
        **kit.LIMP | {"damping": 4.0, "length_solver": solver, "relaxations": 32}
    )
    held = kit.tips([True], cv_count)
    if by == "tie":
        tail = grid[:, -1:] + np.arange(1, 6)[:, None] * np.float32([segment, 0.0, 0.0])
        grid = np.concatenate([grid, tail], axis=1)
        held = kit.tied([True], cv_count + 5, cv_count - 1)
    scene = kit.Scene(grid, settings, held=held)
    state = scene.play(5.0)[-1]
    hanging = state.grid[0, 1:cv_count, [0, 2]].T
    if by == "tie":
        near = 1e-6 if solver == "direct" else 5e-4
        np.testing.assert_allclose(state.grid[0][held[0]], grid[0][held[0]], atol=near)
        assert (state.grid[0, -1, 0] - tip[0]) < 1.5 * segment  # the tail hangs down
    expected = catenary((0.0, 0.0), tip, reach, share[:, 0])
    assert expected[:, 1].min() < -0.07
    np.testing.assert_allclose(hanging, expected, atol=0.02 * length)


# --- frame rate ----------------------------------------------------------------------------------


def oscillation(time):
    """A motion by 0.3 m along x, once a second, with a smooth beginning."""
    begun = np.sin(np.pi * min(max(time, 0.0), 0.5)) ** 2
    matrix = np.eye(4)
    matrix[0, 3] = 0.15 * begun * np.sin(2.0 * np.pi * time)
    return matrix


def tips_after_two_seconds(kit, fps, values, bowed):
    settings = DynamicsSettings(**values)
    scene = kit.Scene(kit.curly(40, 16), settings, oscillation, bowed=bowed)
    return scene.play(2.0, fps)[-1].grid[:, -1]


@pytest.mark.parametrize(
    "values", few_by_name({"still": {}, "wind": {"wind_speed": 4.0, "damping": 2.0}}, "still")
)
@pytest.mark.parametrize("rates", few_in_commits([(24.0, 120.0), (24.0, 30.0, 60.0, 120.0)]))
def test_the_frame_rate_does_not_matter(kit, values, rates):
    """For any two rates, tips differ by less than 2 % of the hair's length (0.2 m).

    The measured difference is 0.1 %, and twice as much on straight trajectories.
    """

    def spread(bowed):
        tips = np.stack([tips_after_two_seconds(kit, fps, values, bowed) for fps in rates])
        return np.linalg.norm(tips[:, None] - tips[None], axis=-1).max()

    smooth = spread(bowed=True)
    assert smooth < 0.02 * 0.2
    assert smooth < spread(bowed=False)
