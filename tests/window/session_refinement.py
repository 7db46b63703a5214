"""Refinement on screen: children, the debug views, counts, hidden strands, far and near."""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    changed_fraction,
    click,
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
from driver import hairloom_module, wait_until

GUIDES, CHILDREN = 300, 2000


def session():
    (one,) = hairloom_module("previews").sessions()
    return one


def statistics():
    """Statistics of the last draw in the viewport."""
    return hairloom_module("overlay").statistics_of(session().uid)


def has_drawn_some():
    return statistics().strands > 0


def draws_all():
    return statistics().strands == GUIDES + CHILDREN


def hair():
    return bpy.data.objects["Hair"]


def corner(picture):
    """The corner with the counts."""
    return picture[-50:, :700]


def saturation(picture):
    """The fraction of strongly coloured pixels, as in debug views, unlike hair."""
    return float((np.ptp(picture, axis=2) > 0.4).mean())


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    yield from set_the_scene()
    yield from children_appear()
    yield from debug_views_and_counts()
    yield from what_the_head_hides()
    yield from far_and_near()
    yield from sliders_while_it_plays()
    yield from two_grooms()
    assert hairloom_module("overlay").failure() == ""


def set_the_scene():
    new_head(keeps_light=True)
    bpy.ops.object.shade_smooth()
    bpy.ops.hairloom.grow(method="normals", lift=1.0, strand_count=GUIDES, length=0.08)
    bpy.context.object.name = "Hair"
    hair().data.hairloom.strands.fullness = 3.0  # few strands would hardly be visible otherwise
    overlays = viewport().spaces.active.overlay
    overlays.show_floor = overlays.show_cursor = overlays.show_object_origins = False
    look_from_front(0.7)
    yield from open_our_sidebar()
    yield from click(*sidebar_button("hairloom.preview"))
    yield from wait_until(has_drawn_some, "no hair is drawn")


def children_appear():
    before = yield from redrawn_pixels("guides")
    children = hair().data.hairloom.children
    children.method, children.strand_count = "multi", CHILDREN
    yield from strands_come(GUIDES + CHILDREN)
    yield from wait_until(
        lambda: changed_fraction(before, pixels("children")) > 0.05, "no children are seen"
    )


def strands_come(count):
    """Wait for this number of strands after edits."""
    yield from wait_until(
        lambda: session().rig.strands.strand_count == count, f"not {count} strands"
    )


def debug_views_and_counts():
    hair().hairloom.debug_view = "none"
    plain = yield from still_pixels("plain")
    hair().hairloom.show_counts = True
    yield from wait_until(
        lambda: changed_fraction(corner(plain), corner(pixels("counts"))) > 0.01,
        "no counts are to be seen",
    )
    counted = yield from still_pixels("counts")
    assert changed_fraction(plain[:-60], counted[:-60]) < 0.003, "the counts lie over something"
    hair().hairloom.show_counts = False
    assert saturation(plain) < 0.01
    for view in ("detail", "guide", "group"):
        hair().hairloom.debug_view = view
        yield
        yield from wait_until(lambda view=view: saturation(pixels(view)) > 0.02, view)
        shown = pixels(view)
        assert changed_fraction(corner(plain), corner(shown)) > 0.01, (
            "a debug view without its counts"
        )
    hair().hairloom.debug_view = "occlusion"  # in grey
    yield
    yield from wait_until(
        lambda: changed_fraction(shown, pixels("occlusion")) > 0.02, "no occlusion is shown"
    )
    grey = yield from redrawn_pixels("occlusion")
    assert saturation(grey) < 0.01
    overlays = viewport().spaces.active.overlay
    overlays.show_overlays = False
    yield from wait_until(
        lambda: changed_fraction(corner(plain), corner(pixels("without-overlays"))) < 0.003,
        "counts without overlays",
    )
    overlays.show_overlays = True
    hair().hairloom.debug_view = "none"
    yield


def what_the_head_hides():
    detail, shading = hair().data.hairloom.detail, viewport().spaces.active.shading
    detail.lod_size = 0.0
    detail.culling = "none"
    yield from wait_until(draws_all, "strands are missing")
    everything = yield from still_pixels("nothing-left-out")
    count = GUIDES + CHILDREN
    detail.culling = "hidden"
    yield from wait_until(
        lambda: 0.3 * count < statistics().strands < 0.95 * count, "the head hides no strands"
    )
    left = yield from still_pixels("hidden-left-out")
    assert changed_fraction(everything, left) < 0.0005, "what is seen was left out"
    shading.show_xray = True
    yield from wait_until(draws_all, "the head hides hair in X-ray")
    driver.screenshot("xray")
    shading.show_xray = False
    bpy.data.objects["Head"].hide_set(True)
    yield from wait_until(draws_all, "a hidden head hides hair")
    driver.screenshot("hidden-head")
    bpy.data.objects["Head"].hide_set(False)
    yield
    detail.lod_size = 300.0
    yield


def far_and_near():
    drawn = {}
    hair().hairloom.show_counts = True
    for distance in (0.15, 0.7, 5.0):
        look_from_front(distance)
        yield
        drawn[distance] = statistics()
        driver.screenshot(f"from-{distance}-m")
    each = {distance: one.pieces / one.strands for distance, one in drawn.items()}
    assert each[0.15] >= each[0.7] >= each[5.0], each
    assert drawn[5.0].strands < 0.4 * drawn[0.7].strands, drawn
    look_from_front(0.7)
    yield


def sliders_while_it_plays():
    live, head = hairloom_module("previews"), bpy.data.objects["Head"]
    yield from click(*sidebar_button("hairloom.play"))
    yield from wait_until(live.is_playing, "the Play button did nothing")
    children = hair().data.hairloom.children
    for count, x in ((500, 0.02), (3000, 0.04), (1000, 0.0)):
        children.strand_count = count
        head.location.x = x
        yield from strands_come(GUIDES + count)
        assert live.is_playing()
    children.method = "single"
    yield
    children.method = "none"
    yield from strands_come(GUIDES)
    children.method = "multi"
    yield from strands_come(GUIDES + 1000)
    driver.screenshot("playing")
    bpy.ops.ed.undo_push(message="playing")
    children.strand_count = 700
    bpy.ops.ed.undo_push(message="fewer")
    yield from strands_come(GUIDES + 700)
    bpy.ops.ed.undo()
    yield from strands_come(GUIDES + 1000)
    assert live.is_playing()
    yield from press("ESC")
    yield from wait_until(lambda: not live.is_playing(), "ESC does not end Play")


def two_grooms():
    """The counts of both are shown one above the other."""
    twin = bpy.data.objects.new("Twin", hair().data)
    bpy.context.collection.objects.link(twin)
    twin.hairloom.show_counts = True
    live = hairloom_module("previews")
    live.start(twin, bpy.context.evaluated_depsgraph_get())
    look_from_front(1.2)
    yield from wait_for_hair()
    yield
    driver.screenshot("two-grooms")
    assert len(live.sessions()) == 2
    live.stop_all()
    yield
    assert hairloom_module("overlay")._overlay.handles == ()


driver.play_session(steps())
