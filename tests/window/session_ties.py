"""A ponytail made as artists do: Add Hair Tie in the panel, Play, the ring moved by hand while hair
swings, deleted while hair plays, and restored by Ctrl-Z.
"""

import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

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
    pixels,
    press,
    sidebar_button,
    viewport,
    wait_for_hair,
)
from dice import press as press_in_view
from dice import select
from driver import hairloom_module, wait_until
from open_panels import OUR_PREFIX, SIDEBAR, only_our_panels, show_panels

log = traces.Log()
STRANDS, LENGTH = 400, 0.15
#: [pixels at UI scale 1] from the field of the ties' collection to the button below it
BELOW = 22
#: [pixels] by which the mouse drags the ring upwards, where hanging hair reaches it
DRAGGED = 30
#: [m] tolerance of the distance between held points and the ring's centre
SLACK = 0.004


def steps():
    yield from press("ESC")
    driver.enable_extension()
    only_our_panels()
    hair = yield from groom()
    ring = yield from add_a_tie(hair)
    yield from play()
    yield from move(ring)
    yield from delete(ring)
    yield from undo()
    assert "Traceback" not in log.new_output(), "something has raised"


def groom():
    show_panels([SIDEBAR])
    yield from open_our_sidebar()
    new_head()
    hide_floor()
    look_from_front(0.9)
    bpy.ops.hairloom.grow(strand_count=STRANDS, length=LENGTH)
    hair = bpy.context.object
    hair.data.hairloom.children.method = "none"
    hair.hairloom.dynamics.wind_speed = 2.0
    bpy.ops.ed.undo_push(message="hair")
    yield
    return hair


def add_a_tie(hair):
    """With the panel's button, at the 3D cursor, which is placed where hair passes."""
    cursor = bpy.context.scene.cursor
    cursor.location, along = thickest(hair)
    cursor.rotation_euler = Vector(along).to_track_quat("Y", "Z").to_euler()
    bpy.ops.ed.undo_push(message="cursor")
    show_panels([f"{OUR_PREFIX}sidebar_dynamics_ties"])
    yield
    x, y = yield from find_field(viewport(), "UI", "tie_collection")
    yield from click(x, int(y - BELOW * bpy.context.preferences.system.ui_scale))
    yield from wait_until(
        lambda: hair.hairloom.tie_collection is not None, "the button adds no tie"
    )
    (ring,) = hair.hairloom.tie_collection.objects
    assert ring.parent == bpy.data.objects["Head"] and ring.empty_display_type == "CIRCLE"
    yield
    driver.screenshot("added")
    return ring


def thickest(hair):
    """The place with the most strands, at two thirds of their length, and their direction there."""
    grid = np.array([point.position for point in hair.data.points])
    grid = grid.reshape(len(hair.data.curves), -1, 3)
    place = 2 * grid.shape[1] // 3
    points, along = grid[:, place], grid[:, place + 1] - grid[:, place - 1]
    near = np.linalg.norm(points[:, None] - points, axis=2) < 0.1 * LENGTH
    best = near.sum(axis=1).argmax()
    return points[near[best]].mean(axis=0), along[near[best]].mean(axis=0)


def live():
    return hairloom_module("previews")


def session():
    (one,) = live().sessions()
    return one


def holds():
    """The holds of the shown strands, or None."""
    found = session().rig.holds
    found = None if found is None else found.where(session().solver.pose.anchors)
    return None if found is None or not len(found.strand) else found


def held_points():
    """Points of all strands that the ring holds, (n, 3)."""
    found, offsets = holds(), session().rig.strands.offsets
    return session().strands[offsets[found.strand] + np.round(found.place).astype(int)]


def farthest(ring):
    """The largest distance of a held point from the ring's centre [m]."""
    middle = np.array(ring.matrix_world.translation)
    return np.linalg.norm(held_points() - middle, axis=1).max()


def play():
    show_panels([SIDEBAR])
    select(next(obj for obj in bpy.data.objects if obj.type == "CURVES"))
    yield
    for button in ("hairloom.preview", "hairloom.play"):
        yield from click(*sidebar_button(button))
        yield from wait_for_hair()
    yield from wait_until(live().is_playing, "it does not play")
    yield from moves()
    assert holds() is not None and len(holds().strand) > 5, "the ring holds nothing"
    tips = session().strands[session().rig.strands.offsets[1:] - 1]
    assert np.isfinite(tips).all()


def moves():
    before = session().strands
    yield from wait_until(
        lambda: np.abs(session().strands - before).max() > 1e-4, "nothing moves any more"
    )


def move(ring):
    """With G and the mouse while hair plays: the hair moves along in the ring."""
    at_rest, before, shot = farthest(ring), ring.matrix_world.translation.copy(), pixels("tied")
    select(ring)
    window, area = bpy.context.window, viewport()
    x, y = area.x + area.width // 2, area.y + area.height // 2
    yield from press_in_view("G")
    for along in range(10, DRAGGED + 1, 10):
        window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y + along)
        yield 1
    for value in ("PRESS", "RELEASE"):
        window.event_simulate("LEFTMOUSE", value, x=x, y=y + DRAGGED)
        yield 1
    way = (ring.matrix_world.translation - before).length
    assert way > 0.02, f"the mouse has moved the ring by {way:.3f} m"
    yield from wait_until(lambda: farthest(ring) < at_rest + SLACK, "the hair leaves the ring")
    assert live().is_playing(), "the drag has stopped it"
    moved = changed_fraction(shot, pixels("ring_moved"))
    assert moved > 0.005, f"the picture stands still: {moved:.4f} of it has changed"


def delete(ring):
    """With the Delete key: the hair is released and plays on, and a message names the ring."""
    name = ring.name
    before = held_points()
    select(ring)
    yield from press_in_view("DEL")
    yield from wait_until(lambda: name not in bpy.context.scene.objects, "the key deletes nothing")
    yield from wait_until(lambda: holds() is None, "what is gone still holds")
    yield from moves()
    assert live().is_playing(), "the end of a tie has stopped it"
    assert any(name in text for text in session().warnings), session().warnings
    assert np.isfinite(session().strands).all() and len(before)
    show_panels([SIDEBAR])
    yield
    driver.screenshot("deleted")


def undo():
    yield from press_in_view("Z", ctrl=True)
    yield from wait_until(
        lambda: "Hair Tie" in bpy.context.scene.objects, "Ctrl-Z brings no ring back"
    )
    yield from wait_until(lambda: holds() is not None, "what is back holds nothing")
    assert not any("Hair Tie" in text for text in session().warnings), session().warnings
    assert live().is_playing(), "undoing has stopped it"
    yield from moves()
    driver.screenshot("undone")


driver.play_session(steps())
