"""A frame of motion: the style, time, invariants, and bad input."""

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.dynamics import step
from hairloom.addon.dynamics.colliders import PosedCollider, SphereCollider
from hairloom.addon.dynamics.constraints import PINNED_COUNT, TINY, directions
from hairloom.addon.dynamics.force_fields import ForceField, ForceFields
from hairloom.addon.dynamics.forces import weight_across_style
from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.groom_rotation import best_rotation
from hairloom.addon.dynamics.held import HeldCvs
from hairloom.addon.dynamics.measure import max_stretch
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import rows_of, start
from hairloom.addon.dynamics.step import advance, grid_at_frame_end
from hairloom.addon.errors import HairloomError

# --- style ---------------------------------------------------------------------------------------


def test_a_groom_at_rest_does_not_sag(kit):
    grid = kit.curly(50, 16)
    states = kit.Scene(grid, DynamicsSettings()).play(2.0)
    assert np.abs(states[-1].grid - grid).max() < 0.01 * 0.2


def test_without_held_weight_it_sags(kit):
    grid = kit.curly(50, 16)
    states = kit.Scene(grid, DynamicsSettings(sag_compensation=0.0)).play(2.0)
    assert np.abs(states[-1].grid - grid).max() > 0.02


def test_tilted_hair_falls(kit):
    """The weight that the style carries turns with the head: bent forward, hair hangs lower."""
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
    held = weight_across_style(gravity, carried)
    whole = np.concatenate([np.zeros_like(held[:, :1]), held], axis=1)
    segment = np.diff(carried[:, 1:], axis=1)
    unit = segment / np.linalg.norm(segment, axis=0)
    np.testing.assert_allclose((np.diff(whole, axis=1) * unit).sum(axis=0), 0.0, atol=2e-4)


def test_hanging_hair_holds_its_own_weight(kit):
    gravity = np.array([0.0, 0.0, -9.81], np.float32)
    held = weight_across_style(gravity, start(kit.straight(3, 12)).position)
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


def farthest_reach(state):
    """Largest ratio of the length along a guide, from its root to a CV, to its rest length.

    At rest 1. The segment of the pinned CVs counts with the length that the head gives it.
    """
    length = state.rest.length.copy()
    length[: PINNED_COUNT - 1] = directions(state.position[:, :PINNED_COUNT])[1]
    along = np.cumsum(np.linalg.norm(np.diff(state.position, axis=1), axis=0), axis=0)
    return float((along / np.maximum(np.cumsum(length, axis=0), TINY)).max())


def end_at(kit, motion, fps, seconds=1.0):
    grid = kit.curly(40, 16)
    return kit.Scene(grid, DynamicsSettings(), motion).play(seconds, fps)[-1].grid


@pytest.mark.parametrize("fps", few_in_commits([24, 30, 144]))
def test_even_motion_gives_the_same_at_any_frame_rate(kit, fps):
    """Linear interpolation is exact for a head at constant speed, so only rounding may differ."""

    def motion(time):
        return kit.translation(0.8 * time, 0.0, 0.3 * time)

    expected = end_at(kit, motion, 60)
    np.testing.assert_allclose(end_at(kit, motion, fps), expected, atol=1e-4)


@pytest.mark.parametrize("fps", few_in_commits([30, 24, 144]))
def test_a_shake_gives_nearly_the_same_at_any_frame_rate(kit, shake, fps):
    """Under 2 % of the hair's length at the tips."""
    expected = end_at(kit, shake, 240, 2.0)[:, -1]
    away = np.linalg.norm(end_at(kit, shake, fps, 2.0)[:, -1] - expected, axis=1)
    assert away.max() < 0.02 * 0.2


def test_time_is_not_lost(kit):
    """100 frames of no whole number of substeps take as many substeps as their total time."""
    settings = DynamicsSettings()
    scene = kit.Scene(kit.curly(3, 8), settings)
    state, count = scene.start(), 0
    for _ in range(100):
        before = state
        state = advance(state, scene.drive(0, 0), settings, 0.0137)
        assert 0.0 <= state.time_left < 1.0 / settings.substep_rate
        count += round((before.time_left + 0.0137 - state.time_left) * settings.substep_rate)
    assert count == int(1.37 * settings.substep_rate)


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
    """At 25 frames a second a frame is no whole number of substeps; the time left is bridged
    without stretching hair."""
    settings = DynamicsSettings()
    scene = kit.Scene(kit.curly(5, 8), settings, lambda time: kit.translation(time, 0, 0))
    drive = scene.drive(0.0, 1 / 25)
    state = advance(scene.start(), drive, settings, 1 / 25)
    assert state.time_left > 0.0
    shown = grid_at_frame_end(state, drive, DynamicsSettings(), 1 / 25)
    np.testing.assert_allclose(shown[:, 0], drive.target_now[:, 0], atol=1e-6)
    np.testing.assert_allclose(np.diff(shown, axis=1), np.diff(state.grid, axis=1), atol=1e-6)


def test_a_changed_substep_keeps_the_speed(kit):
    """Time correction of Verlet's method: a strand moves on at its speed when the rate changes."""
    fast, slow = (DynamicsSettings(**kit.LIMP | {"substep_rate": r}) for r in (480.0, 120.0))
    scene = kit.Scene(kit.straight(1, 3, 2e3), fast, gravity=np.zeros(3))
    state = scene.start()
    previous = state.position.copy()
    previous[0, 2] -= np.float32(1.0 / 480.0)
    state = type(state)(state.position, previous, state.rest, 1.0 / 480.0)
    state = advance(state, scene.drive(0, 0), slow, 0.1)
    assert (state.position - state.previous)[0, 2, 0] * 120.0 == pytest.approx(1.0, rel=0.01)


# --- invariants ----------------------------------------------------------------------------------


def test_the_same_twice(kit, shake):
    scene = kit.Scene(kit.curly(60, 16), DynamicsSettings(), shake)
    one, other = scene.play(0.5)[-1], scene.play(0.5)[-1]
    np.testing.assert_array_equal(one.position, other.position)
    np.testing.assert_array_equal(one.previous, other.previous)


WINDY = {"wind_speed": 5.0, "drag": 1.0, "sag_compensation": 0.0}


def swept(kit, shake, guides, settings):
    """The last state of some of 30 guides on a shaken head, with some tips held and some tied."""
    held = kit.tips(np.arange(30) % 2 == 0, 12)
    held |= kit.tied(np.arange(30) % 3 == 0, 12, 6)
    scene = kit.Scene(
        kit.curly(30, 12)[guides],
        settings,
        lambda time: kit.translation(*shake(3.0 * time)[:3, 3]),
        on_head=(SphereCollider((0, 0, 0), 0.1),),
        standing=(SphereCollider((0.1, 0.0, 0.2), 0.05),),
        held=held[guides],
    )
    return scene.play(0.4)[-1]


@pytest.mark.parametrize("solver", few_in_commits(["direct", "relaxation"]))
def test_a_guide_does_not_feel_the_others(kit, shake, solver):
    """Alone and among others, bit for bit; without carried weight, which turns with the groom's
    mean rotation."""
    settings = DynamicsSettings(**WINDY | {"length_solver": solver})
    together = swept(kit, shake, np.arange(30), settings)
    for guide in (0, 7, 29):
        alone = swept(kit, shake, np.array([guide]), settings)
        np.testing.assert_array_equal(alone.position[:, :, 0], together.position[:, :, guide])
        np.testing.assert_array_equal(alone.previous[:, :, 0], together.previous[:, :, guide])


@pytest.mark.parametrize("size", few_in_commits([7, 1, 30]))
def test_blocks_change_nothing(kit, shake, size, monkeypatch):
    """Also with carried weight, which turns with the mean rotation of the whole groom."""
    whole = swept(kit, shake, np.arange(30), DynamicsSettings())
    monkeypatch.setattr(step, "MAX_BLOCK_GUIDES", size)
    parts = swept(kit, shake, np.arange(30), DynamicsSettings())
    np.testing.assert_array_equal(parts.position, whole.position)
    np.testing.assert_array_equal(parts.previous, whole.previous)


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


@pytest.mark.parametrize("held", [None, True])
@pytest.mark.parametrize("seed", few_in_commits(range(12), 2))
def test_any_settings_stay_finite_and_short(kit, seed, held):
    """Random values from the hard ranges, with a violent head, colliders, force fields and held
    tips."""
    random = np.random.default_rng(seed)
    fixed = {} if seed % 4 == 3 else {"length_solver": "direct"}
    settings = kit.random_settings(random, **fixed)
    way = random.normal(size=(4, 3))

    def motion(time):
        turn = kit.rotation(0, way[0, 0] * 20 * time) @ kit.rotation(2, way[0, 1] * 20 * time)
        return kit.translation(*(way[1] * np.sin(20 * way[2] * time))) @ turn

    even = np.arange(20) % 2 == 0
    scene = kit.Scene(
        kit.curly(20, 16, seed=seed),
        settings,
        motion,
        on_head=(SphereCollider((0, 0, 0), 0.1), SphereCollider((0.1, 0, 0.2), 0.05)),
        standing=(SphereCollider((0.3, 0, 0.0), 0.2),),
        held=held and kit.tied(np.arange(20) % 3 == 0, 16, 3, 9) | kit.tips(even, 16),
        bowed=seed % 2 == 0,
        force_fields=ForceFields(
            (
                ForceField("wind", axis=tuple(way[3] / np.linalg.norm(way[3])), strength=30.0),
                ForceField("vortex", strength=200.0, shape="plane", across_fraction=1.0),
            )
        ),
    )
    for state in scene.play(0.5)[1:]:
        assert np.isfinite(state.position).all()
        assert np.isfinite(state.previous).all()
        if settings.length_solver == "direct":
            assert max_stretch(state) <= settings.length_tolerance + 2e-4
            assert farthest_reach(state) <= 1.02
        elif settings.long_range:
            assert farthest_reach(state) <= 1.0001


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
        ({"gravity": np.zeros(2)}, "gravity"),
        ({"force_fields": ForceFields((ForceField("wind", strength=np.nan),))}, "force field"),
        ({"target_earlier": np.full((4, 8, 3), np.inf, np.float32)}, "not a finite number"),
        ({"target_earlier": np.zeros((4, 7, 3), np.float32)}, "Start the simulation again"),
        ({"held": HeldCvs(np.ones((4, 7), bool))}, "Start the simulation again"),
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


def test_a_collider_that_turns_over_within_a_frame_does_no_harm(kit):
    """Half a turn in one frame: linear interpolation of its matrix would flatten the ball."""
    grid = kit.curly(20, 12)
    posed = PosedCollider(SphereCollider((0, 0, 0), 0.12), np.eye(4), kit.rotation(0, np.pi))
    settings = DynamicsSettings(substep_rate=120.0)
    state = advance(start(grid), Drive(grid, grid, (posed,), kit.EARTH), settings, 1 / 60)
    assert np.isfinite(state.position).all()
    assert farthest_reach(state) <= 1.02


def test_a_tied_straight_strand_stays_calm(kit, shake):
    """Without compliance, length constraints between two fixed ends on a line have no solution."""
    scene = kit.Scene(
        kit.straight(4, 12, 0.2, (0.0, 0.6, 0.8)),
        DynamicsSettings(),
        shake,
        held=kit.tips([True] * 4, 12),
    )
    for time, state in enumerate(scene.play(1.0)):
        assert max_stretch(state) < 0.01
        away = state.grid - kit.moved(shake(time / 60), scene.grid)
        assert np.abs(away).max() < 0.01


def test_bad_guides_are_named(kit):
    grid = kit.curly(4, 8)
    grid[2, 3, 1] = np.nan
    with pytest.raises(HairloomError, match="not a finite number"):
        start(grid)
    with pytest.raises(HairloomError, match="at least two CVs"):
        start(grid[:, :1] * 0.0)
