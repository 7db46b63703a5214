"""Blender's part of the tutorial *Cards into Godot*, played with mouse and keys; tests/engines
draws such an export in Godot.
"""

import sys
from pathlib import Path

import bpy

sys.path += [str(Path(__file__).parent), str(Path(__file__).parents[1])]
import driver
import traces
from artist import changed_fraction, file_browser, redraw, region, still_pixels, viewport
from driver import hairloom_module, wait_until
from engine_folders import missing_files
from reading import box_of, wait_for_words
from tutorials import (
    Page,
    empty_place_in_view,
    enter_file_name,
    press_key,
    region_of,
    wait_until_idle,
)

log, page = traces.Log(), Page("cards_into_godot")


def steps():
    yield from page.begin()
    yield from some_hair()
    yield from cards()
    yield from a_file()
    page.step(4)
    page.quote("docs/engines/godot")
    page.quote("res://addons/hairloom")
    addon = Path(__file__).parents[2] / "docs/engines/godot"
    assert (addon / "plugin.cfg").is_file() and not missing_files(addon)
    page.end()
    assert "Traceback" not in log.new_output(), "something has raised"


def live():
    return hairloom_module("previews")


def some_hair():
    """Add hair by the first step of the first tutorial."""
    page.step(1)
    page.quote("first hair")
    yield from press_key("A", *empty_place_in_view())
    yield from press_key("X", *empty_place_in_view())
    first = Page("first_hair")
    first.step(1)
    yield from first.click("Delete")
    yield from first.menu("Add > Curve > Hairloom Hairstyle > Brows", box_of(region("HEADER")))
    yield from wait_until(live().is_playing, "no brows play")
    yield from press_key("ESC", *empty_place_in_view())
    yield from wait_until(lambda: not live().is_playing(), "Esc does not stop it")
    yield from wait_until_idle()
    page.quote("select it")
    assert bpy.context.object.type == "CURVES" and bpy.context.object.select_get()


def cards():
    page.step(2)
    before = yield from still_pixels("strands")
    yield from page.open("Cards", viewport(), "UI")
    yield from page.picture("Cards", "Mobile", viewport(), "UI")
    yield from page.press("Make Cards", viewport(), "UI")
    yield from wait_until(made, "no cards are made")
    yield from wait_until_idle()
    after = yield from still_pixels("cards")
    assert changed_fraction(before, after) > 0.0, "the view shows no cards"
    driver.screenshot("end")


def made():
    return [obj for obj in bpy.context.scene.objects if obj.hairloom.card_object.groom]


def a_file():
    page.step(3)
    yield from page.open("Export", viewport(), "UI")
    yield from page.press("Export Hair Cards", viewport(), "UI")
    yield from wait_until(lambda: file_browser() is not None, "no file browser opens")
    yield from redraw(file_browser())
    driver.screenshot("browser")
    options = box_of(region_of(file_browser(), "TOOL_PROPS"))
    yield from wait_for_words(page.quote("Own Folder"), options)  # which is on
    folder = Path(file_browser().spaces.active.params.directory.decode())
    yield from enter_file_name(page.quote("hair.glb"))
    written = folder / "hair" / "hair.glb"
    yield from wait_until(written.is_file, "no cards are written")
    yield from wait_until_idle()
    assert len(list(written.parent.iterdir())) > 3


driver.play_session(steps())
