"""Two view layers with the hair, each in its own window: both show our strands and not Blender's,
and hair swings in both when Blender plays."""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from artist import changed_fraction, press, wait_for_hair
from driver import hairloom_module, wait_until
from two_windows import (
    MAX_REDRAW_FRACTION,
    assert_hair_drawn,
    hair,
    previews,
    set_the_scene,
    two_windows,
    view_pictures,
    windows,
)

log = traces.Log()


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    yield from set_the_scene()
    yield from two_windows()
    yield from two_view_layers_with_the_hair()
    assert "Traceback" not in log.new_output()


def two_view_layers_with_the_hair():
    """One view layer in each window: both show our strands and not Blender's, whatever happens in
    either."""
    scene, (first, second) = bpy.context.scene, windows()
    mine, other = first.view_layer, scene.view_layers.new("Too")
    second.view_layer = other
    yield from ours_alone("both-layers-new", mine)
    yield from assert_hair_drawn("both-layers", [True, True])
    yield from ours_alone("both-layers", mine)
    head, settings = bpy.data.objects["Head"], hair().data.hairloom
    settings.shading.base_color = (0.6, 0.1, 0.05)
    yield from ours_alone("both-layers-colour", mine)
    head.location.x = 0.03
    yield from ours_alone("both-layers-moved", mine)
    settings.guides.guide_count = 61
    (session,) = previews().sessions()
    yield from wait_until(lambda: session.is_pending, "no other hair is made")
    yield from wait_until(lambda: not session.is_pending, "it is never made")
    yield from ours_alone("both-layers-made", mine)
    yield from played_in_both(head)
    yield from ours_alone("both-layers-played", mine)
    head.animation_data_clear()
    head.location.x = 0.0
    yield from ended_in_both(mine, other)
    second.view_layer = mine
    scene.view_layers.remove(other)
    scene.frame_set(1)
    yield
    yield from assert_hair_drawn("both-layers-back", [True, True])


def ended_in_both(mine, other):
    """After the preview, both show Blender's own strands; then the preview starts again."""
    previews().stop_all()
    yield
    assert not is_box(mine) and not is_box(other), "a box is left"
    bpy.ops.hairloom.preview()
    yield from wait_for_hair()
    yield from ours_alone("both-layers-again", mine)


def ours_alone(label, mine):
    """The second window shows the same with its own view layer and with the first one."""
    second = windows()[1]
    other = second.view_layer
    yield from wait_until(lambda: is_box(mine) and is_box(other), f"{label}: {is_box(mine)}")
    _, shown = yield from view_pictures(label)
    second.view_layer = mine
    yield
    _, expected = yield from view_pictures(f"{label}-wanted")
    second.view_layer = other
    yield
    share = changed_fraction(shown, expected)
    print(f"{label}: {share:.4f} of the second window is otherwise", flush=True)
    assert share < MAX_REDRAW_FRACTION, f"{label}: Blender's own strands are seen"


def is_box(layer):
    """Whether Blender's own strands are hidden in a view layer."""
    depsgraph = layer.depsgraph  # None before a window has shown it
    return depsgraph and hair().evaluated_get(depsgraph).display_type == "WIRE"


def played_in_both(head):
    """While Blender plays, the hair swings, although the other view layer is evaluated too."""
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 40
    for frame, x in ((1, 0.0), (20, 0.08), (40, 0.0)):
        head.location.x = x
        head.keyframe_insert("location", frame=frame)
    scene.frame_set(1)
    session = previews().sessions()[0]
    bpy.ops.screen.animation_play()
    yield from wait_until(lambda: session.is_playing, "Blender plays, the hair does not")
    lags, frames = [], set()

    def has_swung():
        frames.add(scene.frame_current)
        lags.append(lag(session))
        return len(frames) > 8

    yield from wait_until(has_swung, "Blender does not play")
    bpy.ops.screen.animation_cancel(restore_frame=False)
    yield
    print("lags [mm]", [round(1000.0 * each, 1) for each in lags], flush=True)
    swinging = [each > 1.0e-4 for each in lags[2:]]
    assert sum(swinging) > 0.7 * len(swinging), f"it is put to rest again and again: {lags}"


def lag(session):
    """Largest distance of tips from their places in the carried style [m]."""
    style = hairloom_module("motion_flow").carried_strands(session.rig, session.solver.pose)
    tips = session.rig.strands.offsets[1:] - 1
    return float(np.abs(session.strands[tips] - style[tips]).max())


driver.play_session(steps())
