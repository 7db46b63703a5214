"""Hair in motion: Play at the scene's rate, pause, Blender's playback, bake, cancel, render."""

import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    click,
    look_from_front,
    new_head,
    open_our_sidebar,
    press,
    sidebar_button,
    viewport,
    wait_for_hair,
)
from driver import hairloom_module, wait_until

LAST = 40
FOLDER = Path(bpy.app.tempdir) / "bake"


def session():
    (one,) = hairloom_module("previews").sessions()
    return one


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    yield from set_the_scene()
    yield from play_keeps_the_scenes_rate()
    yield from pause_resume_and_reset()
    yield from playback_takes_over()
    yield from bake_in_the_window()
    yield from escape_cancels_a_bake()
    yield from a_render_beside_the_window()
    yield from loading_in_the_middle_of_a_bake()


def set_the_scene():
    new_head(keeps_light=True)
    bpy.ops.hairloom.grow(strand_count=600, length=0.12)
    bpy.context.object.name = "Hair"
    look_from_front(0.9)
    yield from open_our_sidebar()
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_for_hair()
    yield
    assert session().rig.strands.strand_count > 100


def play_keeps_the_scenes_rate():
    """Simulated time does not exceed real time and is in whole frames; slow machines simulate
    less."""
    rate, durations = 24.0, []
    yield from click(*sidebar_button("hairloom.play"))
    yield from wait_until(lambda: session().is_playing, "the Play button did nothing")
    advance = type(session()).advance

    def noted(self, depsgraph, duration):
        durations.append(duration)
        advance(self, depsgraph, duration)

    type(session()).advance = noted
    begin = time.perf_counter()
    yield from wait_until(lambda: sum(durations) > 0.5, "it does not advance")
    passed = time.perf_counter() - begin
    type(session()).advance = advance
    frames = np.array(durations) * rate
    assert np.allclose(frames, np.round(frames)) and frames.max() < 4.5, frames
    assert 0.0 < sum(durations) < passed + 0.2, (passed, sum(durations))
    print(f"simulated {sum(durations):.2f} s in {passed:.2f} s, {session().device_name}")
    driver.screenshot("playing")


def pause_resume_and_reset():
    live, head = hairloom_module("previews"), bpy.data.objects["Head"]
    yield from click(*sidebar_button("hairloom.pause"))
    yield from wait_until(live.is_paused, "it is not paused")
    held = session().strands
    head.location.x = 0.05
    yield
    assert np.array_equal(session().strands, held), "paused hair moves"
    driver.screenshot("paused")
    yield from click(*sidebar_button("hairloom.pause"))
    yield from wait_until(lambda: not live.is_paused(), "it stays paused")
    yield from wait_until(lambda: not np.array_equal(session().strands, held), "it does not go on")
    head.location.x = 0.0
    yield from click(*sidebar_button("hairloom.reset"))
    yield
    assert live.is_playing()


def playback_takes_over():
    """Space while hair plays: from then on each frame of Blender's animation moves it."""
    live = hairloom_module("previews")
    head, scene = bpy.data.objects["Head"], bpy.context.scene
    scene.frame_start, scene.frame_end = 1, LAST
    for frame, x in ((1, 0.0), (10, 0.1), (20, -0.1), (LAST, 0.0)):
        head.location.x = x
        head.keyframe_insert("location", frame=frame)
    scene.frame_set(1)
    yield
    assert live.is_playing()
    bpy.ops.screen.animation_play()

    def has_taken_over():
        return not live.is_playing() and session().is_playing and scene.frame_current > 5

    yield from wait_until(has_taken_over, "Blender's playback does not take over")
    bpy.ops.screen.animation_cancel(restore_frame=False)
    yield
    carried = session().source.strands.grid[:, -1] - session().source.strands.grid[:, 0]
    offsets = session().rig.strands.offsets
    lag = session().strands[offsets[1:] - 1] - session().strands[offsets[:-1]] - carried
    assert 1e-4 < np.linalg.norm(lag, axis=1).max() < 0.2
    driver.screenshot("playback-stopped")


def run_bake():
    bpy.data.objects["Hair"].hairloom.bake.folder = str(FOLDER)
    with bpy.context.temp_override(window=bpy.context.window, area=viewport()):
        assert bpy.ops.hairloom.bake("INVOKE_DEFAULT") == {"RUNNING_MODAL"}


def is_baking():
    return hairloom_module("long_work").running_label() == "Bake"


def bake_in_the_window():
    scene = bpy.context.scene
    scene.frame_set(7)
    run_bake()
    yield 1
    driver.screenshot("baking")
    yield from wait_until(lambda: not is_baking(), "the bake does not end")
    yield
    assert scene.frame_current == 7
    cache = hairloom_module("playback").cache_of(bpy.data.objects["Hair"])
    assert cache.facts.frame_count == LAST
    preview = hairloom_module("previews").previews[session().uid]
    assert preview.phase.name == "BAKED" and preview.bake.changed_inputs == (), preview.bake
    driver.screenshot("baked")
    bpy.ops.screen.animation_play()
    yield from wait_until(lambda: scene.frame_current not in (7, LAST), "Blender does not play")
    bpy.ops.screen.animation_cancel(restore_frame=False)
    yield
    strands = hairloom_module("playback").strands_in(cache, scene.frame_current)
    assert np.abs(session().strands - strands).max() < 1e-5


def escape_cancels_a_bake():
    before = (FOLDER / "cache.json").stat().st_mtime_ns
    bpy.context.scene.frame_end = 5000
    run_bake()
    yield 1
    assert is_baking()
    yield from press("ESC")
    yield from wait_until(lambda: not is_baking(), "Esc does not cancel the bake")
    assert not hairloom_module("suspension").is_suspended()
    assert (FOLDER / "cache.json").stat().st_mtime_ns == before
    assert len(list(FOLDER.glob("frames-*"))) == 1, "half a bake is left"
    bpy.context.scene.frame_end = LAST


def a_render_beside_the_window():
    """F12 renders in its own thread while the window goes on."""
    scene, hair = bpy.context.scene, bpy.data.objects["Hair"]
    assert scene.render.use_lock_interface and hair.hide_render
    camera = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler.x = (0.0, -1.0, 0.0), np.pi / 2.0
    scene.camera = camera
    scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "CYCLES", 64, 64
    scene.cycles.samples = 1
    scene.frame_set(15)
    finished = []
    bpy.app.handlers.render_complete.append(lambda *_: finished.append(1))
    bpy.ops.render.render("INVOKE_DEFAULT")
    yield from wait_until(lambda: finished, "the render never ends")
    yield
    bpy.app.handlers.render_complete.pop()
    curves = hair.hairloom.bake.copy.data
    points = np.empty((len(curves.position_data), 3), np.float32)
    curves.position_data.foreach_get("vector", points.ravel())
    cache = hairloom_module("playback").cache_of(hair)
    strands = hairloom_module("playback").strands_in(cache, 15)
    assert np.array_equal(points, strands.reshape(-1, 3))
    assert len(hairloom_module("previews").sessions()) == 1
    driver.screenshot("rendered")


def loading_in_the_middle_of_a_bake():
    bpy.context.scene.frame_end = 5000
    run_bake()
    yield 1
    assert is_baking()
    bpy.ops.wm.read_homefile(use_factory_startup=False)
    yield
    assert not is_baking() and not hairloom_module("suspension").is_suspended()
    assert hairloom_module("previews").sessions() == ()
    assert len(list(FOLDER.glob("frames-*"))) == 1, "half a bake is left"
    assert (FOLDER / "cache.json").is_file()


driver.play_session(steps())
