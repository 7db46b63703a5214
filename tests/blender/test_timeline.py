"""Hair follows Blender's timeline: each frame once, reproducibly, at rest after jumps."""

import math

import bpy
import numpy as np
import pytest
from grids import strand_grid
from mathutils import Matrix
from swinging import shake_head
from tiers import few_in_commits
from undoing import redo, undo

from hairloom.addon.blender.bakes import playback
from hairloom.addon.blender.base.frame_clock import MAX_FRAMES_PER_TICK, FrameClock
from hairloom.addon.blender.preview import previews

LAST = 10


@pytest.fixture
def swinging(new_hair, sphere, get_depsgraph, tmp_path):
    """Previewed hair on a head that shakes: (hair, head, session)."""
    hair, head = shake_head(new_hair(sphere), sphere, LAST, tmp_path / "bake")
    bpy.context.scene.frame_set(5)
    return hair, head, previews.start(hair, get_depsgraph())


def go(*frames):
    for frame in frames:
        bpy.context.scene.frame_set(frame)


def lag(session):
    """The largest distance of the tips from their style, carried by the head [m]."""
    head = bpy.data.objects["Head"]
    style = session.source.strands.grid[:, -1] - session.source.strands.grid[:, 0]
    offset = strand_grid(session)[:, -1] - strand_grid(session)[:, 0] - style
    assert np.isfinite(strand_grid(session)).all()
    assert (
        np.abs(strand_grid(session)[:, 0].mean(axis=0)[0] - head.matrix_world.translation.x) < 0.02
    )
    return float(np.linalg.norm(offset, axis=1).max())


def test_playing_twice_from_the_first_frame_gives_identical_bits(swinging):
    _, _, session = swinging
    runs = []
    for _ in range(2):
        shown = []
        for frame in range(1, LAST + 1):
            go(frame)
            shown.append(strand_grid(session))
        runs.append(np.array(shown))
        go(7)
    np.testing.assert_array_equal(runs[0], runs[1])
    assert np.abs(np.diff(runs[0], axis=0)).max() > 0.01


def test_hair_rests_at_the_first_frame_and_where_the_playhead_jumps(swinging):
    _, _, session = swinging
    go(1)
    assert lag(session) < 1e-5
    go(2, 3, 4, 5)
    assert lag(session) > 0.005
    go(8)
    assert lag(session) < 1e-5, "forwards"
    go(9)
    assert lag(session) > 1e-4, "and on from there"
    go(2)
    assert lag(session) < 1e-5, "backwards"


def test_redo_brings_back_the_frame_and_the_hair_as_it_was(swinging, get_depsgraph):
    _, _, session = swinging
    go(1, 2)
    bpy.ops.ed.undo_push(message="frame 2")
    go(3, 4)
    before = strand_grid(session)
    assert lag(session) > 0.005
    bpy.ops.ed.undo_push(message="frame 4")
    go(5)
    after = strand_grid(session)
    go(1, 2, 3, 4)
    for _ in range(2):
        undo()
        assert bpy.context.scene.frame_current == 2
        assert lag(session) < 1e-5, "as where the playhead jumps"
        redo()
        assert bpy.context.scene.frame_current == 4
        np.testing.assert_array_equal(strand_grid(session), before)
    go(5)
    # the head's own motion begins anew
    np.testing.assert_allclose(strand_grid(session), after, atol=0.003)


def test_hair_that_an_undo_has_left_does_not_come_back_on_a_body_that_stands_elsewhere(swinging):
    _, head, session = swinging
    go(1, 2)
    bpy.ops.ed.undo_push(message="frame 2")
    go(3, 4)
    bpy.ops.ed.undo_push(message="frame 4")
    undo()
    head = bpy.data.objects["Head"]
    go(3, 4)
    head.location.y = 0.5
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="moved")
    bpy.data.objects["Hair"].hide_select = True
    bpy.ops.ed.undo_push(message="locked")
    undo()
    assert bpy.context.scene.frame_current == 4 and lag(session) < 1e-5


def test_the_same_frame_again_keeps_the_hair_as_it_is(swinging):
    _, head, session = swinging
    go(1, 2, 3)
    before = strand_grid(session)
    go(3)
    head.update_tag()
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(strand_grid(session), before)
    go(4)
    assert lag(session) > 0.005


def test_a_head_that_is_moved_by_hand_takes_its_hair_along_at_rest(swinging):
    _, head, session = swinging
    go(1, 2, 3)
    head.location.x += 0.3
    bpy.context.view_layer.update()
    assert lag(session) < 1e-5


def test_frames_that_playback_drops_are_made_up_for(swinging, monkeypatch):
    _, _, session = swinging
    durations = []
    advance = type(session).advance

    def noted(session, depsgraph, duration):
        durations.append(duration)
        advance(session, depsgraph, duration)

    monkeypatch.setattr(type(session), "advance", noted)
    monkeypatch.setattr(playback, "is_animation_playing", lambda: True)
    go(1, 2, 5, 6)
    assert durations == pytest.approx([1 / 24, 3 / 24, 1 / 24])
    go(1, 2)
    assert len(durations) == 5 - 1, "a loop begins again"


def test_the_preview_range_begins_where_it_begins(swinging):
    _, _, session = swinging
    scene = bpy.context.scene
    scene.use_preview_range, scene.frame_preview_start, scene.frame_preview_end = True, 4, 8
    go(3, 4)
    assert lag(session) < 1e-5
    go(5)
    assert lag(session) > 1e-4


def test_without_simulate_on_playback_hair_only_follows(swinging):
    hair, _, session = swinging
    hair.hairloom.bake.follows = False
    for frame in (1, 2, 3, 4):
        go(frame)
        assert lag(session) < 1e-5
    assert not session.is_playing


def test_free_play_is_shaken_by_dragging_and_handed_over_to_playback(
    swinging, get_depsgraph, monkeypatch
):
    _, _, session = swinging
    go(1)
    previews.play(get_depsgraph())
    assert previews.is_playing()
    go(4)
    previews.advance(get_depsgraph(), 1 / 24)
    assert previews.is_playing() and lag(session) > 0.005
    monkeypatch.setattr(playback, "is_animation_playing", lambda: True)
    go(5)
    assert not previews.is_playing() and session.is_playing
    assert lag(session) > 0.005, "it goes on from where it was"
    previews.play(get_depsgraph())
    assert previews.is_playing() and lag(session) < 1e-5


def test_paused_hair_holds_and_goes_on(swinging, get_depsgraph):
    _, head, session = swinging
    head.animation_data_clear()
    previews.play(get_depsgraph())
    assert not bpy.ops.hairloom.pause.poll() or previews.is_playing()
    head.location.x += 0.1
    bpy.context.view_layer.update()
    previews.advance(get_depsgraph(), 1 / 24)
    held = strand_grid(session)
    assert bpy.ops.hairloom.pause() == {"FINISHED"}
    previews.advance(get_depsgraph(), 1 / 24)
    np.testing.assert_array_equal(strand_grid(session), held)
    assert previews.is_paused()
    assert bpy.ops.hairloom.pause() == {"FINISHED"}
    previews.advance(get_depsgraph(), 1 / 24)
    assert np.abs(strand_grid(session) - held).max() > 1e-4
    assert bpy.ops.hairloom.reset() == {"FINISHED"}
    assert lag(session) < 1e-5 and previews.is_playing()
    previews.rest(get_depsgraph(), keep_playing=False)
    assert not previews.is_playing() and not bpy.ops.hairloom.pause.poll()


def test_switching_the_device_during_play_continues_the_motion(swinging):
    hair, _, session = swinging
    hair.hairloom.dynamics.device = "automatic"
    go(1, 2, 3, 4)
    before = lag(session)
    hair.hairloom.dynamics.device = "numpy"
    assert session.solver.device == "numpy"
    assert lag(session) == pytest.approx(before, abs=1e-5)
    go(5)
    assert lag(session) > 0.005


@pytest.mark.parametrize("rate", few_in_commits([(240, 1.0), (1, 100.0), (24, 1.001)]))
def test_any_frame_rate_is_simulated(rate, swinging):
    _, _, session = swinging
    render = bpy.context.scene.render
    render.fps, render.fps_base = rate
    go(*range(1, LAST + 1))
    assert lag(session) < 0.2


@pytest.mark.parametrize("scale", [0.0, -1.0, 1e-9])
def test_a_head_of_no_size_or_turned_inside_out_gives_no_nonsense(scale, swinging):
    hair, head, session = swinging
    go(1, 2)
    head.scale = (scale, scale, scale)
    bpy.context.view_layer.update()
    go(3, 4, 5)
    assert previews.session_of(hair) is session, previews.notice()
    assert np.isfinite(strand_grid(session)).all()
    assert scale or "scale is zero" in previews.previews[session.uid].problems
    head.scale = (1.0, 1.0, 1.0)
    go(1, 2)
    assert lag(session) < 0.05 and previews.previews[session.uid].problems == ""


@pytest.mark.parametrize("what", ["a vertex", "the object"])
@pytest.mark.parametrize("when", ["in playback", "while it plays freely"])
def test_non_finite_input_ends_the_preview_with_a_reason(what, when, swinging, get_depsgraph):
    hair, head, _ = swinging
    go(1, 2)
    if when == "while it plays freely":
        previews.play(get_depsgraph())
    curves = np.array([point.position for point in hair.data.points])
    if what == "a vertex":
        head.data.vertices[7].co.x = math.nan
    else:
        head.animation_data_clear()
        head.matrix_world = Matrix(((math.nan,) * 4,) * 4)
    head.data.update()
    go(3)
    previews.advance(get_depsgraph(), 1 / 24)
    assert previews.sessions() == ()
    assert "Head" in previews.notice() and "not a finite number" in previews.notice()
    np.testing.assert_array_equal(curves, [point.position for point in hair.data.points])


def test_a_driver_without_a_number_is_ignored(swinging):
    """Blender itself ignores the value."""
    _, head, session = swinging
    head.driver_add("location", 1).driver.expression = "float('nan')"
    go(1, 2, 3, 4)
    assert lag(session) > 0.005


def test_play_keeps_the_scenes_rate_and_drops_what_it_cannot_make_up_for():
    clock = FrameClock(10.0)
    ticks = 10.0 + np.arange(1, 121) / 120.0
    assert sum(clock.due_frames(now, 24.0) for now in ticks) == 24
    assert max(FrameClock(0.0).due_frames(now, 24.0) for now in (5.0, 0.05)) == MAX_FRAMES_PER_TICK
    slow = FrameClock(0.0)
    assert slow.due_frames(5.0, 24.0) == MAX_FRAMES_PER_TICK
    assert slow.due_frames(5.0 + 1.5 / 24.0, 24.0) == 1, "what was late is forgotten"
    slow.skip(9.0)
    assert slow.due_frames(9.0 + 1.0 / 24.0, 24.0) == 1
    assert FrameClock(0.0).due_frames(0.5, 0.01) == 0
