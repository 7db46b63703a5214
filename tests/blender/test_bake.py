"""Baking: equal to what playback shows, whole or not at all, and shown again."""

import json
import shutil

import bpy
import numpy as np
import pytest

from hairloom.addon.blender.bakes import groom_hashes, playback
from hairloom.addon.blender.bakes.cache import Cache
from hairloom.addon.blender.bakes.simulated import SOLVER_VERSION
from hairloom.addon.blender.base.suspension import is_suspended
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.preview.bake import Bake, free
from hairloom.addon.errors import HairloomError

LAST = 8


@pytest.fixture
def swinging(new_hair, sphere, tmp_path):
    """Hair on a head that is thrown about for some frames: (hair, head)."""
    hair = new_hair(sphere)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, LAST
    for frame, x in ((1, 0.0), (4, 0.1), (LAST, -0.05)):
        sphere.location.x = x
        sphere.keyframe_insert("location", frame=frame)
    hair.hairloom.dynamics.collider_resolution = 8
    hair.hairloom.dynamics.device = "numpy"
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    scene.frame_set(1)
    return hair, sphere


def bake(*objects, **options):
    plan = Bake.of(list(objects), bpy.context.scene, **options)
    return list(plan.steps())


def drawn(hair):
    return previews.session_of(hair).strands


def played(hair, first=1, last=LAST):
    """The strands of each frame while the scene goes through them."""
    shown = []
    for frame in range(first, last + 1):
        bpy.context.scene.frame_set(frame)
        shown.append(drawn(hair))
    return np.array(shown)


def test_a_bake_equals_playback_bit_for_bit(swinging, evaluated):
    hair, _ = swinging
    previews.start(hair, evaluated())
    live_strands = played(hair)
    assert np.ptp(live_strands[:, :, -1] - live_strands[:, :, 0], axis=0).max() > 0.01
    bpy.context.scene.frame_set(3)
    assert bake(hair) == list(range(1, LAST + 1))
    assert bpy.context.scene.frame_current == 3
    assert previews.session_of(hair).is_playing is False
    np.testing.assert_array_equal(drawn(hair), live_strands[2])
    np.testing.assert_array_equal(played(hair), live_strands)
    cache = playback.cache_of(hair)
    for frame in range(1, LAST + 1):
        np.testing.assert_array_equal(playback.strands_in(cache, frame), live_strands[frame - 1])


@pytest.mark.usefixtures("gpu_context")
def test_a_bake_on_the_gpu_equals_playback_on_the_gpu_bit_for_bit(swinging, evaluated):
    """Guides and what is drawn of them; the copy for renders is ridden on the CPU."""
    hair, _ = swinging
    hair.hairloom.dynamics.device = "compute"
    session = previews.start(hair, evaluated())
    guides, strands = [], []
    for frame in range(1, LAST + 1):
        bpy.context.scene.frame_set(frame)
        guides.append(session.solver.guides())
        strands.append(drawn(hair))
    assert session.solver.form == "compute" and np.ptp(np.array(guides), axis=0).max() > 0.01
    bake(hair)
    cache = playback.cache_of(hair)
    for frame in range(1, LAST + 1):
        np.testing.assert_array_equal(cache.frame(frame)["guides"], guides[frame - 1])
        bpy.context.scene.frame_set(frame)
        np.testing.assert_array_equal(drawn(hair), strands[frame - 1])
        ridden = playback.strands_in(cache, frame)
        np.testing.assert_allclose(ridden, strands[frame - 1], rtol=0, atol=2e-6)


@pytest.mark.parametrize("previewed", [True, False])
def test_a_bake_is_the_same_with_and_without_a_preview(previewed, swinging, evaluated, tmp_path):
    hair, _ = swinging
    bake(hair)
    first = Cache(tmp_path / "bake")
    frames = {n: first.frame(n) for n in range(1, LAST + 1)}
    if previewed:
        bpy.context.scene.frame_set(1)
        previews.start(hair, evaluated())
    bake(hair)
    second = Cache(tmp_path / "bake")
    assert second.facts == first.facts
    for number, arrays in frames.items():
        for name, array in arrays.items():
            np.testing.assert_array_equal(second.frame(number)[name], array)


def test_a_preview_begun_elsewhere_shows_the_very_same_strands(swinging, evaluated):
    """It takes the rig of the bake, wherever the head is by then."""
    hair, _ = swinging
    bake(hair)
    cache = playback.cache_of(hair)
    bpy.context.scene.frame_set(5)
    previews.start(hair, evaluated())
    np.testing.assert_array_equal(drawn(hair), playback.strands_in(cache, 5))
    assert previews.previews[hair.session_uid].bake.changed == ()
    bpy.context.scene.frame_set(2)
    np.testing.assert_array_equal(drawn(hair), playback.strands_in(cache, 2))


def test_a_deformed_head_carries_baked_hair(swinging, evaluated):
    hair, head = swinging
    swell = head.modifiers.new("Swell", "DISPLACE")
    swell.mid_level = 0.0
    for frame, strength in ((1, 0.0), (LAST, 0.05)):
        swell.strength = strength
        swell.keyframe_insert("strength", frame=frame)
    previews.start(hair, evaluated())
    shown = played(hair)
    assert np.linalg.norm(shown[-1, :, 0] - shown[0, :, 0], axis=1).max() > 0.04
    bake(hair)
    np.testing.assert_array_equal(played(hair), shown)


def test_hair_without_a_head_is_baked(new_hair, evaluated, tmp_path):
    hair = new_hair()
    scene = bpy.context.scene
    scene.frame_end = 4
    for frame, angle in ((1, 0.0), (4, 0.5)):
        hair.rotation_euler.x = angle
        hair.keyframe_insert("rotation_euler", frame=frame)
    hair.hairloom.bake.folder = str(tmp_path / "bake")
    hair.hairloom.dynamics.device = "numpy"
    scene.frame_set(1)
    previews.start(hair, evaluated())
    shown = played(hair, last=4)
    bake(hair)
    np.testing.assert_array_equal(played(hair, last=4), shown)


def test_what_has_changed_since_is_said_and_the_bake_still_plays(swinging, evaluated):
    hair, head = swinging
    previews.start(hair, evaluated())
    bake(hair)
    scene, uid = bpy.context.scene, hair.session_uid
    shown = played(hair)
    assert previews.previews[uid].bake.changed == ()

    def changed_at(frame):
        scene.frame_set(frame)
        return previews.previews[uid].bake.changed

    hair.hairloom.dynamics.damping = 3.0
    assert previews.previews[uid].bake.changed == ("settings",), "told at once"
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
    scene_events.catch_up(evaluated())
    assert "hair" in changed_at(5)


def test_a_bake_of_another_solver_is_out_of_date(swinging, evaluated, monkeypatch):
    hair, _ = swinging
    bake(hair)
    previews.start(hair, evaluated())
    assert previews.previews[hair.session_uid].bake.changed == ()
    previews.stop_all()
    monkeypatch.setattr(groom_hashes, "SOLVER_VERSION", SOLVER_VERSION + 1)
    previews.start(hair, evaluated())
    assert previews.previews[hair.session_uid].bake.changed == ("solver",)


def test_a_head_that_is_posed_by_hand_takes_its_hair_along(swinging, evaluated):
    hair, head = swinging
    bake(hair)
    bpy.context.scene.frame_set(4)
    session = previews.start(hair, evaluated())
    baked = drawn(hair)
    head.location.y = 0.5
    bpy.context.view_layer.update()
    assert drawn(hair)[:, 0, 1].mean() == pytest.approx(0.5, abs=0.02)
    assert previews.previews[session.uid].bake.changed == ("pose",)
    bpy.context.scene.frame_set(4)
    np.testing.assert_array_equal(drawn(hair), baked)


def test_a_bake_can_be_left_out_and_is_simulated_again(swinging, evaluated):
    hair, _ = swinging
    previews.start(hair, evaluated())
    bake(hair)
    hair.hairloom.dynamics.damping = 9.0
    baked = played(hair)
    hair.hairloom.bake.is_shown = False
    simulated = played(hair)
    assert np.abs(simulated - baked).max() > 1e-4
    hair.hairloom.bake.is_shown = True
    np.testing.assert_array_equal(played(hair), baked)


def test_cancelling_leaves_the_bake_before_untouched(swinging, evaluated, tmp_path):
    hair, _ = swinging
    bake(hair)
    before = {path.name: path.read_bytes() for path in (tmp_path / "bake").iterdir()}
    hair.hairloom.dynamics.damping = 9.0
    bpy.context.scene.frame_set(6)
    steps = Bake.of([hair], bpy.context.scene).steps()
    assert [next(steps), next(steps)] == [1, 2]
    assert (tmp_path / "bake.new").is_dir()
    steps.close()
    assert bpy.context.scene.frame_current == 6
    assert [path.name for path in tmp_path.iterdir()] == ["bake"]
    assert {path.name: path.read_bytes() for path in (tmp_path / "bake").iterdir()} == before
    assert not is_suspended()


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


@pytest.mark.parametrize("broken_off", ["while writing", "before the swap", "in the swap"])
def test_a_crash_leaves_a_whole_bake(broken_off, swinging, tmp_path):
    hair, _ = swinging
    bake(hair)
    folder, new, old = (tmp_path / f"bake{ending}" for ending in ("", ".new", ".old"))
    damping = Cache(folder).facts.rig_hash
    shutil.copytree(folder, new)
    if broken_off == "while writing":
        (new / "cache.json").unlink()
    elif broken_off == "in the swap":
        folder.rename(old)
    assert Cache(folder).facts.rig_hash == damping
    assert Cache(folder).frame(LAST)["guides"].shape == (60, 16, 3)
    bake(hair)
    assert [path.name for path in tmp_path.iterdir()] == ["bake"]


def test_a_folder_with_other_files_is_not_touched(swinging, tmp_path):
    hair, _ = swinging
    (tmp_path / "bake").mkdir()
    (tmp_path / "bake" / "diary.txt").write_text("mine")
    with pytest.raises(HairloomError, match=r"diary\.txt"):
        bake(hair)
    assert (tmp_path / "bake" / "diary.txt").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["bake"]


def test_deleting_a_bake_leaves_what_is_not_its_own(swinging, evaluated, tmp_path):
    hair, _ = swinging
    previews.start(hair, evaluated())
    bake(hair)
    (tmp_path / "bake" / "diary.txt").write_text("mine")
    free(hair, evaluated())
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
    assert hair.hairloom.bake.folder == "//hairloom_cache/Hair"
    assert (tmp_path / "hairloom_cache" / "Hair" / "cache.json").is_file()


def test_a_duplicate_is_baked_into_a_folder_of_its_own(swinging, tmp_path):
    hair, _ = swinging
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "wig.blend"))
    hair.hairloom.bake.folder = ""
    bake(hair)
    twin = hair.copy()
    bpy.context.collection.objects.link(twin)
    bake(twin)
    assert {path.name for path in (tmp_path / "hairloom_cache").iterdir()} == {"Hair", "Hair.001"}


@pytest.mark.parametrize(
    "damage",
    ["no frame", "cut off", "another shape", "pickled", "no json", "newer", "no constants"],
)
def test_a_damaged_bake_is_told_and_the_hair_simulated(damage, swinging, evaluated, tmp_path):
    hair, _ = swinging
    bake(hair)
    folder = tmp_path / "bake"
    frame = folder / "frame_000003.npz"
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
        (folder / "constants.npz").unlink()
    session = previews.start(hair, evaluated())
    if damage == "no constants":  # only renders need them
        with pytest.raises(HairloomError, match="Bake again"):
            playback.strands_in(playback.cache_of(hair), 3)
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
