"""Selected hair under the preview: no box, none of Blender's strands, and the orange outline that
Blender draws around its own hair; alike in Solid, X-Ray and Wireframe.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from artist import (
    changed_fraction,
    hide_floor,
    look_from_front,
    new_head,
    press,
    still_pixels,
    viewport,
    wait_for_hair,
)
from driver import hairloom_module

log = traces.Log()


def steps():
    yield from press("ESC")
    driver.enable_extension()
    yield from groom()
    yield from selection_is_shown()
    yield from nothing_is_left_without_selection()
    assert "Traceback" not in log.new_output(), "something has raised"


def groom():
    new_head()
    hide_floor()
    look_from_front(0.9)
    bpy.ops.hairloom.grow(strand_count=800, length=0.15)
    hair = bpy.context.object
    hair.name = "Hair"
    hair.data.hairloom.children.method = "none"
    bpy.ops.hairloom.preview()
    yield from wait_for_hair()
    yield


def choose(is_chosen):
    hair = bpy.data.objects["Hair"]
    hair.select_set(is_chosen)
    bpy.context.view_layer.objects.active = hair if is_chosen else None


def outline(label):
    """A mask of the orange outline of the selection."""
    choose(True)
    selected = yield from still_pixels(f"{label}-selected")
    choose(False)
    alone = yield from still_pixels(f"{label}-unselected")
    return is_orange(selected) & ~is_orange(alone)


def is_orange(picture):
    red, green, blue = np.moveaxis(picture, 2, 0)
    return (red > 0.75) & (green > 0.2) & (green < 0.75) & (blue < 0.3)


def selection_is_shown():
    ours = yield from outline("ours")
    hairloom_module("previews").stop_all()
    blenders = yield from outline("blenders")
    assert ours.sum() > 500, f"selection is not seen: {ours.sum()} pixels"
    beside = (ours & ~near(blenders)).sum()
    assert beside < 0.02 * ours.sum(), f"{beside} pixels are beside Blender's outline, as a box is"
    choose(True)
    bpy.ops.hairloom.preview()
    yield from wait_for_hair()
    yield


def near(mask, reach=2):
    """The mask, grown by this many pixels."""
    found = mask.copy()
    for axis in (0, 1):
        for step in range(1, reach + 1):
            found |= np.roll(mask, step, axis) | np.roll(mask, -step, axis)
    return found


def nothing_is_left_without_selection():
    """Without our strands, the view equals that of hidden hair, without strands or lines of
    Blender's."""
    hair, space = bpy.data.objects["Hair"], viewport().spaces.active
    drawn = hairloom_module("overlay")._overlay.drawn
    kept = dict(drawn)
    for kind, is_xray in (("SOLID", False), ("SOLID", True), ("WIREFRAME", True)):
        space.shading.type, label = kind, f"{kind.lower()}-{is_xray}"
        setattr(space.shading, "show_xray" if kind == "SOLID" else "show_xray_wireframe", is_xray)
        choose(False)
        shown = yield from still_pixels(f"{label}-shown")
        drawn.clear()
        empty = yield from still_pixels(f"{label}-empty")
        hair.hide_set(True)
        hidden = yield from still_pixels(f"{label}-hidden")
        hair.hide_set(False)
        drawn.update(kept)
        yield
        assert changed_fraction(shown, empty) > 0.01, "our strands are not drawn"
        left = changed_fraction(empty, hidden)
        assert left < 1e-4, f"{kind}, X-Ray {is_xray}: Blender draws {left:.4f} of the view"


driver.play_session(steps())
