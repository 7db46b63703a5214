"""The tutorial *A look for Cycles*, played by mouse and keys."""

import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from artist import changed_fraction, still_pixels, viewport
from driver import wait_until
from tutorials import Page, open_tab, properties, wait_until_idle

log, page = traces.Log(), Page("look_like_cycles")
#: side of the render [pixels], and samples of each, few since the CPU draws here
SIDE, SAMPLES = 96, 4


def steps():
    yield from page.begin()
    page.step(1)
    yield from page.sample_scene()
    yield from blond()
    yield from a_material()
    yield from by_cycles()
    page.end()
    assert "Traceback" not in log.new_output(), "something has raised"


def hair():
    return next(obj for obj in bpy.context.scene.objects if obj.name == "Head Hair")


def blond():
    page.step(2)
    hair().data.hairloom.children.method = "none"  # fewer strands are drawn faster
    yield from wait_until_idle()
    before = yield from still_pixels("brown")
    yield from page.open("Look", viewport(), "UI")
    yield from page.picture("Look", "Blond", viewport(), "UI")
    yield from page.choose("Pigment", "Melanin", "shading.pigment", viewport(), "UI")
    look = hair().data.hairloom.shading
    assert look.pigment == "melanin"
    for label, value in (("Melanin", "0.25"), ("Redness", "0.3")):
        path = f"shading.{label.lower()}"
        yield from page.enter(label, value, path, viewport(), "UI")
        assert abs(getattr(look, label.lower()) - float(value)) < 1e-6, label
    after = yield from still_pixels("blond")
    assert changed_fraction(before, after) > 0.01, "the viewport does not show it"


def a_material():
    page.step(3)
    yield from page.press("To Material", viewport(), "UI")
    yield from wait_until(lambda: hair().data.materials, "there is no material")
    kinds = {node.type for node in hair().data.materials[0].node_tree.nodes}
    assert "BSDF_HAIR_PRINCIPLED" in kinds


def by_cycles():
    page.step(4)
    yield from page.open("Export", viewport(), "UI")
    yield from page.press("Make Real", viewport(), "UI")
    yield from wait_until(lambda: real(), "no ordinary hair curves come")
    yield from wait_until_idle()
    assert hair().hide_get() or hair().hide_viewport, "the groom is not hidden"
    render, cycles = bpy.context.scene.render, bpy.context.scene.cycles
    render.resolution_x = render.resolution_y = SIDE
    cycles.samples, cycles.use_denoising = SAMPLES, False
    page.quote("Properties > Render")
    yield from open_tab("RENDER")
    yield from page.choose("Render Engine", "Cycles", "render.engine", properties())
    assert render.engine == "CYCLES"
    page.quote("F12")
    yield from page.render()
    driver.screenshot("end")


def real():
    return [o for o in bpy.context.scene.objects if o.type == "CURVES" and o.name != "Head Hair"]


driver.play_session(steps())
