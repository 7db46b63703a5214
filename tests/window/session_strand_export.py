"""Export of strands in the window: options and check in the file browser, motion in steps, Esc."""

import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    click,
    confirm_file_browser,
    file_browser,
    look_from_front,
    new_head,
    open_our_sidebar,
    press,
    region,
    viewport,
)
from driver import hairloom_module, wait_until
from open_panels import register_as_open

FOLDER = Path(bpy.app.tempdir) / "strands"

failures: list[str] = []


def running_label():
    return hairloom_module("long_work").running_label()


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    sys.excepthook = lambda kind, error, _: failures.append(f"{kind.__name__}: {error}")
    driver.enable_extension()
    yield from set_the_scene()
    yield from the_check_stands_beside_the_options()
    yield from motion_comes_in_steps()
    yield from escape_leaves_the_old_file()
    yield from the_check_alone()
    assert failures == [], failures


def set_the_scene():
    FOLDER.mkdir()
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    new_head()
    assert bpy.ops.hairloom.grow(strand_count=1000, length=0.12) == {"FINISHED"}
    hair = bpy.context.object
    hair.name = "Hair"
    head = bpy.data.objects["Head"]
    for frame, x in ((1, 0.0), (400, 1.0)):
        head.location.x = x
        head.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(1)
    look_from_front(0.9)
    register_as_open("HAIRLOOM_PT_sidebar_export")
    yield from open_our_sidebar()


def export(**options):
    """Open the file browser for a groom Alembic."""
    path = str(FOLDER / "hair.abc")
    with bpy.context.temp_override(area=viewport(), region=region("WINDOW")):
        asked = bpy.ops.hairloom.export_alembic("INVOKE_DEFAULT", filepath=path, **options)
    assert asked == {"RUNNING_MODAL"}
    assert hairloom_module("export_check")._open.check.options is None, "it is read before it opens"
    yield from wait_until(lambda: file_browser() is not None, "no file browser opens")
    yield


def the_check_stands_beside_the_options():
    yield from export()
    check = hairloom_module("export_check")
    yield from wait_until(lambda: check._open.check.lines, "the hair is not checked")
    assert check.hair_count() == 1 and "guides" in check._open.check.lines[0]
    driver.screenshot("options")
    yield from confirm_file_browser()
    yield from wait_until((FOLDER / "hair.abc").exists, "nothing is written")
    yield from wait_until(lambda: not running_label(), "the export does not end")
    assert check.hair_count() == 0


def motion_comes_in_steps():
    (FOLDER / "hair.abc").unlink()
    yield from export(frames="own", first=1, last=20)
    yield from confirm_file_browser()
    yield from wait_until(lambda: bool(running_label()), "the export does not begin")
    yield
    driver.screenshot("writing")
    yield from wait_until(lambda: not running_label(), "the export does not end")
    assert (FOLDER / "hair.abc").exists()
    assert bpy.context.scene.frame_current == 1


def escape_leaves_the_old_file():
    (FOLDER / "hair.abc").write_bytes(b"old")
    yield from export(frames="own", first=1, last=4000)
    yield from confirm_file_browser()
    yield from wait_until(lambda: bool(running_label()), "the export does not begin")
    yield
    yield from press("ESC")
    yield from wait_until(lambda: not running_label(), "Esc does not cancel the export")
    yield from wait_until(
        lambda: [p.name for p in FOLDER.iterdir()] == ["hair.abc"], "a half-written file is left"
    )
    assert (FOLDER / "hair.abc").read_bytes() == b"old"
    assert bpy.context.scene.frame_current == 1


def the_check_alone():
    """Click the check's button, one of the lowest; buttons below it may open their own popups."""
    check, sidebar = hairloom_module("export_check"), region("UI")
    for y in range(sidebar.y + 6, sidebar.y + sidebar.height, 12):
        yield from click(sidebar.x + sidebar.width // 2, y)
        yield from wait_until(
            lambda: running_label() != "Check for Export", "the check does not end"
        )
        if check.hair_count():
            break
        yield from press("ESC")
    else:
        raise AssertionError("no button opens the check")
    yield
    driver.screenshot("check")
    yield from press("ESC")
    yield
    assert hairloom_module("export_check").hair_count() == 0


driver.play_session(steps())
