"""The fraction of the head's motion that hair inherits without inertia."""

from dataclasses import replace

import numpy as np
import pytest
from tiers import few_in_commits

from hairloom.addon.dynamics.frame import Drive
from hairloom.addon.dynamics.reference.step import advance_reference
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.dynamics.state import start
from hairloom.addon.dynamics.step import advance, grid_at_frame_end

WHOLE = {"inherit_location": 1.0, "inherit_rotation": 1.0}
SOFT = {"style_root": 0.5, "style_tip": 0.0, "bend": 0.5, "length_tolerance": 0.0001}


def tumbling(kit, time):
    """A fast, uneven motion about changing axes."""
    turn = kit.rotation(0, 3.0 * np.sin(4.0 * time)) @ kit.rotation(2, 9.0 * time**2)
    return kit.translation(2.0 * time**2, 0.3 * np.sin(9.0 * time), 0.0) @ turn


def played(kit, settings, motion, form=advance, seconds=0.5, fps=24.0, gravity=(0.0, 0.0, 0.0)):
    """The states and the shown guides of all frames."""
    grid = kit.curly(30, 8)
    state, shown = start(kit.moved(motion(0.0), grid)), []
    for frame in range(round(seconds * fps)):
        times = [max(frame + k, 0) / fps for k in (-1, 0, 1)]
        targets = [kit.moved(motion(time), grid) for time in times]
        drive = Drive(*targets[1:], (), np.array(gravity), targets[0] if frame else None)
        state = form(state, drive, settings, 1.0 / fps)
        shown.append(grid_at_frame_end(state, drive, settings, 1.0 / fps))
    return state, shown


@pytest.mark.parametrize("fps", [24.0, 60.0, 400.0])
@pytest.mark.parametrize("stiff", [SOFT, {"style_root": 0.0, "style_tip": 0.0, "bend": 0.0}])
def test_all_of_it_is_as_at_rest(kit, stiff, fps):
    """Without gravity, hair that inherits all motion of a tumbling head stays in its style."""
    settings = DynamicsSettings(**WHOLE | stiff)
    _, shown = played(kit, settings, lambda time: tumbling(kit, time), fps=fps)
    for frame, guides in enumerate(shown, 1):
        expected = kit.moved(tumbling(kit, frame / fps), kit.curly(30, 8))
        np.testing.assert_allclose(guides, expected, atol=2e-5)


def test_swinging_goes_on_as_if_the_head_stood_still(kit):
    """Relative to the head, hair that is given a push swings on a tumbling head as on a still
    one."""
    settings = DynamicsSettings(**WHOLE | SOFT | {"sag_compensation": 0.0})
    fps, dt, grid, ends = 60.0, 1.0 / 180.0, kit.curly(30, 8), []
    for motion in (lambda time: np.eye(4), lambda time: tumbling(kit, time)):
        state = start(grid)
        throw = np.float32([[[0.002]], [[0.001]], [[0.0]]]) * np.arange(8)[:, None] / 8.0
        state = replace(state, previous=state.position - throw.astype(np.float32), substep=dt)
        for frame in range(20):
            times = [(frame + k) / fps for k in (-1, 0, 1)]
            targets = [kit.moved(motion(max(time, 0.0)), grid) for time in times]
            drive = Drive(*targets[1:], (), np.zeros(3), targets[0] if frame else None)
            state = advance(state, drive, settings, 1.0 / fps)
        ends.append(kit.moved(np.linalg.inv(motion(20 / fps)), state.grid))
    assert np.abs(ends[0] - grid).max() > 0.02
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-4)


def test_parts_lie_in_between(kit):
    """More inherited motion means less lag behind the head; location and rotation are
    independent."""

    def lag(**values):
        settings = DynamicsSettings(**SOFT | values)
        _, shown = played(kit, settings, lambda time: kit.translation(3.0 * time**2, 0.0, 0.0))
        expected = kit.moved(kit.translation(0.75, 0.0, 0.0), kit.curly(30, 8))
        return float(np.abs(shown[-1] - expected).max())

    lags = [lag(inherit_location=fraction) for fraction in (0.0, 0.5, 1.0)]
    assert lags[0] > 1.3 * lags[1] > 0.003
    assert lags[2] < 1e-5
    assert lag(inherit_rotation=1.0) == pytest.approx(lags[0], rel=1e-3)


def test_it_fades_in_without_a_jerk(kit):
    """On a head at constant speed and without air damping, the inherited fraction has no effect, so
    changing it in mid-motion changes nothing."""
    grid, fps, way = kit.curly(30, 8), 60.0, np.float32([0.05, 0.0, 0.0])
    plain = DynamicsSettings(damping=0.0, sag_compensation=0.0)
    states = [start(grid), start(grid)]
    for frame in range(50):
        before = grid + way * frame
        drive = Drive(before, before + way, (), kit.EARTH, before - way if frame else None)
        since = replace(plain, **WHOLE) if frame >= 20 else plain
        states = [
            advance(state, drive, settings, 1.0 / fps)
            for state, settings in zip(states, (plain, since), strict=True)
        ]
    assert np.abs(states[0].grid - before).max() > 0.01, "it swings"
    np.testing.assert_allclose(states[1].grid, states[0].grid, atol=2e-4)


@pytest.mark.parametrize(
    "values", few_in_commits([WHOLE, {"inherit_location": 0.4}, {"inherit_rotation": 0.7}])
)
def test_equals_the_reference(kit, values):
    """With wind, drag and gravity, in frames of no whole number of substeps."""
    settings = DynamicsSettings(
        **SOFT | values | {"drag": 2.0, "wind_speed": 3.0, "damping": 1.0, "sag_compensation": 0.5}
    )

    def motion(time):
        return tumbling(kit, time)

    ends = [
        played(kit, settings, motion, form, 0.15, gravity=kit.EARTH)[0]
        for form in (advance, advance_reference)
    ]
    plain, _ = played(kit, DynamicsSettings(**SOFT), motion, seconds=0.15, gravity=kit.EARTH)
    assert np.abs(plain.position - ends[0].position).max() > 0.01
    np.testing.assert_allclose(ends[0].position, ends[1].position, atol=3e-4)
