"""Several windows, scenes, view layers and instances: hair is drawn where Blender shows it, and
nowhere else."""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from artist import changed_fraction, press
from driver import hairloom_module, wait_until
from two_windows import (
    MAX_REDRAW_FRACTION,
    MIN_HAIR_FRACTION,
    assert_hair_drawn,
    hair,
    look_from_front_in_all,
    previews,
    set_the_scene,
    two_windows,
    view_of,
    view_pictures,
    windows,
)

log = traces.Log()


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    yield from set_the_scene()
    yield from two_windows()
    yield from local_view_in_one_window()
    yield from another_view_layer_in_one_window()
    yield from another_scene_in_one_window()
    yield from hidden_in_every_way()
    yield from instances_are_reported()
    assert "Traceback" not in log.new_output()


def local_view_in_one_window():
    head, second = bpy.data.objects["Head"], windows()[1]
    hair().select_set(False)
    head.select_set(True)

    def switch():
        area = view_of(second)
        part = next(each for each in area.regions if each.type == "WINDOW")
        with bpy.context.temp_override(window=second, area=area, region=part):
            bpy.ops.view3d.localview(frame_selected=False)

    switch()
    yield
    yield from assert_hair_drawn("local-view", [True, False])
    switch()
    yield


def another_view_layer_in_one_window():
    """A view layer without the hair's collection shows no hair, while the other window does."""
    scene, second = bpy.context.scene, windows()[1]
    layer = scene.view_layers.new("Without")
    layer.layer_collection.children["Groom"].exclude = True
    first = second.view_layer
    second.view_layer = layer
    yield
    yield from assert_hair_drawn("view-layer", [True, False])
    second.view_layer = first
    scene.view_layers.remove(layer)
    yield
    yield from assert_hair_drawn("view-layer-back", [True, True])


def another_scene_in_one_window():
    """The preview goes on where its scene is shown, also while the other scene is edited."""
    first, second = windows()
    mine, other = first.scene, bpy.data.scenes.new("Other")
    second.scene = other
    yield
    look_from_front_in_all()
    yield from assert_hair_drawn("scene", [True, False])
    (session,) = previews().sessions()
    rig = session.rig
    ball = bpy.data.objects.new("Ball", bpy.data.objects["Head"].data)
    other.collection.objects.link(ball)
    for x in (0.01, 0.02, 0.0):  # updates of the other scene
        ball.location.x = x
        yield
    assert session.rig is rig, "work in another scene reads the hair again"
    yield from assert_hair_drawn("scene-worked-on", [True, False])
    second.scene = mine
    bpy.data.objects.remove(ball)
    bpy.data.scenes.remove(other)
    yield
    look_from_front_in_all()
    yield from assert_hair_drawn("scene-back", [True, True])
    yield from closed_while_it_moves(second)


def closed_while_it_moves(second):
    """Until the next redraw there is no GPU context, so requests in between wait for it."""
    with bpy.context.temp_override(window=second):
        bpy.ops.wm.window_close()
    bpy.ops.hairloom.reset()
    yield
    assert len(windows()) == 1
    assert len(previews().sessions()) == 1, previews().notice()
    yield from wait_until(lambda: not previews().sessions()[0].is_stale, "it is not read again")


def hidden_in_every_way():
    """Hiding by the eye icon, with the collection, or by the view layer hides hair; hiding it in
    renders does not."""
    layer = bpy.context.view_layer.layer_collection.children["Groom"]
    (shown,) = yield from view_pictures("ways-shown")
    hair().hide_viewport = True
    (without,) = yield from view_pictures("ways-without")
    hair().hide_viewport = False
    head = bpy.data.objects["Head"]
    for owner, name in (
        (layer, "hide_viewport"),
        (layer.collection, "hide_viewport"),
        (layer, "exclude"),
    ):
        setattr(owner, name, True)
        (found,) = yield from view_pictures(f"ways-{name}")
        setattr(owner, name, False)
        yield
        assert not previews().notice(), previews().notice()
        (back,) = yield from view_pictures(f"ways-{name}-back")
        assert changed_fraction(found, without) > MIN_HAIR_FRACTION, "the head is hidden as well"
        assert hair_pixels(found, shown, without) < MAX_REDRAW_FRACTION, f"{name} does not hide it"
        assert changed_fraction(back, shown) < MAX_REDRAW_FRACTION, f"{name} does not show it again"
    hair().hide_render = head.hide_render = True
    (found,) = yield from view_pictures("ways-hide-render")
    assert changed_fraction(found, shown) < MAX_REDRAW_FRACTION, (
        "hidden in renders, it is gone from the view"
    )
    hair().hide_render = head.hide_render = False


def hair_pixels(found, shown, without):
    """The fraction of pixels that show hair: as in `shown`, not as in `without`."""
    is_hair = np.abs(shown - without).max(axis=2) > 0.1
    as_shown = np.abs(found - shown).max(axis=2) < 0.02
    return float((is_hair & as_shown).mean())


def instances_are_reported():
    """An instance of the groom's collection shows only the head, and the panel reports it."""
    scene, note = bpy.context.scene, hairloom_module("diagnostics").instances_note
    twin = bpy.data.objects.new("Twin", None)
    twin.instance_type, twin.instance_collection = "COLLECTION", bpy.data.collections["Groom"]
    twin.location.x = 0.25
    (before,) = yield from view_pictures("instance-before")
    assert note(hair()) == ""
    scene.collection.objects.link(twin)
    (after,) = yield from view_pictures("instance")
    assert changed_fraction(before, after) > MIN_HAIR_FRACTION, "Blender does not draw the instance"
    assert "not in the preview" in note(hair())
    bpy.data.objects.remove(twin)
    assert note(hair()) == ""


driver.play_session(steps())
