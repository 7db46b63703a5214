"""The fast step against the slow one: two solvers that share almost no code must agree."""

from dataclasses import replace

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.dynamics.clearance import guide_clearance, max_clearance
from hairloom.addon.dynamics.colliders import (
    CapsuleCollider,
    DistanceField,
    PosedCollider,
    SphereCollider,
    SphereSetCollider,
)
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.measure import deepest_penetration
from hairloom.addon.dynamics.reference.step import advance_reference
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import start
from hairloom.addon.dynamics.step import advance

#: tolerances [m] of float32 against float64 after 0.4 s: limp strands amplify rounding errors about
#: seventyfold (so does the slow form, if started one rounding error apart), contacts more.
FREE, TOUCHING = 2e-4, 1e-3
#: Otherwise one form could take a last Newton step that the other just avoids.
TIGHT = {"length_tolerance": 0.0001}


def both(kit, scene, seconds=0.4, fps=50.0):
    slow = kit.Scene(**scene.__dict__ | {"advance": advance_reference})
    return scene.play(seconds, fps), slow.play(seconds, fps)


@pytest.mark.parametrize(
    "values",
    few_in_commits(
        [
            {"style_root": 0.0, "style_tip": 0.0, "bend": 3.0},
            {"substep_rate": 100.0, "length_iterations": 2},
            {},
            {"bend": 0.0, "damping": 3.0},
            {"sag_compensation": 0.0, "style_damping": 0.0},
        ],
    ),
)
def test_without_colliders(kit, shake, values):
    scene = kit.Scene(kit.curly(8, 12), DynamicsSettings(**TIGHT | values), shake)
    fast, slow = both(kit, scene)
    assert np.abs(fast[-1].position - fast[0].position).max() > 0.005
    for one, other in zip(fast, slow, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=FREE)
        assert one.time_left == pytest.approx(other.time_left, abs=1e-9)


#: Each feature alone, and combined with others that it interacts with.
FEATURES = {
    "curves": {"style_along": (1.0, 0.1, 0.9, 0.9, 0.2), "bend_along": (1.0, 1.0, 0.5, 0.0, 0.3)},
    "drag": {"drag": 8.0},
    "water": {"buoyancy": 0.8, "drag": 4.0, "damping": 2.0},
    "wind": {"wind_speed": 6.0, "gusts": 1.0, "damping": 4.0, "wind_direction": 1.0},
    "wind with drag": {"wind_speed": 6.0, "drag": 2.0, "wind_elevation": 0.4},
    "relaxation": {"length_solver": "relaxation", "relaxations": 5},
    "relaxation alone": {"length_solver": "relaxation", "relaxations": 3, "long_range": False},
}


@pytest.mark.parametrize("bowed", few_in_commits([True, False]))
@pytest.mark.parametrize("values", FEATURES.values(), ids=FEATURES)
def test_each_feature(kit, shake, values, bowed):
    scene = kit.Scene(
        kit.curly(4, 10),
        DynamicsSettings(**TIGHT | values),
        shake,
        bowed=bowed,
    )
    fast, slow = both(kit, scene, 0.2)
    plain = kit.Scene(**scene.__dict__ | {"settings": DynamicsSettings(**TIGHT)}).play(0.2, 50.0)
    assert np.abs(fast[-1].position - plain[-1].position).max() > 1e-4  # the feature does act
    for one, other in zip(fast, slow, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=FREE)
        assert one.time == pytest.approx(other.time, abs=1e-9)


@pytest.mark.parametrize("solver", few_in_commits(["direct", "relaxation"]))
def test_held_cvs(kit, shake, solver):
    grid = kit.curly(6, 10)
    held = kit.tips(np.arange(6) % 2 == 0, 10) | kit.tied(np.arange(6) % 3 == 0, 10, 5)
    settings = DynamicsSettings(**TIGHT | {"length_solver": solver, "style_tip": 0.5})
    fast, slow = both(kit, kit.Scene(grid, settings, shake, held=held))
    expected = kit.moved(shake(0.4), grid)[held]
    np.testing.assert_allclose(fast[-1].grid[held], expected, atol=1e-4)
    for one, other in zip(fast, slow, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=FREE)


def test_another_style_in_mid_play(kit, shake):
    """A change to longer guides of another shape, as if nodes had moved the style's curves."""
    first = kit.curly(6, 10)
    second = first * np.linspace(1.0, 1.3, 10)[:, None] + [0.0, 0.01, 0.0]
    settings, found = DynamicsSettings(**TIGHT), []
    for form in (advance, advance_reference):
        state, before = start(first), first
        for frame in range(1, 11):
            style = first if frame < 4 else second
            state = replace(state, rest=start(style).rest)
            now = kit.moved(shake(frame / 50.0), style)
            state = form(state, Drive(before, now, (), kit.EARTH), settings, 1.0 / 50.0)
            before = now
        found.append(state.grid)
    np.testing.assert_allclose(*found, atol=FREE)
    length = np.linalg.norm(np.diff(found[0], axis=1), axis=2)
    np.testing.assert_allclose(length, np.linalg.norm(np.diff(second, axis=1), axis=2), rtol=0.003)


@pytest.mark.parametrize("held", few_in_commits([True, False]))
@pytest.mark.parametrize("solver", few_in_commits(["direct", "relaxation"]))
def test_curls_that_give(kit, shake, solver, held):
    """Some segments of some guides stretch, with ties and a ball; the style carries part of the
    weight."""
    room = np.random.default_rng(4).uniform(-0.5, 1.5, (6, 9)).clip(0.0, None)
    room[::3] = 0.0
    values = {"length_solver": solver, "curl_stretch": 0.5, "sag_compensation": 0.6}
    scene = kit.Scene(
        kit.curly(6, 10),
        DynamicsSettings(**TIGHT | values),
        shake,
        on_head=(SphereCollider((0.0, 0.0, 0.0), 0.13),),
        held=kit.tied(np.arange(6) % 2 == 0, 10, 5) if held else None,
        room=room,
    )
    fast, slow = both(kit, scene, 0.3)
    plain = kit.Scene(**scene.__dict__ | {"room": None}).play(0.3, 50.0)
    assert np.abs(fast[-1].position - plain[-1].position).max() > 2e-3
    for one, other in zip(fast, slow, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=TOUCHING)


@pytest.mark.parametrize("iterations", [1, 8])
def test_held_cvs_that_tear(kit, iterations):
    """Heads that turn by a right angle in a frame: both forms lay the same guides out again."""
    grid = kit.curly(6, 10)
    settings = DynamicsSettings(**TIGHT | {"length_iterations": iterations, "substep_rate": 50.0})
    held = kit.tips(np.arange(6) % 2 == 0, 10) | kit.tied(np.arange(6) % 3 == 0, 10, 3)
    scene = kit.Scene(grid, settings, lambda time: kit.rotation(0, 70.0 * time), held=held)
    fast, slow = both(kit, scene, seconds=0.06)
    for one, other in zip(fast, slow, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=TOUCHING)


def test_a_changed_substep(kit, shake):
    """The speed is kept, also for quadratic drag."""
    one, other = (DynamicsSettings(**TIGHT | {"drag": 3.0, "substep_rate": r}) for r in (200, 100))
    scene = kit.Scene(kit.curly(4, 8), one, shake)
    state = scene.play(0.2, 50.0)[-1]
    drive = scene.drive(0.2, 0.22)
    fast, slow = (step(state, drive, other, 0.02) for step in (advance, advance_reference))
    np.testing.assert_allclose(fast.position, slow.position, atol=FREE)


@pytest.mark.parametrize("friction", few_in_commits([0.5, 0.0]))
@pytest.mark.parametrize("is_combed", few_in_commits([True, False]))
def test_with_a_ball_and_a_mesh(kit, shake, friction, is_combed):
    radii = {"radius_root": 0.02, "radius_tip": 0.1} if is_combed else {}
    settings = DynamicsSettings(
        **kit.LIMP | TIGHT | {"damping": 1.0, "friction": friction, "collider_resolution": 24},
        **radii,
    )
    mesh = DistanceField.from_surface(kit.icosphere(0.095, 2), settings)
    grid = kit.curly(4, 12)
    ball = SphereCollider(grid[3, 7] + [0.0, 0.0, 0.03], 0.05)
    scene = kit.Scene(grid, settings, shake, on_head=(mesh,), standing=(ball,), is_combed=is_combed)
    fast, slow = both(kit, scene)
    if is_combed:  # makes a difference here
        uncombed = kit.Scene(**scene.__dict__ | {"is_combed": False}).play(0.4, 50.0)
        assert np.abs(fast[-1].position - uncombed[-1].position).max() > 5e-3
    assert deepest_penetration(fast[0], scene.colliders(0, 0)) > 0.0  # some start inside
    for one, other in zip(fast, slow, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=TOUCHING)


def balls() -> SphereSetCollider:
    random = np.random.default_rng(5)
    centers = random.normal(size=(9, 3))
    centers *= 0.06 / np.linalg.norm(centers, axis=1, keepdims=True)
    return SphereSetCollider(centers, random.uniform(0.03, 0.05, 9))


@pytest.mark.slow(instead="test_with_a_ball_and_a_mesh")
@pytest.mark.parametrize(
    "collider",
    [
        pytest.param(CapsuleCollider((0.12, 0.0, 0.05), (0.05, 0.1, 0.16), 0.04), id="capsule"),
        pytest.param(balls(), id="sphere set"),
    ],
)
@pytest.mark.parametrize("bowed", [True, False])
def test_with_a_sphere_set_and_a_capsule(kit, shake, collider, bowed):
    """Moving, turned and scaled unevenly."""
    settings = DynamicsSettings(**kit.LIMP | TIGHT | {"damping": 1.0})
    stretched = np.diag([1.1, 0.9, 1.2, 1.0])
    scene = kit.Scene(
        kit.curly(6, 10), settings, lambda t: shake(t) @ stretched, on_head=(collider,), bowed=bowed
    )
    fast, slow = both(kit, scene)
    alone = kit.Scene(**scene.__dict__ | {"on_head": ()}).play(0.4, 50.0)
    assert np.abs(fast[-1].position - alone[-1].position).max() > 5e-3
    for one, other in zip(fast, slow, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=TOUCHING)


@pytest.mark.parametrize("is_mesh", few_in_commits([True, False]))
@pytest.mark.parametrize("is_combed", [False, True])
@pytest.mark.parametrize("speed", few_in_commits([6.5, 2.2]))
def test_segments_at_what_is_thin_and_fast(kit, is_mesh, is_combed, speed):
    """A collider that moves by twice its thickness per substep, or by more than a segment's length:
    both forms find the same places on the segments."""
    settings = DynamicsSettings(**kit.LIMP | TIGHT | {"damping": 1.0, "collider_resolution": 24})
    if is_combed:
        settings = replace(settings, radius_root=0.02, radius_tip=0.08)
    thin = CapsuleCollider((-0.1, 0.0, 0.0), (0.1, 0.0, 0.0), 0.006)
    if is_mesh:
        thin = DistanceField.from_surface(kit.box((0.2, 0.012, 0.06)), settings)
    grid = kit.straight(4, 9, 0.25)

    def motion(time):
        return kit.translation(0.02, -0.05 + speed * time, -0.14) @ kit.rotation(0, 3.0 * time)

    moving = [
        kit.Scene(grid, settings, motion, on_head=(thin,), advance=how)
        for how in (advance, advance_reference)
    ]
    states = [start(grid) for _ in moving]
    still, clearance = kit.Scene(grid, settings), None
    if is_combed:  # near enough to make a difference
        aside = kit.translation(0.0, 0.04, 0.0)
        near = [PosedCollider(thin, aside @ motion(0.0), aside @ motion(0.0))]
        clearance = guide_clearance(grid, near, max_clearance(settings, 0.25))
        assert (clearance.distances[:, 2:] < 0.01).any()
    for frame in range(4):
        times = frame / 60.0, (frame + 1) / 60.0
        colliders = moving[0].colliders(*times)
        drive = replace(still.drive(*times), colliders=colliders, clearance=clearance)
        states = [
            scene.advance(state, drive, settings, 1.0 / 60.0)
            for scene, state in zip(moving, states, strict=True)
        ]
        np.testing.assert_allclose(states[0].position, states[1].position, atol=TOUCHING)
    assert np.abs(states[0].position - start(grid).position).max() > 0.02


def test_no_guides(kit, shake):
    scene = kit.Scene(np.zeros((0, 8, 3), np.float32), DynamicsSettings(), shake)
    fast, slow = both(kit, scene, 0.1)
    assert fast[-1].position.shape == slow[-1].position.shape
