"""Growing stays editable: hair follows a slider of the panel Grow while it is dragged; Ctrl-Z
restores both; combed hair stays until Grow Again is pressed; a vertex group is chosen from a list.
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
    click,
    find_field,
    hide_floor,
    look_from_front,
    new_head,
    open_our_sidebar,
    press,
    still_pixels,
    viewport,
    wait_for_hair,
)
from dice import press as press_in_view
from driver import hairloom_module, wait_until
from open_panels import SIDEBAR, only_our_panels, show_panels

log = traces.Log()
STRANDS, LENGTH = 600, 0.15
#: [pixels] from one row of a panel to the next
ROW = 20


def steps():
    yield from press("ESC")
    driver.enable_extension()
    only_our_panels()
    yield from groom()
    yield from drag_a_slider()
    yield from undo()
    yield from combed_hair_stays()
    yield from a_group_from_a_list()
    assert "Traceback" not in log.new_output(), "something has raised"


def hair():
    return next(obj for obj in bpy.context.scene.objects if obj.type == "CURVES")


def points():
    return hairloom_module("curves").curve_points(hair().data)


def groom():
    show_panels([SIDEBAR + "_grow"])
    yield from open_our_sidebar()
    head = new_head()
    top = head.vertex_groups.new(name="Top")
    top.add([v.index for v in head.data.vertices if v.co.z > 0.06], 1.0, "REPLACE")
    hide_floor()
    look_from_front(0.9)
    bpy.ops.hairloom.add_groom(strand_count=STRANDS, length=LENGTH, plays=False)
    bpy.ops.ed.undo_push(message="hair")
    yield from wait_for_hair()
    yield


def drag_a_slider():
    """The hair gets shorter while the button is down, as curves and in the preview."""
    long = yield from still_pixels("long")
    (session,) = hairloom_module("previews").sessions()
    before = session.rig.strands
    window, (x, y) = bpy.context.window, (yield from find_field(viewport(), "UI", "grow.length"))
    window.event_simulate("LEFTMOUSE", "PRESS", x=x, y=y)
    yield 1
    seen = set()
    for along in range(4, 64, 4):
        window.event_simulate("MOUSEMOVE", "NOTHING", x=x - along, y=y)
        yield 1
        seen.add(round(float(np.ptp(points()[:, 2])), 3))
    assert len(seen) > 3, f"the curves do not follow the slider: {seen}"
    window.event_simulate("LEFTMOUSE", "RELEASE", x=x - 64, y=y)
    yield 1
    own = hair().data.hairloom.grow
    assert own.length < 0.8 * LENGTH, f"the slider was not dragged: {own.length}"
    yield from wait_until(lambda: session.rig.strands is not before, "the preview does not follow")
    short = yield from still_pixels("short")
    assert changed_fraction(long, short) > 0.02, "the picture stands still"


def undo():
    shape = points()
    yield from press_in_view("Z", ctrl=True)
    yield from wait_until(lambda: hair().data.hairloom.grow.length > 0.95 * LENGTH, "no undo")
    assert np.abs(points() - shape).max() > 0.01, "the hair is not undone"
    growing = hairloom_module("growing")
    assert growing.lost_by_regrowing(hair().data) == () and not growing.is_outdated(hair().data)
    yield


def combed_hair_stays():
    growing = hairloom_module("growing")
    shape = points() * np.float32(1.02)
    hairloom_module("curves").set_points(hair().data, shape)
    bpy.ops.ed.undo_push(message="comb")
    hair().data.hairloom.grow.length = 0.5 * LENGTH
    yield
    driver.screenshot("combed")
    assert np.array_equal(points(), shape), "what was combed is lost"
    assert growing.lost_by_regrowing(hair().data) == ("combed shape",)
    x, y = yield from find_field(viewport(), "UI", "grow.method")
    yield from click(x, y + ROW)  # Grow Again is above it
    yield from wait_until(
        lambda: growing.lost_by_regrowing(hair().data) == (), "Grow Again does nothing"
    )
    yield
    driver.screenshot("grown-again")


def a_group_from_a_list():
    """A click opens the list; arrow key and Return choose its only entry."""
    x, y = yield from find_field(viewport(), "UI", "grow.density_group")
    yield from click(x, y)
    yield
    driver.screenshot("list")
    for key in ("DOWN_ARROW", "RET"):
        yield from press(key)
    own = hair().data.hairloom.grow
    yield from wait_until(lambda: own.density_group == "Top", f"'{own.density_group}' is chosen")
    roots = points().reshape(STRANDS, -1, 3)[:, 0]
    assert roots[:, 2].min() > 0.03, "it does not grow by the group"
    yield
    driver.screenshot("by-group")


driver.play_session(steps())
