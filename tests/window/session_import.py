"""Import of grooms in the window: the file browser of a menu entry, the popup of dropped files, Esc
while a file is read, undo and redo, and undo after a click."""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
from artist import click, confirm_file_browser, look_from_front, new_head, press, viewport
from driver import hairloom_module, wait_until

FOLDER = Path(bpy.app.tempdir) / "grooms"


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    set_the_scene()
    yield from the_menu_opens_a_browser_for_its_format()
    yield from esc_ends_the_process_that_reads()
    yield from dropped_files_come_in_after_the_popup()
    yield from undo_and_redo()
    yield from undo_after_a_click()


def set_the_scene():
    new_head(keeps_light=True)
    look_from_front(0.9)
    FOLDER.mkdir()
    outward = np.random.default_rng(1).normal(size=(500, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    points = outward[:, None] * np.linspace(0.1, 0.2, 8)[:, None]
    strands = hairloom_module("strands").StrandSet(
        points.reshape(-1, 3), np.arange(501) * 8, np.full(4000, 1e-4), np.arange(500) % 3
    )
    groom = hairloom_module("groom_file").Groom(strands)
    hairloom_module("tressfx").write_tfx(FOLDER / "first.tfx", groom)
    hairloom_module("hair_file").write_hair_file(FOLDER / "second.hair", groom)
    with in_the_view():
        bpy.ops.ed.undo_push(message="the scene")  # a script's changes are no step by themselves


def in_the_view():
    area = viewport()
    region = next(each for each in area.regions if each.type == "WINDOW")
    return bpy.context.temp_override(window=bpy.context.window, area=area, region=region)


def grooms():
    return {each.name: each for each in bpy.data.objects if each.type == "CURVES"}


def browsers():
    """The areas of all windows that show files."""
    areas = (area for w in bpy.context.window_manager.windows for area in w.screen.areas)
    return [area for area in areas if area.type == "FILE_BROWSER"]


def the_menu_opens_a_browser_for_its_format():
    with in_the_view():
        bpy.ops.hairloom.import_strands("INVOKE_DEFAULT", filter_glob="*.hair")
    yield from wait_until(lambda: bool(browsers()), "no file browser has come")
    yield
    (browser,) = browsers()
    assert browser.spaces.active.params.filter_glob == "*.hair"
    driver.screenshot("browser")
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[-1], area=browser):
        bpy.ops.file.cancel()
    yield from wait_until(lambda: not browsers(), "the file browser stays")
    assert grooms() == {}


def drop_files():
    """Call the operator with file names, as Blender does when files are dropped."""
    with in_the_view():
        assert bpy.types.HAIRLOOM_FH_strands.poll_drop(bpy.context)
        bpy.ops.hairloom.import_strands(
            "INVOKE_DEFAULT",
            True,
            filepath=str(FOLDER / "first.tfx"),
            directory=str(FOLDER),
            files=[{"name": "first.tfx"}, {"name": "second.hair"}],
        )


def esc_ends_the_process_that_reads():
    """While an endless process reads the second file; nothing of the first file stays either."""
    module, number = hairloom_module("import_groom"), FOLDER / "number"
    real = module.read_strands
    script = f"echo $$ > '{number}'; exec sleep 600"

    def read(path, **how):
        if path.suffix == ".hair":
            hairloom_module("child_process").run_child(["/bin/sh", "-c", script], seconds=600)
        return real(path, **how)

    module.read_strands = read
    drop_files()
    yield
    yield from press("RET")
    yield from wait_until(lambda: number.is_file() and number.read_text(), "no process reads")
    work = hairloom_module("long_work")
    assert work.running_label() == "Import Hair Strands"
    assert not bpy.ops.hairloom.import_strands.poll(), "another import may begin"
    driver.screenshot("reading")
    yield from press("ESC")
    yield from wait_until(lambda: not work.running_label(), "Esc does not cancel")
    child = Path("/proc", number.read_text().strip())
    yield from wait_until(lambda: not child.exists(), "the process goes on")
    assert grooms() == {}
    module.read_strands = real
    number.unlink()


def dropped_files_come_in_after_the_popup():
    drop_files()
    yield
    assert grooms() == {}, "it does not ask before"
    driver.screenshot("popup")
    yield from press("RET")
    yield from wait_until(lambda: len(grooms()) == 2, "the files do not come in")
    head = bpy.data.objects["Head"]
    assert all(each.data.surface == head for each in grooms().values())
    assert bpy.context.view_layer.objects.active == grooms()["first"]
    yield
    driver.screenshot("imported")


def undo_and_redo():
    with in_the_view():
        bpy.ops.ed.undo()
    yield
    assert grooms() == {}
    assert [each.name for each in bpy.data.objects if each.type == "MESH"] == ["Head"]
    with in_the_view():
        bpy.ops.ed.redo()
    yield
    assert sorted(grooms()) == ["first", "second"]


def undo_after_a_click():
    """An import by click is one undo step, and a later click another; keys undo one each."""
    yield from undo_by_keys()
    assert grooms() == {}
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    with in_the_view():
        bpy.ops.hairloom.import_strands("INVOKE_DEFAULT", True, filter_glob="*.tfx")
    yield from wait_until(lambda: bool(browsers()), "no file browser has come")
    browsers()[0].spaces.active.params.filename = "first.tfx"
    yield from confirm_file_browser(FOLDER)
    yield from wait_until(lambda: sorted(grooms()) == ["first"], "the file does not come in")
    yield
    assert bpy.context.selected_objects == [grooms()["first"]]
    yield from click(*beside_the_head())
    yield from wait_until(lambda: not bpy.context.selected_objects, "the click deselects nothing")
    yield from undo_by_keys()
    assert bpy.context.selected_objects == [grooms()["first"]]
    yield from undo_by_keys()
    assert grooms() == {}
    assert bpy.context.selected_objects == [bpy.data.objects["Head"]]


def beside_the_head():
    """A pixel of the view without anything to select."""
    view = next(each for each in viewport().regions if each.type == "WINDOW")
    return view.x + 3 * view.width // 4, view.y + view.height // 8


def undo_by_keys():
    """Ctrl+Z with the mouse over the view."""
    window, (x, y) = bpy.context.window, beside_the_head()
    window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
    yield 1
    for value in ("PRESS", "RELEASE"):
        window.event_simulate("Z", value, x=x, y=y, ctrl=True)
        yield 1
    yield


driver.play_session(steps())
