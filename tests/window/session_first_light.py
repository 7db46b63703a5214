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
    changed,
    click,
    hair_is_made,
    hide_floor,
    look_from_front,
    new_head,
    open_our_sidebar,
    pixels,
    press,
    sidebar_button,
    until,
    viewport,
    viewport_middle,
    viewport_pixels,
)
from driver import of_hairloom

STRANDS = 1500
RED = (0.8, 0.05, 0.05)
DISTANCE = 0.9  # of the eye [m]
FILE = str(Path(bpy.app.tempdir) / "first_light.blend")


def live():
    return of_hairloom("blender.preview.live")


def overlay():
    return of_hairloom("blender.viewport.overlay")


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
    """A head with hair in the middle of the viewport, the sidebar open at our tab."""
    new_head(keeps_light=True)
    bpy.ops.object.shade_smooth()
    assert bpy.ops.hairloom.grow(strand_count=STRANDS, length=0.12) == {"FINISHED"}
    bpy.context.object.name = "Hair"
    hide_floor()
    look_from_front(DISTANCE)
    yield from open_our_sidebar()


def preview(shading):
    """The button in the sidebar draws the strands; once more, and all is as before."""
    viewport().spaces.active.shading.type = shading
    yield from wait_for_the_head()
    off = pixels(f"{shading.lower()}-off")
    yield from click(*sidebar_button("hairloom.preview"))
    yield 10
    assert len(live().sessions()) == 1, "the Preview button did nothing"
    name = f"{shading.lower()}-preview"
    yield from until(
        lambda: changed(off, pixels(name)) > 0.02, f"{shading}: the strands do not show"
    )
    on = pixels(name)
    assert overlay().failure() == ""
    yield from depth_is_tested(shading)
    if shading == "SOLID":
        yield from click(*sidebar_button("hairloom.preview"))
        yield 15  # until Blender's own anti-aliasing has settled
        assert live().sessions() == ()
        left, shown = changed(off, pixels("solid-off-again")), changed(off, on)
        assert left < 0.1 * shown, f"something stays after the preview: {left} of {shown}"


def wait_for_the_head():
    """Until it stays in the middle of the view: EEVEE compiles its shaders first, and goes on
    showing the last picture for a while."""
    seen = 0
    for _ in range(80):
        yield 10
        picture = driver.screenshot("waiting")
        background = np.median(viewport_pixels(picture)[-20:, :20], axis=(0, 1))
        middle = np.median(viewport_middle(picture), axis=(0, 1))
        picture.unlink()
        seen = seen + 1 if np.abs(middle - background).max() > 0.1 else 0
        if seen == 4:
            return
    raise AssertionError("the head never shows")


def depth_is_tested(shading):
    """A plate before the head hides the hair; behind it, it does not."""
    bpy.ops.mesh.primitive_cube_add(size=0.15, location=(0.0, -0.4, 0.09))
    plate = bpy.context.object
    plate.scale.y = 0.01
    look_at_hair_from_above()
    before = yield from roughness(f"{shading.lower()}-plate-before", lambda found: found < 0.02)
    plate.location.y = 0.4
    behind = yield from roughness(f"{shading.lower()}-plate-behind", lambda found: found > 0.05)
    bpy.data.objects.remove(plate)
    look_from_front(DISTANCE)
    select_hair()
    yield 5
    assert before < 0.02, f"hair shines through a plate before it: {before}"
    assert behind > 0.05, f"a plate behind hides the hair: {behind}"


def roughness(name, is_expected):
    """How much the middle of the view varies, once it is as expected; a busy machine draws late."""
    for _ in range(8):
        yield 5
        found = viewport_middle(driver.screenshot(name)).std(axis=(0, 1)).max()
        if is_expected(found):
            break
    return found


def look_at_hair_from_above():
    """The middle of the view on the hair over the forehead."""
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
    yield from until(
        lambda: changed(before, pixels("slider-after")) > 0.02, "the hair does not change"
    )
    after = pixels("slider-after")
    red = (after - before)[..., 0].mean()
    assert red > abs((after - before)[..., 2].mean()), "the hair did not turn red"


def play_and_stop():
    """Play by the button, move the head meanwhile, stop by ESC."""
    head = bpy.data.objects["Head"]
    at_rest = live().sessions()[0].strands
    before = pixels("play-before")
    yield from click(*sidebar_button("hairloom.play"))
    yield 40  # the collider is made
    assert live().is_playing(), "the Play button did nothing"
    offsets = []
    for frame in range(20):
        head.location.x = 0.06 if frame < 10 else 0.08
        yield 1
        strands = live().sessions()[0].strands
        carried = at_rest + np.array([head.location.x, 0.0, 0.0])
        offsets.append(float((strands - carried)[:, -1, 0].mean()))
    moving = pixels("play-moving")
    assert min(offsets) < -0.001, f"the tips do not lag behind: {offsets}"
    assert abs(offsets[9]) < abs(min(offsets)), f"the tips do not come after: {offsets}"
    head.location.x = 0.0
    yield 2
    yield from press("ESC")
    yield 15
    assert not live().is_playing()
    strands = live().sessions()[0].strands
    assert np.abs(strands - at_rest).max() < 1e-5, "ESC did not restore the style"
    left = changed(before, pixels("play-stopped"))
    assert left < 0.1 * changed(before, moving), "the picture is not the one before"


def undo():
    """A moved head, undone and redone; our buttons are no undo steps of their own."""
    at_rest = live().sessions()[0].strands
    bpy.ops.ed.undo_push(message="before the move")
    bpy.data.objects["Head"].location.z = 0.05
    bpy.ops.ed.undo_push(message="the move")
    yield 5
    moved = live().sessions()[0].strands
    assert np.abs(moved - at_rest - np.float32([0, 0, 0.05])).max() < 1e-5
    bpy.ops.ed.undo()
    yield 10
    assert np.abs(live().sessions()[0].strands - at_rest).max() < 1e-5
    bpy.ops.ed.redo()
    yield 10
    assert np.abs(live().sessions()[0].strands - moved).max() < 1e-5
    bpy.ops.ed.undo()
    yield 10
    driver.screenshot("undone")


def save_and_reload():
    """Loading in the middle of Play: sessions go, settings stay, and preview works again."""
    yield from click(*sidebar_button("hairloom.play"))
    yield 15
    assert live().is_playing()
    bpy.ops.wm.save_as_mainfile(filepath=FILE)
    yield 5
    assert live().is_playing(), "saving stopped it"
    bpy.ops.wm.open_mainfile(filepath=FILE)
    yield 10
    assert live().sessions() == ()
    hair = bpy.data.objects["Hair"]
    assert np.allclose(hair.data.hairloom.shading.base_color, RED)
    assert hair.display_type == "TEXTURED"
    off = pixels("reloaded-off")
    yield from click(*sidebar_button("hairloom.preview"))
    yield from hair_is_made()
    yield 10
    assert changed(off, pixels("reloaded-preview")) > 0.02


def disable():
    """Disabling in the middle of Play leaves nothing that draws, ticks or raises."""
    yield from click(*sidebar_button("hairloom.play"))
    yield 15
    assert live().is_playing()
    on = pixels("before-disabling")
    addon_utils.disable(driver.EXTENSION, default_set=True)
    yield 10
    assert not hasattr(bpy.types.Curves, "hairloom")
    off = pixels("disabled")
    assert changed(on, off) > 0.02
    driver.enable_extension()
    yield 5
    addon_utils.disable(driver.EXTENSION, default_set=True)
    yield 5
    os.remove(FILE)


driver.play(steps())
