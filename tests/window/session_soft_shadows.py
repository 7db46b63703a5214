"""Soft shadows of a view at rest: they appear, disappear at once with any change, and cost nothing
afterwards."""

import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler

sys.path.append(str(Path(__file__).parent))
import driver
from artist import (
    changed_fraction,
    hide_floor,
    look_from_front,
    new_fringe,
    press,
    still_pixels,
    viewport,
)
from driver import hairloom_module, wait_until

SAMPLES = 12
#: fraction of a view's pixels by which Blender's own redraws differ
SAME = 0.002
#: how often strands were drawn, and how often as a sample of soft shadows
counted = {"drawn": 0, "samples": 0}


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    count_draws()
    yield from set_the_scene()
    hard = yield from hard_is_what_it_was()
    soft = yield from shadows_become_soft(hard)
    yield from nothing_more_is_drawn(soft)
    yield from what_changes_is_hard_at_once(soft)
    yield from one_sample_tells_whether_all_is_right(soft)
    yield from without_samples_all_is_let_go_of(hard)
    assert hairloom_module("overlay").failure() == ""


def count_draws():
    strands = hairloom_module("strand_pass").StrandPass
    draw = strands.draw

    def count(*values, **options):
        counted["samples" if options["view"].is_sample else "drawn"] += 1
        return draw(*values, **options)

    strands.draw = count


def set_the_scene():
    """A fringe above a ball, under a wide sun, in a view with the scene's lights."""
    bpy.context.scene.render.engine = "BLENDER_WORKBENCH"
    _, _, sun = new_fringe(2000)
    sun.data.angle = np.radians(20.0)
    shading = viewport().spaces.active.shading
    shading.type = "RENDERED"
    shading.use_scene_lights_render = shading.use_scene_world_render = True
    hide_floor()
    look_from_front(0.6)
    bpy.ops.hairloom.preview()
    yield from wait_until(lambda: counted["drawn"], "no hair is drawn")
    yield


def picture():
    return bpy.context.scene.hairloom.picture


def views():
    return hairloom_module("views").known_views()


def held():
    hairloom_module("gpu_objects").free_unused()
    return hairloom_module("gpu_objects").bytes_in_use()


def hard_is_what_it_was():
    """Without a GPU, and with one sample on a GPU, the pixels are the same."""
    picture().viewport_samples = SAMPLES
    before = yield from still_pixels("no-gpu")
    hairloom_module("softening").is_software = lambda: False
    picture().viewport_samples = 1
    hard = yield from still_pixels("hard")
    assert changed_fraction(before, hard, 0.0) == 0.0 and not counted["samples"]
    return hard


def shadows_become_soft(hard):
    picture().viewport_samples = SAMPLES
    yield from wait_until(
        lambda: all(each.has_all_samples for each in views()), "shadows stay hard"
    )
    soft = yield from still_pixels("soft")
    assert counted["samples"] >= SAMPLES
    assert changed_fraction(hard, soft, 0.05) > 0.003, changed_fraction(hard, soft, 0.05)
    # the same brightness
    assert abs(hard.mean() - soft.mean()) < 0.01
    return soft


def nothing_more_is_drawn(soft):
    """Nothing is drawn, however often the view is shown, except for one sample after each series of
    redraws, which checks whether the picture is still right.
    """
    before = dict(counted)
    again = yield from still_pixels("soft-again")
    assert changed_fraction(soft, again, 0.0) == 0.0
    # on a slow machine each of these redraws is its own series
    assert all(each.is_soft and each.has_all_samples for each in views())
    shown = counted["samples"]
    for _ in range(60):
        yield 1
    assert counted["drawn"] == before["drawn"] and counted["samples"] <= shown + 1


def what_changes_is_hard_at_once(soft):
    """After a change shadows are hard, then soft again; with the change undone, the pixels are the
    same."""
    region, sun = viewport().spaces.active.region_3d, bpy.data.objects["Sun"]
    hair = bpy.data.objects["Hair"].data.hairloom

    def turn():
        region.view_rotation = Euler((1.5708, 0.0, 0.3)).to_quaternion()

    def turn_the_sun():
        sun.rotation_euler.x += 0.2

    def comb():
        hair.strands.fullness = 2.0

    for change, back in (
        (turn, lambda: look_from_front(0.6)),
        (turn_the_sun, lambda: setattr(sun.rotation_euler, "x", np.radians(25.0))),
        (comb, lambda: setattr(hair.strands, "fullness", 3.0)),
    ):
        for name, act in ((change.__name__, change), (f"{change.__name__}-back", back)):
            drawn = counted["drawn"]
            act()
            yield from wait_until(
                lambda drawn=drawn: counted["drawn"] > drawn, f"{name}: not drawn"
            )
            assert not any(each.is_soft for each in views()), f"{name}: soft shadows that were"
            yield from wait_until(
                lambda: all(each.has_all_samples for each in views()), f"{name}: stays hard"
            )
            found = yield from still_pixels(name)
        assert changed_fraction(soft, found, 0.02) < SAME, (
            name,
            changed_fraction(soft, found, 0.02),
        )


def one_sample_tells_whether_all_is_right(soft):
    """An engine may draw something before the hair later. Simulated with a view that is asked to
    check again, and with one that had more hair before.
    """
    drawn = counted["drawn"]
    for fragments, least in ((None, 1), ((1 << 30,), SAMPLES)):
        for view in views():
            view.needs_redraw, view.fragment_counts = True, fragments or view.fragment_counts
        before = counted["samples"]
        hairloom_module("views")._redraw_strands()
        yield from wait_until(
            lambda before=before: (
                counted["samples"] > before and not any(each.wants_samples for each in views())
            ),
            "no sample is taken",
        )
        assert least <= counted["samples"] - before < least + 2, (before, counted)
        assert all(each.is_soft for each in views())
    assert counted["drawn"] == drawn
    found = yield from still_pixels("looked-again")
    assert changed_fraction(soft, found, 0.02) < SAME


def without_samples_all_is_let_go_of(hard):
    assert hairloom_module("softening").sample_picture().count == 0
    soft_held = held()
    picture().viewport_samples = 1
    found = yield from still_pixels("hard-again")
    assert changed_fraction(hard, found, 0.02) < SAME
    assert held() == soft_held, "samples leave something on the GPU"


driver.play_session(steps())
