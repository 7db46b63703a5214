"""The tutorial *Part, settle and play*, played by mouse and keys."""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
import traces
from artist import region, viewport
from bpy_extras.view3d_utils import location_3d_to_region_2d
from driver import hairloom_module, wait_until
from reading import width_of
from tutorials import (
    Page,
    area_of,
    click,
    drag,
    empty_place_in_view,
    find_button_below_name,
    find_field_beside,
    open_tab,
    press_key,
    properties,
    save_the_file,
    scroll_to,
    type_text,
    wait_until_idle,
)

log, page = traces.Log(), Page("comb_and_play")
#: frames to bake, few since the CPU draws each
LAST = 4
#: typed distance [m] by which the parting is moved; [pixels] from a name in the Outliner to the
#: triangle that opens it
ASIDE, TRIANGLE = "0.006", 28
#: hair's height [pixels] below which few of its strands are drawn, and their fraction
FAR, SPARSE = 10_000.0, 0.1
#: [pixels] by which the brush and the wind's slider are dragged
COMBED, SLID = 60, 30


def steps():
    yield from page.begin()
    page.step(1)
    yield from page.sample_scene()
    yield from parted()
    yield from combed()
    yield from settled()
    yield from played()
    yield from baked()
    page.end()
    assert "Traceback" not in log.new_output(), "something has raised"


def live():
    return hairloom_module("previews")


def hair():
    return next(obj for obj in bpy.context.scene.objects if obj.name == "Head Hair")


def shape():
    return hairloom_module("curves").curve_points(hair().data).copy()


def moved(before, after):
    """The fraction of points that have moved."""
    return float((np.linalg.norm(after - before, axis=1) > 1e-4).mean())


def parted():
    page.step(2)
    groom = hair().data.hairloom
    groom.children.method = "none"  # fewer strands are drawn faster
    groom.detail.lod_size, groom.detail.min_density = FAR, SPARSE
    yield from wait_until_idle()
    page.quote("Properties > Data")
    yield from open_tab("DATA")
    panel, below = page.quote("Children"), page.quote("Partings")
    yield from page.open(panel, properties())
    yield from page.open(below, properties())
    before = set(bpy.context.scene.objects)
    yield from page.press("Add Parting", properties())
    yield from wait_until(lambda: set(bpy.context.scene.objects) != before, "no line comes")
    uncombed = shape()
    yield from its_points_are_moved()
    yield from page.press("Comb from Partings", properties())
    yield from wait_until(lambda: moved(uncombed, shape()) > 0.02, "the parting combs nothing")
    yield from wait_until_idle()
    driver.screenshot("parted")


def its_points_are_moved():
    line = next(obj for obj in bpy.context.scene.objects if obj.type == "CURVE")
    outliner = area_of("OUTLINER")
    page.quote("To move its points, select it")
    yield from click(*(yield from scroll_to("Parting", outliner)))
    yield from wait_until(lambda: bpy.context.object == line, "the line is not selected")
    yield from page.mode("Edit Mode", "Object Mode")
    before = places_of(line)
    for name in ("A", "G", "X"):
        yield from press_key(name, *empty_place_in_view())
    yield from type_text(ASIDE, *empty_place_in_view())
    yield from press_key("RET", *empty_place_in_view())
    yield from page.mode("Object Mode", "Edit Mode")
    assert np.abs(places_of(line) - before).max() > 1e-3, "the line stays where it is"
    page.quote("in the Outliner open Head and click Head Hair")
    x, y = yield from scroll_to("Head", outliner)
    yield from click(x - width_of("Head") // 2 - TRIANGLE, y)
    yield
    yield from click(*(yield from scroll_to("Head Hair", outliner)))
    yield from wait_until(lambda: bpy.context.object == hair(), "the hair is not selected")


def places_of(line):
    return np.array([point.co for point in line.data.splines[0].bezier_points])


def combed():
    page.step(3)
    yield from page.mode("Sculpt Mode", "Object Mode")
    assert hair().mode == "SCULPT_CURVES"
    yield from wait_until_idle()
    page.quote("drag with Comb")
    assert bpy.context.tool_settings.curves_sculpt.brush.name == "Comb"
    before, (x, y) = shape(), in_front()
    yield from drag((x, y), (x + COMBED, y))
    yield from wait_until(lambda: moved(before, shape()) > 0.0, "the brush combs nothing")
    yield from wait_until_idle()
    driver.screenshot("combed")
    yield from page.mode("Object Mode", "Sculpt Mode")
    assert hair().mode == "OBJECT"
    yield from wait_until_idle()


def in_front():
    """The place in the window of the middle of the guide nearest to the eye."""
    view = region("WINDOW")
    eye = view.data.view_matrix.inverted().translation
    (session,) = live().sessions()
    middles = session.rig.guide_grid[:, session.rig.guide_grid.shape[1] // 2]
    place = middles[np.linalg.norm(middles - eye, axis=1).argmin()]
    x, y = location_3d_to_region_2d(view, view.data, place)
    return int(view.x + x), int(view.y + y)


def settled():
    page.step(4)
    yield from page.open("Dynamics", properties())
    before = shape()
    yield from page.press("Settle", properties())
    yield from wait_until(lambda: moved(before, shape()) > 0.5, "nothing falls")
    yield from wait_until_idle()
    driver.screenshot("settled")
    page.quote("Revert Settle")


def played():
    page.step(5)
    yield from page.press("Play", viewport(), "UI")
    yield from wait_until(lambda: live().is_playing(), "nothing plays")
    yield from goes_on("Play")
    dynamics = hair().hairloom.dynamics
    gusts = dynamics.gusts
    yield from page.picture("Dynamics", "Windy", properties())
    yield from wait_until(lambda: dynamics.gusts != gusts, "the preset is not taken")
    yield from page.open("Medium & Wind", properties())
    before = dynamics.wind_speed
    x, y = yield from find_field_beside(
        page.quote("Wind Speed"), "dynamics.wind_speed", properties()
    )
    yield from drag((x, y), (x + SLID, y))
    yield from wait_until(lambda: dynamics.wind_speed > before, "the mouse drags nothing")
    yield from goes_on("the wind")
    driver.screenshot("plays")
    page.quote("Press Esc")
    yield from press_key("ESC", *empty_place_in_view())
    yield from wait_until(lambda: not live().is_playing(), "Esc does not stop it")
    yield from wait_until_idle()


def goes_on(what):
    (session,) = live().sessions()
    before = session.strands
    yield from wait_until(
        lambda: not np.array_equal(session.strands, before), f"{what} moves nothing"
    )


def baked():
    page.step(6)
    page.quote("Save the file")
    bpy.context.scene.frame_end = LAST
    hair().hairloom.dynamics.device = "numpy"
    yield from save_the_file()
    yield from page.open("Bake", properties())
    yield from click(*(yield from find_button_below_name(page.quote("Bake"), properties())))
    cache = hairloom_module("playback").cache_of
    yield from wait_until(lambda: cache(hair()) is not None, "there is no bake")
    yield from wait_until_idle()
    page.quote("Space plays")
    yield from press_key("SPACE", *empty_place_in_view())
    yield from wait_until(lambda: bpy.context.screen.is_animation_playing, "Space plays nothing")
    frame = bpy.context.scene.frame_current
    yield from wait_until(lambda: bpy.context.scene.frame_current != frame, "the playhead stands")
    (preview,) = live().previews.values()
    assert preview.phase.name == "BAKED", f"it is {preview.phase.name}, not baked"
    yield from press_key("SPACE", *empty_place_in_view())
    yield from wait_until(lambda: not bpy.context.screen.is_animation_playing, "it plays on")
    driver.screenshot("end")


driver.play_session(steps())
