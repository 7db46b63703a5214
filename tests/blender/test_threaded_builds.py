"""Hair that is built in a thread: the previous state is shown until it arrives."""

import threading
from dataclasses import replace

import bpy
import numpy as np
import pytest
from grids import strand_grid
from swinging import key_x
from waiting import run_steps_until, wait_until, wait_until_playing

from hairloom.addon import light_flow, motion_flow, rig_flow
from hairloom.addon.arrays import same_content
from hairloom.addon.blender.bakes import playback
from hairloom.addon.blender.base import latest_job
from hairloom.addon.blender.colliders import fields
from hairloom.addon.blender.pictures.showing import shown_groom
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.preview.bake import simulation_for
from hairloom.addon.blender.preview.phases import Phase
from hairloom.addon.blender.sessions import prepared_groom
from hairloom.addon.blender.sessions import session as session_module
from hairloom.addon.blender.sessions.groom_source import GroomSource
from hairloom.addon.blender.sessions.prepared_groom import BuildRequest, build_groom
from hairloom.addon.blender.sessions.snapshots import snapshot_of
from hairloom.addon.blender.viewport import overlay
from hairloom.addon.dynamics.colliders import DistanceField
from hairloom.addon.dynamics.settings import DynamicsSettings
from hairloom.addon.errors import HairloomError
from hairloom.addon.groom.settings import GuideSettings
from hairloom.addon.refine import lead_out
from hairloom.addon.render.ride_pass import RideTexels

FRAME = 1.0 / 60.0
COUNT = 60


@pytest.fixture
def in_window(monkeypatch):
    monkeypatch.setattr(latest_job, "is_blocking", lambda: False)
    yield
    scene_events.clear()


@pytest.fixture
def gate(in_window, monkeypatch):
    """Building hair is held back until this event is set."""
    opened, ranks = threading.Event(), rig_flow.strand_ranks

    def wait_and_make(*arguments, **named):
        assert opened.wait(60.0)
        return ranks(*arguments, **named)

    monkeypatch.setattr(rig_flow, "strand_ranks", wait_and_make)
    yield opened
    opened.set()


@pytest.fixture
def hair(new_hair, sphere):
    made = new_hair(sphere)
    made.hairloom.dynamics.collider_resolution = 16
    return made


def arrive(session):
    """Run timer steps until nothing is pending."""
    run_steps_until(lambda: not (session.is_pending and previews.sessions()))


def shown(session):
    return overlay.drawing_of(session.uid)


def is_box(hair, get_depsgraph):
    return hair.evaluated_get(get_depsgraph()).display_type == "WIRE"


def test_a_preview_shows_blenders_strands_until_its_own_are_made(hair, get_depsgraph, gate):
    session = previews.start(hair, get_depsgraph())
    assert not session.is_made and session.is_pending
    assert shown(session).snapshot.strand_count == 0 and "is being made" in shown(session).note
    assert not is_box(hair, get_depsgraph)
    assert bpy.app.timers.is_registered(latest_job.run_steps)
    gate.set()
    arrive(session)
    assert session.is_made and shown(session).note == ""
    assert shown(session).snapshot.strand_count == COUNT and is_box(hair, get_depsgraph)


@pytest.mark.parametrize("view", ["stretch", "depth"])
def test_hair_that_is_being_made_may_be_coloured_by_what_it_has_not_yet(
    view, hair, get_depsgraph, gate
):
    hair.hairloom.debug_view = view
    session = previews.start(hair, get_depsgraph())
    assert shown(session).snapshot.strand_count == 0
    gate.set()
    arrive(session)
    assert shown(session).snapshot.debug_view == view
    assert shown(session).snapshot.strand_count == COUNT


def test_cancel_ends_the_preview_of_hair_that_is_being_made(hair, get_depsgraph, gate):
    session = previews.start(hair, get_depsgraph())
    hair.select_set(True)
    bpy.context.view_layer.objects.active = hair
    assert not session.is_made and bpy.ops.hairloom.cancel_build() == {"FINISHED"}
    assert previews.session_of(hair) is None and not session.is_pending
    gate.set()
    run_steps_until(lambda: not latest_job.is_scheduled(session))
    assert previews.session_of(hair) is None


def test_a_build_in_a_thread_is_bit_for_bit_the_same(hair, get_depsgraph, in_window):
    hair.data.hairloom.children.method = "multi"
    hair.data.hairloom.children.strand_count = 500
    session = previews.start(hair, get_depsgraph())
    arrive(session)
    alone = build_groom(GroomSource(hair, get_depsgraph()).request, is_drawn=True)
    assert np.array_equal(session.rig.strands.points, alone.rig.strands.points)
    assert np.array_equal(session.rig.weights.weight, alone.rig.weights.weight)
    assert np.array_equal(session.snapshot.occlusion, alone.light.occlusion)
    assert np.array_equal(session.snapshot.rank, alone.rank)


@pytest.mark.usefixtures("gpu_context")
def test_gpu_buffers_of_strands_are_laid_out_in_the_thread(
    hair, get_depsgraph, in_window, monkeypatch
):
    laid_out, lay_out = [], RideTexels.of

    def recorded(strands, *others):
        is_beside = threading.current_thread() is not threading.main_thread()
        laid_out.append((strands, is_beside))
        return lay_out(strands, *others)

    monkeypatch.setattr(RideTexels, "of", recorded)
    session = previews.start(hair, get_depsgraph())
    arrive(session)
    assert session.solver.device == "compute"
    assert [beside for strands, beside in laid_out if strands is session.rig.strands] == [True]


@pytest.fixture
def light_gate(in_window, monkeypatch):
    """Computing light is held back until this event is set."""
    opened, lit = threading.Event(), session_module.with_full_light

    def wait_and_light(groom, report):
        assert opened.wait(60.0)
        return lit(groom, report)

    monkeypatch.setattr(session_module, "with_full_light", wait_and_light)
    yield opened
    opened.set()


def light_of(hair, get_depsgraph):
    """The complete light of a preview that starts now."""
    return build_groom(GroomSource(hair, get_depsgraph()).request, is_drawn=True).light


def has_light(snapshot, light):
    return all(
        np.array_equal(getattr(snapshot, name), getattr(light, name))
        for name in ("occlusion", "openness", "skin_seen")
    )


def test_hair_is_shown_before_its_light_is_found(hair, get_depsgraph, light_gate):
    session, whole = previews.start(hair, get_depsgraph()), light_of(hair, get_depsgraph)
    run_steps_until(lambda: session.is_made)
    quick = shown(session).snapshot
    assert session.is_lighting and session.is_pending and is_box(hair, get_depsgraph)
    assert quick.occlusion.shape == whole.occlusion.shape and not has_light(quick, whole)
    assert quick.openness.shape == whole.openness.shape
    assert quick.skin_seen.shape == whole.skin_seen.shape
    assert quick.occlusion.mean() == pytest.approx(whole.occlusion.mean(), abs=0.1)
    light_gate.set()
    arrive(session)
    after = shown(session).snapshot
    assert has_light(after, whole)
    assert after.points is quick.points and after.layout is quick.layout


def test_a_picture_waits_for_the_light(hair, get_depsgraph, in_window):
    session, whole = previews.start(hair, get_depsgraph()), light_of(hair, get_depsgraph)
    run_steps_until(lambda: session.is_made)
    assert session.is_lighting
    picture = shown_groom(hair, get_depsgraph())
    assert not session.is_pending and has_light(session.snapshot, whole)
    assert has_light(snapshot_of(picture.studio._groom), whole)


def test_a_new_build_starts_while_light_of_the_old_one_is_computed(hair, get_depsgraph, light_gate):
    session = previews.start(hair, get_depsgraph())
    run_steps_until(lambda: session.is_made)
    first = session.groom
    assert session.is_lighting
    hair.data.hairloom.children.method = "multi"
    hair.data.hairloom.children.strand_count = 300
    scene_events.catch_up(get_depsgraph())
    assert not session.is_lighting
    run_steps_until(lambda: session.groom is not first)
    quick = session.groom.light
    assert session.is_lighting and quick.fields is first.light.fields, "in the light before"
    light_gate.set()
    arrive(session)
    assert has_light(shown(session).snapshot, light_of(hair, get_depsgraph))


def test_nothing_is_left_of_light_that_is_found_for_hair_that_goes(hair, get_depsgraph, light_gate):
    session = previews.start(hair, get_depsgraph())
    run_steps_until(lambda: session.is_made)
    previews.stop(session)
    assert not session.is_pending and previews.session_of(hair) is None
    light_gate.set()
    run_steps_until(lambda: not latest_job.is_scheduled(session))
    session = previews.start(hair, get_depsgraph())
    run_steps_until(lambda: session.is_made)
    assert session.is_lighting
    scene_events.clear()
    bpy.data.objects.remove(hair)
    assert not session.is_pending


def test_play_waits_for_the_hair(hair, get_depsgraph, gate):
    session = previews.start(hair, get_depsgraph())
    assert previews.play(get_depsgraph(), blocking=False) == []
    wait_until(fields.are_ready)
    previews.advance(get_depsgraph(), FRAME)
    assert previews.previews[session.uid].phase is Phase.WAITING and not session.is_playing
    with pytest.raises(fields.NotReadyError):
        session.play(get_depsgraph(), blocking=False)
    gate.set()
    arrive(session)
    wait_until_playing(session, get_depsgraph, FRAME)
    assert len(strand_grid(session)) == COUNT


def test_play_begins_and_simulates_in_frames_of_their_own(hair, get_depsgraph, gate):
    session = previews.start(hair, get_depsgraph())
    previews.play(get_depsgraph(), blocking=False)
    gate.set()
    arrive(session)
    wait_until_playing(session, get_depsgraph, FRAME)
    assert session.solver.motion.clearance is not None
    assert not session.solver.motion.duration, "it begins"
    previews.advance(get_depsgraph(), FRAME)
    assert session.solver.motion.duration == FRAME


def test_blenders_playback_and_a_bake_wait_for_no_timer(hair, get_depsgraph, in_window):
    session = previews.start(hair, get_depsgraph())
    session.play(get_depsgraph())
    assert session.is_made and session.is_playing and not session.is_pending
    hair.data.hairloom.guides.guide_count = 7
    assert session.is_stale
    assert simulation_for(hair, get_depsgraph()) is session
    assert len(session.rig.guides) == 7


@pytest.fixture
def playing(hair, get_depsgraph, in_window, sphere):
    """The session of hair that swings."""
    session = previews.start(hair, get_depsgraph())
    arrive(session)
    previews.play(get_depsgraph())
    sphere.location.x = 0.05
    for _ in range(3):
        previews.advance(get_depsgraph(), FRAME)
    return session


def hold(monkeypatch):
    """From now on, preparing hair is held back until the returned event is set."""
    opened, prepare = threading.Event(), rig_flow.prepare

    def wait_and_prepare(*arguments, **named):
        assert opened.wait(60.0)
        return prepare(*arguments, **named)

    monkeypatch.setattr(rig_flow, "prepare", wait_and_prepare)
    return opened


def test_old_hair_plays_until_the_new_is_made(playing, hair, get_depsgraph, monkeypatch):
    opened = hold(monkeypatch)
    hair.data.hairloom.children.method = "multi"
    hair.data.hairloom.children.strand_count = 300
    scene_events.catch_up(get_depsgraph())
    assert playing.is_pending and not playing.is_stale
    before = strand_grid(playing)
    previews.advance(get_depsgraph(), FRAME)
    assert len(strand_grid(playing)) == COUNT and not np.array_equal(strand_grid(playing), before)
    tips = playing.solver.guides()[:, -1]
    opened.set()
    arrive(playing)
    assert len(strand_grid(playing)) > COUNT and playing.is_playing
    # no step has run since: the same guides are at the same places
    assert np.array_equal(playing.solver.guides()[:, -1], tips)
    at_rest = motion_flow.carried_guides(playing.rig, playing.solver.pose)[:, -1]
    assert np.abs(tips - at_rest).max() > 1e-3, "the hair did not swing"


@pytest.fixture
def contacts(monkeypatch):
    """For each clearance that is computed: whether in a thread, and the clearance."""
    of_each, find = [], lead_out.clearance_at

    def recorded(*arguments):
        is_beside = threading.current_thread() is not threading.main_thread()
        of_each.append((is_beside, find(*arguments)))
        return of_each[-1][1]

    monkeypatch.setattr(motion_flow, "clearance_at", recorded)
    return of_each


def knows_contacts(session, contacts):
    """Whether the clearance was computed once, in a thread, and the session uses it; asserts that
    it equals that of hair at rest here."""
    ((is_beside, found),) = contacts
    motion, settings = session.solver.motion, session.settings[DynamicsSettings]
    begun = motion_flow.begin(session.rig, motion.pose)
    standing = tuple(each.at_end() for each in session.posed_colliders)
    expected = motion_flow.with_clearance(session.rig, begun, standing, settings)
    contacts.pop()
    assert np.isfinite(found.points).any()
    np.testing.assert_array_equal(found.points, expected.clearance.points)
    np.testing.assert_array_equal(found.held, expected.clearance.held)
    np.testing.assert_array_equal(
        motion.guide_clearance.distances, expected.guide_clearance.distances
    )
    return is_beside and motion.clearance is found


def test_contacts_are_found_once_beside_the_work_of_the_window(
    hair, get_depsgraph, in_window, contacts
):
    session = previews.start(hair, get_depsgraph())
    arrive(session)
    assert previews.play(get_depsgraph(), blocking=False) == []
    assert previews.previews[session.uid].phase is Phase.WAITING
    wait_until_playing(session, get_depsgraph, FRAME)
    previews.rest(get_depsgraph(), keep_playing=True)
    session.rest(get_depsgraph())
    assert knows_contacts(session, contacts)


def test_play_does_not_wait_for_ever_for_a_body_that_moves(hair, get_depsgraph, in_window, sphere):
    session = previews.start(hair, get_depsgraph())
    arrive(session)
    previews.play(get_depsgraph(), blocking=False)

    def moves_on():
        sphere.location.x += 0.01
        previews.advance(get_depsgraph(), FRAME)
        return session.is_playing

    wait_until(moves_on)
    begun, alone = session.solver.motion, motion_flow.begin(session.rig, session.solver.pose)
    expected = motion_flow.with_clearance(
        session.rig, alone, session.posed_colliders, session.settings[DynamicsSettings]
    )
    np.testing.assert_array_equal(begun.clearance.points, expected.clearance.points)


def test_a_frame_of_blenders_playback_is_not_put_off_for_contacts(hair, get_depsgraph, in_window):
    session = previews.start(hair, get_depsgraph())
    arrive(session)
    session.make_fields(get_depsgraph())
    wait_until(fields.are_ready)
    session.play(get_depsgraph(), blocking=False, is_frame=True)
    assert session.is_playing and session.solver.motion.clearance is not None


def test_hair_that_begins_again_in_play_knows_how_far_it_stays_from_colliders(
    playing, hair, get_depsgraph, contacts
):
    previews.advance(get_depsgraph(), FRAME)
    contacts.clear()
    hair.data.hairloom.guides.guide_count = 9
    scene_events.catch_up(get_depsgraph())
    arrive(playing)
    assert len(playing.rig.guides) == 9 and not playing.solver.motion.duration, "it begins again"
    assert knows_contacts(playing, contacts)


def test_hair_that_arrives_in_play_knows_how_far_it_stays_from_colliders(
    playing, hair, get_depsgraph, contacts
):
    """Computed in the thread, and equal to what the next frame would compute."""
    previews.advance(get_depsgraph(), FRAME)
    contacts.clear()
    hair.data.hairloom.children.strand_count = 3 * COUNT
    hair.data.hairloom.children.method = "multi"
    scene_events.catch_up(get_depsgraph())
    arrive(playing)
    previews.advance(get_depsgraph(), FRAME)
    ((is_beside, found),) = contacts
    assert is_beside and playing.solver.motion.clearance is found
    motion, settings = playing.solver.motion, playing.settings[DynamicsSettings]
    unknown = replace(motion, clearance=None)
    expected = motion_flow.with_clearance(
        playing.rig, unknown, motion.colliders, settings
    ).clearance
    np.testing.assert_array_equal(found.points, expected.points)
    np.testing.assert_array_equal(found.held, expected.held)
    assert np.isfinite(found.points).any() and found.max_distance == expected.max_distance


def test_of_many_settings_the_last_one_counts(playing, hair, get_depsgraph, monkeypatch):
    opened = hold(monkeypatch)
    for count in (10, 11, 12):
        hair.data.hairloom.guides.guide_count = count
        scene_events.catch_up(get_depsgraph())
    made, take = [], type(playing).take_made
    monkeypatch.setattr(
        type(playing), "take_made", lambda s, d: (take(s, d), made.append(len(s.rig.guides)))
    )
    opened.set()
    arrive(playing)
    assert made == [10, 12], "what is in between is left out"
    assert playing.settings[GuideSettings].guide_count == 12 and not playing.is_stale


def test_immediate_settings_changed_during_a_build_are_kept(
    playing, hair, get_depsgraph, monkeypatch
):
    opened = hold(monkeypatch)
    hair.data.hairloom.guides.guide_count = 9
    scene_events.catch_up(get_depsgraph())
    hair.data.hairloom.strands.fullness = 3.0
    assert shown(playing).snapshot.strand_settings.fullness == 3.0
    assert not playing.is_stale
    opened.set()
    arrive(playing)
    assert shown(playing).snapshot.strand_settings.fullness == 3.0
    assert len(playing.rig.guides) == 9


def test_edits_while_hair_is_made_arrive_too(playing, hair, get_depsgraph, monkeypatch):
    opened = hold(monkeypatch)
    for scale in (0.9, 0.8):
        points = np.empty(len(hair.data.points) * 3, np.float32)
        hair.data.position_data.foreach_get("vector", points)
        hair.data.position_data.foreach_set("vector", points * np.float32(scale))
        scene_events.updated(get_depsgraph())
        scene_events.catch_up(get_depsgraph())
    opened.set()
    arrive(playing)
    expected = build_groom(GroomSource(hair, get_depsgraph()).request, is_drawn=False).rig.strands
    length = np.linalg.norm(np.diff(expected.grid, axis=1), axis=2).sum()
    now = np.linalg.norm(np.diff(playing.rig.strands.grid, axis=1), axis=2).sum()
    assert now == pytest.approx(length, rel=1e-3)


def test_ambient_light_needs_no_other_strands(playing, hair, get_depsgraph, monkeypatch):
    monkeypatch.setattr(rig_flow, "prepare", None)
    rig, motion, before = playing.rig, strand_grid(playing), playing.snapshot.occlusion
    hair.data.hairloom.ambient.strength = 0.2
    scene_events.catch_up(get_depsgraph())
    arrive(playing)
    assert playing.rig is rig and np.array_equal(strand_grid(playing), motion)
    assert playing.snapshot.occlusion.mean() > before.mean()


@pytest.mark.parametrize("is_combed", [False, True])
def test_how_strong_ambient_light_is_finds_no_light_again(
    hair, get_depsgraph, monkeypatch, is_combed
):
    """Only changed strands need new light, not a changed strength."""
    session = previews.start(hair, get_depsgraph())
    found, make = [], light_flow.sky_field
    monkeypatch.setattr(light_flow, "sky_field", lambda *given: found.append("sky") or make(*given))
    hair.data.hairloom.ambient.strength, hair.data.hairloom.ambient.ao_bias = 0.2, 0.8
    if is_combed:
        hair.data.position_data[7].vector.z += 0.02
        hair.data.update_tag()
    session.read_again(get_depsgraph())
    assert bool(found) == is_combed
    own = build_groom(GroomSource(hair, get_depsgraph()).request, is_drawn=True)
    assert same_content(session.groom.light, own.light)
    np.testing.assert_array_equal(session.groom.head_occlusion, own.head_occlusion)


@pytest.mark.parametrize("end", ["stop", "delete", "load"])
def test_an_end_in_the_middle_leaves_nothing(end, hair, get_depsgraph, gate):
    session = previews.start(hair, get_depsgraph())
    if end == "stop":
        previews.stop(session)
    elif end == "delete":
        bpy.data.objects.remove(hair)
        bpy.context.view_layer.update()
    else:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert previews.sessions() == () and latest_job.run_steps() is None
    assert not session.is_pending, "nobody waits for it any more"


def test_hair_that_cannot_be_made_ends_the_preview_with_a_notice(playing, hair, monkeypatch):
    def fail(*_, **__):
        raise HairloomError("it cannot be", place="Hair", remedy="Undo")

    monkeypatch.setattr(rig_flow, "prepare", fail)
    hair.data.hairloom.guides.guide_count = 5
    scene_events.catch_up(bpy.context.evaluated_depsgraph_get())
    arrive(playing)
    assert previews.sessions() == () and "it cannot be" in previews.notice()


def test_a_failed_build_that_is_no_longer_requested_is_ignored(
    playing, hair, get_depsgraph, monkeypatch
):
    opened, prepare = threading.Event(), rig_flow.prepare

    def fail_for_five(strands, head, settings, **named):
        assert opened.wait(60.0)
        if settings.guide_count == 5:
            raise HairloomError("it cannot be", place="Hair", remedy="Undo")
        return prepare(strands, head, settings, **named)

    monkeypatch.setattr(rig_flow, "prepare", fail_for_five)
    for count in (5, 6):
        hair.data.hairloom.guides.guide_count = count
        scene_events.catch_up(get_depsgraph())
    opened.set()
    arrive(playing)
    assert previews.sessions() == (playing,) and len(playing.rig.guides) == 6


def test_pictures_are_of_whole_hair(hair, get_depsgraph, in_window):
    previews.start(hair, get_depsgraph())
    assert len(shown_groom(hair, get_depsgraph()).points) == 16 * COUNT


def test_build_requests_compare_equal_if_they_give_the_same_rig(hair, get_depsgraph, extension):
    reading = GroomSource(hair, get_depsgraph())
    order = reading.request
    assert order.gives_same_rig_as(order) and reading.read_again(get_depsgraph()) is None
    hair.data.hairloom.guides.guide_count = 5
    other = reading.read_again(get_depsgraph())
    assert isinstance(other, BuildRequest) and not other.gives_same_rig_as(order)
    assert reading.settings[GuideSettings].guide_count != 5, "it is not shown yet"
    reading.accept(other)
    assert reading.settings[GuideSettings].guide_count == 5


@pytest.fixture
def moving(sphere):
    """A head that shakes from frame 1 to 12."""
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 12
    key_x(sphere, {1: 0.0, 5: 0.1, 12: -0.05})
    scene.frame_set(1)


def rounds(session, *frames):
    """The strands in each of these frames."""
    found = []
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        found.append(strand_grid(session))
    return np.array(found)


def test_playback_goes_on_before_the_hair_is_made(hair, moving, get_depsgraph, gate, monkeypatch):
    hair.hairloom.dynamics.device = "numpy"
    session = previews.start(hair, get_depsgraph())
    fields.field_of(session.source.head, session.settings[DynamicsSettings], place="Head")
    monkeypatch.setattr(playback, "is_animation_playing", lambda: True)
    before = rounds(session, 1, 2, 3, 4)  # would wait for the gate forever if it blocked
    assert (
        not session.is_made
        and not session.is_playing
        and previews.previews[session.uid].is_deferred
    )
    assert not is_box(hair, get_depsgraph), "Blender's own strands are there until then"
    assert before[3, :, 0, 0].mean() > before[0, :, 0, 0].mean() + 0.01, "it goes with its body"
    gate.set()
    arrive(session)
    begun = rounds(session, 5)[0]
    assert session.is_playing and not previews.previews[session.uid].is_deferred
    at_rest = motion_flow.carried_strands(session.rig, session.solver.pose)
    np.testing.assert_array_equal(begun.reshape(-1, 3), at_rest)
    after = rounds(session, 6, 7)[1]
    at_rest = motion_flow.carried_strands(session.rig, session.solver.pose)
    assert np.abs(after.reshape(-1, 3) - at_rest).max() > 1e-3, "it does not swing"
    second = rounds(session, *range(1, 8))
    previews.stop(session)
    bpy.context.scene.frame_set(1)  # the frame in which the first preview began
    monkeypatch.setattr(latest_job, "is_blocking", lambda: True)
    again = previews.start(hair, get_depsgraph())
    np.testing.assert_array_equal(second, rounds(again, *range(1, 8)))


def test_playback_goes_on_before_a_collider_is_made(hair, moving, get_depsgraph, monkeypatch):
    opened, from_surface = threading.Event(), DistanceField.from_surface

    def wait_and_make(*arguments, **named):
        assert opened.wait(60.0)
        return from_surface(*arguments, **named)

    monkeypatch.setattr(DistanceField, "from_surface", wait_and_make)
    session = previews.start(hair, get_depsgraph())
    monkeypatch.setattr(latest_job, "is_blocking", lambda: False)
    monkeypatch.setattr(playback, "is_animation_playing", lambda: True)
    rounds(session, 1, 2, 3)
    assert session.is_made and not session.is_playing and previews.previews[session.uid].is_deferred
    opened.set()
    wait_until(fields.are_ready)
    rounds(session, 4)
    assert session.is_playing and not previews.previews[session.uid].is_deferred


def test_old_hair_goes_on_in_playback_too(playing, hair, moving, get_depsgraph, monkeypatch):
    opened = hold(monkeypatch)
    monkeypatch.setattr(playback, "is_animation_playing", lambda: True)
    rounds(playing, 1, 2)
    hair.data.hairloom.guides.guide_count = 7
    scene_events.catch_up(get_depsgraph())
    shown = rounds(playing, 3, 4, 1, 2)
    assert (
        playing.is_pending and playing.is_playing and not previews.previews[playing.uid].is_deferred
    )
    assert np.abs(np.diff(shown, axis=0)).max() > 1e-3
    opened.set()
    arrive(playing)
    assert len(playing.rig.guides) == 7


def test_a_step_of_a_frame_waits_to_be_exact(hair, moving, get_depsgraph, gate):
    session = previews.start(hair, get_depsgraph())
    threading.Timer(0.3, gate.set).start()
    rounds(session, 1, 2)
    assert session.is_made and session.is_playing


def test_the_placeholder_on_a_dense_head_searches_a_part_of_it(
    new_hair, get_depsgraph, monkeypatch
):
    bpy.ops.mesh.primitive_ico_sphere_add(radius=0.1, subdivisions=5)
    hair = new_hair(bpy.context.object)
    order = GroomSource(hair, get_depsgraph()).request
    head, searched, bind = order.source.head, [], rig_flow.bind_roots
    assert len(head.triangles) > prepared_groom._MAX_SEARCHED_TRIANGLES

    def noted(strands, surface, *, place):
        searched.append(len(surface.triangles))
        return bind(strands, surface, place=place)

    monkeypatch.setattr(rig_flow, "bind_roots", noted)
    made = prepared_groom.placeholder_groom(order)
    assert len(searched) == 1 and searched[0] < len(head.triangles) / 10
    assert made.rig.head is head and made.is_placeholder
    expected = bind(made.rig.strands, head, place="Hair").strands
    assert np.array_equal(made.rig.strands.root_triangle, expected.root_triangle)
    carried = motion_flow.carried_strands(made.rig, made.rig.rest_pose)
    assert np.array_equal(carried, made.rig.strands.points)


def test_hair_of_another_scale_is_reported_on_dense_heads_too(new_hair, get_depsgraph):
    bpy.ops.mesh.primitive_ico_sphere_add(radius=0.1, subdivisions=5)
    order = GroomSource(new_hair(bpy.context.object), get_depsgraph()).request
    large = order.source.strands.transformed(np.diag([1000.0, 1000.0, 1000.0, 1.0]))
    order = replace(order, source=replace(order.source, strands=large))
    messages = []
    for make_it in (prepared_groom.placeholder_groom, prepared_groom.requested_rig):
        with pytest.raises(HairloomError) as error:
            make_it(order)
        messages.append(str(error.value))
    assert messages[0] == messages[1] and "a different scale" in messages[0]


def test_hair_of_another_scene_is_not_waited_for(hair, get_depsgraph, in_window):
    """Hair previewed in one scene cannot be finished while another scene is shown."""
    session = previews.start(hair, get_depsgraph())
    bpy.context.window.scene = bpy.data.scenes.new("Elsewhere")
    with pytest.raises(HairloomError, match="another scene"):
        previews.finish(session, get_depsgraph())


def test_hair_that_is_made_while_another_scene_is_shown_arrives_with_its_own(
    hair, get_depsgraph, in_window, monkeypatch
):
    bpy.context.scene.frame_set(5)  # in its first frame hair would start to play, which waits
    session = previews.start(hair, get_depsgraph())
    window, scene, refreshed = bpy.context.window, bpy.context.scene, []
    monkeypatch.setattr(previews, "refresh_views", lambda: refreshed.append(True))
    window.scene = bpy.data.scenes.new("Elsewhere")
    get_depsgraph()
    wait_until(lambda: session.has_result)
    for _ in range(3):
        latest_job.run_steps()
    assert not refreshed and not session.is_made, "the other scene is left alone"
    window.scene = scene
    get_depsgraph()
    run_steps_until(lambda: session.is_made)
    assert refreshed and overlay.drawing_of(session.uid).is_made
