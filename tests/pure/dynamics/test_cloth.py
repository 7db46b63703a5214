"""Fins, meshes that move as cloth: edge lengths, pins and energy."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from hairloom.addon.dynamics.cloth.coloring import (
    distances_along_edges,
    greedy_colors,
    opposite_pairs,
    unique_edges,
)
from hairloom.addon.dynamics.cloth.reference import advance_cloth_reference
from hairloom.addon.dynamics.cloth.settings import FinSettings
from hairloom.addon.dynamics.cloth.state import distances, start_cloth, vertex_normals
from hairloom.addon.dynamics.cloth.step import advance_cloth, cloth_at_frame_end
from hairloom.addon.dynamics.colliders import PosedCollider, SphereCollider
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.errors import HairloomError
from hairloom.addon.strands import Surface

EARTH = np.array([0.0, 0.0, -9.81])
#: nothing but inertia, gravity and edges
BARE = {"damping": 0.0, "bend": 0.0}


def max_cloth_stretch(state):
    """Largest growth of an edge, as a fraction of its rest length, except for edges of no
    length."""
    rest = state.fabric.length
    growth = (distances(state.position, state.fabric.pairs) - rest)[rest > 1e-9]
    return float((growth / rest[rest > 1e-9]).max(initial=0.0))


def sheet(rows, columns, size):
    """A sheet below its first row in the plane y = 0; its spacing is `size` / 39 [m]."""
    down, along = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    points = np.stack([along.ravel(), np.zeros(down.size), -down.ravel()], axis=1) * size / 39.0
    quads = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (
        q.ravel() for q in (quads[:-1, :-1], quads[:-1, 1:], quads[1:, :-1], quads[1:, 1:])
    )
    triangles = np.concatenate([np.stack([a, c, b], axis=1), np.stack([b, c, d], axis=1)])
    return points.astype(np.float32), triangles


def hanging(rows=40, columns=40, size=1.0):
    """A sheet pinned at its first row."""
    points, triangles = sheet(rows, columns, size)
    return start_cloth(points, triangles, (np.arange(len(points)) < columns).astype(float))


def still(points, time):
    return points


def shaken(points, time):
    """Points shaken by 5 cm along a slanted line, once a second, fading in and out within three
    seconds."""
    strength = np.sin(np.pi * min(max(time, 0.0), 3.0) / 3.0) ** 2
    push = 0.05 * strength * np.sin(2.0 * np.pi * time) * np.array([1.0, 2.0, 1.0])
    return points + push


def play(state, seconds, settings, motion=still, fps=60.0, advance=advance_cloth, **drive):
    """The states at all frames, the start first."""
    points, states = state.fabric.position.T.copy(), [state]
    for frame in range(round(seconds * fps)):
        earlier, before, now = (motion(points, (frame + k) / fps) for k in (-1, 0, 1))
        way = Drive(
            before,
            now,
            gravity=EARTH,
            target_earlier=earlier,
            **{"colliders": ()} | drive,
        )
        states.append(advance(states[-1], way, settings, 1.0 / fps))
    return states


# ----------------------------------------------------------------------------- edges and colours


def test_each_edge_comes_once_and_no_color_holds_a_vertex_twice():
    _, triangles = sheet(9, 7, 1.0)
    edges = unique_edges(triangles)
    assert len(edges) == 8 * 7 + 9 * 6 + 8 * 6
    folds = opposite_pairs(triangles)
    for pairs in (edges, folds):
        colors = greedy_colors(pairs)
        assert colors.max() < 12
        for color in range(colors.max() + 1):
            vertices = pairs[colors == color].ravel()
            assert vertices.size and len(np.unique(vertices)) == len(vertices)


def test_folds_lie_across_inner_edges():
    """Two triangles: their outer vertices. Three at one edge: each one's with the next one's."""
    assert opposite_pairs(np.array([[0, 1, 2], [1, 0, 3]])).tolist() == [[2, 3]]
    assert opposite_pairs(np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])).tolist() == [[2, 3], [3, 4]]
    # a tetrahedron's opposite vertices are edges already
    assert not len(opposite_pairs(np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])))


def test_ways_lead_along_edges_to_the_nearest_seed():
    edges = np.array([[0, 1], [1, 2], [2, 3], [0, 3], [4, 5]])
    way, seed = distances_along_edges(edges, np.array([1.0, 1.0, 1.0, 5.0, 1.0]), np.array([0]), 6)
    assert way.tolist() == [0.0, 1.0, 2.0, 3.0, np.inf, np.inf]
    assert seed.tolist() == [0, 0, 0, 0, -1, -1]


def test_normals_are_those_of_the_surface():
    points, triangles = sheet(9, 7, 1.0)
    points += np.random.default_rng(1).normal(size=points.shape).astype(np.float32) * 0.005
    normals = vertex_normals(np.ascontiguousarray(points.T), triangles).T
    assert normals == pytest.approx(Surface(points, triangles).vertex_normals(), abs=1e-5)


# --------------------------------------------------------------------------------------- motion


def test_distances_are_fractions_of_what_the_page_says():
    points, _ = sheet(4, 40, 3.0)
    quarter = 0.25 * np.linalg.norm(np.ptp(points, axis=0))
    assert hanging(4, 40, 3.0).fabric.size == pytest.approx(quarter, rel=1e-6)
    page = (Path(__file__).parents[3] / "docs" / "dynamics.md").read_text(encoding="utf-8")
    assert "or of a quarter of the cloth's extent." in " ".join(page.split())


@pytest.mark.slow
def test_a_shaken_sheet_keeps_its_edges_and_comes_to_rest():
    """40 x 40 vertices, one metre, at the defaults: under 1 % in every frame."""
    states = play(hanging(), 6.0, FinSettings(), shaken)
    stretch = [max_cloth_stretch(state) for state in states]
    moved = np.abs(states[90].position - states[0].position).max()
    assert moved > 0.09, "it was shaken"
    assert max(stretch) < 0.01
    fastest = [np.abs(b.position - a.position).max() * 60.0 for a, b in pairwise(states)]
    assert fastest[-1] < 0.1 * max(fastest)
    assert np.abs(states[-1].position - states[0].position).max() < 0.02


def test_pinned_vertices_go_with_the_mesh():
    state = hanging(6, 6)
    states = play(state, 0.5, FinSettings(), shaken)
    target = shaken(state.fabric.position.T, 0.5)
    assert states[-1].position.T[:6] == pytest.approx(target[:6], abs=1e-6)
    assert np.abs(states[-1].position.T[6:] - target[6:]).max() > 1e-3


@pytest.mark.slow
def test_weights_between_pull_the_more_the_higher_they_are():
    points, triangles = sheet(2, 5, 0.2)
    sag = []
    for weight in (0.2, 0.5, 0.8, 0.99):
        state = start_cloth(points, triangles, np.full(len(points), weight))
        end = play(state, 1.5, FinSettings(damping=10.0, edgewise=1.0))[-1]
        sag.append(-(end.position - state.position)[2].mean())
    assert (np.diff(sag) < 0.0).all() and sag[-1] < 1e-4
    # a spring that swings f times a second is lengthened by g / (2 pi f)^2
    assert sag[1] == pytest.approx(9.81 / (2.0 * np.pi * FinSettings().pin_pull) ** 2, rel=0.02)


def test_a_strip_held_at_both_ends_hangs_as_a_catenary():
    """Against the analytic catenary, to 2 % of the sag."""
    points, triangles = sheet(2, 61, 0.65)
    points = points[:, [0, 2, 1]]  # lies flat
    length = points[60, 0]
    pin = np.isclose(points[:, 0], 0.0) | np.isclose(points[:, 0], length)
    span = 0.75 * length

    def narrowing(points, time):
        share = 1.0 - 0.25 * min(max(time, 0.0), 1.0)
        return points * np.array([share, 1.0, 1.0], np.float32)

    state = start_cloth(points, triangles, pin.astype(float))
    end = play(state, 8.0, FinSettings(bend=0.0), narrowing)[-1].position[:, :61]
    a = 1.0  # length = 2 a sinh(span / 2 a), by bisection
    low, high = 0.01, 100.0
    for _ in range(100):
        a = (low + high) / 2.0
        low, high = (a, high) if 2.0 * a * np.sinh(span / (2.0 * a)) > length else (low, a)
    x = end[0] - span / 2.0
    expected = a * (np.cosh(x / a) - np.cosh(span / (2.0 * a)))
    sag = -expected.min()
    assert sag > 0.1
    assert np.abs(end[2] - expected).max() < 0.02 * sag


@pytest.mark.slow
def test_stretch_is_as_promised_for_any_mesh_and_step():
    """The topmost edge of a hanging string of one metre stretches by the parameter's fraction."""
    for count, steps in ((11, 10), (41, 20), (41, 40)):
        points = np.zeros((count, 3), np.float32)
        points[:, 2] = -np.linspace(0.0, 1.0, count)
        edges = np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
        pin = (np.arange(count) == 0).astype(float)
        state = start_cloth(points, np.empty((0, 3), int), pin, edges)
        settings = FinSettings(
            stretch=0.1, long_range=False, damping=20.0, edgewise=1.0, small_steps=steps
        )
        end = play(state, 3.0, settings)[-1]
        upper = (-(end.position[2, 1]) * (count - 1)) - 1.0
        assert upper == pytest.approx(0.1 * (count - 1) / count, rel=0.12)


def energy(state):
    """Mean energy [J/kg] in the middle of the last small step, where the speed is known."""
    speed = (state.position - state.previous) / state.small_step
    height = (state.position[2] + state.previous[2]) / 2.0
    return float((0.5 * (speed**2).sum(axis=0) + 9.81 * height).mean())


def test_energy_never_grows_without_input():
    """Up to 0.5 % of its range is allowed, for the energy stored in stretched edges."""
    points, triangles = sheet(12, 12, 1.0)
    corners = np.zeros(144)
    corners[[0, 11]] = 1.0
    state = start_cloth(points[:, [0, 2, 1]], triangles, corners)  # lies flat, falls
    states = play(state, 4.0, FinSettings(**BARE))
    total = np.array([energy(each) for each in states[1:]])
    moved = total[0] - total[-1]
    assert moved > 0.01
    assert (total - np.minimum.accumulate(total)).max() < 0.005 * moved


def test_two_runs_are_alike_to_the_last_bit():
    settings = FinSettings(wind_speed=3.0, drag=1.0)
    one, two = (play(hanging(12, 12), 1.0, settings, shaken)[-1] for _ in range(2))
    assert np.array_equal(one.position, two.position)
    assert np.array_equal(one.previous, two.previous)


@pytest.mark.slow
def test_the_frame_rate_does_not_matter():
    """After a second of shaking, positions agree within 2 % of the cloth's length."""
    ends = {}
    for fps in (24.0, 30.0, 60.0, 120.0):
        states = play(hanging(12, 12, 1.0), 1.0, FinSettings(), shaken, fps)
        ends[fps] = states[-1].position
    length = 11.0 / 39.0
    for fps in (24.0, 30.0, 120.0):
        assert np.abs(ends[fps] - ends[60.0]).max() < 0.02 * length


def test_a_changed_step_keeps_the_speed():
    points, triangles = sheet(2, 2, 1.0)
    state = start_cloth(points, triangles, np.zeros(4))
    state = play(state, 0.5, FinSettings(**BARE))[-1]
    state = play(state, 0.5, FinSettings(**BARE, small_steps=3, substep_rate=480.0))[-1]
    fallen = -(state.position[2] - points[:, 2]).mean()
    assert fallen == pytest.approx(9.81 / 2.0, rel=0.01)


def test_broadside_air_brakes_and_edgewise_air_does_not():
    points, triangles = sheet(4, 4, 1.0)
    flat, upright = points[:, [0, 2, 1]], points
    fallen = []
    for pose in (flat, upright):
        state = start_cloth(pose, triangles, np.zeros(16))
        end = play(state, 1.0, FinSettings(damping=3.0, edgewise=0.0))[-1]
        fallen.append(-(end.position - state.position)[2].mean())
    assert fallen[1] == pytest.approx(9.81 / 2.0, rel=0.01)
    # v' = -c v + g
    assert fallen[0] == pytest.approx(9.81 / 3.0 * (1.0 - (1.0 - np.exp(-3.0)) / 3.0), rel=0.01)


def test_wind_carries_free_cloth_along():
    points, triangles = sheet(4, 4, 1.0)
    state = start_cloth(points, triangles, np.zeros(16))
    settings = FinSettings(gravity=0.0, wind_speed=2.0, wind_direction=np.pi / 2, gusts=0.0)
    states = play(state, 4.0, settings)
    speed = (states[-1].position - states[-2].position).mean(axis=1) * 60.0
    assert speed == pytest.approx([0.0, 2.0, 0.0], abs=0.01)


@pytest.mark.parametrize(
    ("values", "tolerance"),
    [
        pytest.param({}, 2e-5, marks=pytest.mark.slow),
        ({"drag": 2.0, "wind_speed": 3.0, "stretch": 0.01, "bend": 5.0, "shape": 1.0}, 5e-5),
        pytest.param({"radius": 0.04}, 2e-5, marks=pytest.mark.slow),
    ],
)
def test_the_slow_form_agrees(values, tolerance):
    """Within the rounding errors of float32 over eight frames."""
    points, triangles = sheet(6, 6, 2.0)
    pin = np.zeros(36)
    pin[:6], pin[6:12] = 1.0, np.linspace(0.0, 0.9, 6)
    state = start_cloth(points, triangles, pin)
    ball = SphereCollider((0.1, -0.09, -0.15), 0.08)
    moved = np.diag([1.2, 1.0, 1.0, 1.0])
    drive = {"colliders": (PosedCollider(ball, np.eye(4), moved),)} if "radius" in values else {}
    ends = [
        play(state, 8 / 60, FinSettings(**values), shaken, advance=form, **drive)[-1]
        for form in (advance_cloth, advance_cloth_reference)
    ]
    assert np.abs(ends[0].position - state.position).max() > 1e-3
    assert ends[0].position == pytest.approx(ends[1].position, abs=tolerance)


# ------------------------------------------------------------------------------------ colliders


def test_a_sheet_falls_over_a_ball_and_stays_outside():
    points, triangles = sheet(20, 20, 0.8)
    points = points[:, [0, 2, 1]] - points[:, [0, 2, 1]].mean(axis=0) + np.float32([0, 0, 0.12])
    state = start_cloth(points, triangles, np.zeros(400))
    ball = PosedCollider(SphereCollider((0, 0, 0), 0.1), np.eye(4), np.eye(4))
    states = play(state, 1.5, FinSettings(radius=0.0, friction=1.0), colliders=(ball,))
    away = [np.linalg.norm(each.position, axis=0) - 0.1 for each in states]
    assert min(each.min() for each in away) > -1e-4
    assert away[-1].min() < 1e-3, "it lies on the ball"
    assert max(max_cloth_stretch(each) for each in states[-10:]) < 0.03, "and is not torn by it"


def test_a_moving_ball_pushes_hanging_cloth():
    state = hanging(16, 16, 1.0)
    ball = SphereCollider((0.19, -0.2, -0.25), 0.08)
    points, states = state.fabric.position.T.copy(), [state]
    for frame in range(60):
        ways = [np.eye(4) for _ in range(2)]
        for matrix, k in zip(ways, (frame, frame + 1), strict=True):
            matrix[1, 3] = 0.3 * k / 60.0
        collider = PosedCollider(ball, *ways)
        drive = Drive(points, points, (collider,), EARTH)
        states.append(advance_cloth(states[-1], drive, FinSettings(), 1.0 / 60.0))
        center = np.array(ball.center) + ways[1][:3, 3]
        away = np.linalg.norm(states[-1].position - center[:, None], axis=0) - ball.radius
        assert away.min() > FinSettings().radius * state.fabric.size - 1e-4
    assert states[-1].position[1].max() > 0.05


# ------------------------------------------------------------------------------------ bad input


def test_cloth_without_pins_falls():
    points, triangles = sheet(4, 4, 1.0)
    state = start_cloth(points, triangles, np.zeros(16))
    end = play(state, 0.5, FinSettings(**BARE))[-1]
    assert end.position[2] - points[:, 2] == pytest.approx(np.full(16, -9.81 / 8.0), rel=0.01)


def test_odd_meshes_survive():
    """Coincident vertices, edges of no length, loose vertices, a degenerate face, and three faces
    at an edge."""
    points = np.array(
        [[0, 0, 0], [0, 0, 0], [0.1, 0, 0], [0, 0, -0.1], [0.1, 0, -0.1], [9, 9, 9], [0, 0.1, 0]],
        np.float32,
    )
    triangles = np.array([[0, 1, 2], [1, 2, 3], [2, 3, 4], [2, 3, 6], [2, 2, 4], [3, 2, 0]])
    state = start_cloth(points, triangles, np.eye(7)[2])
    end = play(state, 1.0, FinSettings(wind_speed=2.0), shaken)[-1]
    assert np.isfinite(end.position).all()
    assert max_cloth_stretch(end) < 0.02
    assert end.position[:, 5] == pytest.approx(shaken(points, 1.0)[5], abs=1e-6), "loose: carried"
    assert end.position[:, 0] == pytest.approx(end.position[:, 1], abs=1e-4), "doubles stay so"
    assert np.isfinite(end.normals()).all()


def test_two_vertices_swing_as_a_pendulum():
    """Period 2 pi sqrt(l / g), from 5 degrees."""
    tilt = np.radians(5.0)
    points = np.array([[0, 0, 0], [0.25 * np.sin(tilt), 0, -0.25 * np.cos(tilt)]], np.float32)
    state = start_cloth(points, np.empty((0, 3), int), np.array([1.0, 0.0]), np.array([[0, 1]]))
    states = play(state, 4.0, FinSettings(**BARE), fps=240.0)
    x = np.array([each.position[0, 1] for each in states])
    down = np.flatnonzero((x[:-1] > 0.0) & (x[1:] <= 0.0))
    period = np.diff(down).mean() / 240.0
    assert period == pytest.approx(2.0 * np.pi * np.sqrt(0.25 / 9.81), rel=0.02)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"positions": np.full((3, 3), np.nan)}, "not a finite number"),
        ({"positions": np.zeros((0, 3))}, "shape"),
        ({"triangles": [[0, 1, 3]]}, "does not exist"),
        ({"pin": np.zeros(2)}, "pinned"),
        ({"pin": [0.0, np.nan, 0.0]}, "pinned"),
        ({"edges": [[0, -1]]}, "does not exist"),
    ],
)
def test_what_cannot_be_cloth_is_said(change, says):
    good = {"positions": np.eye(3), "triangles": [[0, 1, 2]], "pin": np.zeros(3)}
    start_cloth(**good)
    with pytest.raises(HairloomError, match=says):
        start_cloth(**good | change)


@pytest.mark.parametrize(
    ("now", "gravity", "duration"),
    [
        (np.full((3, 3), np.inf), EARTH, 0.1),
        (np.zeros((4, 3)), EARTH, 0.1),
        (np.eye(3), np.full(3, np.nan), 0.1),
        (np.eye(3), EARTH, np.nan),
        (np.eye(3), EARTH, -1.0),
    ],
)
def test_a_broken_drive_is_said(now, gravity, duration):
    state = start_cloth(np.eye(3), [[0, 1, 2]], np.zeros(3))
    before = state.position.copy()
    with pytest.raises(HairloomError):
        advance_cloth(state, Drive(np.eye(3), now, (), gravity), FinSettings(), duration)
    assert np.array_equal(state.position, before)


def test_time_left_over_is_bridged_for_drawing():
    state = hanging(4, 4)
    points = state.fabric.position.T.copy()
    moved = points + np.float32([0.01, 0.0, 0.0])
    drive = Drive(points, moved, (), EARTH)
    state = advance_cloth(state, drive, FinSettings(), 1.5 / 240.0)
    assert state.time_left == pytest.approx(0.5 / 240.0)
    drawn = cloth_at_frame_end(state, drive)
    assert drawn[:4] == pytest.approx(moved[:4], abs=1e-7)
    way = drawn - state.position.T
    assert way[4:] == pytest.approx(np.tile(way[0], (12, 1)), abs=1e-6)
    # without pins they keep their velocity
    loose = start_cloth(points, state.fabric.triangles, np.zeros(16))
    loose = advance_cloth(loose, drive, FinSettings(**BARE), 1.5 / 240.0)
    fallen = (cloth_at_frame_end(loose, drive) - loose.position.T)[:, 2]
    assert fallen == pytest.approx(np.full(16, -9.81 / 240.0 * 0.5 / 240.0), rel=0.1)


@pytest.mark.parametrize("end", [0, 1])
@pytest.mark.parametrize("name", [p.name for p in FinSettings.parameters() if p.hard_range])
def test_the_ends_of_each_range_can_be_simulated(name, end):
    """No overflow, no NaN; with a shaken sheet, a ball and wind."""
    values = {"wind_speed": 3.0, "drag": 1.0, "stretch": 0.001, "small_steps": 2}
    parameter = next(each for each in FinSettings.parameters() if each.name == name)
    values[name] = parameter.hard_range[end]
    if parameter.kind == "integer":
        values[name] = int(values[name])
    points, triangles = sheet(5, 5, 1.0)
    pin = np.zeros(25)
    pin[:5], pin[5:10] = 1.0, 0.5
    ball = PosedCollider(SphereCollider((0.05, 0.0, -0.08), 0.03), np.eye(4), np.eye(4))
    state = start_cloth(points, triangles, pin)
    end_state = play(state, 4 / 60, FinSettings(**values), shaken, colliders=(ball,))[-1]
    assert np.isfinite(end_state.position).all() and np.isfinite(end_state.previous).all()


def test_far_from_the_origin_it_moves_the_same():
    """A kilometre away, to 0.1 mm."""
    points, triangles = sheet(8, 8, 1.0)
    pin = (np.arange(64) < 8).astype(float)
    away = np.array([1000.0, -500.0, 20.0])
    ends = [
        play(start_cloth(points + place, triangles, pin), 0.5, FinSettings(), shaken)[-1]
        for place in (np.zeros(3), away)
    ]
    assert ends[1].position.T - away == pytest.approx(ends[0].position.T, abs=1e-4)


def test_nothing_happens_in_a_frame_of_no_time():
    state = hanging(4, 4)
    points = state.fabric.position.T.copy()
    after = advance_cloth(state, Drive(points, points, (), EARTH), FinSettings(), 0.0)
    assert np.array_equal(after.position, state.position) and after.time == 0.0
