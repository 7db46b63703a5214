"""Hair that is made beside the window's work: what was there is shown until it arrives."""

import threading
import time

import bpy
import numpy as np
import pytest

from hairloom.addon import pipeline
from hairloom.addon.errors import HairloomError
from hairloom.addon.host.bakes.bake import simulated_for
from hairloom.addon.host.colliders import fields
from hairloom.addon.host.preview import live, making, overlay, previewed, reactions
from hairloom.addon.host.preview.making import Order, make
from hairloom.addon.host.preview.reading import Reading
from hairloom.addon.host.preview.showing import shown_groom
from hairloom.addon.host.thread_work import GivenUpError

FRAME = 1.0 / 60.0
COUNT = 60


@pytest.fixture
def in_window(monkeypatch):
    monkeypatch.setattr(making, "is_awaited", lambda: False)
    yield
    reactions.clear()


@pytest.fixture
def gate(in_window, monkeypatch):
    """Holds hair back until it is opened."""
    opened, occlusion = threading.Event(), pipeline.rest_occlusion

    def wait_and_make(*arguments):
        assert opened.wait(60.0)
        return occlusion(*arguments)

    monkeypatch.setattr(pipeline, "rest_occlusion", wait_and_make)
    yield opened
    opened.set()


@pytest.fixture
def hair(new_hair, sphere):
    made = new_hair(sphere)
    made.hairloom.dynamics.collider_resolution = 16
    return made


def arrive(session):
    """As Blender's timer does, until nothing is being made."""
    end = time.monotonic() + 60.0
    while session.is_pending and live.sessions():
        assert time.monotonic() < end, "it is never made"
        previewed.take_arrivals()
        time.sleep(0.005)


def shown(session):
    return overlay.drawing_of(session.uid)


def is_box(hair, evaluated):
    return hair.evaluated_get(evaluated()).display_type == "BOUNDS"


def test_a_preview_shows_blenders_strands_until_its_own_are_made(hair, evaluated, gate):
    session = live.start(hair, evaluated())
    assert not session.is_made and session.is_pending
    assert shown(session).snapshot.strand_count == 0 and "is being made" in shown(session).note
    assert not is_box(hair, evaluated)
    assert bpy.app.timers.is_registered(previewed.take_arrivals)
    gate.set()
    arrive(session)
    assert session.is_made and shown(session).note == ""
    assert shown(session).snapshot.strand_count == COUNT and is_box(hair, evaluated)


def test_what_a_thread_makes_is_the_same_to_the_bit(hair, evaluated, in_window):
    hair.data.hairloom.children.way = "multi"
    hair.data.hairloom.children.strand_count = 500
    session = live.start(hair, evaluated())
    arrive(session)
    alone = make(Reading(hair, evaluated()).ordered, is_drawn=True)
    assert np.array_equal(session.rig.strands.points, alone.rig.strands.points)
    assert np.array_equal(session.rig.weights.weight, alone.rig.weights.weight)
    assert np.array_equal(session.snapshot.occlusion, alone.occlusion)
    assert np.array_equal(session.snapshot.rank, alone.rank)


def test_play_waits_for_the_hair(hair, evaluated, gate):
    session = live.start(hair, evaluated())
    assert live.play(evaluated(), waits=False) == []
    while not fields.are_made():
        time.sleep(0.005)
    live.advance(evaluated(), FRAME)
    assert live.is_waiting(session) and not session.is_playing
    with pytest.raises(fields.NotMadeYetError):
        session.play(evaluated(), waits=False)
    gate.set()
    arrive(session)
    live.advance(evaluated(), FRAME)
    assert session.is_playing and len(session.strands) == COUNT


def test_blenders_playback_and_a_bake_wait_for_no_timer(hair, evaluated, in_window):
    session = live.start(hair, evaluated())
    session.play(evaluated())
    assert session.is_made and session.is_playing and not session.is_pending
    hair.data.hairloom.guides.guide_count = 7
    assert session.is_stale
    assert simulated_for(hair, evaluated()) is session
    assert len(session.rig.guides) == 7


@pytest.fixture
def playing(hair, evaluated, in_window, sphere):
    """Hair that swings."""
    session = live.start(hair, evaluated())
    arrive(session)
    live.play(evaluated())
    sphere.location.x = 0.05
    for _ in range(3):
        live.advance(evaluated(), FRAME)
    return session


def hold(monkeypatch):
    """From now on hair is held back until the gate is opened."""
    opened, prepare = threading.Event(), pipeline.prepare

    def wait_and_prepare(*arguments, **named):
        assert opened.wait(60.0)
        return prepare(*arguments, **named)

    monkeypatch.setattr(pipeline, "prepare", wait_and_prepare)
    return opened


def test_old_hair_plays_until_the_new_is_made(playing, hair, evaluated, monkeypatch):
    opened = hold(monkeypatch)
    hair.data.hairloom.children.way = "multi"
    hair.data.hairloom.children.strand_count = 300
    reactions.catch_up(evaluated())
    assert playing.is_pending and not playing.is_stale
    before = playing.strands
    live.advance(evaluated(), FRAME)
    assert len(playing.strands) == COUNT and not np.array_equal(playing.strands, before)
    tips = playing.solver.guides()[:, -1]
    opened.set()
    arrive(playing)
    assert len(playing.strands) > COUNT and playing.is_playing
    # no step has been taken since: the same guides are where they were
    assert np.array_equal(playing.solver.guides()[:, -1], tips)
    at_rest = pipeline.carried(playing.rig, playing.solver.pose, playing.rig.guides)[:, -1]
    assert np.abs(tips - at_rest).max() > 1e-3, "the hair did not swing"


def test_of_many_settings_the_last_one_counts(playing, hair, evaluated, monkeypatch):
    opened = hold(monkeypatch)
    for count in (10, 11, 12):
        hair.data.hairloom.guides.guide_count = count
        reactions.catch_up(evaluated())
    made, take = [], type(playing).take_made
    monkeypatch.setattr(
        type(playing), "take_made", lambda s, d: (take(s, d), made.append(len(s.rig.guides)))
    )
    opened.set()
    arrive(playing)
    assert made == [10, 12], "what is in between is left out"
    assert playing.choices.guides.guide_count == 12 and not playing.is_stale


def test_what_acts_at_once_meanwhile_is_kept(playing, hair, evaluated, monkeypatch):
    opened = hold(monkeypatch)
    hair.data.hairloom.guides.guide_count = 9
    reactions.catch_up(evaluated())
    hair.data.hairloom.strands.width_scale = 3.0
    assert shown(playing).snapshot.strand_settings.width_scale == 3.0
    assert not playing.is_stale
    opened.set()
    arrive(playing)
    assert shown(playing).snapshot.strand_settings.width_scale == 3.0
    assert len(playing.rig.guides) == 9


def test_edits_while_hair_is_made_arrive_too(playing, hair, evaluated, monkeypatch):
    opened = hold(monkeypatch)
    for scale in (0.9, 0.8):
        points = np.empty(len(hair.data.points) * 3, np.float32)
        hair.data.position_data.foreach_get("vector", points)
        hair.data.position_data.foreach_set("vector", points * np.float32(scale))
        reactions.updated(evaluated())
        reactions.catch_up(evaluated())
    opened.set()
    arrive(playing)
    wanted = make(Reading(hair, evaluated()).ordered, is_drawn=False).rig.strands
    length = np.linalg.norm(np.diff(wanted.grid, axis=1), axis=2).sum()
    now = np.linalg.norm(np.diff(playing.rig.strands.grid, axis=1), axis=2).sum()
    assert now == pytest.approx(length, rel=1e-3)


def test_ambient_light_needs_no_other_strands(playing, hair, evaluated, monkeypatch):
    monkeypatch.setattr(pipeline, "prepare", None)
    rig, motion, before = playing.rig, playing.strands, playing.snapshot.occlusion
    hair.data.hairloom.ambient.strength = 0.2
    reactions.catch_up(evaluated())
    arrive(playing)
    assert playing.rig is rig and np.array_equal(playing.strands, motion)
    assert playing.snapshot.occlusion.mean() > before.mean()


@pytest.mark.parametrize("end", ["stop", "delete", "load"])
def test_an_end_in_the_middle_leaves_nothing(end, hair, evaluated, gate):
    session = live.start(hair, evaluated())
    work = session._making._work
    if end == "stop":
        live.stop(session)
    elif end == "delete":
        bpy.data.objects.remove(hair)
        bpy.context.view_layer.update()
    else:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert live.sessions() == () and previewed.take_arrivals() is None
    gate.set()
    work.wait()
    with pytest.raises(GivenUpError):
        work.result()


def test_hair_that_cannot_be_made_ends_the_preview_with_a_notice(playing, hair, monkeypatch):
    def fail(*_, **__):
        raise HairloomError("it cannot be", place="Hair", remedy="Undo")

    monkeypatch.setattr(pipeline, "prepare", fail)
    hair.data.hairloom.guides.guide_count = 5
    reactions.catch_up(bpy.context.evaluated_depsgraph_get())
    arrive(playing)
    assert live.sessions() == () and "it cannot be" in live.notice()


def test_a_failure_of_what_nobody_wants_any_more_is_no_matter(
    playing, hair, evaluated, monkeypatch
):
    opened, prepare = threading.Event(), pipeline.prepare

    def fail_for_five(strands, head, settings, **named):
        assert opened.wait(60.0)
        if settings.guide_count == 5:
            raise HairloomError("it cannot be", place="Hair", remedy="Undo")
        return prepare(strands, head, settings, **named)

    monkeypatch.setattr(pipeline, "prepare", fail_for_five)
    for count in (5, 6):
        hair.data.hairloom.guides.guide_count = count
        reactions.catch_up(evaluated())
    opened.set()
    arrive(playing)
    assert live.sessions() == (playing,) and len(playing.rig.guides) == 6


def test_pictures_are_of_whole_hair(hair, evaluated, in_window):
    live.start(hair, evaluated())
    assert len(shown_groom(hair, evaluated()).points) == COUNT


def test_orders_tell_whether_they_give_the_same_rig(hair, evaluated, extension):
    reading = Reading(hair, evaluated())
    order = reading.ordered
    assert order.gives_rig_of(order) and reading.read_again(evaluated()) is None
    hair.data.hairloom.guides.guide_count = 5
    other = reading.read_again(evaluated())
    assert isinstance(other, Order) and not other.gives_rig_of(order)
    assert reading.choices.guides.guide_count != 5, "it is not shown yet"
    reading.accept(other)
    assert reading.choices.guides.guide_count == 5
