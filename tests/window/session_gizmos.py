"""Handles in the 3D view, dragged with the mouse: the wind's speed and direction, and the size of a
colliding ball; each drag is one undo step, and no handle is shown in modes with brushes.
"""

import math
import sys
from pathlib import Path

import bpy
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Euler, Vector

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from artist import (
    hide_floor,
    look_from_front,
    new_head,
    press,
    redrawn_pixels,
    region,
    viewport,
    wait_for_hair,
)
from dice import press as press_in_view
from dice import select
from driver import hairloom_module

log = traces.Log()
STRANDS, LENGTH = 300, 0.1
#: speed of the wind [m/s], and the distance by which a handle is dragged [pixels]
SPEED, DRAGGED = 6.0, 90
#: radius of the ball [m]
RADIUS = 0.05


def steps():
    yield from press("ESC")
    driver.enable_extension()
    yield from groom()
    yield from the_winds_direction()
    yield from the_winds_speed()
    yield from a_balls_size()
    yield from not_under_a_brush()
    assert "Traceback" not in log.new_output(), "something has raised"


def groom():
    new_head()
    hide_floor()
    look_from_front(0.9)
    view = viewport().spaces.active.region_3d
    view.view_rotation = Euler((math.radians(60.0), 0.0, 0.0)).to_quaternion()
    bpy.ops.hairloom.grow(strand_count=STRANDS, length=LENGTH)
    hair = bpy.context.object
    hair.data.hairloom.children.method = "none"
    hair.hairloom.dynamics.wind_speed = SPEED
    bpy.ops.hairloom.preview()
    yield from wait_for_hair()
    hair.hairloom.shown_overlays = {"wind"}
    bpy.ops.ed.undo_push(message="hair")
    yield
    driver.screenshot("wind")


def groom_in_scene():
    """The groom's object, looked up again, since undo recreates all objects."""
    return next(obj for obj in bpy.data.objects if obj.type == "CURVES")


def wind():
    return groom_in_scene().hairloom.dynamics


def ball():
    """The middle of the hair, and its radius [m]."""
    (session,) = hairloom_module("previews").sessions()
    return Vector(session.snapshot.root_center.tolist()), session.rig.radius


def on_screen(place):
    """The pixel of the window that shows a place of the scene."""
    window = region("WINDOW")
    x, y = location_3d_to_region_2d(window, viewport().spaces.active.region_3d, place)
    return round(window.x + x), round(window.y + y)


def is_blue(pixels):
    """A mask of the overlay's lines and the handles of the wind."""
    return pixels[..., 2] - pixels[..., 0] > 0.3


def drag(label, start, end):
    """Drag with the left button, in several steps as a hand does."""
    window = bpy.context.window
    for x, y in [start] * 3:
        window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
        yield 1
        yield 1
    window.event_simulate("LEFTMOUSE", "PRESS", x=start[0], y=start[1])
    yield 1
    for part in range(1, 7):
        x, y = (round(a + (b - a) * part / 6) for a, b in zip(start, end, strict=True))
        window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
        yield 1
    yield
    driver.screenshot(label)
    window.event_simulate("LEFTMOUSE", "RELEASE", x=end[0], y=end[1])
    yield 1
    yield


def the_winds_speed():
    """Dragged by the arrow's head, which stays under the mouse."""
    center, radius = ball()
    x, y = on_screen(center + Vector((2.0 * radius * SPEED / 10.0, 0.0, 0.0)))
    yield from drag("speed", (x, y), (x + DRAGGED, y))
    faster = wind().wind_speed
    assert faster > SPEED + 1.0, f"the arrow was dragged, and the wind has {faster} m/s"
    tip = on_screen(center + Vector((2.0 * radius * faster / 10.0, 0.0, 0.0)))
    assert abs(tip[0] - x - DRAGGED) < 5, f"the arrow ends at {tip}, the mouse is at {x + DRAGGED}"
    yield from press_in_view("Z", ctrl=True)
    yield
    assert abs(wind().wind_speed - SPEED) < 1e-5, f"Ctrl-Z leaves {wind().wind_speed} m/s"


def the_winds_direction():
    """Dragged by the ring around the hair, whose front follows the mouse."""
    center, _ = ball()
    pixels = bpy.context.preferences.view.gizmo_size * hairloom_module("gizmos").RING_SCALE
    aside = on_screen(center + Vector((0.01, 0.0, 0.0)))[0] - on_screen(center)[0]
    radius = 0.01 * pixels / aside
    angle = math.radians(-60.0)
    start = center + Vector((math.cos(angle), math.sin(angle), 0.0)) * radius
    end = center + Vector((math.cos(0.8 + angle), math.sin(0.8 + angle), 0.0)) * radius
    yield from drag("direction", on_screen(start), on_screen(end))
    turned = wind().wind_direction
    assert abs(turned - 0.8) < 0.05, f"the ring was turned by 0.8, the wind by {turned:.2f}"
    yield from press_in_view("Z", ctrl=True)
    yield
    assert wind().wind_direction == 0.0, "Ctrl-Z does not turn it back"


def a_balls_size():
    """Dragged by the box at its border, also for a scaled ball."""
    empty = bpy.data.objects.new("Ball", None)
    empty.empty_display_type, empty.empty_display_size = "SPHERE", RADIUS
    empty.location, empty.scale = (0.2, 0.0, 0.0), (2.0, 2.0, 2.0)
    colliders = bpy.data.collections.new("Colliders")
    bpy.context.scene.collection.children.link(colliders)
    colliders.objects.link(empty)
    groom_in_scene().hairloom.collider_collection = colliders
    select(empty)
    bpy.ops.ed.undo_push(message="ball")
    yield
    driver.screenshot("ball")
    edge = Vector((0.2 + 2.0 * RADIUS, 0.0, 0.0))
    x, y = on_screen(edge)
    yield from drag("size", (x, y), (x + DRAGGED, y))
    larger = bpy.data.objects["Ball"].empty_display_size
    edge = on_screen(Vector((0.2 + 2.0 * larger, 0.0, 0.0)))
    assert abs(edge[0] - x - DRAGGED) < 5, f"the ball ends at {edge}, the mouse is at {x + DRAGGED}"
    yield from press_in_view("Z", ctrl=True)
    yield
    assert abs(bpy.data.objects["Ball"].empty_display_size - RADIUS) < 1e-6


def not_under_a_brush():
    """In Sculpt Mode the arrow's head is neither shown nor draggable."""
    select(groom_in_scene())
    yield
    center, radius = ball()
    tip = on_screen(center + Vector((0.2 * radius * SPEED, 0.0, 0.0)))
    shown = yield from redrawn_pixels("shown")
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    hidden = yield from redrawn_pixels("sculpting")
    yield from drag("combed", tip, (tip[0] + DRAGGED, tip[1]))
    assert wind().wind_speed == SPEED, "it is dragged in Sculpt Mode"
    blue = [is_blue(each).sum() for each in (shown, hidden)]
    assert blue[0] > 1.5 * blue[1] > 0, f"blue pixels with and without handles: {blue}"


driver.play_session(steps())
