"""Blender's part of the tutorial *Cards into Godot*, played with mouse and keys; tests/engines
draws such an export in Godot.
"""

import sys
from pathlib import Path

import bpy

sys.path += [str(Path(__file__).parent), str(Path(__file__).parents[1])]
import driver
import traces
from artist import changed, file_browser, pixels_at_rest, redrawn, region, viewport
from driver import of_hairloom, until
from engine_folders import missing_files
from reading import box_of, read
from tutorials import (
    Page,
    in_view,
    key,
    named_file,
    part_of,
    still,
)

log, page = traces.Log(), Page("cards_into_godot")


def steps():
    yield from page.begin()
    yield from some_hair()
    yield from cards()
    yield from a_file()
    page.step(4)
    page.says("docs/engines/godot")
    page.says("res://addons/hairloom")
    addon = Path(__file__).parents[2] / "docs/engines/godot"
    assert (addon / "plugin.cfg").is_file() and not missing_files(addon)
    page.end()
    assert "Traceback" not in log.added(), "something has raised"


def live():
    return of_hairloom("previews")


def some_hair():
    """Add hair by the first step of the first tutorial."""
    page.step(1)
    page.says("first hair")
    yield from key("A", *in_view())
    yield from key("X", *in_view())
    first = Page("first_hair")
    first.step(1)
    yield from first.click("Delete")
    yield from first.menu("Add > Curve > Hairloom Hairstyle > Brows", box_of(region("HEADER")))
    yield from until(live().is_playing, "no brows play")
    yield from key("ESC", *in_view())
    yield from until(lambda: not live().is_playing(), "Esc does not stop it")
    yield from still()
    page.says("select it")
    assert bpy.context.object.type == "CURVES" and bpy.context.object.select_get()


def cards():
    page.step(2)
    before = yield from pixels_at_rest("strands")
    yield from page.open("Cards", viewport(), "UI")
    yield from page.picture("Cards", "Mobile", viewport(), "UI")
    yield from page.press("Make Cards", viewport(), "UI")
    yield from until(made, "no cards are made")
    yield from still()
    after = yield from pixels_at_rest("cards")
    assert changed(before, after) > 0.0, "the view shows no cards"
    driver.screenshot("end")


def made():
    return [obj for obj in bpy.context.scene.objects if obj.hairloom.card_object.groom]


def a_file():
    page.step(3)
    yield from page.open("Export", viewport(), "UI")
    yield from page.press("Export Hair Cards", viewport(), "UI")
    yield from until(lambda: file_browser() is not None, "no file browser opens")
    yield from redrawn(file_browser())
    driver.screenshot("browser")
    options = box_of(part_of(file_browser(), "TOOL_PROPS"))
    yield from read(page.says("Own Folder"), options)  # which is on
    folder = Path(file_browser().spaces.active.params.directory.decode())
    yield from named_file(page.says("hair.glb"))
    written = folder / "hair" / "hair.glb"
    yield from until(written.is_file, "no cards are written")
    yield from still()
    assert len(list(written.parent.iterdir())) > 3


driver.play(steps())
