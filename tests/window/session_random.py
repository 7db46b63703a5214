"""Random actions from five seeds: no exception, no crash, and nothing is left behind.

Each action is printed before it runs, so that the log of a crash ends with its cause. A seed
gives the same actions on every backend: HAIRLOOM_SEEDS="3" HAIRLOOM_ACTIONS="120" plays the first
120 of seed 3 again.
"""

import os
import sys
import tempfile
import time
from inspect import isgenerator
from pathlib import Path

import addon_utils
import bpy

sys.path.append(str(Path(__file__).parent))
import driver
import random_blender
import random_hairloom
import traces
from artist import press
from dice import Dice, actions_in
from driver import wait_until

SEEDS = [int(seed) for seed in os.environ.get("HAIRLOOM_SEEDS", "1 2 3 4 5").split()]
ACTIONS = actions_in(random_hairloom, random_blender)
ACTION_COUNT = int(os.environ.get("HAIRLOOM_ACTIONS", "80"))
#: fraction of actions that are followed by a redraw, so that several are combined in one
REDRAWN = 0.3
#: part of a tick, in which Blender redraws
BRIEFLY = 0.1
RAISED = ("Traceback (most recent call last)", "Error: Python:", "SystemError")

log = traces.Log()


def steps():
    yield from press("ESC")  # the splash screen takes the first event
    driver.enable_extension()  # once before: Blender turns menus into lists the first time
    addon_utils.disable(driver.EXTENSION, default_set=True)
    yield
    before = traces.blender_traces()
    driver.enable_extension()
    enabled = traces.blender_traces()
    assert enabled != before, "the traces show nothing"
    with tempfile.TemporaryDirectory() as folder:
        for seed in SEEDS:
            yield from play(seed, Path(folder))
            bpy.ops.wm.read_homefile(use_factory_startup=False)
            yield from wait_until(lambda: is_at_rest(enabled), f"seed {seed}: something is left")
    addon_utils.disable(driver.EXTENSION, default_set=True)
    # a thread that makes a collider has to end first
    yield from wait_until(lambda: traces.blender_traces() == before, "something of ours is left")
    assert driver.timers.pending() == []
    assert "Traceback" not in log.new_output(), "disabling raised"


def play(seed, folder):
    dice, began, refused = Dice(seed, folder), time.monotonic(), 0
    bpy.ops.wm.read_homefile(use_factory_startup=False)
    yield
    shrink_the_view()
    for number in range(ACTION_COUNT):
        try:
            refused += yield from act(dice, f"{seed}.{number}")
        except Exception as error:
            again = f"HAIRLOOM_SEEDS={seed} HAIRLOOM_ACTIONS={number + 1}"
            raise AssertionError(f"seed {seed}, action {number}; again by {again}") from error
    print(
        f"seed {seed}: {ACTION_COUNT} actions, {refused} refused, "
        f"{time.monotonic() - began:.0f} s, {len(bpy.data.objects)} objects",
        flush=True,
    )


def act(dice, number):
    """Perform one action; whether it was refused."""
    action, is_refused = dice.action(ACTIONS), False
    print(f"{number} {action.__name__} at {time.process_time():.1f} s", flush=True)
    try:
        doing = action(dice)
        if isgenerator(doing):
            yield from doing
    except RuntimeError as error:  # Blender raises it for an operator's report
        assert "Traceback" not in str(error), error
        is_refused = True
    if dice.happens(REDRAWN):
        yield BRIEFLY
    output = log.new_output()
    assert not any(sign in output for sign in RAISED), f"{action.__name__} raised"
    return is_refused


def shrink_the_view():
    """A small view, since drawing takes most of the time."""
    area = next(a for a in bpy.context.window.screen.areas if a.type == "VIEW_3D")
    for direction, part in (("VERTICAL", 0.4), ("HORIZONTAL", 0.4)):
        with bpy.context.temp_override(area=area):
            bpy.ops.screen.area_split(direction=direction, factor=part)
        others = [a for a in bpy.context.window.screen.areas if a.type == "VIEW_3D"]
        area = min(others, key=lambda a: a.width * a.height)
        for other in others:
            if other != area:
                other.type = "TEXT_EDITOR"


def is_at_rest(enabled):
    """Whether loading an empty file has ended all activity."""
    is_idle = not any(traces.preview_traces().values()) and driver.timers.pending() == []
    return is_idle and traces.blender_traces() == enabled


driver.play_session(steps())
