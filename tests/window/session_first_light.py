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
    click,
    look_from_front,
    open_our_sidebar,
    press,
    sidebar_button,
    viewport,
    viewport_pixels,
)

STRANDS = 1500
FILE = str(Path(bpy.app.tempdir) / "first_light.blend")


def live():
    return sys.modules[f"{driver.EXTENSION}.addon.host.live"]


def overlay():
    return sys.modules[f"{driver.EXTENSION}.addon.host.overlay"]


def pixels(label):
    """What the viewport shows, (height, width, 3) in 0 to 1."""
    return viewport_pixels(driver.screenshot(label))


def changed(before, after, at_least=8.0 / 255.0):
    """Share of the viewport's pixels that differ visibly."""
    return float((np.abs(after - before).max(axis=2) > at_least).mean())


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    yield from set_the_scene()
    for shading in ("SOLID", "MATERIAL"):
        yield from preview(shading)
    yield from sliders_act_at_once()
    yield from play_and_stop()
    yield from undo()
    yield from save_and_reload()
    yield from disable()


def set_the_scene():
    """A head with hair in the middle of the viewport, the sidebar open at our tab."""
    for obj in list(bpy.data.objects):
        if obj.type == "MESH":
            bpy.data.objects.remove(obj)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)
    bpy.context.object.name = "Head"
    bpy.ops.object.shade_smooth()
    assert bpy.ops.hairloom.grow(strand_count=STRANDS, length=0.12) == {"FINISHED"}
    bpy.context.object.name = "Hair"
    viewport().spaces.active.overlay.show_floor = False
    look_from_front(distance=0.9)
    yield from open_our_sidebar()


def preview(shading):
    """The button in the sidebar draws the strands; once more, and all is as before."""
    viewport().spaces.active.shading.type = shading
    yield 30 if shading == "MATERIAL" else 5  # EEVEE compiles its shaders
    off = pixels(f"{shading.lower()}-off")
    yield from click(*sidebar_button("hairloom.preview"))
    yield 10
    assert len(live().sessions()) == 1, "the Preview button did nothing"
    on = pixels(f"{shading.lower()}-preview")
    assert overlay().failure() == ""
    assert changed(off, on) > 0.02, f"{shading}: the strands do not show"
    yield from depth_is_tested(on, shading)
    if shading == "SOLID":
        yield from click(*sidebar_button("hairloom.preview"))
        yield 5
        assert live().sessions() == ()
        assert changed(off, pixels("solid-off-again")) < 0.002, "something stays after the preview"


def depth_is_tested(on, shading):
    """A plate before the head hides hair; behind it, it does not."""
    bpy.ops.mesh.primitive_cube_add(size=0.15, location=(0.0, -0.4, 0.0))
    plate = bpy.context.object
    plate.scale.y = 0.01
    yield 5
    before = pixels(f"{shading.lower()}-plate-before")
    plate.location.y = 0.4
    yield 5
    behind = pixels(f"{shading.lower()}-plate-behind")
    bpy.data.objects.remove(plate)
    bpy.context.view_layer.objects.active = bpy.data.objects["Hair"]
    bpy.data.objects["Hair"].select_set(True)
    yield 5
    height, width, _ = on.shape
    middle = np.s_[height // 2 - 20 : height // 2 + 20, width // 2 - 20 : width // 2 + 20]
    assert before[middle].std(axis=(0, 1)).max() < 0.02, "hair shines through a plate before it"
    assert behind[middle].std(axis=(0, 1)).max() > 0.02, "a plate behind hides the hair"


def sliders_act_at_once():
    before = pixels("slider-before")
    bpy.data.objects["Hair"].data.hairloom.shading.base_color = (0.8, 0.05, 0.05)
    yield 5
    after = pixels("slider-after")
    assert changed(before, after) > 0.02
    red = (after - before)[..., 0].mean()
    assert red > abs((after - before)[..., 2].mean()), "the hair did not turn red"


def play_and_stop():
    """Play by the button, move the head meanwhile, stop by ESC."""
    head = bpy.data.objects["Head"]
    at_rest = live().sessions()[0].snapshot.strands
    before = pixels("play-before")
    yield from click(*sidebar_button("hairloom.play"))
    yield 40  # the collider is made
    assert live().is_playing(), "the Play button did nothing"
    offsets = []
    for frame in range(20):
        head.location.x = 0.004 * (frame + 1)
        yield 1
        strands = live().sessions()[0].snapshot.strands
        carried = at_rest + np.array([head.location.x, 0.0, 0.0])
        offsets.append(float((strands - carried)[:, -1, 0].mean()))
    driver.screenshot("play-moving")
    assert min(offsets) < -0.001, f"the tips do not lag behind: {offsets}"
    head.location.x = 0.0
    yield 2
    yield from press("ESC")
    yield 5
    assert not live().is_playing()
    strands = live().sessions()[0].snapshot.strands
    assert np.abs(strands - at_rest).max() < 1e-5, "ESC did not restore the style"
    assert changed(before, pixels("play-stopped")) < 0.002, "the picture is not the one before"


def undo():
    """A moved head, undone and redone; our buttons are no undo steps of their own."""
    at_rest = live().sessions()[0].snapshot.strands
    bpy.ops.ed.undo_push(message="before the move")
    bpy.data.objects["Head"].location.z = 0.05
    bpy.ops.ed.undo_push(message="the move")
    yield 5
    moved = live().sessions()[0].snapshot.strands
    assert np.abs(moved - at_rest - np.float32([0, 0, 0.05])).max() < 1e-5
    bpy.ops.ed.undo()
    yield 10
    assert np.abs(live().sessions()[0].snapshot.strands - at_rest).max() < 1e-5
    bpy.ops.ed.redo()
    yield 10
    assert np.abs(live().sessions()[0].snapshot.strands - moved).max() < 1e-5
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
    assert hair.data.hairloom.shading.base_color[:] == np.float32([0.8, 0.05, 0.05]).tolist()
    assert hair.display_type == "TEXTURED"
    off = pixels("reloaded-off")
    yield from click(*sidebar_button("hairloom.preview"))
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
