"""Shadows on screen: hair under a sun with and without them, and while it plays."""

import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    changed,
    click,
    look_from_front,
    open_our_sidebar,
    press,
    sidebar_button,
    viewport,
    viewport_pixels,
)


def of_hairloom(module):
    return sys.modules[f"{driver.EXTENSION}.addon.{module}"]


def pixels(label):
    return viewport_pixels(driver.screenshot(label))


def volume():
    return bpy.data.objects["Hair"].data.hairloom.volume


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    yield from set_the_scene()
    yield from shadows_appear()
    yield from they_stay_while_hair_plays()
    assert of_hairloom("host.overlay").failure() == ""


def set_the_scene():
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)
    bpy.context.object.name = "Head"
    bpy.ops.object.shade_smooth()
    bpy.ops.hairloom.grow(way="normals", strand_count=1500, length=0.06)
    bpy.context.object.name = "Hair"
    bpy.ops.object.light_add(type="SUN", rotation=(0.0, 1.2, 0.0))
    bpy.context.object.data.energy = 4.0
    bpy.context.view_layer.objects.active = bpy.data.objects["Hair"]
    bpy.data.objects["Hair"].select_set(True)
    shading = viewport().spaces.active.shading
    shading.type = "MATERIAL"
    shading.use_scene_lights, shading.use_scene_world = True, False
    overlays = viewport().spaces.active.overlay
    overlays.show_overlays = False
    bpy.data.objects["Hair"].data.hairloom.shading.model = "marschner"
    look_from_front(0.7)
    yield from open_our_sidebar()
    yield from click(*sidebar_button("hairloom.preview"))
    yield 30


def shadows_appear():
    """The side that faces away is darker with them; each form is drawn without a failure."""
    plain = pixels("without_shadows")
    for form in ("slices", "deep"):
        volume().shadows = form
        yield 20
        shaded = pixels(f"shadows_{form}")
        assert changed(plain, shaded, 0.03) > 0.01, form
        assert of_hairloom("host.overlay").failure() == ""
    volume().scattering = False
    yield 20
    assert changed(shaded, pixels("without_scattering"), 0.03) > 0.005
    volume().scattering = True
    yield 20


def they_stay_while_hair_plays():
    before = pixels("before_play")
    yield from click(*sidebar_button("hairloom.play"))
    yield 20
    bpy.data.objects["Head"].location.x = 0.05
    yield 60
    assert changed(before, pixels("playing")) > 0.01
    yield from press("ESC")
    yield 10
    bpy.data.objects["Head"].location.x = 0.0
    yield 20


driver.play(steps())
