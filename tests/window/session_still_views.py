"""Views without changes show their last picture again; any change is visible at once."""

import sys
import time
from pathlib import Path

import bpy
from mathutils import Euler

sys.path += [str(Path(__file__).parent), str(Path(__file__).parents[2] / "tools")]
import driver
from artist import changed_fraction, look_from_front, new_head, press, still_pixels, viewport
from driver import hairloom_module, wait_until
from gpu_calls import gpu_calls

#: fraction of a view's pixels by which Blender's own redraws differ
SAME = 0.002
#: how often strands were drawn, and how often a picture was shown again
counted = {"drawn": 0, "again": 0}


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()
    count_draws()
    yield from set_the_scene()
    yield from nothing_is_drawn_twice("solid")
    yield from what_is_in_the_way_is_seen()
    yield from what_a_view_shows_is_seen()
    yield from after_an_orbit_shadows_are_exact()
    yield from what_moves_waits_for_nothing()
    viewport().spaces.active.shading.type = "MATERIAL"
    yield from still_pixels("material")
    yield from it_comes_to_rest()
    yield from a_ball_comes_and_goes("material")
    assert hairloom_module("overlay").failure() == ""


def count_draws():
    kept, strands = (
        hairloom_module("cached_picture").CachedPicture,
        hairloom_module("strand_pass").StrandPass,
    )
    for owner, name, key in ((kept, "show", "again"), (strands, "draw", "drawn")):
        setattr(owner, name, counting(getattr(owner, name), key))


def counting(original, key):
    def count(*values, **options):
        counted[key] += 1
        return original(*values, **options)

    return count


def set_the_scene():
    new_head()
    bpy.ops.hairloom.grow(strand_count=1500, length=0.06)
    bpy.context.object.data.hairloom.children.method = "none"
    viewport().spaces.active.overlay.show_overlays = False
    look_from_front(0.7)
    bpy.ops.hairloom.preview()
    yield from wait_until(lambda: counted["drawn"], "no hair is drawn")
    yield from still_pixels("at-first")


def nothing_is_drawn_twice(label):
    before = yield from still_pixels(f"{label}-before")
    drawn, again = counted.values()
    after = yield from still_pixels(f"{label}-after")
    assert counted["drawn"] == drawn, "strands are drawn afresh"
    assert counted["again"] >= again + 3
    assert changed_fraction(before, after, 0.01) == 0.0


def what_is_in_the_way_is_seen():
    """Objects before the hair hide it: a ball, and the head, which is hidden and shown again."""
    before = yield from a_ball_comes_and_goes("solid")
    for hidden in (True, False):
        bpy.data.objects["Head"].hide_set(hidden)
        found = yield from still_pixels(f"head-hidden-{hidden}")
        assert (changed_fraction(before, found) < SAME) != hidden


def a_ball_comes_and_goes(label):
    """A ball before the hair is added and removed; returns the view before."""
    before = yield from still_pixels(f"{label}-nothing-in-the-way")
    ball = bpy.data.objects.new("Ball", bpy.data.objects["Head"].data)
    bpy.context.scene.collection.objects.link(ball)
    ball.location = 0.05, -0.2, 0.0
    covered = yield from still_pixels(f"{label}-ball-in-the-way")
    assert changed_fraction(before, covered) > 0.02
    expected = yield from drawn_afresh(f"{label}-ball-afresh")
    assert changed_fraction(covered, expected) < SAME
    bpy.data.objects.remove(ball)
    back = yield from still_pixels(f"{label}-ball-gone")
    assert changed_fraction(before, back) < SAME
    return before


def what_a_view_shows_is_seen():
    shading = viewport().spaces.active.shading
    before = yield from still_pixels("opaque")
    shading.show_xray = True
    through = yield from still_pixels("x-ray")
    expected = yield from drawn_afresh("x-ray-afresh")
    assert changed_fraction(before, through) > 0.005 and changed_fraction(through, expected) < SAME
    shading.show_xray = False
    back = yield from still_pixels("opaque-again")
    assert changed_fraction(before, back) < SAME


def after_an_orbit_shadows_are_exact():
    view = viewport().spaces.active.region_3d
    for degrees in range(0, 30, 3):
        view.view_rotation = Euler((1.5708, 0.0, degrees / 57.3)).to_quaternion()
        yield 1
    found = yield from still_pixels("orbited")
    expected = yield from drawn_afresh("orbited-afresh", with_maps=True)
    assert changed_fraction(found, expected, 0.02) == 0.0
    look_from_front(0.7)
    yield from still_pixels("orbited-back")


def what_moves_waits_for_nothing():
    """In frames of an orbit, and of playback with simulation, draws read nothing back."""
    strands, reads, space = hairloom_module("strand_pass").StrandPass, [], viewport().spaces.active
    draw = strands.draw

    def noted(*values, **options):
        if options["view"].is_moving:
            reads.append(gpu_calls(lambda: draw(*values, **options))["reads"])
        else:
            draw(*values, **options)

    strands.draw = noted
    for degrees in range(0, 30, 3):
        space.region_3d.view_rotation = Euler((1.5708, 0.0, degrees / 57.3)).to_quaternion()
        yield 1
    assert len(reads) >= 5 and not any(reads), reads
    reads.clear()
    bpy.ops.screen.animation_play()
    yield from wait_until(lambda: len(reads) > 12, "the hair does not play")
    bpy.ops.screen.animation_cancel(restore_frame=True)
    strands.draw = draw
    assert not any(reads), reads
    look_from_front(0.7)
    yield from still_pixels("played-back")


def drawn_afresh(label, *, with_maps=False):
    """The view without any cached picture."""
    views = hairloom_module("views")
    for view in views._known.views.values():
        view.picture.forget()
    if with_maps:
        for each in hairloom_module("overlay")._overlay.drawn.values():
            each.hair.strands.forget_views(frozenset())
    return (yield from still_pixels(label))


def it_comes_to_rest():
    """An engine redraws a view for its samples; afterwards hair is drawn once more, then never."""

    def rests():
        """Whether hair is not drawn for 60 ticks; False as soon as it is drawn."""
        drawn = counted["drawn"]
        for _ in range(60):
            yield 1
            if counted["drawn"] > drawn:
                return False
        return True

    end = time.monotonic() + driver.TIMEOUT_S
    while not (yield from rests()):
        assert time.monotonic() < end, "a view in which nothing changes is drawn for ever"
    assert counted["again"] > 0


driver.play_session(steps())
