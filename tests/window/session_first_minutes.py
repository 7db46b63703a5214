"""The first five minutes: no selection, the sample scene, hair on a mesh that plays at once, undo,
presets with pictures, warnings with a fix, export, and the test in the Preferences.
"""

import os
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    changed_fraction,
    hide_floor,
    look_from_front,
    open_our_sidebar,
    pixels,
    press,
    redrawn_pixels,
    region,
    still_pixels,
    viewport,
    wait_for_hair,
)
from driver import hairloom_module, wait_until


def live():
    return hairloom_module("previews")


def in_view():
    return bpy.context.temp_override(area=viewport(), region=region("WINDOW"))


def invoke(name, **settings):
    """Call an operator as a menu of the 3D view does."""
    with in_view():
        result = getattr(bpy.ops.hairloom, name)("INVOKE_DEFAULT", True, **settings)
    assert result & {"FINISHED", "RUNNING_MODAL"}, f"{name}: {result}"


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    yield from nothing_selected()
    yield from the_sample_scene_plays()
    yield from hair_on_a_mesh_of_ones_own()
    yield from undo_takes_it_away()
    yield from presets_have_pictures()
    yield from a_menu_under_the_mouse()
    yield from a_key_of_ones_own()
    yield from a_warning_mends()
    yield from to_the_engine()
    yield from the_page_in_the_preferences()
    assert hairloom_module("overlay").failure() == "" and live().notice() == ""


def nothing_selected():
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    yield from open_our_sidebar()
    driver.screenshot("start")
    assert not bpy.ops.hairloom.add_groom.poll()
    with in_view():
        bpy.ops.wm.call_menu(name="VIEW3D_MT_curve_add")
    yield
    driver.screenshot("add-menu")
    yield from press("ESC")


def the_sample_scene_plays():
    """One click gives moving, shining hair in its own scene."""
    own = bpy.context.window.scene
    invoke("sample_scene")
    yield from wait_until(
        lambda: not hairloom_module("long_work").running_label(), "the scene does not come"
    )
    scene = bpy.context.window.scene
    assert scene != own and len(live().sessions()) == 1
    yield from wait_until(lambda: bpy.context.screen.is_animation_playing, "nothing plays")
    yield from wait_until(lambda: scene.frame_current > 2, "the playhead stands")
    one = pixels("sample")
    frame = scene.frame_current
    yield from wait_until(lambda: abs(scene.frame_current - frame) > 3, "the playhead stands")
    other = pixels("sample-later")
    assert changed_fraction(one, other) > 0.02, "nothing has moved"
    with in_view():
        bpy.ops.screen.animation_cancel(restore_frame=False)
    yield
    bpy.context.window.scene = own
    live().stop_all()
    yield


def hair_on_a_mesh_of_ones_own():
    """Add > Curve > Hairloom Groom on a selected mesh: hair grows, shines and swings at once."""
    for obj in list(bpy.context.scene.objects):
        if obj.type == "MESH":
            bpy.data.objects.remove(obj)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)
    bpy.context.object.name = "Ball"
    hide_floor()
    look_from_front(0.9)
    bare = yield from still_pixels("bare")
    bpy.ops.ed.undo_push(message="a head")
    invoke("add_groom", strand_count=1500)
    yield from wait_until(lambda: live().is_playing(), "it does not play")
    (session,) = live().sessions()
    yield from wait_for_hair()
    at_first = session.strands
    yield from wait_until(
        lambda: np.abs(session.strands - at_first).max() > 1.0e-3, "nothing moves"
    )
    grown = yield from redrawn_pixels("own-mesh")
    assert changed_fraction(bare, grown) > 0.02, "no hair is seen"
    parts = ("simulation", "drawing")
    yield from wait_until(lambda: all(part in session.times.text for part in parts), "no times")


def undo_takes_it_away():
    with in_view():
        bpy.ops.ed.undo()
    yield from wait_until(lambda: not live().sessions(), "the preview outlives its hair")
    assert not live().is_playing() and live().notice() == ""
    yield
    with in_view():
        bpy.ops.ed.redo()
    yield
    hair = bpy.context.scene.objects["Ball Hair"]
    yield from wait_until(lambda: live().sessions(), "redo brings no preview back")
    bpy.context.view_layer.objects.active = hair
    hair.select_set(True)
    yield from wait_for_hair()
    yield


def presets_have_pictures():
    presets = hairloom_module("presets")
    bpy.context.window.cursor_warp(viewport().x + 300, viewport().y + viewport().height // 2)
    for section in ("shading", "dynamics", "volume", "cards"):
        entries = presets.shipped_presets(section)
        assert entries and all(entry.icon for entry in entries), section
    before = yield from redrawn_pixels("brown")
    bpy.context.window_manager.hairloom_presets.shading = "looks/blond"
    blond = yield from redrawn_pixels("blond")
    assert changed_fraction(before, blond) > 0.01, "the look is the same"


def a_menu_under_the_mouse():
    """The object menu under the mouse offers the commands for hair."""
    with in_view():
        before = driver.screenshot("no-menu")
        bpy.ops.wm.call_menu(name="HAIRLOOM_MT_object")
    yield
    assert changed_fraction(before / 255.0, driver.screenshot("object-menu") / 255.0) > 0.01
    yield from press("ESC")
    with in_view():
        bpy.ops.wm.call_menu(name="VIEW3D_MT_object_context_menu")
    yield
    driver.screenshot("context-menu")
    yield from press("ESC")
    with in_view():
        bpy.ops.wm.call_menu_pie("INVOKE_DEFAULT", name="HAIRLOOM_MT_pie")
    yield
    driver.screenshot("pie")
    yield from press("ESC")


def a_key_of_ones_own():
    """Preview's shortcut has no key by default; with a key of the user's it presses the button."""
    assert preview_key().type == "NONE", "Hairloom takes a key that nobody gave it"
    preview_key().type = "F19"
    count = len(live().sessions())
    view = region("WINDOW")
    x, y = view.x + view.width // 2, view.y + view.height // 2
    bpy.context.window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
    yield
    yield from press("F19", x, y)
    yield from wait_until(lambda: len(live().sessions()) != count, "the key does nothing")
    yield from press("F19", x, y)
    yield from wait_until(lambda: len(live().sessions()) == count, "the key works once")
    yield from wait_for_hair()
    preview_key().type = "NONE"


def preview_key():
    """The keymap item, looked up each time, since Blender recreates items when it merges
    keymaps."""
    keymap = bpy.context.window_manager.keyconfigs.user.keymaps["3D View"]
    (item,) = (each for each in keymap.keymap_items if each.idname == "hairloom.preview")
    return item


def a_warning_mends():
    hair, head = bpy.data.objects["Ball Hair"], bpy.data.objects["Ball"]
    live().stop_all()
    hair.data.surface, hair.parent = None, None
    hair.scale.x = 1.4
    assert bpy.ops.hairloom.preview() == {"FINISHED"}
    properties = next(a for a in bpy.context.screen.areas if a.type == "PROPERTIES")
    bpy.ops.hairloom.show_settings()
    yield
    driver.screenshot("warnings")
    assert properties.spaces.active.context == "DATA"
    assert bpy.ops.hairloom.set_surface() == {"FINISHED"} and hair.data.surface == head
    assert bpy.ops.hairloom.apply_scale() == {"FINISHED"}
    yield from wait_until(
        lambda: live().sessions() and live().sessions()[0].head is not None, "it has no head yet"
    )
    issues = hairloom_module("diagnostics").issues_of(hair, live().sessions()[0])
    driver.screenshot("mended")
    assert [issue.operator for issue in issues] in ([], ["hairloom.snap_roots"])


def to_the_engine():
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "cards.glb")
        bpy.ops.hairloom.apply_preset(name="cards/crowd")
        assert bpy.ops.hairloom.export_cards(filepath=path) & {"FINISHED", "RUNNING_MODAL"}
        yield from wait_until(lambda: os.path.isfile(path), "no cards were written")
    yield


def the_page_in_the_preferences():
    area = viewport()
    area.type = "PREFERENCES"
    bpy.context.preferences.active_section = "ADDONS"
    bpy.context.window_manager.addon_search = "hairloom"
    bpy.ops.preferences.addon_expand(module=driver.EXTENSION)
    yield
    assert bpy.ops.hairloom.self_test() == {"FINISHED"}
    checks = hairloom_module("self_test").last_report()
    failed = [check for check in checks if check.outcome == "failed"]
    assert not failed and sum(check.outcome == "passed" for check in checks) >= 5, checks
    bpy.ops.hairloom.copy_report()
    assert "Drawing, Marschner" in bpy.context.window_manager.clipboard
    yield
    driver.screenshot("preferences")
    page = hairloom_module("preferences").preferences(bpy.context)
    assert page.bl_rna.identifier.startswith("HAIRLOOM"), "it is the defaults, not the page"
    page.look = "looks/red"
    area.type = "VIEW_3D"
    yield


driver.play_session(steps())
