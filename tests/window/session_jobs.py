"""Progress of long jobs: a hairstyle is added, made real and grown again in the window. The panel
shows each job's stage, Esc reverts all of it, and so does one undo.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from artist import (
    height_in_view,
    look_from_front,
    open_our_sidebar,
    press,
    region,
    viewport,
    wait_for_hair,
)
from driver import hairloom_module, wait_until
from open_panels import SIDEBAR, only_our_panels, show_panels
from reading import box_of, wait_for_words

log = traces.Log()
#: enough that growing takes a while
STRANDS = 30_000
#: [m] distance at which a head is a dot
FAR = 18.0
#: faces along each side of a cloth that takes seconds to make
FACES = 250


def steps():
    yield from press("ESC")
    driver.enable_extension()
    only_our_panels()
    show_panels([SIDEBAR, SIDEBAR + "_export", SIDEBAR + "_grow", SIDEBAR + "_fin"])
    yield from open_our_sidebar()
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    look_from_front(0.9)
    yield from a_hairstyle()
    yield from made_real()
    yield from grown_again()
    yield from cloth_is_played()
    assert "Traceback" not in log.new_output(), "something has raised"


def running_label():
    return hairloom_module("long_work").running_label()


def stage():
    work = hairloom_module("long_work")._running
    return "" if work is None else work.progress.text


def objects():
    return {obj.name: obj.hide_viewport for obj in bpy.context.scene.objects}


def begin(name, **settings):
    """Start an operator as a button of the panel does."""
    with bpy.context.temp_override(area=viewport(), region=region("UI")):
        result = getattr(bpy.ops.hairloom, name)("INVOKE_DEFAULT", True, **settings)
    assert result == {"RUNNING_MODAL"}, f"{name}: {result}"


def cancelled(at, label):
    """Cancel with Esc at a stage that the panel shows."""
    yield from wait_until(lambda: stage() == at, f"it is never {at}")
    yield 1
    if stage() == at:
        driver.screenshot(label)
    yield from press("ESC")
    yield from wait_until(lambda: not running_label(), "Esc does not cancel")


def done():
    yield from wait_until(lambda: not running_label(), "it does not end")
    yield from wait_for_hair()


def undone_and_done_again(before):
    after = objects()
    bpy.ops.ed.undo()
    assert objects() == before, "one undo does not take all back"
    bpy.ops.ed.redo()
    assert objects() == after
    yield


def a_hairstyle():
    bpy.ops.ed.undo_push(message="nothing there")
    meshes = len(bpy.data.meshes)
    begin("add_hairstyle", style="buzz_cut", plays=False)
    yield from cancelled("Painting the skin", "adding")
    assert objects() == {} and len(bpy.data.meshes) == meshes, "something was added"
    look_from_front(FAR)
    begin("add_hairstyle", style="buzz_cut", plays=False)
    yield from done()
    assert len(objects()) == 3
    yield from wait_until(lambda: height_in_view(head()) > 0.3, "a head alone is a dot in the view")
    yield
    driver.screenshot("near")
    look_from_front(FAR)
    with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
        bpy.ops.ed.undo_redo("EXEC_DEFAULT", True)
    assert not running_label() and len(objects()) == 3, "Adjust Last Operation gives something else"
    yield from done()
    assert height_in_view(head()) < 0.1, "Adjust Last Operation moves the view"
    yield from undone_and_done_again({})
    yield from beside_something_else()


def beside_something_else():
    """If the view shows something else, it does not move."""
    bpy.ops.ed.undo()
    bpy.ops.mesh.primitive_cube_add(size=0.1)
    bpy.context.object.select_set(False)
    bpy.context.view_layer.objects.active = None
    bpy.ops.ed.undo_push(message="a cube")
    begin("add_hairstyle", style="buzz_cut", plays=False)
    yield from done()
    yield
    assert height_in_view(head()) < 0.1, "the view does not stay"
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    look_from_front(0.9)


def head():
    return bpy.data.objects["Head"]


def choose(end):
    for obj in bpy.context.scene.objects:
        obj.select_set(obj.name.endswith(end))
        if obj.name.endswith(end):
            bpy.context.view_layer.objects.active = obj
    return bpy.context.view_layer.objects.active


def made_real():
    choose("Buzz Cut")
    bpy.ops.ed.undo_push(message="chosen")
    before = objects()
    begin("make_real")
    assert not bpy.ops.hairloom.make_real.poll(), "it may begin again"
    yield from cancelled("Making strands", "making-real")
    assert objects() == before
    begin("make_real")
    yield from done()
    assert objects() == {**before, "Head Buzz Cut": True, "Head Buzz Cut Real": False}
    yield from undone_and_done_again(before)


def grown_again():
    bpy.context.view_layer.objects.active = head = bpy.data.objects["Head"]
    choose("Head")
    assert bpy.ops.hairloom.grow(strand_count=60) == {"FINISHED"}
    hair = bpy.context.object
    name = hair.name
    assert head == hair.parent
    put, points = hairloom_module("curves").set_points, hairloom_module("curves").curve_points
    put(hair.data, points(hair.data) * np.float32(1.05))
    hair.data.hairloom.grow.strand_count = STRANDS
    bpy.ops.ed.undo_push(message="combed")
    combed = points(hair.data)
    begin("grow_again")
    yield from cancelled(f"Growing {STRANDS:,} strands", "growing-again")
    assert np.array_equal(points(hair.data), combed), "combing is lost"
    begin("grow_again")
    yield from done()
    assert len(hair.data.curves) == STRANDS
    bpy.ops.ed.undo()
    assert np.array_equal(points(bpy.data.objects[name].data), combed)
    yield


def cloth_is_played():
    """Play waits for cloth that is made in the background, and says so; Esc cancels it."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=FACES, y_subdivisions=FACES, size=0.2)
    assert bpy.ops.hairloom.fin_add() == {"FINISHED"}
    yield
    live = hairloom_module("previews")
    play()
    assert live.waiting_names() == ("Grid",), "Play does not wait, or no window while it does"
    yield from wait_for_words("Making the cloth", box_of(region("UI")))
    driver.screenshot("cloth")
    yield from press("ESC")
    assert not live.is_playing(), "Esc does not cancel"
    play()
    yield from wait_until(lambda: live.is_playing() and not live.waiting_names(), "it never plays")
    yield from press("ESC")
    assert not live.is_playing(), "Esc does not stop it"


def play():
    with bpy.context.temp_override(area=viewport(), region=region("UI")):
        assert bpy.ops.hairloom.play("INVOKE_DEFAULT") == {"FINISHED"}


driver.play_session(steps())
