"""The tutorial *A look for Cycles*, played by mouse and keys."""

import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from artist import changed, pixels_at_rest, viewport
from driver import until
from tutorials import Page, open_tab, properties, still

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
    assert "Traceback" not in log.added(), "something has raised"


def hair():
    return next(obj for obj in bpy.context.scene.objects if obj.name == "Head Hair")


def blond():
    page.step(2)
    hair().data.hairloom.children.method = "none"  # fewer strands are drawn faster
    yield from still()
    before = yield from pixels_at_rest("brown")
    yield from page.open("Look", viewport(), "UI")
    yield from page.picture("Look", "Blond", viewport(), "UI")
    yield from page.choose("Pigment", "Melanin", "shading.pigment", viewport(), "UI")
    look = hair().data.hairloom.shading
    assert look.pigment == "melanin"
    for label, value in (("Melanin", "0.25"), ("Redness", "0.3")):
        path = f"shading.{label.lower()}"
        yield from page.enter(label, value, path, viewport(), "UI")
        assert abs(getattr(look, label.lower()) - float(value)) < 1e-6, label
    after = yield from pixels_at_rest("blond")
    assert changed(before, after) > 0.01, "the viewport does not show it"


def a_material():
    page.step(3)
    yield from page.press("To Material", viewport(), "UI")
    yield from until(lambda: hair().data.materials, "there is no material")
    kinds = {node.type for node in hair().data.materials[0].node_tree.nodes}
    assert "BSDF_HAIR_PRINCIPLED" in kinds


def by_cycles():
    page.step(4)
    yield from page.open("Export", viewport(), "UI")
    yield from page.press("Make Real", viewport(), "UI")
    yield from until(lambda: real(), "no ordinary hair curves come")
    yield from still()
    assert hair().hide_get() or hair().hide_viewport, "the groom is not hidden"
    render, cycles = bpy.context.scene.render, bpy.context.scene.cycles
    render.resolution_x = render.resolution_y = SIDE
    cycles.samples, cycles.use_denoising = SAMPLES, False
    page.says("Properties > Render")
    yield from open_tab("RENDER")
    yield from page.choose("Render Engine", "Cycles", "render.engine", properties())
    assert render.engine == "CYCLES"
    page.says("F12")
    yield from page.render()
    driver.screenshot("end")


def real():
    return [o for o in bpy.context.scene.objects if o.type == "CURVES" and o.name != "Head Hair"]


driver.play(steps())
