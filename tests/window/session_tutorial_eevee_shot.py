"""The tutorial *A shot in EEVEE*, played by mouse and keys."""

import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from driver import hairloom_module, wait_until
from tutorials import (
    Page,
    click,
    find_button_below_name,
    open_tab,
    properties,
    save_the_file,
    wait_until_idle,
)

log, page = traces.Log(), Page("eevee_shot")
#: frames of the shot, side [pixels] and samples, few since the CPU draws here
LAST, SIDE, SAMPLES = 4, 128, 2


def steps():
    yield from page.begin()
    page.step(1)
    yield from page.sample_scene()
    yield from the_engine()
    yield from baked()
    yield from rendered()
    page.end()
    assert "Traceback" not in log.new_output(), "something has raised"


def scene():
    return bpy.context.scene


def hair():
    return next(obj for obj in scene().objects if obj.name == "Head Hair")


def the_engine():
    hair().data.hairloom.children.method = "none"  # fewer strands are drawn faster
    hair().hairloom.dynamics.device = "numpy"
    scene().frame_end = LAST
    scene().render.resolution_x = scene().render.resolution_y = SIDE
    scene().eevee.taa_render_samples = SAMPLES
    page.step(2)
    page.quote("Properties > Render")
    yield from open_tab("RENDER")
    yield from page.choose("Render Engine", "EEVEE", "render.engine", properties())
    yield from page.tick("Hairloom Hair", properties())
    assert scene().hairloom.use_hair_scene, "Hairloom Hair is not on"
    yield
    driver.screenshot("hair-scene")


def baked():
    page.step(3)
    page.quote("Save the file")
    yield from save_the_file()
    yield from open_tab("DATA")
    panel, below = page.quote("Dynamics > Bake").split(" > ")
    yield from page.open(panel, properties())
    yield from page.open(below, properties())
    yield from click(*(yield from find_button_below_name("Bake", properties())))
    cache = hairloom_module("playback").cache_of
    yield from wait_until(lambda: cache(hair()) is not None, "there is no bake")
    yield from wait_until_idle()


def rendered():
    page.step(4)
    yield from open_tab("RENDER")
    yield from page.tick("Motion Blur", properties())
    assert scene().render.use_motion_blur
    page.quote("F12")
    yield from page.render()
    driver.screenshot("end")


driver.play_session(steps())
