"""Grooms that interact: played, baked, in any order, with others at rest or baked."""

from pathlib import Path

import bpy
import numpy as np
import pytest
from bake_files import contents, frames_in
from hedgehogs import hedgehog

from hairloom.addon.blender.bakes import playback
from hairloom.addon.blender.bakes.stale_bakes import changed_inputs
from hairloom.addon.blender.preview import previews
from hairloom.addon.blender.preview.bake import Bake
from hairloom.addon.blender.preview.diagnostics import unfelt_note
from hairloom.addon.blender.sessions.session import Session
from hairloom.addon.errors import HairloomError

LAST = 6


@pytest.fixture
def two(new_hair, sphere, tmp_path):
    """Two grooms that interpenetrate on a turning head; one is softer than the other."""
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, LAST
    for frame, angle in ((1, 0.0), (LAST, 1.5)):
        sphere.rotation_euler.z = angle
        sphere.keyframe_insert("rotation_euler", frame=frame)
    found = []
    for name, seed, stiff in (("One", 1, 0.05), ("Two", 2, 0.8)):
        hair = new_hair(sphere, hedgehog(150, seed=seed, groups=1))
        hair.name = name
        dynamics = hair.hairloom.dynamics
        dynamics.collider_resolution, dynamics.volume = 8, 1.0
        dynamics.style_root = dynamics.style_tip = stiff
        hair.hairloom.bake.folder = str(tmp_path / name)
        found.append(hair)
    scene.frame_set(1)
    return found


def previewed(*grooms):
    """Start previews of these grooms at rest in the first frame."""
    previews.stop_all()
    bpy.context.scene.frame_set(1)
    for hair in grooms:
        previews.start(hair, bpy.context.evaluated_depsgraph_get())


def played(*grooms, last=LAST):
    """For each groom, the guides in each frame as the scene steps through the frames."""
    shown = [[] for _ in grooms]
    for frame in range(1, last + 1):
        bpy.context.scene.frame_set(frame)
        for hair, frames in zip(grooms, shown, strict=True):
            frames.append(previews.session_of(hair).guides())
    return [np.array(frames) for frames in shown]


def baked(*grooms):
    list(Bake.of(list(grooms), bpy.context.scene).steps())
    return [contents(frames_in(Path(hair.hairloom.bake.folder))) for hair in grooms]


def alone(two):
    """The motion of each groom when the other is hidden in renders."""
    previewed(*two)
    found = []
    for hair, other in (two, two[::-1]):
        other.hide_render = True
        found += played(hair)
        other.hide_render = False
    return found


def test_grooms_push_each_other(two):
    by_themselves = alone(two)
    previewed(*two)
    for one, other in zip(played(*two), by_themselves, strict=True):
        assert np.array_equal(one[0], other[0])
        assert np.abs(one - other).max() > 0.001


def test_their_order_changes_no_bit(two):
    previewed(*two)
    found = played(*two)
    previewed(*two[::-1])
    for one, other in zip(found, played(*two), strict=True):
        assert np.array_equal(one, other)


def test_a_bake_of_both_is_what_was_played_and_the_same_each_time(two):
    previewed(*two)
    found = played(*two)
    first = baked(*two)
    assert baked(*two[::-1]) == first[::-1]
    for one, other in zip(found, played(*two), strict=True):
        assert np.array_equal(one, other)
    previews.stop_all()
    assert baked(*two) == first


@pytest.mark.slow(instead="test_a_bake_of_one_beside_one_that_is_baked")
def test_a_bake_of_one_beside_one_at_rest(two):
    """It equals playback in which the other groom does not follow the timeline."""
    one, other = two
    by_itself = alone(two)[0]
    other.hairloom.bake.follows = False
    previewed(*two)
    found = played(one)[0]
    assert np.abs(found - by_itself).max() > 0.0005
    previews.stop_all()
    baked(one)
    previewed(one)
    assert np.array_equal(played(one)[0], found)


def test_a_bake_of_one_beside_one_that_is_baked(two):
    """The other groom plays its bake meanwhile."""
    one, other = two
    baked(other)
    previewed(*two)
    found = played(one)[0]
    previews.stop_all()
    baked(one)
    previewed(one)
    assert np.array_equal(played(one)[0], found)


def test_a_bake_leaves_out_hair_that_cannot_be_used_and_says_so(two):
    """Such as Blender's Empty Hair on the same head, without curves."""
    one, other = two
    other.hide_render = True
    (expected,) = baked(one)
    empty = bpy.data.objects.new("Nothing", bpy.data.hair_curves.new("Nothing"))
    empty.data.surface = empty.parent = one.parent
    bpy.context.collection.objects.link(empty)
    plan = Bake.of([one], bpy.context.scene)
    list(plan.steps())
    found = contents(frames_in(Path(one.hairloom.bake.folder)))
    assert all(found[name] == expected[name] for name in expected if name.endswith(".npz"))
    assert any("not felt" in note and "Nothing: it has no curves" in note for note in plan.notes)


def test_a_kilometre_apart_they_are_as_if_alone(two):
    one, other = two
    by_itself = alone(two)[0]
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1, segments=24, ring_count=12)
    other.data.surface = other.parent = bpy.context.object
    other.parent.location.x = 1000.0
    previewed(*two)
    found = played(*two)
    assert np.array_equal(found[0], by_itself)
    assert np.isfinite(found[1]).all()
    assert previews.session_of(one).known_hair.grid is None


def test_hair_that_feels_nothing_is_felt(two):
    other = two[1]
    by_themselves = alone(two)
    other.hairloom.dynamics.volume = 0.0
    previewed(*two)
    found = played(*two)
    other.hide_render = True
    assert np.abs(found[0] - by_themselves[0]).max() > 0.001
    assert np.array_equal(found[1], played(*two)[1])


def test_one_that_comes_and_goes_in_mid_play(two):
    one, other = two
    previewed(*two)
    for frame in range(1, LAST + 1):
        other.hide_render = frame in (3, 4)
        bpy.context.scene.frame_set(frame)
        if frame == 5:
            previews.stop(previews.session_of(other))
    assert previews.session_of(one).is_playing
    assert np.isfinite(previews.session_of(one).guides()).all()


def test_one_that_fails_does_not_stop_the_other(two, monkeypatch):
    one, other = two
    previewed(*two)
    simulate = Session._simulate

    def fail(session, *args):
        if session.name == "Two" and bpy.context.scene.frame_current > 3:
            raise HairloomError("it broke", place="Two", remedy="Repair it")
        yield from simulate(session, *args)

    monkeypatch.setattr(Session, "_simulate", fail)
    played(*two)
    assert previews.session_of(one).is_playing
    assert not previews.session_of(other).is_playing
    assert "it broke" in previews.previews[other.session_uid].problems
    with pytest.raises(HairloomError, match=r"it broke \(in frame 4\); nothing was baked"):
        baked(*two)


@pytest.mark.usefixtures("gpu_context")
def test_on_the_gpu_it_is_as_by_numpy(two):
    ends = []
    for forms in (("numpy", "numpy"), ("compute", "compute"), ("compute", "numpy")):
        for hair, form in zip(two, forms, strict=True):
            hair.hairloom.dynamics.device = form
        previewed(*two)
        ends.append(np.stack([found[-1] for found in played(*two)]))
    for other in ends[1:]:
        assert np.quantile(np.abs(other - ends[0]), 0.99) < 1e-4


def test_a_bake_is_out_of_date_once_other_hair_has_changed(two):
    one, other = two
    baked(*two)
    previewed(*two)
    assert previews.bake_of(one).changed_inputs == ()
    other.data.position_data[7].vector.x += 0.02
    previewed(*two)
    assert previews.bake_of(one).changed_inputs == ("other grooms",)
    one.hairloom.dynamics.volume = 0.0
    baked(one)
    other.data.position_data[7].vector.x += 0.02
    previewed(*two)
    assert previews.bake_of(one).changed_inputs == ()


def test_a_bake_is_out_of_date_by_what_moves_other_hair_in_its_frame(two):
    """The other hair's keyed settings, in frames that have them, and its name change nothing."""
    one, other = two
    scene = bpy.context.scene
    scene.frame_end = 3
    own_head = other.parent.copy()
    scene.collection.objects.link(own_head)
    other.data.surface = other.parent = own_head
    for frame, damping in ((1, 0.5), (3, 6.0)):
        other.hairloom.dynamics.damping = damping
        other.keyframe_insert("hairloom.dynamics.damping", frame=frame)
    baked(*two)
    cache = playback.cache_of(one)

    def changed(frame):
        scene.frame_set(frame)
        return changed_inputs(one, cache, bpy.context.evaluated_depsgraph_get())

    assert [changed(frame) for frame in (1, 2, 3)] == [()] * 3
    other.name = "A beard"
    assert changed(2) == ()
    own_head.delta_location.x = 0.01
    assert changed(2) == ("other grooms",)
    own_head.delta_location.x = 0.0
    assert changed(2) == ()
    other.animation_data.action = None
    other.hairloom.dynamics.damping = 0.7
    assert changed(2) == ("other grooms",)


def test_the_panel_names_hair_that_only_a_bake_would_feel(two):
    one, other = two
    previewed(one)
    session = previews.session_of(one)
    assert unfelt_note(session).startswith("Two: near, but not previewed")
    other.hide_render = True
    assert unfelt_note(session) == ""
    other.hide_render = False
    one.hairloom.dynamics.volume = 0.0
    assert unfelt_note(session) == ""
    one.hairloom.dynamics.volume = 1.0
    previewed(*two)
    assert unfelt_note(previews.session_of(one)) == ""
