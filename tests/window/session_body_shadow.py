"""Hair's shadow on a head that Blender draws, and the layers of its map in an Image Editor."""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    changed_fraction,
    click,
    hide_floor,
    look_from_front,
    new_fringe,
    open_our_sidebar,
    pixels,
    press,
    sidebar_button,
    still_pixels,
    viewport,
)
from driver import hairloom_module, wait_until


def volume():
    return bpy.data.objects["Hair"].data.hairloom.volume


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    yield from set_the_scene()
    yield from hair_shades_the_head()
    yield from full_shadow_is_as_dark_as_without_the_light()
    yield from hair_is_there_without_overlays()
    yield from layers_are_shown()
    assert hairloom_module("overlay").failure() == ""


def set_the_scene():
    """A fringe above a ball, under a sun from above the eye."""
    bpy.context.scene.render.engine = "BLENDER_EEVEE"
    head, hair, _ = new_fringe(3000)
    hair.select_set(True)
    hair.data.hairloom.shading.model = "marschner"
    head.data.materials.append(bpy.data.materials.new("Skin"))
    skin = head.data.materials[0].node_tree.nodes["Principled BSDF"].inputs
    skin["Base Color"].default_value = (0.55, 0.38, 0.31, 1.0)
    skin["Specular IOR Level"].default_value = 0.0
    assert volume().shadows == "deep" and volume().on_body
    shading = viewport().spaces.active.shading
    shading.type = "MATERIAL"
    shading.use_scene_lights = shading.use_scene_world = True
    hide_floor()
    look_from_front(0.6)
    yield from open_our_sidebar()
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_until(has_drawn, "no hair is drawn")


def has_drawn():
    overlay = hairloom_module("overlay")
    return any(overlay.statistics_of(uid).strands > 0 for uid in overlay.drawn_uids())


def hair_shades_the_head():
    """In a light that casts shadows; without them the head is bright, and with them dark again."""
    shaded = yield from still_pixels("on_body")
    sun = bpy.data.objects["Sun"].data
    sun.use_shadow = False
    yield from wait_until(
        lambda: changed_fraction(shaded, pixels("bare"), 0.05) > 0.004,
        "hair does not shade the head",
    )
    bare = yield from still_pixels("bare")
    assert np.quantile((shaded - bare).max(axis=2), 0.995) < 0.05, "it only darkens"
    # without shadows of the light and without Shadow on Surface it is the same, since Blender's
    # strands cast none
    volume().on_body = False
    none = yield from still_pixels("no_shadow_at_all")
    assert changed_fraction(bare, none, 0.05) < 5e-3
    volume().on_body = sun.use_shadow = True
    yield from wait_until(
        lambda: changed_fraction(shaded, pixels("on_body_again"), 0.05) < 5e-3,
        "it does not come back",
    )
    # a hidden head is not shaded
    bpy.data.objects["Head"].hide_set(True)
    yield from wait_until(
        lambda: changed_fraction(shaded, pixels("hidden_head"), 0.05) > 0.02,
        "the head is not hidden",
    )
    hidden = yield from still_pixels("hidden_head")
    volume().on_body = False
    bare = yield from still_pixels("hidden_head_bare")
    assert changed_fraction(hidden, bare, 0.05) < 1e-3
    bpy.data.objects["Head"].hide_set(False)
    yield


def full_shadow_is_as_dark_as_without_the_light():
    """Where hair blocks all of the sun, against EEVEE's own picture without a sun."""
    bpy.ops.object.select_all(action="DESELECT")  # no outlines
    volume().extinction, volume().on_body = 100.0, True
    shaded = yield from still_pixels("full")
    volume().on_body = False
    sun = bpy.data.objects["Sun"]
    sun.data.use_shadow = False
    lit = yield from still_pixels("full_lit")
    sun.hide_set(True)
    dark = yield from still_pixels("full_dark")
    sun.hide_set(False)
    volume().extinction, volume().on_body, sun.data.use_shadow = 1.0, True, True
    taken, missing = (lit - shaded).mean(axis=2), (lit - dark).mean(axis=2)
    # pixels of the head; hair is dark, and shaded itself
    is_full = (lit.mean(axis=2) > 0.45) & (missing > 0.2) & (taken > 0.75 * missing)
    away = np.abs(shaded - dark)[is_full].mean()
    assert is_full.sum() > 50 and away < 0.04, (is_full.sum(), away)


def hair_is_there_without_overlays():
    """Hair is drawn, and stays hidden behind the head, although EEVEE leaves no depths without
    overlays."""
    overlays = viewport().spaces.active.overlay
    with_overlays = yield from still_pixels("with_overlays")
    overlays.show_overlays = False
    found = yield from still_pixels("without_overlays")
    # selection outlines are gone
    assert changed_fraction(with_overlays, found, 0.05) < 0.05
    bpy.data.objects["Head"].hide_set(True)
    bald = yield from still_pixels("without_overlays_and_head")
    assert changed_fraction(found, bald, 0.05) > 0.02
    bpy.data.objects["Head"].hide_set(False)
    overlays.show_overlays = True
    yield


def layers_are_shown():
    area = viewport()
    before = len(bpy.context.window_manager.windows)
    space = next(each for each in area.regions if each.type == "WINDOW")
    with bpy.context.temp_override(area=area, region=space):
        assert bpy.ops.hairloom.show_slices() == {"FINISHED"}
    yield
    windows = bpy.context.window_manager.windows
    assert len(windows) == before + 1
    editor = windows[-1].screen.areas[0]
    assert editor.type == "IMAGE_EDITOR"
    image = editor.spaces.active.image
    # tiles: the starts of layers, and the layers; with few strands they are coarser than requested
    tiles = 1 + volume().layers
    columns = int(np.ceil(np.sqrt(tiles)))
    pitch, rest = divmod(image.size[0], columns)
    assert rest == 0 and image.size[1] == -(-tiles // columns) * pitch
    assert 64 < pitch <= 256 + 2
    driver.screenshot("slices")


driver.play_session(steps())
