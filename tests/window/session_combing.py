"""Combing under the preview: in Sculpt Mode the brush is dragged over a head of hair, and the whole
style follows, with guides as thin lines instead of Blender's thick curves; Ctrl-Z restores it. And
painting: in Vertex Paint hair gets the colour of its head.
"""

import sys
import time
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from artist import (
    changed_fraction,
    click,
    hide_floor,
    look_from_front,
    new_head,
    open_our_sidebar,
    pixels,
    press,
    region,
    sidebar_button,
    wait_for_hair,
)
from dice import press as press_in_view
from dice import select
from driver import hairloom_module, wait_until
from open_panels import SIDEBAR, only_our_panels, show_panels

log = traces.Log()
GUIDES, CHILDREN, LENGTH = 300, 20_000, 0.15


def steps():
    yield from press("ESC")
    driver.enable_extension()
    only_our_panels()
    hair = yield from groom()
    yield from sculpt(hair)
    yield from comb(hair)
    yield from undo(hair)
    yield from paint(session().hair.resolve())  # which Ctrl-Z has replaced
    assert "Traceback" not in log.new_output(), "something has raised"


def groom():
    show_panels([SIDEBAR])
    yield from open_our_sidebar()
    new_head()
    hide_floor()
    look_from_front(0.9)
    bpy.ops.hairloom.grow(strand_count=GUIDES, length=LENGTH)
    hair = bpy.context.object
    children = hair.data.hairloom.children
    children.method, children.strand_count = "multi", CHILDREN
    bpy.ops.ed.undo_push(message="hair")
    select(hair)
    yield
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_for_hair()
    yield
    return hair


def session():
    (one,) = hairloom_module("previews").sessions()
    return one


def evaluated(hair):
    return hair.evaluated_get(bpy.context.evaluated_depsgraph_get())


def sculpt(hair):
    """Blender's curves stay hidden, and ours are drawn as lines."""
    before = pixels("before_sculpting")
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    yield
    assert hair.mode == "SCULPT_CURVES"
    yield from wait_until(
        lambda: evaluated(hair).display_type == "WIRE", "Blender's curves are shown"
    )
    drawing = hairloom_module("overlay").drawing_of(session().uid)
    (lines,) = drawing.lines
    assert 0 < len(lines.seen_from(np.array([0.0, -9.0, 0.0, 1.0])).points) < len(lines.points)
    assert len(lines.points) == 2 * len(session().rig.guides) * (
        session().rig.guide_grid.shape[1] - 1
    )
    yield
    shot = pixels("sculpting")
    moved = changed_fraction(before, shot, 0.4)
    assert moved < 0.05, f"{100 * moved:.1f} % of the picture is other than hair"


def comb(hair):
    """The mouse drags the brush across the hair, which follows while the button is down."""
    window, (x, y) = bpy.context.window, in_front()
    before, shot, offsets = session().strands, pixels("uncombed"), session().rig.strands.offsets
    window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
    yield 1
    window.event_simulate("LEFTMOUSE", "PRESS", x=x, y=y)
    yield 1
    for along in range(10, 81, 10):
        window.event_simulate("MOUSEMOVE", "NOTHING", x=x + along, y=y)
        yield 1
    during = session().strands
    own = offsets[session().rig.own_count]
    moved = np.abs(during - before).max(axis=1)
    assert moved[:own].max() > 0.005, "the brush combs nothing"
    assert moved[own:].max() > 0.005, "children do not follow while the button is down"
    assert (moved == 0.0).mean() > 0.2, "what the brush did not touch has moved"
    window.event_simulate("LEFTMOUSE", "RELEASE", x=x + 80, y=y)
    yield 1
    assert (yield from settled()) is not None
    yield
    follows = changed_fraction(shot, pixels("combed"))
    assert follows > 0.002, f"the picture stands still: {follows:.4f} of it has changed"


def in_front():
    """The place in the window of the middle of the guide nearest to the eye."""
    view, grid = region("WINDOW"), session().rig.guide_grid
    point = grid[grid[:, -1, 1].argmin(), grid.shape[1] // 2]
    place = location_3d_to_region_2d(view, view.data, point)
    return int(view.x + place.x), int(view.y + place.y)


def settled():
    """Wait for the final rest hair; returns how long that took [s]."""
    began = time.monotonic()
    yield from wait_until(
        lambda: not (session().is_stale or session().is_pending), "the rest does not come"
    )
    took = time.monotonic() - began
    print(f"the rest came after {took:.2f} s")
    return took


def undo(hair):
    combed = session().rig.guide_grid
    yield from press_in_view("Z", ctrl=True)
    yield from wait_until(
        lambda: np.abs(session().rig.guide_grid - combed).max() > 0.005, "Ctrl-Z is not followed"
    )
    yield from settled()
    yield
    driver.screenshot("undone")
    bpy.ops.object.mode_set(mode="OBJECT")
    yield
    assert not hairloom_module("overlay").drawing_of(session().uid).lines


def paint(hair):
    """The brush is dragged over the head: strands there get its colour within half a second, while
    the button is down."""
    head, window = hair.parent, bpy.context.window
    colors = head.data.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
    colors.data.foreach_set("color", np.tile(np.float32([0.2, 0.9, 0.2, 1.0]), len(colors.data)))
    hair.data.hairloom.shading.color_map = "Paint"
    yield from settled()
    assert np.ptp(drawn_colors(), axis=0).max() == 0.0, "green all over"
    select(head)
    bpy.ops.object.mode_set(mode="VERTEX_PAINT")
    yield
    shot, (x, y) = pixels("unpainted"), in_front()
    window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
    yield 1
    window.event_simulate("LEFTMOUSE", "PRESS", x=x, y=y)
    began = time.monotonic()
    for along in range(10, 81, 10):
        window.event_simulate("MOUSEMOVE", "NOTHING", x=x + along, y=y)
        yield 1
        if np.ptp(drawn_colors(), axis=0).max() > 0.0:
            break
    took = time.monotonic() - began
    print(f"strands had the colour of the brush after {took:.2f} s, {along} pixels along")
    assert np.ptp(drawn_colors(), axis=0).max() > 0.0, "hair does not follow the brush"
    window.event_simulate("LEFTMOUSE", "RELEASE", x=x + 80, y=y)
    yield 1
    yield from settled()
    yield
    follows = changed_fraction(shot, pixels("painted"))
    assert follows > 0.0005, f"the picture stands still: {follows:.5f} of it has changed"
    bpy.ops.object.mode_set(mode="OBJECT")
    yield


def drawn_colors():
    """The drawn colours of all points."""
    return hairloom_module("overlay").drawing_of(session().uid).snapshot.color


driver.play_session(steps())
