"""The tutorial *First hair*, played by mouse and keys."""

import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from artist import (
    changed,
    hair_is_made,
    pixels_at_rest,
    region,
    share_of_view,
    viewport,
)
from driver import of_hairloom, until
from reading import box_of
from tutorials import Page, click, in_view, key, middle, open_tab, properties

log, page = traces.Log(), Page("first_hair")


def steps():
    yield from page.begin()
    yield from a_head()
    yield from hair_on_it()
    yield from longer_and_wavy()
    yield from red()
    page.end()
    assert "Traceback" not in log.added(), "something has raised"


def live():
    return of_hairloom("previews")


def groom():
    return bpy.data.objects["Head Hair"].data.hairloom


def a_head():
    page.step(1)
    yield from key(page.says("A"), *in_view())
    yield from key(page.says("X"), *in_view())
    yield from page.click("Delete")
    yield from until(lambda: not bpy.context.scene.objects, "the scene is not empty")
    path = "Add > Curve > Hairloom Hairstyle > Brows"
    yield from page.menu(path, box_of(region("HEADER")))
    yield from until(lambda: live().is_playing(), "no brows play")
    assert set(bpy.data.objects.keys()) == {"Head", "Head Brows"}
    page.says("the view goes near it")
    yield from until(lambda: share_of_view(bpy.data.objects["Head"]) > 0.3, "the head stays small")
    driver.screenshot("head")


def hair_on_it():
    page.step(2)
    head = middle(box_of(region("WINDOW")))
    page.says("Click the head")
    yield from click(*head)
    yield from until(lambda: bpy.context.object.name == "Head", "the head is not selected")
    yield from page.right_click("Hairloom > Add Hair", *head)
    yield from until(lambda: len(live().sessions()) == 2, "no hair grows")
    page.says("Press Esc")
    yield from key("ESC", *in_view())
    yield from until(lambda: not live().is_playing(), "Esc does not stop it")
    yield from hair_is_made()
    yield from strands_between_guides()


def strands_between_guides():
    page.says("Properties > Data")
    yield from open_tab("DATA")
    yield from page.open("Children", properties())
    yield from page.choose("Method", "Between Guides", "children.method", properties())
    yield from page.enter("Strands", "24000", "children.strand_count", properties())
    page.says("24,000")
    assert groom().children.strand_count == 24_000 and groom().children.method == "multi"
    yield from hair_is_made()


def longer_and_wavy():
    page.step(3)
    short = yield from pixels_at_rest("short")
    yield from page.open("Grow", properties())
    for label, value, path in (("Length", "0.3", "grow.length"), ("Wave", "0.014", "grow.wave")):
        page.says(f"{label} to {value} m")
        yield from page.enter(label, value, path, properties())
        own = getattr(groom().grow, label.lower())
        assert abs(own - float(value)) < 1e-6, f"{label} is {own}"
    yield from hair_is_made()
    long = yield from pixels_at_rest("long")
    assert changed(short, long) > 0.1, "the hair does not follow"


def red():
    page.step(4)
    brown = yield from pixels_at_rest("brown")
    yield from page.open("Look", viewport(), "UI")
    yield from page.picture("Look", "Red", viewport(), "UI")
    red = yield from pixels_at_rest("red")
    assert changed(brown, red) > 0.02, "the hair is not red"
    page.says("Click beside the head")
    yield from click(*in_view())
    yield from until(lambda: not bpy.context.selected_objects, "the hair stays selected")
    yield
    driver.screenshot("end")


driver.play(steps(), anti_aliasing=True)
