"""Long jobs show themselves: a hairstyle is added, made real and grown again in the window. Each
says in the panel what it makes, Esc takes all of it back, and one undo does.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from artist import hair_is_made, look_from_front, open_our_sidebar, press, region, viewport
from driver import of_hairloom, until
from open_panels import SIDEBAR, only_our_panels, show

log = traces.Log()
#: enough that growing takes a while
STRANDS = 30_000


def steps():
    yield from press("ESC")
    driver.enable_extension()
    only_our_panels()
    show([SIDEBAR, SIDEBAR + "_export", SIDEBAR + "_grow"])
    yield from open_our_sidebar()
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    look_from_front(0.9)
    yield from a_hairstyle()
    yield from made_real()
    yield from grown_again()
    assert "Traceback" not in log.added(), "something has raised"


def running():
    return of_hairloom("long_work").running()


def stage():
    work = of_hairloom("long_work")._running
    return "" if work is None else work.progress.text


def objects():
    return {obj.name: obj.hide_viewport for obj in bpy.context.scene.objects}


def begin(name, **settings):
    """As a button of the panel does."""
    with bpy.context.temp_override(area=viewport(), region=region("UI")):
        result = getattr(bpy.ops.hairloom, name)("INVOKE_DEFAULT", True, **settings)
    assert result == {"RUNNING_MODAL"}, f"{name}: {result}"


def cancelled(at, label):
    """By Esc, at a stage, which the panel shows."""
    yield from until(lambda: stage() == at, f"it is never {at}")
    yield 1
    if stage() == at:
        driver.screenshot(label)
    yield from press("ESC")
    yield from until(lambda: not running(), "Esc does not cancel")


def done():
    yield from until(lambda: not running(), "it does not end")
    yield from hair_is_made()


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
    begin("add_hairstyle", style="buzz_cut", plays=False)
    yield from done()
    assert len(objects()) == 3
    with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
        bpy.ops.ed.undo_redo("EXEC_DEFAULT", True)
    assert not running() and len(objects()) == 3, "Adjust Last Operation gives something else"
    yield from done()
    yield from undone_and_done_again({})


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
    put, points = of_hairloom("curves").put_points, of_hairloom("curves").curve_points
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


driver.play(steps())
