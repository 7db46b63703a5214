"""A previewed groom in two windows side by side, and pictures of both."""

import bpy
import driver
import numpy as np
from artist import area_pixels, arrange_side_by_side, changed_fraction, new_head
from driver import hairloom_module, wait_until
from mathutils import Euler

#: fractions of a view's pixels: that hair covers, and by which Blender's own redraws differ
MIN_HAIR_FRACTION, MAX_REDRAW_FRACTION = 0.02, 0.002


def set_the_scene():
    new_head()
    bpy.ops.hairloom.grow(strand_count=3000, length=0.12)
    bpy.context.object.name = "Hair"
    bpy.context.object.data.hairloom.children.method = "none"
    collection = bpy.data.collections.new("Groom")
    bpy.context.scene.collection.children.link(collection)
    for obj in (bpy.data.objects["Head"], hair()):
        obj.users_collection[0].objects.unlink(obj)
        collection.objects.link(obj)
    yield
    hair().select_set(True)
    bpy.context.view_layer.objects.active = hair()
    bpy.ops.hairloom.preview()
    yield from wait_until(previews().sessions, "there is no preview")
    look_from_front_in_all()
    yield


def previews():
    return hairloom_module("previews")


def hair():
    return bpy.data.objects["Hair"]


def windows():
    return list(bpy.context.window_manager.windows)


def view_of(window):
    areas = [area for area in window.screen.areas if area.type == "VIEW_3D"]
    return max(areas, key=lambda area: area.width * area.height)


def look_from_front_in_all():
    """Look from the front in every window, without overlays."""
    for window in windows():
        space = view_of(window).spaces.active
        space.overlay.show_overlays = False
        view = space.region_3d
        view.view_perspective, view.view_location = "PERSP", (0.0, 0.0, 0.0)
        view.view_rotation = Euler((np.pi / 2.0, 0.0, 0.0)).to_quaternion()
        view.view_distance = 0.45


def view_pictures(label):
    """The current 3D view of each window."""
    yield
    screenshot = driver.screenshot(label)
    return [area_pixels(window, view_of(window), screenshot) for window in windows()]


def two_windows():
    bpy.ops.wm.window_new_main()  # other kinds share scene and view layer with the first window
    yield
    assert len(windows()) == 2
    arrange_side_by_side()
    yield
    look_from_front_in_all()
    yield from assert_hair_drawn("two-windows", [True, True])


def assert_hair_drawn(label, drawn):
    """Assert in which windows hair is drawn: there, hiding it changes the picture."""
    shown = yield from view_pictures(f"{label}-shown")
    hair().hide_viewport = True
    hidden = yield from view_pictures(f"{label}-hidden")
    hair().hide_viewport = False
    yield
    fractions = [changed_fraction(one, other) for one, other in zip(shown, hidden, strict=True)]
    print(f"{label}: {[round(fraction, 4) for fraction in fractions]}", flush=True)
    for fraction, is_drawn in zip(fractions, drawn, strict=True):
        assert fraction > MIN_HAIR_FRACTION if is_drawn else fraction < MAX_REDRAW_FRACTION, (
            label,
            fractions,
        )
    assert len(previews().sessions()) == 1, f"{label}: {previews().notice()}"
