"""Hair's shadow on the head that Blender draws, and the layers of its map in an Image Editor."""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    changed,
    click,
    hide_floor,
    look_from_front,
    new_head,
    open_our_sidebar,
    pixels,
    pixels_at_rest,
    press,
    sidebar_button,
    viewport,
)
from driver import of_hairloom, until


def volume():
    return bpy.data.objects["Hair"].data.hairloom.volume


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    yield from set_the_scene()
    yield from hair_shades_the_head()
    yield from layers_are_shown()
    assert of_hairloom("overlay").failure() == ""


def set_the_scene():
    """A fringe above a ball, under a sun from above the eye."""
    bpy.context.scene.render.engine = "BLENDER_EEVEE"
    head = new_head(segments=48, ring_count=24)
    bpy.ops.object.shade_smooth()
    group = head.vertex_groups.new(name="Crown")
    crown = [each.index for each in head.data.vertices if each.co.z > 0.075]
    group.add(crown, 1.0, "REPLACE")
    bpy.ops.hairloom.grow(
        method="normals", lift=1.0, strand_count=3000, length=0.08, density_group="Crown"
    )
    bpy.context.object.name = "Hair"
    bpy.context.object.data.hairloom.children.method = "none"
    bpy.ops.object.light_add(type="SUN", rotation=(np.radians(25.0), 0.0, 0.0))
    bpy.context.object.data.energy = 4.0
    bpy.context.view_layer.objects.active = bpy.data.objects["Hair"]
    bpy.data.objects["Hair"].select_set(True)
    bpy.data.objects["Hair"].data.hairloom.shading.model = "marschner"
    bpy.data.objects["Hair"].data.hairloom.strands.fullness = 3.0
    volume().shadows = "deep"
    volume().on_body = True
    shading = viewport().spaces.active.shading
    shading.type = "MATERIAL"
    shading.use_scene_lights = shading.use_scene_world = True
    hide_floor()
    look_from_front(0.6)
    yield from open_our_sidebar()
    yield from click(*sidebar_button("hairloom.preview"))
    yield from until(has_drawn, "no hair is drawn")


def has_drawn():
    overlay = of_hairloom("overlay")
    return any(overlay.statistics_of(uid).strands > 0 for uid in overlay.drawn())


def hair_shades_the_head():
    """By a light that throws shadows, and as before when it does so again."""
    shaded = yield from pixels_at_rest("on_body")
    sun = bpy.data.objects["Sun"].data
    sun.use_shadow = False
    yield from until(
        lambda: changed(shaded, pixels("bare"), 0.05) > 0.004, "hair does not shade the head"
    )
    bare = yield from pixels_at_rest("bare")
    assert np.quantile((shaded - bare).max(axis=2), 0.995) < 0.05, "it only darkens"
    # with neither shadows of the light nor Shadow on Surface it is the same:
    # Blender's strands throw none
    volume().on_body = False
    none = yield from pixels_at_rest("no_shadow_at_all")
    assert changed(bare, none, 0.05) < 5e-3
    volume().on_body = sun.use_shadow = True
    yield from until(
        lambda: changed(shaded, pixels("on_body_again"), 0.05) < 5e-3, "it does not come back"
    )
    # a head that is not shown is not shaded
    bpy.data.objects["Head"].hide_set(True)
    yield from until(
        lambda: changed(shaded, pixels("hidden_head"), 0.05) > 0.02, "the head is not hidden"
    )
    hidden = yield from pixels_at_rest("hidden_head")
    volume().on_body = False
    bare = yield from pixels_at_rest("hidden_head_bare")
    assert changed(hidden, bare, 0.05) < 1e-3
    bpy.data.objects["Head"].hide_set(False)
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
    # nine tiles: where eight layers start, and they; of few strands they are coarser than asked
    assert image.size[0] == image.size[1] and image.size[0] % 3 == 0
    assert 64 < image.size[0] // 3 <= 256 + 2
    driver.screenshot("slices")


driver.play(steps())
