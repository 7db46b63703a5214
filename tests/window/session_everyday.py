"""Everyday actions of artists: open every panel, hide, local view, overlays, duplicate, play the
animation; and faults: hair without a surface, a GPU that refuses a shader."""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    changed_fraction,
    click,
    find_field,
    hide_floor,
    look_from_front,
    new_head,
    open_our_sidebar,
    pixels,
    press,
    redrawn_pixels,
    sidebar_button,
    still_pixels,
    viewport,
    wait_for_hair,
)
from dice import press as press_in_view
from driver import hairloom_module, wait_until

failures: list[str] = []
drawn: set[str] = set()


def steps():
    yield from press("ESC")
    driver.enable_extension()
    watch_panels()
    yield from nothing_selected()
    yield from set_the_scene()
    yield from the_panel_keeps_still()
    yield from every_panel_draws()
    yield from hiding_and_local_view()
    yield from what_acts_on_it()
    yield from duplicates_by_keys()
    yield from blenders_own_animation()
    yield from hair_without_a_surface()
    yield from a_failing_shader_is_reported_once()
    assert failures == [], failures


def watch_panels():
    """Open all panels, and record every exception of their draw functions, which Blender only
    prints."""
    panels = [each for each in hairloom_module("registration").CLASSES if "_PT_" in each.__name__]
    for each in reversed(panels):
        bpy.utils.unregister_class(each)
    for each in panels:
        each.draw = watched(each)
        each.bl_options = set()
        bpy.utils.register_class(each)


def watched(panel):
    original, name = panel.draw, panel.__name__

    def draw(self, context):
        try:
            original(self, context)
            drawn.add(name)
        except Exception as error:
            failures.append(f"{name}: {error!r}")

    return draw


def nothing_selected():
    """An empty scene: buttons are grey, and nothing raises."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    yield from open_our_sidebar()
    yield from click(*sidebar_button("hairloom.preview"))
    yield
    driver.screenshot("nothing-selected")
    assert hairloom_module("previews").sessions() == ()


def set_the_scene():
    new_head()
    bpy.ops.hairloom.grow(strand_count=800, length=0.12)
    bpy.context.object.name = "Hair"
    bpy.context.object.data.add_curves([1, 1, 1])
    hide_floor()
    look_from_front(0.9)
    yield


def the_panel_keeps_still():
    """A field below all messages about the hair stays under the mouse, whatever they are."""
    live, hair, places = hairloom_module("previews"), bpy.data.objects["Hair"], {}
    places["not previewed"] = yield from find_field(viewport(), "UI", "hide_original")
    before = places["not previewed"]
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_for_hair()
    places["at rest"] = yield from find_field(viewport(), "UI", "hide_original", expected=before)
    yield from click(*sidebar_button("hairloom.play"))
    yield from wait_until(live.is_playing, "it does not play")
    places["playing"] = yield from find_field(viewport(), "UI", "hide_original", expected=before)
    yield from click(*sidebar_button("hairloom.play"))
    hair.scale.x = 1.4
    yield
    places["with a problem"] = yield from find_field(
        viewport(), "UI", "hide_original", expected=before
    )
    driver.screenshot("with-a-problem")
    hair.scale.x = 1.0
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_until(lambda: not live.sessions(), "the preview goes on")
    # the mouse moves in steps of half a row
    heights = [y for _, y in places.values()]
    assert max(heights) - min(heights) < 20, f"it moves: {places}"


def every_panel_draws():
    """All panels draw in the sidebar and in Properties > Data, with and without a preview."""
    properties = next(a for a in bpy.context.screen.areas if a.type == "PROPERTIES")
    properties.spaces.active.context = "DATA"
    yield
    drawn.clear()
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_for_hair()
    yield
    driver.screenshot("all-panels")
    hair, head = bpy.data.objects["Hair"], bpy.data.objects["Head"]
    fin_modifier = hairloom_module("fin_modifier")
    fin_modifier.add_modifier(head)
    for obj, tab in ((head, "PHYSICS"), (hair, "DATA")):  # a mesh has panels of its own
        bpy.context.active_object.select_set(False)
        obj.select_set(True)
        bpy.context.view_layer.objects.active = obj
        yield
        properties.spaces.active.context = tab
        yield
        driver.screenshot(f"panels-of-{obj.name.lower()}")
    fin_modifier.remove_modifier(head)
    yield from panels_of_the_engine(properties)
    missing = {
        each.__name__ for each in hairloom_module("registration").CLASSES if "_PT_" in each.__name__
    } - drawn
    assert not missing, f"never drawn: {missing}"
    (session,) = hairloom_module("previews").sessions()
    assert session.source.dropped == {"fewer than two points": 3}


def panels_of_the_engine(properties):
    """They are shown while the engine is chosen, with Passes below a panel of Blender's own.
    Hairloom Hair is shown with Blender's engines."""
    render = bpy.context.scene.render
    before, render.engine = render.engine, "HAIRLOOM"
    for tab in ("RENDER", "VIEW_LAYER"):
        properties.spaces.active.context = tab
        yield
        driver.screenshot(f"panels-of-the-engine-{tab.lower()}")
    render.engine = before
    properties.spaces.active.context = "RENDER"
    yield
    driver.screenshot("panels-of-blenders-engine")
    properties.spaces.active.context = "DATA"
    yield


def hiding_and_local_view():
    hair, head = bpy.data.objects["Hair"], bpy.data.objects["Head"]
    shown = yield from still_pixels("shown")
    hair.hide_set(True)
    hidden = yield from still_pixels("hidden")
    assert changed_fraction(shown, hidden) > 0.01, "hidden hair is drawn"
    hair.hide_set(False)
    hair.select_set(True)  # hiding deselects
    again = yield from still_pixels("shown-again")
    assert changed_fraction(shown, again) < 0.003

    hair.select_set(False)
    head.select_set(True)
    with bpy.context.temp_override(area=viewport(), region=viewport().regions[-1]):
        bpy.ops.view3d.localview(frame_selected=False)
    local = yield from still_pixels("local-view")
    assert changed_fraction(hidden, local) < 0.003, "hair is drawn in a local view without it"
    with bpy.context.temp_override(area=viewport(), region=viewport().regions[-1]):
        bpy.ops.view3d.localview(frame_selected=False)
    out = yield from redrawn_pixels("out-of-local-view")
    assert changed_fraction(local, out) > 0.01


def what_acts_on_it():
    """What acts on hair, and its motion, are lines in the view that Blender's overlay switch
    hides."""
    hair, overlay = bpy.data.objects["Hair"], viewport().spaces.active.overlay
    bpy.ops.object.light_add(type="SUN", rotation=(0.6, 0.6, 0.0))
    ball = bpy.data.objects.new("Ball", bpy.data.objects["Head"].data)
    bpy.context.collection.objects.link(ball)
    hair.hairloom.dynamics.wind_speed = 8.0
    without = yield from still_pixels("no-overlays")
    bpy.data.objects["Head"].vertex_groups.new(name="Shown")
    hair.hairloom.shown_map = "Shown"
    kinds = {"colliders", "wind", "lights", "stretch", "density", "paint"}
    for kind in sorted(kinds):
        hair.hairloom.shown_overlays = set()
        yield from wait_until(
            lambda: changed_fraction(without, pixels("no-overlays-again")) < 1e-4, "lines stay"
        )
        hair.hairloom.shown_overlays = {kind}
        yield from wait_until(
            lambda kind=kind: 0.0002 < changed_fraction(without, pixels(kind)) < 0.1, f"no {kind}"
        )
    hair.hairloom.shown_overlays = kinds
    yield
    driver.screenshot("all-overlays")
    overlay.show_overlays = False
    bare = yield from still_pixels("overlays-off")
    hair.hairloom.shown_overlays = set()
    without = yield from still_pixels("no-overlays")
    assert changed_fraction(bare, without) < 0.001, "lines without overlays"
    overlay.show_overlays = True
    hair.hairloom.dynamics.wind_speed = 0.0
    yield


def duplicates_by_keys():
    """Shift-D and Alt-D while hair plays: it plays on, Blender shows the copy, Ctrl-Z removes
    it."""
    live, hair = hairloom_module("previews"), bpy.data.objects["Hair"]
    choose(hair)
    bpy.ops.ed.undo_push(message="the scene")
    yield from click(*sidebar_button("hairloom.play"))
    yield from wait_until(live.is_playing, "it does not play")
    names = set(bpy.data.objects.keys())
    for held in ({"shift": True}, {"alt": True}):
        yield from press_in_view("D", **held)
        yield from press("RET")  # the copy follows the mouse
        yield from wait_until(lambda: len(bpy.data.objects) > len(names), f"no copy by {held}")
        (copy,) = set(bpy.data.objects.keys()) - names
        yield from still_plays(f"beside a copy by {held}")
        driver.screenshot(f"copy-by-{next(iter(held))}")
        shown = {name: shown_as(name) for name in (copy, "Hair")}
        assert shown == {copy: "TEXTURED", "Hair": "WIRE"}, shown
        yield from press_in_view("Z", ctrl=True)
        yield from wait_until(
            lambda: set(bpy.data.objects.keys()) == names, "Ctrl-Z leaves the copy"
        )
        yield from still_plays("after Ctrl-Z")
    choose(bpy.data.objects["Hair"])
    yield from click(*sidebar_button("hairloom.play"))
    yield from wait_until(lambda: not live.is_playing(), "it plays on")


def still_plays(where):
    live = hairloom_module("previews")
    assert len(live.sessions()) == 1 and live.notice() == "", f"{where}: {live.notice()}"
    before = live.sessions()[0].strands

    def has_moved():
        return not np.array_equal(live.sessions()[0].strands, before)

    yield from wait_until(has_moved, f"{where} it stands still")


def shown_as(name):
    """The display type with which Blender shows an object."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return bpy.data.objects[name].evaluated_get(depsgraph).display_type


def choose(obj):
    for each in bpy.context.selected_objects:
        each.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj


def blenders_own_animation():
    """Space bar: hair without simulation moves with the head and is drawn in every frame."""
    live, head = hairloom_module("previews"), bpy.data.objects["Head"]
    bpy.data.objects["Hair"].hairloom.bake.follows = False
    for frame, x in ((1, 0.0), (40, 0.2)):
        head.location.x = x
        head.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(1)
    at_first = live.sessions()[0].strands
    bpy.ops.screen.animation_play()
    yield from wait_until(lambda: bpy.context.scene.frame_current > 1, "Blender does not play")
    bpy.ops.screen.animation_cancel(restore_frame=False)
    yield
    moved = live.sessions()[0].strands - at_first
    assert np.allclose(moved, [head.matrix_world.translation.x, 0.0, 0.0], atol=1e-5)
    head.animation_data_clear()
    head.location.x = 0.0
    yield


def hair_without_a_surface():
    """Only a warning in the panel."""
    live = hairloom_module("previews")
    hair = bpy.data.objects["Hair"]
    live.stop_all()
    hair.data.surface, hair.parent = None, None
    hair.select_set(True)
    bpy.context.view_layer.objects.active = hair
    yield
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_for_hair()
    yield
    (session,) = live.sessions()
    assert "no surface" in session.source.warnings[0]
    driver.screenshot("without-surface")


def a_failing_shader_is_reported_once():
    overlay = hairloom_module("overlay")
    strand_pass = hairloom_module("strand_pass").StrandPass
    draw, calls = strand_pass.draw, []

    def fail(*_, **__):
        calls.append(1)
        raise RuntimeError("this GPU refuses")

    strand_pass.draw = fail
    for x in (0.01, 0.02, 0.0):
        bpy.data.objects["Hair"].location.x = x
        yield
    driver.screenshot("failing-shader")
    assert len(calls) == 1, f"it was tried {len(calls)} times"
    hair = bpy.data.objects["Hair"].evaluated_get(bpy.context.evaluated_depsgraph_get())
    assert hair.display_type == "TEXTURED", "neither our strands nor Blender's are to be seen"
    assert "this GPU refuses" in hairloom_module("previews").notice()
    strand_pass.draw = draw
    for _ in range(2):  # off and on again
        yield from click(*sidebar_button("hairloom.preview"))
        yield
    assert overlay.failure() == "" and hairloom_module("previews").notice() == ""
    driver.screenshot("drawn-again")


driver.play_session(steps())
