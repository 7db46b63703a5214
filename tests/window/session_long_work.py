"""Long work in the window: started from a dialog and from the file browser, one at a time,
cancelled by Esc, undone, repeated with other settings, and ended by undo, loading and disabling."""

import sys
from pathlib import Path

import addon_utils
import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from artist import (
    confirm_file_browser,
    look_from_front,
    new_head,
    open_our_sidebar,
    press,
    region,
    viewport,
)
from driver import hairloom_module, wait_until

FOLDER = Path(bpy.app.tempdir) / "long"
SMALL = {"size": 64, "samples": 1}
#: numbers of rays that take long and that do not
MANY, FEW = 4096, 64
#: frames of a bake, enough for the fit of joints to take a while
MOVED = 60

failures: list[str] = []


def running_label():
    return hairloom_module("long_work").running_label()


def progress_text():
    """The work's text in the status bar."""
    work = hairloom_module("long_work")._running
    return "" if work is None else work.progress.text


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    sys.excepthook = lambda kind, error, _: failures.append(f"{kind.__name__}: {error}")
    driver.enable_extension()
    yield from set_the_scene()
    at_rest = traces.blender_traces()["handlers"]
    for work in (
        from_a_dialog,
        undone_in_mid_work,
        into_a_popup,
        from_the_file_browser,
        cards_in_motion,
        another_file_in_mid_work,
    ):
        yield from work()
        assert traces.blender_traces()["handlers"] == at_rest, f"{work.__name__} leaves a handler"
    yield from disabled_in_mid_work()
    assert failures == [], failures


def set_the_scene():
    FOLDER.mkdir()
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    new_head()
    assert bpy.ops.hairloom.grow(strand_count=300, length=0.12) == {"FINISHED"}
    hair = bpy.context.object
    hair.name = "Hair"
    groom = hair.data.hairloom
    groom.cards.source, groom.cards.card_count, groom.cards.levels = "clusters", 300, 1
    groom.atlas.source = "made"
    assert bpy.ops.hairloom.make_cards() == {"FINISHED"}, "a script does not get all at once"
    look_from_front(0.9)
    yield from open_our_sidebar()
    cards = bpy.data.objects["Hair Cards"]
    cards.data = mixed_up(cards.data)
    choose(cards)
    bpy.ops.ed.undo_push(message="mixed up")


def mixed_up(mesh):
    """The same cards with shuffled faces."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Hair Cards"]
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.sort_elements(type="RANDOMIZE", elements={"FACE"}, seed=3)
    bpy.ops.object.mode_set(mode="OBJECT")
    return mesh


def choose(obj):
    for each in bpy.context.selected_objects:
        each.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj


def order():
    mesh = bpy.data.objects["Hair Cards"].data
    found = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", found)
    return found


def sort_by_dialog(rays):
    with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
        asked = bpy.ops.hairloom.sort_cards("INVOKE_DEFAULT", head="Head", rays=rays)
    assert asked == {"RUNNING_MODAL"}
    yield
    yield from press("RET")
    yield from wait_until(lambda: running_label() == "Sort Hair Cards", "the dialog starts nothing")


def from_a_dialog():
    """Esc leaves the mesh as it was; the second time the work runs to its end."""
    before = order()
    yield from sort_by_dialog(MANY)
    driver.screenshot("sorting")
    for operator in (bpy.ops.hairloom.sort_cards, bpy.ops.hairloom.turntable):
        assert not operator.poll(), "another long work may begin"
    yield from press("ESC")
    yield from wait_until(lambda: not running_label(), "Esc does not cancel")
    assert np.array_equal(order(), before)
    yield from sort_by_dialog(FEW)
    yield from wait_until(lambda: not running_label(), "sorting does not end")
    after = order()
    assert not np.array_equal(after, before)
    repeated_at_once(bpy.ops.ed.undo_redo)
    assert np.array_equal(order(), after), "Adjust Last Operation gives another order"
    bpy.ops.ed.undo()
    assert np.array_equal(order(), before), "undo does not bring the order back"
    bpy.ops.ed.redo()
    assert np.array_equal(order(), after)
    yield


def repeated_at_once(repeat):
    """A repeated operator must not run on in the window, since Blender can free it at any time."""
    with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
        repeat("EXEC_DEFAULT", True)  # with an undo step, as for a click
    assert not running_label()


def undone_in_mid_work():
    """A script can undo the data that the work uses."""
    after = order()
    yield from sort_by_dialog(MANY)
    bpy.ops.ed.undo()
    assert not running_label(), "the work goes on with data that is gone"
    yield
    assert bpy.ops.hairloom.sort_cards.poll()
    bpy.ops.ed.redo()
    yield
    assert np.array_equal(order(), after)


def check():
    choose(bpy.data.objects["Hair"])
    with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
        asked = bpy.ops.hairloom.check_export("INVOKE_DEFAULT", engine="alembic unreal")
    assert asked == {"RUNNING_MODAL"} and running_label() == "Check for Export"
    assert progress_text() == "Making strands"


def into_a_popup():
    """Data that was read is freed by Esc while it is read, and by Esc in the popup."""
    seen = hairloom_module("export_check").hair_count
    check()
    yield from press("ESC")
    yield from wait_until(lambda: not running_label(), "Esc does not cancel the check")
    assert seen() == 0, "a check that was cancelled goes on"
    check()
    yield from wait_until(lambda: not running_label(), "the check does not end")
    assert seen() == 1, "no popup shows what was read"
    yield
    driver.screenshot("checked")
    yield from press("ESC")
    yield from wait_until(lambda: seen() == 0, "the check goes on unseen")
    yield


def turntable(frames):
    choose(bpy.data.objects["Hair"])
    with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
        bpy.ops.hairloom.turntable("INVOKE_DEFAULT", frames=frames, **SMALL)
    yield from confirm_file_browser(FOLDER)
    yield from wait_until(lambda: running_label() == "Turntable", "the file browser starts nothing")


def from_the_file_browser():
    yield from turntable(2000)
    yield 1
    driver.screenshot("turning")
    yield from press("ESC")
    yield from wait_until(lambda: not running_label(), "Esc does not cancel the turntable")
    assert list(FOLDER.iterdir()) == []
    yield from turntable(3)
    yield from wait_until(lambda: not running_label(), "the turntable does not end")
    assert len(list(FOLDER.glob("Hair_000*.png"))) == 3
    yield


def cards_in_motion():
    """Esc while joints are fitted keeps existing files as they were."""
    hair, scene = bpy.data.objects["Hair"], bpy.context.scene
    head = bpy.data.objects["Head"]
    for frame, x in ((1, 0.0), (MOVED // 2, 0.1), (MOVED, -0.1)):
        head.location.x = x
        head.keyframe_insert("location", frame=frame)
    hair.hairloom.bake.folder = str(Path(bpy.app.tempdir) / "bake")
    hair.hairloom.bake.use_own_range = True
    hair.hairloom.bake.first, hair.hairloom.bake.last = 1, MOVED
    hair.hairloom.dynamics.device, hair.hairloom.dynamics.collider_resolution = "numpy", 8
    scene.frame_set(1)
    choose(hair)
    assert bpy.ops.hairloom.bake() == {"FINISHED"}
    cards = FOLDER / "Hair"
    cards.mkdir()
    (cards / "Hair.glb").write_bytes(b"the cards of before")
    with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
        bpy.ops.hairloom.export_cards("INVOKE_DEFAULT", motion="joints")
    yield from confirm_file_browser(FOLDER)
    yield from wait_until(
        lambda: running_label() == "Export Hair Cards", "the browser starts no export"
    )
    yield from wait_until(lambda: progress_text() == "Fitting joints", "no joints are fitted")
    driver.screenshot("fitting")
    yield from press("ESC")
    yield from wait_until(lambda: not running_label(), "Esc does not cancel the export of cards")
    assert [file.name for file in cards.iterdir()] == ["Hair.glb"]
    assert (cards / "Hair.glb").read_bytes() == b"the cards of before"
    head.animation_data_clear()
    yield


def another_file_in_mid_work():
    path = str(Path(bpy.app.tempdir) / "long.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    yield from turntable(2000)
    bpy.ops.wm.open_mainfile(filepath=path)
    yield
    assert not running_label() and list(FOLDER.glob(".turntable*")) == []
    assert bpy.ops.hairloom.turntable.poll()


def disabled_in_mid_work():
    yield from turntable(2000)
    addon_utils.disable(driver.EXTENSION, default_set=True)
    assert list(FOLDER.glob(".turntable*")) == []
    yield
    driver.screenshot("disabled")


driver.play_session(steps())
