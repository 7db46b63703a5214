"""Hair follows a brush at once, and what arrives later equals a rebuild without the brush."""

import threading

import bpy
import numpy as np
import pytest
from waiting import run_steps_until

from hairloom.addon.blender.base import latest_job
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.scene.curves import curve_offsets, curve_points, set_points
from hairloom.addon.blender.sessions import session as session_module
from hairloom.addon.blender.sessions.session import Session
from hairloom.addon.blender.viewport import overlay


@pytest.fixture
def hair(new_hair, sphere):
    hair = new_hair(sphere)
    children = hair.data.hairloom.children
    children.method, children.strand_count = "multi", 2000
    return hair


@pytest.fixture
def session(hair, get_depsgraph, monkeypatch):
    """A preview whose rebuilds do not block, as in a window."""
    made = previews.start(hair, get_depsgraph())
    monkeypatch.setattr(latest_job, "is_blocking", lambda: False)
    yield made
    scene_events.clear()


def stroke(hair, curves, angle=0.3):
    """Turn curves around their roots, as a brush that keeps lengths does."""
    points, offsets = curve_points(hair.data), curve_offsets(hair.data)
    turn = np.eye(3, dtype=np.float32)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    for curve in curves:
        own = slice(offsets[curve], offsets[curve + 1])
        points[own] = points[own][0] + (points[own] - points[own][0]) @ turn.T
    set_points(hair.data, points)
    bpy.context.view_layer.update()


def drawn(session):
    return np.array(session.strands)


def arrive(session, get_depsgraph):
    scene_events.catch_up(get_depsgraph())
    run_steps_until(lambda: not session.is_pending)


def rebuilt(hair, get_depsgraph):
    """Strands and occlusion of a preview that starts now."""
    fresh = Session(hair, get_depsgraph())
    return fresh.rig.strands.points, fresh.snapshot.occlusion


def test_strands_follow_with_the_update_and_nothing_else_moves(hair, session, get_depsgraph):
    before, snapshot = drawn(session), session.snapshot
    stroke(hair, range(5))
    after = drawn(session)
    own = session.rig.strands.offsets[5]
    assert np.abs(after[:own] - before[:own]).max() > 1e-3
    is_child = np.arange(len(after)) >= session.rig.strands.offsets[session.rig.own_count]
    moved = np.abs(after - before).max(axis=1) > 0.0
    assert 0.02 < moved[is_child].mean() < 0.6
    assert session.snapshot.layout is snapshot.layout
    assert session.snapshot.occlusion is snapshot.occlusion
    assert session.is_stale, "the rest is to come"


def test_combed_hair_ends_bit_for_bit_as_a_rebuild(hair, session, get_depsgraph):
    for number in range(3):
        stroke(hair, range(4 * number, 4 * number + 4))
    arrive(session, get_depsgraph)
    points, occlusion = rebuilt(hair, get_depsgraph)
    np.testing.assert_array_equal(session.rig.strands.points, points)
    np.testing.assert_array_equal(session.snapshot.occlusion, occlusion)
    assert not session.is_stale


def test_an_undo_brings_back_the_very_hair(hair, session, get_depsgraph):
    """Undo works before and after the rebuild has arrived. After it, children keep the combed
    guides until the next rebuild arrives."""
    before, points, groom = drawn(session), curve_points(hair.data), session.groom
    own = session.rig.strands.offsets[session.rig.own_count]
    stroke(hair, range(5))
    set_points(hair.data, points)
    bpy.context.view_layer.update()
    np.testing.assert_allclose(drawn(session), before, atol=1e-6)
    arrive(session, get_depsgraph)
    np.testing.assert_array_equal(drawn(session), before)
    assert session.groom is groom, "made once, not again"
    stroke(hair, range(5))
    arrive(session, get_depsgraph)
    set_points(hair.data, points)
    bpy.context.view_layer.update()
    np.testing.assert_allclose(drawn(session)[:own], before[:own], atol=1e-6)
    arrive(session, get_depsgraph)
    np.testing.assert_array_equal(drawn(session), before)


def test_blenders_undo_and_redo_are_followed(hair, session, get_depsgraph):
    bpy.ops.ed.undo_push(message="before")
    before = drawn(session)
    stroke(hair, range(5))
    bpy.ops.ed.undo_push(message="combed")
    combed = drawn(session)
    for back, expected in ((bpy.ops.ed.undo, before), (bpy.ops.ed.redo, combed)):
        back()
        scene_events.follow_undo()
        np.testing.assert_allclose(drawn(session), expected, atol=1e-6)


def test_a_stroke_amid_a_build_is_not_lost_when_that_arrives(hair, session, get_depsgraph):
    stroke(hair, range(5))
    scene_events.catch_up(get_depsgraph())
    stroke(hair, range(10, 15))
    shown = drawn(session)
    run_steps_until(lambda: not session.is_pending)
    own = session.rig.strands.offsets[session.rig.own_count]
    np.testing.assert_allclose(drawn(session)[:own], shown[:own], atol=1e-6)
    arrive(session, get_depsgraph)
    np.testing.assert_array_equal(session.rig.strands.points, rebuilt(hair, get_depsgraph)[0])


def test_hair_that_plays_is_not_put_to_rest_by_the_first_touch(hair, session, get_depsgraph):
    previews.play(get_depsgraph())
    previews.advance(get_depsgraph(), 1.0 / 60.0)
    solver = session.solver
    stroke(hair, range(5))
    assert session.solver is solver and session.is_playing


@pytest.fixture
def group(hair, sphere):
    """The density of the children, a vertex group."""
    group = sphere.vertex_groups.new(name="Hair")
    group.add([v.index for v in sphere.data.vertices], 1.0, "REPLACE")
    hair.hairloom.children_density = "Hair"
    return group


def paint(group, weight):
    """Set the weights of half of the head, as a brush does."""
    sphere = next(obj for obj in bpy.data.objects if group.name in obj.vertex_groups)
    group.add([v.index for v in sphere.data.vertices if v.co.x > 0.0], weight, "REPLACE")
    sphere.data.update_tag()
    bpy.context.view_layer.update()


def roots(session):
    own = session.rig.own_count
    return {root.tobytes() for root in session.rig.strands.roots[own:]}


def test_children_follow_a_density_with_the_update(hair, group, session, get_depsgraph):
    arrive(session, get_depsgraph)
    before, snapshot = roots(session), session.snapshot
    paint(group, 0.2)
    after, drawn_now = roots(session), drawn(session)
    assert 0.1 < len(before - after) / len(before) < 0.6
    assert session.snapshot.layout is snapshot.layout
    assert session.is_stale, "the rest is to come"
    assert {p.tobytes() for p in drawn_now[session.rig.strands.offsets[:-1]]} >= after
    arrive(session, get_depsgraph)
    assert roots(session) == after
    points, occlusion = rebuilt(hair, get_depsgraph)
    np.testing.assert_array_equal(session.rig.strands.points, points)
    np.testing.assert_array_equal(session.snapshot.occlusion, occlusion)


def test_an_undo_of_painting_brings_back_the_very_hair(hair, group, session, get_depsgraph):
    arrive(session, get_depsgraph)
    before, groom = drawn(session), session.groom
    paint(group, 0.2)
    paint(group, 1.0)
    arrive(session, get_depsgraph)
    np.testing.assert_array_equal(drawn(session), before)
    assert session.groom is groom, "made once, not again"


def test_painting_amid_a_build_is_not_lost_when_that_arrives(hair, group, session, get_depsgraph):
    arrive(session, get_depsgraph)
    paint(group, 0.5)
    scene_events.catch_up(get_depsgraph())
    paint(group, 0.1)
    painted = roots(session)
    run_steps_until(lambda: not session.is_pending)
    assert roots(session) == painted
    arrive(session, get_depsgraph)
    np.testing.assert_array_equal(session.rig.strands.points, rebuilt(hair, get_depsgraph)[0])


def test_playing_hair_waits_for_the_build_with_new_paint(hair, group, session, get_depsgraph):
    arrive(session, get_depsgraph)
    previews.play(get_depsgraph())
    previews.advance(get_depsgraph(), 1.0 / 60.0)
    solver, before = session.solver, roots(session)
    paint(group, 0.2)
    assert session.solver is solver and roots(session) == before


def test_guides_are_lines_while_brushes_comb_them(hair, session, get_depsgraph):
    """Blender's own curves stay hidden. Guides on the far side of the head are not drawn."""
    assert overlay.drawing_of(session.uid).lines == ()
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    bpy.context.view_layer.update()
    assert hair.evaluated_get(get_depsgraph()).display_type == "WIRE"
    (lines,) = overlay.drawing_of(session.uid).lines
    grid = session.rig.guide_grid
    np.testing.assert_allclose(lines.points.reshape(len(grid), -1, 2, 3)[:, :, 0], grid[:, :-1])
    np.testing.assert_allclose(lines.points.reshape(len(grid), -1, 2, 3)[:, :, 1], grid[:, 1:])
    seen = lines.seen_from(np.array([0.0, 0.0, 5.0, 1.0])).points
    assert 0 < len(seen) < len(lines.points) and seen[:, 2].min() > -0.05
    stroke(hair, range(5))
    (combed,) = overlay.drawing_of(session.uid).lines
    assert np.abs(combed.points - lines.points).max() > 1e-3
    hair.hairloom.hide_original = False
    bpy.context.view_layer.update()
    assert overlay.drawing_of(session.uid).lines == ()
    assert hair.evaluated_get(get_depsgraph()).display_type != "WIRE"
    bpy.ops.object.mode_set(mode="OBJECT")


def test_new_curves_are_no_stroke(hair, session, get_depsgraph):
    before = drawn(session)
    hair.data.add_curves([6])
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(drawn(session), before)


def test_a_combed_head_that_moved_since_takes_hair_along(hair, session, get_depsgraph):
    """Strokes are detected on the curves at rest, wherever hair and head are now."""
    hair.parent.location.x += 0.5
    bpy.context.view_layer.update()
    before = drawn(session)
    stroke(hair, range(5))
    own = session.rig.strands.offsets[5]
    away = np.abs(drawn(session) - before).max(axis=1)
    assert away[:own].max() > 1e-3 and (away > 1e-5).mean() < 0.6


def test_rebuilt_hair_arrives_with_its_old_light_and_keeps_newer_strokes(
    hair, session, get_depsgraph, monkeypatch
):
    """Combed hair first has the old light. Its own arrives later, and keeps newer strokes."""
    opened, lit = threading.Event(), session_module.with_full_light
    monkeypatch.setattr(
        session_module, "with_full_light", lambda *given: opened.wait(60.0) and lit(*given)
    )
    monkeypatch.setattr(latest_job, "is_blocking", lambda: False)
    fields = session.groom.light.fields
    stroke(hair, range(5))
    scene_events.catch_up(get_depsgraph())
    run_steps_until(lambda: session.is_lighting)
    assert session.groom.light.is_quick and session.groom.light.fields is fields
    expected = rebuilt(hair, get_depsgraph)[1]
    assert not np.array_equal(session.snapshot.occlusion, expected)
    assert np.abs(session.snapshot.occlusion - expected).mean() < 0.05
    stroke(hair, range(10, 15))
    shown, combed = drawn(session), session.rig.strands.points
    opened.set()
    run_steps_until(lambda: not session.is_lighting)
    np.testing.assert_array_equal(drawn(session), shown)
    np.testing.assert_array_equal(session.rig.strands.points, combed)
    np.testing.assert_array_equal(session.snapshot.occlusion, expected)
    arrive(session, get_depsgraph)
    points, occlusion = rebuilt(hair, get_depsgraph)
    np.testing.assert_array_equal(session.rig.strands.points, points)
    np.testing.assert_array_equal(session.snapshot.occlusion, occlusion)
