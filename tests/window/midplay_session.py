"""What cuts Play short: another file, a deleted object, a disabled extension; a slider dragged with
the mouse while hair plays; and Ctrl-Z and Ctrl-Shift-Z at each step of the quick start.
"""

import sys
import tempfile
from pathlib import Path

import addon_utils
import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from artist import look_from_front, press, until
from dice import in_view
from dice import press as press_in_view
from traces import of_hairloom

log, registered = traces.Log(), traces.Registered()
STRANDS = 300


def live():
    return of_hairloom("host.preview.live")


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    with tempfile.TemporaryDirectory() as folder:
        yield from undo_and_redo_each_step(Path(folder))
        yield from a_slider_is_dragged()
        yield from another_file(Path(folder))
    for number, delete in enumerate((delete_hair, delete_head, delete_by_key)):
        yield from playing_hair()
        yield from delete()
        yield from ended(f"deleted, {number}")
    yield from playing_hair()
    addon_utils.disable(driver.EXTENSION, default_set=True)
    yield from ended("disabled")
    assert not hasattr(bpy.types.Curves, "hairloom")


def playing_hair():
    """In a fresh file: hair on a ball, which swings."""
    bpy.ops.wm.read_homefile(use_factory_startup=False)
    yield 5
    new_ball()
    with in_view():
        bpy.ops.hairloom.add_groom("INVOKE_DEFAULT", True, strand_count=STRANDS)
    yield from plays()


def new_ball():
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1, segments=24, ring_count=12)
    bpy.context.object.name = "Ball"
    look_from_front(0.9)


def plays():
    yield from until(live().is_playing, "it does not play")
    before = live().sessions()[0].strands

    def has_moved():
        return not np.array_equal(live().sessions()[0].strands, before)

    yield from until(has_moved, "nothing moves", tries=300)


def ended(where):
    """Nothing plays, ticks, draws or has raised."""
    yield from until(lambda: not any(traces.of_previews().values()), f"{where}: something goes on")
    yield from until(lambda: registered.timers() == [], f"{where}: {registered.timers()}")
    nothing_raised(where)


def nothing_raised(where):
    assert "Traceback" not in log.added(), f"{where} raised"


def undo_and_redo_each_step(folder):
    """Select, grow, change, preset, cards, delete: back to nothing by keys, and forth again."""
    bpy.ops.wm.read_homefile(use_factory_startup=False)
    yield 5
    new_ball()
    bpy.ops.ed.undo_push(message="a ball")
    states = [state()]
    for step in (grow, longer_locks, redder, take_a_preset, show_cards, move_the_ball, delete_all):
        yield from step()
        yield 3
        states.append(state())
        assert states[-1] != states[-2], f"{step.__name__} has changed nothing"
        nothing_raised(step.__name__)
    yield from by_keys(states[-2::-1], shift=False)
    yield from by_keys(states[1:], shift=True)
    yield from by_keys(states[-2::-1], shift=False)
    yield from until(lambda: not live().sessions(), "the preview outlives its hair")
    nothing_raised("undoing everything")


def by_keys(states, shift):
    for number, wanted in enumerate(states):
        yield from press_in_view("Z", ctrl=True, shift=shift)
        what = f"{'redo' if shift else 'undo'} {number}: {state()}, not {wanted}"
        yield from until(lambda wanted=wanted: state() == wanted, what, tries=30)
        yield 3
        nothing_raised(what)


def state():
    """What the quick start makes of a file."""
    found = {}
    for obj in sorted(bpy.context.scene.objects, key=lambda obj: obj.name):
        found[obj.name] = tuple(round(x, 4) for x in obj.location)
        if obj.type == "CURVES":
            groom = obj.data.hairloom
            look = tuple(round(x, 4) for x in groom.shading.base_color)
            found["look"] = (look, groom.card_drawing.shown_as, obj.hairloom.dynamics.gusts)
    return found


def hair():
    return next(obj for obj in bpy.context.scene.objects if obj.type == "CURVES")


def grow():
    with in_view():
        bpy.ops.hairloom.add_groom("INVOKE_DEFAULT", True, strand_count=STRANDS)
    yield from plays()


def longer_locks():
    hair().hairloom.dynamics.gusts = 0.75
    bpy.ops.ed.undo_push(message="gusts")
    yield 1


def redder():
    hair().data.hairloom.shading.base_color = (0.6, 0.1, 0.05)
    bpy.ops.ed.undo_push(message="colour")
    yield 1


def take_a_preset():
    bpy.ops.hairloom.apply_preset("EXEC_DEFAULT", True, name="looks/blond")
    yield 1


def show_cards():
    hair().data.hairloom.cards.card_count = 20
    hair().data.hairloom.card_drawing.shown_as = "cards"
    bpy.ops.ed.undo_push(message="cards")
    yield 1


def move_the_ball():
    bpy.data.objects["Ball"].location.x = 0.05
    bpy.ops.ed.undo_push(message="move")
    yield 5


def delete_all():
    with in_view():
        bpy.ops.object.select_all(action="SELECT")
        bpy.ops.object.delete("EXEC_DEFAULT", True)
    yield 1


def a_slider_is_dragged():
    """The mouse drags a field of Properties > Data while hair swings: it goes on, by the value."""
    yield from playing_hair()
    editor = next(a for a in bpy.context.screen.areas if a.type == "PROPERTIES")
    editor.spaces.active.context = "OBJECT"
    yield 5
    (session,), obj = live().sessions(), hair()
    before, strands = tuple(obj.location), session.strands
    body = next(each for each in editor.regions if each.type == "WINDOW")
    x, y, window = body.x + int(0.7 * body.width), body.y + body.height, bpy.context.window
    for below in range(60, 200, 12):  # where the first number is depends on the font
        window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y - below)
        yield 1
        window.event_simulate("LEFTMOUSE", "PRESS", x=x, y=y - below)
        yield 1
        for along in range(5, 50, 5):
            window.event_simulate("MOUSEMOVE", "NOTHING", x=x + along, y=y - below)
            yield 0.3
        window.event_simulate("LEFTMOUSE", "RELEASE", x=x + 45, y=y - below)
        yield 2
        if tuple(obj.location) != before:
            break
    driver.screenshot("dragged")
    assert tuple(obj.location) != before, "no slider was dragged"
    assert live().is_playing() and not np.array_equal(session.strands, strands)
    nothing_raised("dragging")


def another_file(folder):
    path = str(folder / "other.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    assert live().is_playing(), "saving stopped it"
    bpy.ops.wm.open_mainfile(filepath=path)
    yield from ended("another file")
    assert hair().display_type == "TEXTURED"


def delete_hair():
    bpy.data.objects.remove(hair())
    yield 2


def delete_head():
    """Hair without a head is told of; it may be previewed, and ends with its own object."""
    bpy.data.objects.remove(bpy.data.objects["Ball"])
    yield 10
    nothing_raised("without a head")
    bpy.data.objects.remove(hair())
    yield 2


def delete_by_key():
    with in_view():
        bpy.ops.object.select_all(action="SELECT")
    yield from press_in_view("DEL")
    yield 2


driver.play(steps())
