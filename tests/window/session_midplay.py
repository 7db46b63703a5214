"""Interruptions of Play: another file, a deleted object, a disabled extension; a slider dragged
while hair plays; and Ctrl-Z and Ctrl-Shift-Z at each step of the quick start.
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
from artist import (
    changed_fraction,
    find_field,
    look_from_front,
    open_our_sidebar,
    pixels,
    press,
    viewport,
)
from dice import press as press_in_view
from dice import viewport_context
from driver import hairloom_module, wait_until
from open_panels import register_as_open

log = traces.Log()
STRANDS = 300
#: [pixels] by which the mouse drags a slider
DRAGGED = 45


def live():
    return hairloom_module("previews")


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()  # once before: Blender turns menus into lists the first time
    addon_utils.disable(driver.EXTENSION, default_set=True)
    yield
    before = traces.blender_traces()
    driver.enable_extension()
    with tempfile.TemporaryDirectory() as folder:
        yield from undo_and_redo_each_step()
        yield from a_slider_is_dragged()
        yield from another_file(Path(folder))
    for delete in (delete_hair, delete_head, delete_by_key, undo_its_making):
        yield from playing_hair()
        yield from delete()
        yield from ended(delete.__name__)
    yield from disabled_and_enabled()
    addon_utils.disable(driver.EXTENSION, default_set=True)
    # a thread that makes a collider has to end first
    yield from wait_until(lambda: traces.blender_traces() == before, "something of ours is left")
    nothing_raised("disabling")


def playing_hair():
    """Swinging hair on a ball, in a new file."""
    bpy.ops.wm.read_homefile(use_factory_startup=False)
    yield
    new_ball()
    bpy.ops.ed.undo_push(message="a ball")
    yield from grow()


def new_ball():
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1, segments=24, ring_count=12)
    bpy.context.object.name = "Ball"
    look_from_front(0.9)


def grow():
    with viewport_context():
        bpy.ops.hairloom.add_groom("INVOKE_DEFAULT", True, strand_count=STRANDS)
    yield from plays()


def plays():
    yield from wait_until(live().is_playing, "it does not play")
    yield from moves("it plays")


def moves(where):
    before = live().sessions()[0].strands

    def has_moved():
        return not np.array_equal(live().sessions()[0].strands, before)

    yield from wait_until(has_moved, f"{where}, but nothing moves")


def ended(where):
    """Assert that nothing plays, ticks, draws, is on the GPU or has raised."""
    yield from wait_until(
        lambda: not any(traces.preview_traces().values()), f"{where}: something goes on"
    )
    pending = driver.timers.pending
    yield from wait_until(lambda: not pending(), lambda: f"{where}: {pending()}")
    nothing_raised(where)


def nothing_raised(where):
    assert "Traceback" not in log.new_output(), f"{where} raised"


def undo_and_redo_each_step():
    """Grow, change, preset, cards, move, delete: all undone by keys, and redone."""
    bpy.ops.wm.read_homefile(use_factory_startup=False)
    yield
    new_ball()
    bpy.ops.ed.undo_push(message="a ball")
    states = [state()]
    for step in (grow, longer_locks, redder, take_a_preset, show_cards, move_the_ball, delete_all):
        yield from step()
        yield
        states.append(state())
        assert states[-1] != states[-2], f"{step.__name__} has changed nothing"
        nothing_raised(step.__name__)
    yield from by_keys(states[-2::-1], shift=False)
    yield from by_keys(states[1:], shift=True)
    yield from by_keys(states[-2::-1], shift=False)
    yield from wait_until(lambda: not live().sessions(), "the preview outlives its hair")
    nothing_raised("undoing everything")


def by_keys(states, shift):
    for number, expected in enumerate(states):
        yield from press_in_view("Z", ctrl=True, shift=shift)
        what = f"{'redo' if shift else 'undo'} {number} to {expected}"
        yield from wait_until(lambda expected=expected: state() == expected, what)
        yield
        nothing_raised(what)


def state():
    """The file's content that the quick start changes."""
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
    groom = hair().data.hairloom
    groom.cards.card_count, groom.card_occlusion.rays, groom.atlas.size = 20, 8, "512"
    hair().data.hairloom.card_drawing.shown_as = "cards"
    bpy.ops.ed.undo_push(message="cards")
    yield 1


def move_the_ball():
    bpy.data.objects["Ball"].location.x = 0.05
    bpy.ops.ed.undo_push(message="move")
    yield


def delete_all():
    with viewport_context():
        bpy.ops.object.select_all(action="SELECT")
        bpy.ops.object.delete("EXEC_DEFAULT", True)
    yield 1


def a_slider_is_dragged():
    """The mouse drags a field of our panel while hair swings on; Ctrl-Z restores the value."""
    register_as_open("HAIRLOOM_PT_sidebar_dynamics")
    yield from playing_hair()
    look_from_front(0.45)
    yield from open_our_sidebar()
    yield
    dynamics, window = hair().hairloom.dynamics, bpy.context.window
    # left of the mask beside it
    x, y = yield from find_field(viewport(), "UI", "dynamics.gravity", x_fraction=0.5)
    before, shot = dynamics.gravity, pixels("before-dragging")
    window.event_simulate("LEFTMOUSE", "PRESS", x=x, y=y)
    yield 1
    values = []
    for along in range(5, DRAGGED + 1, 5):
        window.event_simulate("MOUSEMOVE", "NOTHING", x=x + along, y=y)
        yield 1
        values.append(dynamics.gravity)
    yield from moves("the mouse is still pressed")
    assert live().is_playing(), "the drag has stopped it"
    window.event_simulate("LEFTMOUSE", "RELEASE", x=x + DRAGGED, y=y)
    yield
    after = dynamics.gravity
    print(f"gravity from {before:.3f} by {[round(each, 3) for each in values]} to {after:.3f}")
    assert after > before and len(set(values)) > 3, "the value did not follow the mouse"
    assert after == values[-1], "it goes on without the mouse"
    yield from moves("the mouse is off")
    moved = changed_fraction(shot, pixels("dragged"))
    assert moved > 0.01, f"the picture stands still: {moved:.4f} of it has changed"
    yield from press_in_view("Z", ctrl=True)
    yield from wait_until(lambda: hair().hairloom.dynamics.gravity == before, "Ctrl-Z does nothing")
    yield from moves("the slider is back")
    nothing_raised("dragging")


def another_file(folder):
    path = str(folder / "other.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    assert live().is_playing(), "saving stopped it"
    in_play, at_rest = [], []
    for _ in range(3):
        in_play.append(traces.gpu_object_counts())
        bpy.ops.wm.open_mainfile(filepath=path)
        yield
        yield from ended("another file")
        at_rest.append(traces.gpu_object_counts())
        assert hair().display_type == "TEXTURED"
        assert live().notice() == "", "nothing needs to be reported"
        with viewport_context():
            bpy.ops.hairloom.play("INVOKE_DEFAULT")
        yield from plays()
    print(f"on the GPU in play {in_play}, at rest {at_rest}", flush=True)
    assert in_play[0].total() > at_rest[0].total(), "the counts show nothing"
    assert at_rest[1] == at_rest[2], "each file leaves something on the GPU"


def delete_hair():
    """A script deletes the hair: a notice says why it no longer plays."""
    name = hair().name
    bpy.data.objects.remove(hair())
    yield from wait_until(lambda: live().notice() != "", "no notice")
    assert live().notice().startswith(f"Preview of {name} ended."), live().notice()
    assert "gone" in live().notice(), live().notice()


def delete_head():
    """Hair without a head can still be previewed; the preview ends with the hair's object."""
    bpy.data.objects.remove(bpy.data.objects["Ball"])
    yield
    nothing_raised("without a head")
    bpy.data.objects.remove(hair())
    yield


def delete_by_key():
    with viewport_context():
        bpy.ops.object.select_all(action="SELECT")
    yield from press_in_view("DEL")
    yield from wait_until(lambda: live().notice() != "", "no notice")
    assert "gone" in live().notice(), live().notice()


def undo_its_making():
    """If Ctrl-Z removes the hair, there is no notice."""
    yield from press_in_view("Z", ctrl=True)
    yield from wait_until(lambda: not live().sessions(), "the preview outlives its hair")
    assert live().notice() == ""
    assert [obj.type for obj in bpy.context.scene.objects] == ["MESH"]


def disabled_and_enabled():
    """Disabled while hair plays: everything ends, settings are kept, and it plays again after
    enabling."""
    yield from playing_hair()
    hair().hairloom.dynamics.gusts = 0.625
    addon_utils.disable(driver.EXTENSION, default_set=True)
    assert not hasattr(bpy.types.Curves, "hairloom")
    yield from ended("disabled")
    driver.enable_extension()
    assert hair().hairloom.dynamics.gusts == 0.625, "disabling has lost a setting"
    assert not live().simulations()
    with viewport_context():
        bpy.ops.hairloom.play("INVOKE_DEFAULT")
    yield from plays()
    addon_utils.disable(driver.EXTENSION, default_set=True)
    yield from ended("disabled again")
    driver.enable_extension()
    yield


driver.play_session(steps())
