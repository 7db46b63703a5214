"""The tutorial *First hair*, played by mouse and keys."""

import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from artist import (
    changed_fraction,
    height_in_view,
    region,
    still_pixels,
    viewport,
    wait_for_hair,
)
from driver import hairloom_module, wait_until
from reading import box_of
from tutorials import Page, click, empty_place_in_view, middle, open_tab, press_key, properties

log, page = traces.Log(), Page("first_hair")


def steps():
    yield from page.begin()
    yield from a_head()
    yield from hair_on_it()
    yield from longer_and_wavy()
    yield from red()
    page.end()
    assert "Traceback" not in log.new_output(), "something has raised"


def live():
    return hairloom_module("previews")


def groom():
    return bpy.data.objects["Head Hair"].data.hairloom


def a_head():
    page.step(1)
    yield from press_key(page.quote("A"), *empty_place_in_view())
    yield from press_key(page.quote("X"), *empty_place_in_view())
    yield from page.click("Delete")
    yield from wait_until(lambda: not bpy.context.scene.objects, "the scene is not empty")
    path = "Add > Curve > Hairloom Hairstyle > Brows"
    yield from page.menu(path, box_of(region("HEADER")))
    yield from wait_until(lambda: live().is_playing(), "no brows play")
    assert set(bpy.data.objects.keys()) == {"Head", "Head Brows"}
    page.quote("the view goes near it")
    yield from wait_until(
        lambda: height_in_view(bpy.data.objects["Head"]) > 0.3, "the head stays small"
    )
    driver.screenshot("head")


def hair_on_it():
    page.step(2)
    head = middle(box_of(region("WINDOW")))
    page.quote("Click the head")
    yield from click(*head)
    yield from wait_until(lambda: bpy.context.object.name == "Head", "the head is not selected")
    yield from page.right_click("Hairloom > Add Hair", *head)
    yield from wait_until(lambda: len(live().sessions()) == 2, "no hair grows")
    page.quote("Press Esc")
    yield from press_key("ESC", *empty_place_in_view())
    yield from wait_until(lambda: not live().is_playing(), "Esc does not stop it")
    yield from wait_for_hair()
    yield from strands_between_guides()


def strands_between_guides():
    page.quote("Properties > Data")
    yield from open_tab("DATA")
    yield from page.open("Children", properties())
    yield from page.choose("Method", "Between Guides", "children.method", properties())
    yield from page.enter("Strands", "24000", "children.strand_count", properties())
    page.quote("24,000")
    assert groom().children.strand_count == 24_000 and groom().children.method == "multi"
    yield from wait_for_hair()


def longer_and_wavy():
    page.step(3)
    short = yield from still_pixels("short")
    yield from page.open("Grow", properties())
    for label, value, path in (("Length", "0.3", "grow.length"), ("Wave", "0.014", "grow.wave")):
        page.quote(f"{label} to {value} m")
        yield from page.enter(label, value, path, properties())
        own = getattr(groom().grow, label.lower())
        assert abs(own - float(value)) < 1e-6, f"{label} is {own}"
    yield from wait_for_hair()
    long = yield from still_pixels("long")
    assert changed_fraction(short, long) > 0.1, "the hair does not follow"


def red():
    page.step(4)
    brown = yield from still_pixels("brown")
    yield from page.open("Look", viewport(), "UI")
    yield from page.picture("Look", "Red", viewport(), "UI")
    red = yield from still_pixels("red")
    assert changed_fraction(brown, red) > 0.02, "the hair is not red"
    page.quote("Click beside the head")
    yield from click(*empty_place_in_view())
    yield from wait_until(lambda: not bpy.context.selected_objects, "the hair stays selected")
    yield
    driver.screenshot("end")


driver.play_session(steps(), anti_aliasing=True)
