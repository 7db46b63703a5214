"""Bakes equal playback, are complete or not written at all, and are shown again."""

import json
import os
import shutil
import threading
from collections import OrderedDict
from pathlib import Path

import bpy
import numpy as np
import pytest
from bake_files import contents, frames_in
from fin_motion import evaluated_vertices
from gpu_rounding import is_same
from grids import baked_grid, strand_grid
from swinging import shake_head
from undoing import redo, undo
from windows_rules import windows_rules

from hairloom.addon.blender.bakes import groom_hashes, playback
from hairloom.addon.blender.bakes.bake_settings import folder_of
from hairloom.addon.blender.bakes.cache import Cache, CacheWriter, Facts
from hairloom.addon.blender.bakes.simulation import SOLVER_VERSION
from hairloom.addon.blender.base.suspension import is_suspended, suspended
from hairloom.addon.blender.engine import engine_hair
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.preview.bake import Bake, free
from hairloom.addon.errors import HairloomError
from hairloom.addon.exchange.files import file_moves, stale_temp_files
from hairloom.addon.ui import state

LAST = 8


@pytest.fixture
def swinging(new_hair, sphere, tmp_path):
    """Hair on a head that shakes for some frames: (hair, head)."""
    return shake_head(new_hair(sphere), sphere, LAST, tmp_path / "bake")


def bake(*objects, **options):
    plan = Bake.of(list(objects), bpy.context.scene, **options)
    return list(plan.steps())


def drawn(hair):
    return strand_grid(previews.session_of(hair))


def played(hair, first=1, last=LAST):
    """The drawn strands of each frame as the scene steps through the frames."""
    shown = []
    for frame in range(first, last + 1):
        bpy.context.scene.frame_set(frame)
        shown.append(drawn(hair))
    return np.array(shown)


def test_a_bake_equals_playback_bit_for_bit(swinging, get_depsgraph):
    hair, _ = swinging
    hair.hairloom.dynamics.radius_root = 0.5  # wide enough that swinging strands touch the head
    previews.start(hair, get_depsgraph())
    live_strands = played(hair)
    assert np.ptp(live_strands[:, :, -1] - live_strands[:, :, 0], axis=0).max() > 0.01
    assert len(previews.session_of(hair).solver.led_out_strands().strands), (
        "the head pushes some strands"
    )
    bpy.context.scene.frame_set(3)
    assert bake(hair) == list(range(1, LAST + 1))
    assert bpy.context.scene.frame_current == 3
    assert previews.session_of(hair).is_playing is False
    np.testing.assert_array_equal(drawn(hair), live_strands[2])
    np.testing.assert_array_equal(played(hair), live_strands)
    cache = playback.cache_of(hair)
    for frame in range(1, LAST + 1):
        np.testing.assert_array_equal(baked_grid(cache, frame), live_strands[frame - 1])


@pytest.mark.usefixtures("gpu_context")
def test_a_bake_on_the_gpu_equals_playback_on_the_gpu_bit_for_bit(swinging, get_depsgraph):
    """Baked guides and drawn strands equal playback; strands ridden from the bake on the CPU, as
    for renders, are within 2e-6 m."""
    hair, _ = swinging
    hair.hairloom.dynamics.device = "compute"
    hair.hairloom.dynamics.radius_root = 0.5  # wide enough that swinging strands touch the head
    session = previews.start(hair, get_depsgraph())
    guides, strands = [], []
    for frame in range(1, LAST + 1):
        bpy.context.scene.frame_set(frame)
        guides.append(session.solver.guides())
        led = session.solver.led_out_strands()
        strands.append(drawn(hair))
    assert session.solver.device == "compute" and np.ptp(np.array(guides), axis=0).max() > 0.01
    assert len(led.strands), "the head pushes some strands"
    bake(hair)
    cache = playback.cache_of(hair)
    np.testing.assert_array_equal(cache.frame(LAST)["led_strands"], led.strands)
    for frame in range(1, LAST + 1):
        np.testing.assert_array_equal(cache.frame(frame)["guides"], guides[frame - 1])
        bpy.context.scene.frame_set(frame)
        assert is_same(drawn(hair), strands[frame - 1])
        ridden = baked_grid(cache, frame)
        np.testing.assert_allclose(ridden, strands[frame - 1], rtol=0, atol=2e-6)


@pytest.mark.parametrize("previewed", [True, False])
def test_a_bake_is_the_same_with_and_without_a_preview(
    previewed, swinging, get_depsgraph, tmp_path
):
    hair, _ = swinging
    bake(hair)
    first = Cache(tmp_path / "bake")
    frames = {n: first.frame(n) for n in range(1, LAST + 1)}
    if previewed:
        bpy.context.scene.frame_set(1)
        previews.start(hair, get_depsgraph())
    bake(hair)
    second = Cache(tmp_path / "bake")
    assert second.facts == first.facts
    for number, arrays in frames.items():
        for name, array in arrays.items():
            np.testing.assert_array_equal(second.frame(number)[name], array)


def test_a_preview_started_on_a_moved_head_shows_the_same_strands(swinging, get_depsgraph):
    """A preview that starts after the head has moved uses the rig of the bake."""
    hair, _ = swinging
    bake(hair)
    cache = playback.cache_of(hair)
    bpy.context.scene.frame_set(5)
    previews.start(hair, get_depsgraph())
    np.testing.assert_array_equal(drawn(hair), baked_grid(cache, 5))
    assert previews.previews[hair.session_uid].bake.changed_inputs == ()
    bpy.context.scene.frame_set(2)
    np.testing.assert_array_equal(drawn(hair), baked_grid(cache, 2))


def test_baked_hair_has_the_size_of_its_bake(swinging, get_depsgraph):
    """A changed scale of the head shows once the bake is remade or deleted, also in a preview."""
    hair, head = swinging
    previews.start(hair, get_depsgraph())
    bake(hair)
    bpy.context.scene.frame_set(3)
    small = drawn(hair)
    head.scale = (2.0, 2.0, 2.0)
    bpy.context.view_layer.update()
    session = previews.session_of(hair)
    scene_events.catch_up(get_depsgraph())
    assert previews.session_of(hair) is session, "it does not begin over again and again"
    bpy.context.scene.frame_set(4)
    bpy.context.scene.frame_set(3)
    np.testing.assert_array_equal(drawn(hair), small)
    bake(hair)
    large = baked_grid(playback.cache_of(hair), 3)
    np.testing.assert_array_equal(drawn(hair), large)
    lengths = [np.linalg.norm(np.diff(grid, axis=1), axis=2).sum(axis=1) for grid in (small, large)]
    np.testing.assert_allclose(lengths[1], 2.0 * lengths[0], rtol=0.02)
    head.scale = (1.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    scene_events.catch_up(get_depsgraph())
    free(hair, get_depsgraph())
    rendered = engine_hair.read_groom(hair, get_depsgraph()).points
    np.testing.assert_allclose(previews.session_of(hair).strands, rendered, atol=1e-6)


def test_a_preview_that_began_in_another_size_shows_the_bake_that_is_made(swinging, get_depsgraph):
    hair, head = swinging
    for frame, size in ((1, 1.0), (LAST, 2.0)):
        head.scale = (size, size, size)
        head.keyframe_insert("scale", frame=frame)
    bake(hair)
    alone = baked_grid(playback.cache_of(hair), 5)
    free(hair, get_depsgraph())
    bpy.context.scene.frame_set(5)
    previews.start(hair, get_depsgraph())
    bake(hair)
    np.testing.assert_array_equal(baked_grid(playback.cache_of(hair), 5), alone)
    np.testing.assert_array_equal(drawn(hair), alone)


def test_a_deformed_head_carries_baked_hair(swinging, get_depsgraph):
    hair, head = swinging
    swell = head.modifiers.new("Swell", "DISPLACE")
    swell.mid_level = 0.0
    for frame, strength in ((1, 0.0), (LAST, 0.05)):
        swell.strength = strength
        swell.keyframe_insert("strength", frame=frame)
    previews.start(hair, get_depsgraph())
    shown = played(hair)
    assert np.linalg.norm(shown[-1, :, 0] - shown[0, :, 0], axis=1).max() > 0.04
    bake(hair)
    np.testing.assert_array_equal(played(hair), shown)


def test_hair_without_a_head_is_baked(new_hair, get_depsgraph, tmp_path):
    hair = new_hair()
    scene = bpy.context.scene
    scene.frame_end = 4
    for frame, angle in ((1, 0.0), (4, 0.5)):
        hair.rotation_euler.x = angle
        hair.keyframe_insert("rotation_euler", frame=frame)
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    hair.hairloom.dynamics.device = "numpy"
    scene.frame_set(1)
    previews.start(hair, get_depsgraph())
    shown = played(hair, last=4)
    bake(hair)
    np.testing.assert_array_equal(played(hair, last=4), shown)


def test_changes_since_the_bake_are_reported_and_the_bake_still_plays(swinging, get_depsgraph):
    hair, head = swinging
    previews.start(hair, get_depsgraph())
    bake(hair)
    scene, uid = bpy.context.scene, hair.session_uid
    shown = played(hair)
    assert previews.previews[uid].bake.changed_inputs == ()

    def changed_at(frame):
        scene.frame_set(frame)
        return previews.previews[uid].bake.changed_inputs

    hair.hairloom.dynamics.damping = 3.0
    assert previews.previews[uid].bake.changed_inputs == ("settings",), "reported at once"
    assert changed_at(3) == ("settings",)
    np.testing.assert_array_equal(drawn(hair), shown[2])
    hair.hairloom.dynamics.damping = 0.5
    assert changed_at(4) == ()
    scene.use_gravity = False
    assert changed_at(3) == ("forces",)
    scene.use_gravity = True
    scene.render.fps = 30
    assert changed_at(1) == ("frame rate",)
    scene.render.fps = 24
    assert changed_at(1) == ()
    curve = head.animation_data.action.layers[0].strips[0].channelbags[0].fcurves[0]
    curve.keyframe_points[1].co.y += 0.02
    curve.update()
    assert changed_at(4) == ("pose",)
    np.testing.assert_array_equal(drawn(hair), shown[3])
    hair.data.position_data[3].vector.x += 0.01
    bpy.context.view_layer.update()
    scene_events.catch_up(get_depsgraph())
    assert "hair" in changed_at(5)


def test_a_bake_of_another_solver_is_out_of_date(swinging, get_depsgraph, monkeypatch):
    hair, _ = swinging
    bake(hair)
    previews.start(hair, get_depsgraph())
    assert previews.previews[hair.session_uid].bake.changed_inputs == ()
    previews.stop_all()
    monkeypatch.setattr(groom_hashes, "SOLVER_VERSION", SOLVER_VERSION + 1)
    previews.start(hair, get_depsgraph())
    assert previews.previews[hair.session_uid].bake.changed_inputs == ("solver",)


def test_a_head_that_is_posed_by_hand_takes_its_hair_along(swinging, get_depsgraph):
    hair, head = swinging
    bake(hair)
    bpy.context.scene.frame_set(4)
    session = previews.start(hair, get_depsgraph())
    baked = drawn(hair)
    head.location.y = 0.5
    bpy.context.view_layer.update()
    assert drawn(hair)[:, 0, 1].mean() == pytest.approx(0.5, abs=0.02)
    assert previews.previews[session.uid].bake.changed_inputs == ("pose",)
    bpy.context.scene.frame_set(4)
    np.testing.assert_array_equal(drawn(hair), baked)


def set_damping(hair):
    hair.hairloom.dynamics.damping = 3.0


def hide_bake(hair):
    hair.hairloom.bake.is_shown = False


def move_head(_hair):
    bpy.data.objects["Head"].location.y = 0.5


def comb(hair):
    hair.data.position_data[7].vector.x += 0.01


@pytest.mark.parametrize("change", [set_damping, hide_bake, move_head, comb])
def test_undo_shows_the_bake_again(change, swinging, get_depsgraph):
    hair, _ = swinging
    bake(hair)
    bpy.context.scene.frame_set(4)
    previews.start(hair, get_depsgraph())
    baked = drawn(hair)
    bpy.ops.ed.undo_push(message="baked")
    change(hair)
    bpy.context.view_layer.update()
    scene_events.catch_up(get_depsgraph())
    changed = drawn(hair)
    bpy.ops.ed.undo_push(message="changed")
    for step, shown in ((undo, baked), (redo, changed), (undo, baked)):
        step()
        np.testing.assert_allclose(drawn(bpy.data.objects["Hair"]), shown, atol=1e-6)


def test_undo_and_redo_show_the_bake_in_the_frame_that_they_bring_back(swinging, get_depsgraph):
    hair, _ = swinging
    bake(hair)
    previews.start(hair, get_depsgraph())
    shown = {}
    for frame in (2, 4):
        bpy.context.scene.frame_set(frame)
        shown[frame] = drawn(hair)
        bpy.ops.ed.undo_push(message=f"frame {frame}")
    assert np.abs(shown[4] - shown[2]).max() > 0.02
    for step, frame in ((undo, 2), (redo, 4), (undo, 2)):
        step()
        np.testing.assert_allclose(drawn(bpy.data.objects["Hair"]), shown[frame], atol=1e-6)


def test_hair_that_was_combed_since_its_bake_says_so_and_what_to_do(swinging, get_depsgraph):
    hair, _ = swinging
    bake(hair)
    bpy.context.scene.frame_set(4)
    session = previews.start(hair, get_depsgraph())
    assert state._state(session) == "baked" and not state.problems_of(hair, session)
    comb(hair)
    bpy.context.view_layer.update()
    scene_events.catch_up(get_depsgraph())
    assert state._state(session) == "at rest, CPU", "it is shown as it was combed"
    (problem,) = state.problems_of(hair, session)
    assert problem.text == "Changed since its bake: combed or edited hair. Bake again"
    assert problem.operator == "hairloom.bake"
    hair.hairloom.dynamics.damping = 3.0
    bpy.context.scene.frame_set(5)
    assert state._state(session) == "baked, out of date", "its bake is shown"
    (problem,) = state.problems_of(hair, session)
    assert "combed or edited hair, settings. Bake again" in problem.text


def test_a_head_that_is_moved_back_has_its_baked_hair_again(swinging, get_depsgraph):
    """As when a move is cancelled by Esc."""
    hair, head = swinging
    bake(hair)
    bpy.context.scene.frame_set(4)
    previews.start(hair, get_depsgraph())
    baked = drawn(hair)
    for y in (0.5, 0.0):
        head.location.y = y
        bpy.context.view_layer.update()
    np.testing.assert_array_equal(drawn(hair), baked)


def test_replacing_the_bake_of_another_scene_is_reported(swinging):
    hair, head = swinging
    bake(hair)
    assert not Bake.of([hair], bpy.context.scene).notes
    other = bpy.data.scenes.new("Other")
    for obj in (hair, head):
        other.collection.objects.link(obj)
    other.frame_start, other.frame_end = LAST + 10, LAST + 12
    assert not Bake.of([hair], bpy.context.scene).notes, "the same frames"
    (note,) = Bake.of([hair], other).notes
    assert f"bake of frames 1 to {LAST} was replaced, as 2 scenes share" in note


def test_hair_is_simulated_while_its_bake_is_not_used(swinging, get_depsgraph):
    hair, _ = swinging
    previews.start(hair, get_depsgraph())
    bake(hair)
    hair.hairloom.dynamics.damping = 9.0
    baked = played(hair)
    hair.hairloom.bake.is_shown = False
    simulated = played(hair)
    assert np.abs(simulated - baked).max() > 1e-4
    hair.hairloom.bake.is_shown = True
    np.testing.assert_array_equal(played(hair), baked)


def test_cancelling_keeps_the_previous_bake(swinging, get_depsgraph, tmp_path):
    hair, _ = swinging
    bake(hair)
    before = contents(tmp_path / "bake")
    hair.hairloom.dynamics.damping = 9.0
    bpy.context.scene.frame_set(6)
    steps = Bake.of([hair], bpy.context.scene).steps()
    assert [next(steps), next(steps)] == [1, 2]
    assert len(list((tmp_path / "bake").glob("frames-*"))) == 2
    steps.close()
    assert bpy.context.scene.frame_current == 6
    assert [path.name for path in tmp_path.iterdir()] == ["bake"]
    assert contents(tmp_path / "bake") == before
    assert not is_suspended()


@pytest.mark.parametrize("what", ["a second version of the file", "a duplicate"])
def test_after_cancelling_hair_still_shows_the_bake_of_another_groom(what, swinging, tmp_path):
    hair, _ = swinging
    hair.hairloom.bake.folder = ""
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot_v1.blend"))
    bake(hair)
    hair = bpy.data.objects["Hair"]
    if what == "a duplicate":
        hair = hair.copy()
        bpy.context.collection.objects.link(hair)
    else:
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot_v2.blend"))
    steps = Bake.of([hair], bpy.context.scene).steps()
    next(steps)
    steps.close()
    assert hair.hairloom.bake.folder == "//hairloom_cache/shot_v1/Hair"
    assert playback.cache_of(hair).facts.file == "shot_v1.blend"


def test_a_bake_that_fails_says_in_which_frame_and_leaves_nothing(swinging, tmp_path):
    hair, head = swinging
    smooth = head.modifiers.new("Smooth", "SUBSURF")
    for frame, is_on in ((1, False), (5, True)):
        smooth.show_viewport = is_on
        smooth.keyframe_insert("show_viewport", frame=frame)
    with pytest.raises(HairloomError, match=r"vertices.*frame 5") as raised:
        bake(hair)
    assert raised.value.place == "Head"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["Hair", "Head"])
def test_an_object_that_is_deleted_during_a_bake_is_named(name, swinging, tmp_path):
    steps = Bake.of([swinging[0]], bpy.context.scene).steps()
    next(steps)
    bpy.data.objects.remove(bpy.data.objects[name])
    gone = rf"{name}: this object is gone \(in frame 2\); nothing was baked\. Bake again\."
    with pytest.raises(HairloomError, match=gone):
        next(steps)
    assert list(tmp_path.iterdir()) == []


def test_hair_that_blender_simulates_is_not_baked(swinging, tmp_path):
    hair, _ = swinging
    modifier = hair.modifiers.new("Swing", "NODES")
    modifier.node_group = bpy.data.node_groups.new("Hair Dynamics", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        modifier.node_group.interface.new_socket(
            "Geometry", in_out=way, socket_type="NodeSocketGeometry"
        )
    nodes = modifier.node_group.nodes
    ends = nodes.new("NodeGroupInput").outputs[0], nodes.new("NodeGroupOutput").inputs[0]
    modifier.node_group.links.new(*ends)
    with pytest.raises(HairloomError, match="Swing simulates it already") as raised:
        bake(hair)
    assert "Mute" in raised.value.remedy and list(tmp_path.iterdir()) == []
    assert bpy.ops.hairloom.mute_hair_dynamics() == {"FINISHED"}
    assert bake(hair)[-1] == LAST


def test_files_of_a_killed_bake_are_removed_by_the_next(swinging, tmp_path, monkeypatch):
    hair, _ = swinging
    bake(hair)
    folder, shown = tmp_path / "bake", frames_in(tmp_path / "bake")
    with monkeypatch.context() as dying:
        dying.setattr(stale_temp_files.os, "getpid", lambda: 4_000_000)
        left = folder / f"frames-{stale_temp_files.writer_tag()}"
    shutil.copytree(shown, left)
    assert Cache(folder).frame(LAST)["guides"].shape == (60, 16, 3)
    assert frames_in(folder) == shown
    bake(hair)
    assert {path.name for path in folder.iterdir()} == {"cache.json", frames_in(folder).name}
    assert frames_in(folder) not in (shown, left)


def test_two_writers_of_one_folder_never_mix_their_frames(tmp_path):
    """Two writers interleave their frames; each time, the last to finish is shown completely."""
    folder = tmp_path / "bake"
    writers = [CacheWriter(folder), CacheWriter(folder)]
    for value, writer in enumerate(writers):
        writer.add_constants({"value": np.array(value)})
    for frame in (1, 2):
        for value, writer in enumerate(writers):
            writer.add(frame, {"value": np.array(value)}, "hair=00")
    for value, writer in enumerate(writers):
        writer.finish(Facts("Hair", 1, 2, 24.0, "numpy", "hair=00", "0.1.0"))
        writer.publish()
        writer.remove_previous()
        shown = Cache(folder)
        arrays = [shown.constants(), shown.frame(1), shown.frame(2)]
        assert [int(each["value"]) for each in arrays] == [value] * 3


def test_a_bake_that_cannot_replace_the_previous_one_is_kept_beside_it(
    swinging, tmp_path, monkeypatch
):
    """Under Windows' rule that open files cannot be replaced, the new frames are kept and named."""
    hair, _ = swinging
    bake(hair)
    folder, shown = tmp_path / "bake", frames_in(tmp_path / "bake")
    replace = os.replace

    def held(source, target):
        if Path(target) == folder / "cache.json":
            raise PermissionError(13, "Access is denied")
        replace(source, target)

    with monkeypatch.context() as windows:
        windows.setattr(file_moves.os, "replace", held)
        with pytest.raises(HairloomError, match="cannot replace") as raised:
            bake(hair)
    assert frames_in(folder) == shown and Cache(folder).frame(LAST)
    (kept,) = (path for path in folder.glob("frames-*") if path != shown)
    assert str(kept) in raised.value.remedy
    assert Cache(kept).frame(LAST)["guides"].shape == (60, 16, 3)


def test_a_render_and_the_window_read_a_bake_at_the_same_time(tmp_path):
    """One thread drops a frame from memory between another thread's check for it and its read."""
    writer = CacheWriter(tmp_path / "bake")
    writer.add_constants({"value": np.zeros(1)})
    frames = range(1, 9)
    for frame in frames:
        writer.add(frame, {"value": np.full(1, frame)}, "hash")
    writer.finish(Facts("Hair", 1, len(frames), 24.0, "numpy", "hash", "0.1.0"))
    writer.publish()
    cache = Cache(tmp_path / "bake")
    other = threading.Thread(target=lambda: [cache.frame(frame) for frame in frames])

    class Interrupted(OrderedDict):
        def __contains__(self, frame):
            is_there = super().__contains__(frame)
            if is_there and not other.ident:
                other.start()
                other.join(0.2)  # it reads all frames, unless it waits for the lock of this thread
            return is_there

    cache.frame(1)
    cache._frames = Interrupted(cache._frames)
    assert cache.frame(1)["value"][0] == 1
    other.join()
    assert cache.frame(8)["value"][0] == 8


def test_frames_that_are_open_elsewhere_go_when_their_writer_is_gone(tmp_path):
    """Under Windows' rules, frames that a player holds open outlive the next bake and go with the
    one after it, once their writer has ended."""
    folder = tmp_path / "bake"

    def bake(value):
        writer = CacheWriter(folder)
        writer.add_constants({"value": np.full(3, value)})
        writer.add(1, {"value": np.full(3, value)}, "hash")
        writer.finish(Facts("Hair", 1, 1, 24.0, "numpy", "hash", "0.1.0"))
        writer.publish()
        writer.remove_previous()

    bake(1)
    (held,) = folder.glob("frames-*/frame_000001.npz")
    with windows_rules(open_files=[held]):
        bake(2)
        assert Cache(folder).frame(1)["value"].tolist() == [2, 2, 2]
    assert held.is_file()
    held.parent.rename(folder / held.parent.name.replace(f"-{os.getpid()}-", "-99999999-"))
    with windows_rules():
        bake(3)
    assert Cache(folder).frame(1)["value"].tolist() == [3, 3, 3]
    assert len(list(folder.glob("frames-*"))) == 1


def test_a_folder_whose_path_is_too_long_is_reported(tmp_path):
    folder = tmp_path / ("x" * 100) / ("y" * (150 - len(str(tmp_path)) % 50))
    with windows_rules(), pytest.raises(HairloomError, match="259 work here") as raised:
        CacheWriter(folder).add_constants({"value": np.zeros(3)})
    assert raised.value.remedy == "Choose a folder with a shorter path"


def test_several_bakes_are_replaced_together_or_not_at_all(swinging, tmp_path, monkeypatch):
    hair, _ = swinging
    twin = hair.copy()
    bpy.context.collection.objects.link(twin)
    twin.hairloom.bake.folder = str(tmp_path / "twin")
    bake(hair, twin)
    shown = [frames_in(tmp_path / name) for name in ("bake", "twin")]
    replace = os.replace

    def held(source, target):
        if Path(target) == tmp_path / "twin" / "cache.json":
            raise PermissionError(13, "Access is denied")
        replace(source, target)

    with monkeypatch.context() as windows:
        windows.setattr(file_moves.os, "replace", held)
        with pytest.raises(HairloomError, match="cannot replace"):
            bake(hair, twin)
    assert [frames_in(tmp_path / name) for name in ("bake", "twin")] == shown
    assert all(Cache(tmp_path / name).frame(LAST) for name in ("bake", "twin"))


def test_a_bake_through_a_link_stays_on_the_other_disk(swinging, tmp_path):
    hair, _ = swinging
    (tmp_path / "large_disk").mkdir()
    (tmp_path / "bake").symlink_to(tmp_path / "large_disk")
    bake(hair)
    bake(hair)
    assert (tmp_path / "bake").is_symlink()
    assert Cache(tmp_path / "large_disk").frame(LAST)["guides"].shape == (60, 16, 3)


def test_an_adjacent_folder_named_old_is_not_touched(swinging, get_depsgraph, tmp_path):
    hair, _ = swinging
    (tmp_path / "bake.old").mkdir()
    (tmp_path / "bake.old" / "project.txt").write_text("mine")
    previews.start(hair, get_depsgraph())
    assert playback.cache_of(hair) is None
    bake(hair)
    assert (tmp_path / "bake.old" / "project.txt").read_text() == "mine"


def test_a_folder_with_other_files_is_not_touched(swinging, tmp_path):
    hair, _ = swinging
    (tmp_path / "bake").mkdir()
    (tmp_path / "bake" / "diary.txt").write_text("mine")
    with pytest.raises(HairloomError, match=r"diary\.txt"):
        bake(hair)
    assert (tmp_path / "bake" / "diary.txt").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["bake"]
    assert [path.name for path in (tmp_path / "bake").iterdir()] == ["diary.txt"]


def test_deleting_a_bake_leaves_what_is_not_its_own(swinging, get_depsgraph, tmp_path):
    hair, _ = swinging
    previews.start(hair, get_depsgraph())
    bake(hair)
    (tmp_path / "bake" / "diary.txt").write_text("mine")
    free(hair, get_depsgraph())
    assert [path.name for path in (tmp_path / "bake").iterdir()] == ["diary.txt"]
    assert previews.previews[hair.session_uid].bake is None
    assert not bpy.ops.hairloom.bake_free.poll()


def test_an_unsaved_file_needs_a_folder_of_its_own(swinging, tmp_path):
    hair, _ = swinging
    hair.hairloom.bake.folder = ""
    with pytest.raises(RuntimeError, match="Save the file"):
        bpy.ops.hairloom.bake()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "wig.blend"))
    assert bpy.ops.hairloom.bake() == {"FINISHED"}
    assert hair.hairloom.bake.folder == "//hairloom_cache/wig/Hair"
    assert (tmp_path / "hairloom_cache" / "wig" / "Hair" / "cache.json").is_file()


def test_every_file_has_bakes_of_its_own(swinging, tmp_path):
    """A second version of a file shows the first one's bake until it is baked itself, and leaves
    the first one's frames alone."""
    hair, _ = swinging
    hair.hairloom.bake.folder = ""
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot_v1.blend"))
    bake(hair)
    first = tmp_path / "hairloom_cache" / "shot_v1" / "Hair"
    shown = frames_in(first)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot_v2.blend"))
    hair = bpy.data.objects["Hair"]
    assert playback.cache_of(hair).facts.file == "shot_v1.blend"
    bake(hair)
    assert hair.hairloom.bake.folder == "//hairloom_cache/shot_v2/Hair"
    assert playback.cache_of(hair).facts.file == "shot_v2.blend"
    assert frames_in(first) == shown


def test_a_folder_with_the_bake_of_another_file_is_refused(swinging, get_depsgraph, tmp_path):
    hair, _ = swinging
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot_v1.blend"))
    bake(hair)
    shown = frames_in(tmp_path / "bake")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot_v2.blend"))
    hair = bpy.data.objects["Hair"]
    with pytest.raises(HairloomError, match=r"the bake of Hair in shot_v1\.blend"):
        bake(hair)
    free(hair, get_depsgraph())
    assert hair.hairloom.bake.folder == "" and frames_in(tmp_path / "bake") == shown
    bake(hair, folder=tmp_path / "bake")  # a folder that is given explicitly is taken
    assert Cache(tmp_path / "bake").facts.file == "shot_v2.blend"


def test_a_renamed_groom_keeps_its_bake_where_another_gets_its_name(swinging, get_depsgraph):
    hair, _ = swinging
    bake(hair)
    folder = folder_of(hair)
    hair.name = "Renamed"
    other = bpy.data.objects.new("Hair", hair.data.copy())
    bpy.context.collection.objects.link(other)
    other.hairloom.bake.folder = str(folder.parent / "elsewhere")
    bake(hair)
    assert Cache(folder).facts.owner == "Renamed"
    hair.name = "Again"
    other.name = "Renamed"
    free(hair, get_depsgraph())
    assert not folder.exists()
    bake(other)
    hair.hairloom.bake.folder = other.hairloom.bake.folder
    other.hairloom.bake.folder = ""
    with pytest.raises(HairloomError, match="holds the bake of Renamed"):
        bake(hair)


def test_a_duplicate_is_baked_into_a_folder_of_its_own(swinging, tmp_path):
    hair, _ = swinging
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "wig.blend"))
    hair.hairloom.bake.folder = ""
    bake(hair)
    twin = hair.copy()
    bpy.context.collection.objects.link(twin)
    bake(twin)
    assert {path.name for path in (tmp_path / "hairloom_cache" / "wig").iterdir()} == {
        "Hair",
        "Hair.001",
    }


@pytest.mark.alike
@pytest.mark.parametrize(
    "damage",
    ["no frame", "cut off", "another shape", "pickled", "no json", "newer", "no constants"],
)
def test_a_damaged_bake_is_reported_and_hair_is_simulated(
    damage, swinging, get_depsgraph, tmp_path
):
    hair, _ = swinging
    bake(hair)
    folder = tmp_path / "bake"
    frame = frames_in(folder) / "frame_000003.npz"
    if damage == "no frame":
        frame.unlink()
    elif damage == "cut off":
        frame.write_bytes(frame.read_bytes()[:-500])
    elif damage == "another shape":
        np.savez(frame, guides=np.zeros((3, 3, 3), np.float32))
    elif damage == "pickled":
        np.savez(frame, guides=np.array([{}, None]), allow_pickle=True)
    elif damage == "no json":
        (folder / "cache.json").write_text("{")
    elif damage == "newer":
        facts = json.loads((folder / "cache.json").read_text())
        (folder / "cache.json").write_text(json.dumps(facts | {"version": 99}))
    elif damage == "no constants":
        (frames_in(folder) / "constants.npz").unlink()
    session = previews.start(hair, get_depsgraph())
    if damage == "no constants":  # only renders need them
        with pytest.raises(HairloomError, match="Bake again"):
            baked_grid(playback.cache_of(hair), 3)
        return
    played(hair, last=3)
    assert previews.sessions() == (session,)
    assert "ake" in previews.previews[session.uid].problems
    assert np.isfinite(drawn(hair)).all()


def test_few_frames_stay_in_memory(swinging):
    hair, _ = swinging
    bake(hair)
    cache = playback.cache_of(hair)
    for frame in range(1, LAST + 1):
        cache.frame(frame)
    assert len(cache._frames) == 3


@pytest.mark.usefixtures("swinging")
def test_undo_takes_the_copy_away_and_keeps_the_files(tmp_path):
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.hairloom.bake()
    bpy.ops.ed.undo_push(message="baked")
    assert "Hair Baked" in bpy.data.objects and bpy.data.objects["Hair"].hide_render
    bpy.ops.ed.undo()
    assert "Hair Baked" not in bpy.data.objects and not bpy.data.objects["Hair"].hide_render
    assert (tmp_path / "bake" / "cache.json").is_file()
    bpy.ops.ed.redo()
    assert bpy.data.objects["Hair"].hairloom.bake.copy.name == "Hair Baked"


def test_the_buttons_bake_and_delete(swinging, tmp_path):
    hair, _ = swinging
    hair.hide_render = True
    assert not bpy.ops.hairloom.bake_free.poll()
    assert bpy.ops.hairloom.bake() == {"FINISHED"}
    copy = hair.hairloom.bake.copy
    assert copy.hide_viewport and copy.hide_render, "the hair was not to be rendered before"
    assert bpy.ops.hairloom.bake() == {"FINISHED"}
    assert hair.hairloom.bake.copy == copy
    assert bpy.ops.hairloom.bake_free() == {"FINISHED"}
    assert list(tmp_path.iterdir()) == []
    assert hair.hide_render and hair.hairloom.bake.copy is None
    assert [curves.name for curves in bpy.data.hair_curves] == ["Hair"]


def test_a_bake_stores_stretch_and_depth_of_its_strands(swinging):
    """The stored figures equal those computed from the bake's frames, with the head as a sphere."""
    hair, head = swinging
    head.hairloom.collider_shape = "sphere"
    bake(hair)
    cache, change, depth = playback.cache_of(hair), [0.0], [0.0]
    for frame in range(2, LAST + 1):
        grid, matrix = baked_grid(cache, frame), playback.pose_in(cache, frame).matrix
        length = np.linalg.norm(np.diff(grid, axis=1), axis=2).sum(axis=1)
        change.append(np.abs(length / 0.08 - 1.0).max())
        depth.append(0.1 - np.linalg.norm(grid[:, 1:] - matrix[:3, 3], axis=2).min())
    found = cache.facts.figures
    assert found.strands_stretch_max_percent == pytest.approx(100.0 * max(change), abs=1e-3)
    # the sphere encloses the mesh's bounding box and is a little larger than its faces
    assert found.strands_penetration_max_mm == pytest.approx(1000.0 * max(depth), abs=0.2)


def test_non_finite_figures_make_a_bake_damaged(swinging):
    hair, _ = swinging
    bake(hair)
    facts = Path(hair.hairloom.bake.folder) / "cache.json"
    content = json.loads(facts.read_text())
    for bad in ("many", {}, content["figures"] | {"penetration_max_mm": None}):
        facts.write_text(json.dumps(content | {"figures": bad}))
        with pytest.raises(HairloomError, match="damaged"):
            Cache(facts.parent)
    del content["figures"]  # as written by an earlier version
    facts.write_text(json.dumps(content))
    assert Cache(facts.parent).facts.figures is None


@pytest.mark.parametrize(("strands", "count"), [([10**6], 16), ([-1], 16), ([0], 15), ([0, 1], 16)])
def test_led_strands_that_are_not_of_the_groom_are_refused(strands, count, swinging, tmp_path):
    hair, _ = swinging
    bake(hair)
    path = frames_in(tmp_path / "bake") / "frame_000002.npz"
    with np.load(path) as file:
        arrays = dict(file)
    arrays["led_strands"] = np.array(strands, np.int32)
    arrays["led_points"] = np.zeros((count, 3), np.float32)
    np.savez(path, **arrays)
    playback.forget()
    with pytest.raises(HairloomError, match="Bake again"):
        playback.strands_in(playback.cache_of(hair), 2)


def test_a_render_has_the_rig_of_the_newest_bake(swinging, get_depsgraph):
    """Strands at rest are unchanged, but other guides move them."""
    hair, _ = swinging
    bake(hair)
    engine_hair.read_groom(hair, get_depsgraph())
    before = engine_hair._cache[hair.session_uid].built.rig
    hair.data.hairloom.guides.guide_count = 10
    bake(hair)
    engine_hair.read_groom(hair, get_depsgraph())
    after = engine_hair._cache[hair.session_uid].built.rig
    np.testing.assert_array_equal(before.strands.points, after.strands.points)
    assert len(after.guides) == 10 < len(before.guides)
    engine_hair.forget()


def test_a_requested_folder_is_used_even_if_another_object_names_it(swinging, tmp_path):
    hair, _ = swinging
    twin = hair.copy()
    bpy.context.collection.objects.link(twin)
    asked = tmp_path / "asked"
    for each in (hair, twin):
        bake(each, folder=asked)
        assert Cache(asked).facts.owner == each.name
        assert each.hairloom.bake.folder == str(asked)


def test_two_paths_of_one_folder_count_as_one_folder(swinging, tmp_path):
    """Two bakes of one run do not overwrite each other if two spellings name one folder."""
    hair, _ = swinging
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "wig.blend"))
    twin = hair.copy()
    bpy.context.collection.objects.link(twin)
    hair.hairloom.bake.folder = str(tmp_path / "one")
    twin.hairloom.bake.folder = "//one/../one/"
    bake(hair, twin)
    owners = {Cache(folder_of(each)).facts.owner for each in (hair, twin)}
    assert owners == {hair.name, twin.name}


def test_while_hair_is_baked_cloth_shows_its_bake_as_on_the_timeline(
    swinging, flag_object, get_depsgraph, tmp_path
):
    hair, scene = swinging[0], bpy.context.scene
    flag_object.hairloom.bake.folder = str(tmp_path / "flag")
    bake(flag_object)
    there = []
    for frame in range(1, LAST + 1):
        scene.frame_set(frame)
        there.append(evaluated_vertices(flag_object, get_depsgraph))
    assert np.ptp(there, axis=0).max() > 0.001, "it does not move"
    scene.frame_set(1)
    during = [
        evaluated_vertices(flag_object, get_depsgraph) for _ in Bake.of([hair], scene).steps()
    ]
    np.testing.assert_array_equal(during, there)


def test_nested_suspension_keeps_work_suspended():
    with suspended():
        with suspended():
            pass
        assert is_suspended()
    assert not is_suspended()
