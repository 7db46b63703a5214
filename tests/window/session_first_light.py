"""An artist's first minutes: enable, preview, play, stop, change, undo, save, reload, disable."""

import os
import sys
from pathlib import Path

import addon_utils
import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    changed_fraction,
    click,
    hide_floor,
    look_from_front,
    new_head,
    open_our_sidebar,
    pixels,
    press,
    redrawn_pixels,
    sidebar_button,
    still_pixels,
    viewport,
    viewport_middle,
    viewport_pixels,
    wait_for_hair,
)
from driver import hairloom_module, wait_until

STRANDS = 1500
RED = (0.8, 0.05, 0.05)
DISTANCE = 0.9  # [m], of the eye
FILE = str(Path(bpy.app.tempdir) / "first_light.blend")


def live():
    return hairloom_module("previews")


def overlay():
    return hairloom_module("overlay")


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    yield from set_the_scene()
    for shading in ("SOLID", "MATERIAL"):
        yield from preview(shading)
    viewport().spaces.active.shading.type = "SOLID"
    yield from sliders_act_at_once()
    yield from play_and_stop()
    yield from undo()
    yield from save_and_reload()
    yield from disable()


def set_the_scene():
    """A head with hair in the middle of the viewport, and the sidebar at our tab."""
    new_head(keeps_light=True)
    bpy.ops.object.shade_smooth()
    assert bpy.ops.hairloom.grow(strand_count=STRANDS, length=0.12) == {"FINISHED"}
    bpy.context.object.name = "Hair"
    bpy.context.object.data.hairloom.children.method = "none"  # only its own strands
    hide_floor()
    look_from_front(DISTANCE)
    yield from open_our_sidebar()


def preview(shading):
    """The sidebar's button draws the strands; a second click restores the view."""
    viewport().spaces.active.shading.type = shading
    yield from wait_for_the_head()
    off = yield from still_pixels(f"{shading.lower()}-off")
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_until(live().sessions, "the Preview button did nothing")
    name = f"{shading.lower()}-preview"
    yield from wait_until(
        lambda: changed_fraction(off, pixels(name)) > 0.02, f"{shading}: the strands do not show"
    )
    on = pixels(name)
    assert overlay().failure() == ""
    yield from depth_is_tested(shading)
    if shading == "SOLID":
        yield from click(*sidebar_button("hairloom.preview"))
        yield from wait_until(lambda: not live().sessions(), "the Preview button does not end it")
        again = yield from still_pixels("solid-off-again")
        left, shown = changed_fraction(off, again), changed_fraction(off, on)
        assert left < 0.1 * shown, f"something stays after the preview: {left} of {shown}"


def wait_for_the_head():
    """Wait until the head stays in the middle of the view: EEVEE compiles its shaders first, and
    shows the last picture meanwhile."""
    yield

    def is_seen():
        screen = driver.screenshot("waiting")
        background = np.median(viewport_pixels(screen)[-20:, :20], axis=(0, 1))
        return np.abs(np.median(viewport_middle(screen), axis=(0, 1)) - background).max() > 0.1

    yield from wait_until(is_seen, "the head never shows")
    yield from still_pixels("waiting")
    yield from wait_until(is_seen, "the head does not stay")


def depth_is_tested(shading):
    """A plate before the head hides the hair; a plate behind it does not."""
    bpy.ops.mesh.primitive_cube_add(size=0.15, location=(0.0, -0.4, 0.09))
    plate = bpy.context.object
    plate.scale.y = 0.01
    look_at_hair_from_above()
    before = f"{shading}: hair shines through a plate before it"
    yield from wait_until(lambda: roughness(f"{shading.lower()}-plate-before") < 0.02, before)
    plate.location.y = 0.4
    behind = f"{shading}: a plate behind hides the hair"
    yield from wait_until(lambda: roughness(f"{shading.lower()}-plate-behind") > 0.05, behind)
    bpy.data.objects.remove(plate)
    look_from_front(DISTANCE)
    select_hair()
    yield


def roughness(name):
    """The largest standard deviation of channels in the middle of the view."""
    return viewport_middle(driver.screenshot(name)).std(axis=(0, 1)).max()


def look_at_hair_from_above():
    """Centre the view on the hair over the forehead."""
    look_from_front(DISTANCE)
    viewport().spaces.active.region_3d.view_location = (0.0, 0.0, 0.09)


def select_hair():
    hair = bpy.data.objects["Hair"]
    hair.select_set(True)
    bpy.context.view_layer.objects.active = hair


def sliders_act_at_once():
    yield from wait_for_the_head()
    before = pixels("slider-before")
    bpy.data.objects["Hair"].data.hairloom.shading.base_color = RED
    yield from wait_until(
        lambda: changed_fraction(before, pixels("slider-after")) > 0.02, "the hair does not change"
    )
    after = pixels("slider-after")
    red = (after - before)[..., 0].mean()
    assert red > abs((after - before)[..., 2].mean()), "the hair did not turn red"


def play_and_stop():
    """Play with the button, move the head meanwhile, stop with Esc."""
    head = bpy.data.objects["Head"]
    at_rest = live().sessions()[0].strands
    before = yield from still_pixels("play-before")
    yield from click(*sidebar_button("hairloom.play"))
    yield from wait_until(lambda: live().sessions()[0].is_playing, "the Play button did nothing")
    lags = [0.0]

    def lag():
        carried = at_rest + np.array([head.location.x, 0.0, 0.0])
        session = live().sessions()[0]
        tips = session.rig.strands.offsets[1:] - 1
        lags.append(float((carried - session.strands)[tips, 0].mean()))
        return lags[-1]

    head.location.x = 0.06
    yield from wait_until(lambda: lag() > 0.001, "the tips do not lag behind")
    yield from wait_until(lambda: lag() < 0.5 * max(lags), "the tips do not come after")
    head.location.x = 0.08
    moving = yield from redrawn_pixels("play-moving")
    head.location.x = 0.0
    yield
    yield from press("ESC")
    yield from wait_until(lambda: not live().is_playing(), "ESC does not end Play")
    stopped = yield from still_pixels("play-stopped")
    strands = live().sessions()[0].strands
    assert np.abs(strands - at_rest).max() < 1e-5, "ESC did not restore the style"
    left = changed_fraction(before, stopped)
    assert left < 0.1 * changed_fraction(before, moving), "the picture is not the one before"


def undo():
    """A move of the head is undone and redone; our buttons add no undo steps."""
    at_rest = live().sessions()[0].strands
    bpy.ops.ed.undo_push(message="before the move")
    bpy.data.objects["Head"].location.z = 0.05
    bpy.ops.ed.undo_push(message="the move")
    yield
    moved = live().sessions()[0].strands
    assert np.abs(moved - at_rest - np.float32([0, 0, 0.05])).max() < 1e-5
    bpy.ops.ed.undo()
    yield
    assert np.abs(live().sessions()[0].strands - at_rest).max() < 1e-5
    bpy.ops.ed.redo()
    yield
    assert np.abs(live().sessions()[0].strands - moved).max() < 1e-5
    bpy.ops.ed.undo()
    yield
    driver.screenshot("undone")


def save_and_reload():
    """Loading a file during Play: sessions end, settings stay, and Preview works again."""
    yield from click(*sidebar_button("hairloom.play"))
    yield from wait_until(live().is_playing, "the Play button did nothing")
    bpy.ops.wm.save_as_mainfile(filepath=FILE)
    yield
    assert live().is_playing(), "saving stopped it"
    bpy.ops.wm.open_mainfile(filepath=FILE)
    yield
    assert live().sessions() == ()
    hair = bpy.data.objects["Hair"]
    assert np.allclose(hair.data.hairloom.shading.base_color, RED)
    assert hair.display_type == "TEXTURED"
    off = yield from redrawn_pixels("reloaded-off")
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_for_hair()
    on = yield from redrawn_pixels("reloaded-preview")
    assert changed_fraction(off, on) > 0.02


def disable():
    """Disabling during Play leaves nothing that draws, ticks or raises."""
    yield from click(*sidebar_button("hairloom.play"))
    yield from wait_until(live().is_playing, "the Play button did nothing")
    on = yield from redrawn_pixels("before-disabling")
    addon_utils.disable(driver.EXTENSION, default_set=True)
    off = yield from redrawn_pixels("disabled")
    assert not hasattr(bpy.types.Curves, "hairloom")
    assert changed_fraction(on, off) > 0.02
    driver.enable_extension()
    yield
    addon_utils.disable(driver.EXTENSION, default_set=True)
    yield
    os.remove(FILE)


driver.play_session(steps(), anti_aliasing=True)
