"""Shadows on screen: hair in studio light with and without shadows, and while it plays."""

import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    changed_fraction,
    click,
    hide_floor,
    look_from_front,
    new_head,
    open_our_sidebar,
    pixels,
    press,
    sidebar_button,
    still_pixels,
)
from driver import hairloom_module, wait_until


def volume():
    return bpy.data.objects["Hair"].data.hairloom.volume


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    yield from set_the_scene()
    yield from shadows_appear()
    yield from they_stay_while_hair_plays()
    assert hairloom_module("overlay").failure() == ""


def set_the_scene():
    new_head()
    bpy.ops.object.shade_smooth()
    bpy.ops.hairloom.grow(method="normals", lift=1.0, strand_count=1500, length=0.06)
    bpy.context.object.name = "Hair"
    bpy.context.object.data.hairloom.children.method = "none"
    hide_floor()
    bpy.data.objects["Hair"].data.hairloom.shading.model = "marschner"
    look_from_front(0.7)
    yield from open_our_sidebar()
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_until(has_drawn, "no hair is drawn")
    yield


def has_drawn():
    overlay = hairloom_module("overlay")
    return any(overlay.statistics_of(uid).strands > 0 for uid in overlay.drawn_uids())


def shadows_appear():
    """Shadows are on by default and darken the side away from the light; each form is drawn without
    an error.
    """
    assert volume().shadows == "deep"
    shaded = yield from still_pixels("shadows_at_first")
    volume().shadows = "none"
    yield from seen_to_differ(shaded, "without_shadows")
    plain = yield from still_pixels("without_shadows")
    for form in ("slices", "deep"):
        volume().shadows = form
        yield from seen_to_differ(plain, f"shadows_{form}")
        assert hairloom_module("overlay").failure() == ""
    shaded = yield from still_pixels("shadows_deep")
    volume().scattering = False
    yield from seen_to_differ(shaded, "without_scattering")
    volume().scattering = True
    yield


def seen_to_differ(before, label):
    yield from wait_until(lambda: changed_fraction(before, pixels(label), 0.03) > 0.005, label)


def they_stay_while_hair_plays():
    before = yield from still_pixels("before_play")
    yield from click(*sidebar_button("hairloom.play"))
    yield
    bpy.data.objects["Head"].location.x = 0.05
    yield from seen_to_differ(before, "playing")
    yield from press("ESC")
    yield
    bpy.data.objects["Head"].location.x = 0.0
    yield


driver.play_session(steps())
