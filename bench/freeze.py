"""How long the window stands still: the main thread's stops while hair is shown, played and set.

The sample scene at default settings. For each thing that an artist does, the longest stop of the
main thread, in wall time and in its own processor time: on a machine that does other work as well
the latter is what counts. Drawing is left out. Play waits for its collider as in a window; the
ticks of that time are `waiting`.

make bench NAME="freeze --form numpy"
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from collections.abc import Callable

import bpy
import gpu

import hairloom
from hairloom.addon.host.colliders import fields
from hairloom.addon.host.preview import live, reactions
from hairloom.addon.host.sample_scene import add_sample_scene

RATE, FRAMES, MOVES = 24.0, 24, 8
#: group of settings -> a slider of it and what it is dragged to
SLIDERS = {
    "dynamics.damping": 0.3,
    "shading.sparkle": 0.5,
    "strands.width_scale": 1.5,
    "guides.guide_count": 400,
}


class Stops:
    """The longest stop of each kind, (wall, processor) [ms]."""

    def __init__(self) -> None:
        self.longest: dict[str, tuple[float, float]] = {}

    def timed[T](self, kind: str, action: Callable[[], T]) -> T:
        wall, used = time.perf_counter(), time.thread_time()
        result = action()
        wall, used = time.perf_counter() - wall, time.thread_time() - used
        known = self.longest.get(kind, (0.0, 0.0))
        now = round(1000.0 * wall, 1), round(1000.0 * used, 1)
        self.longest[kind] = max(known[0], now[0]), max(known[1], now[1])
        return result


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--form", default="automatic", help="automatic, compute or numpy")
    form = options.parse_args().form
    gpu.init()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    hairloom.register()
    scene, hair = add_sample_scene(())
    hair.hairloom.dynamics.form = form
    depsgraph = scene.view_layers[0].depsgraph
    stops = Stops()
    session = stops.timed("preview", lambda: live.start(hair, depsgraph))
    stops.timed("fields are begun", lambda: session.make_fields(depsgraph))
    stops.timed("play", lambda: live.play(depsgraph, waits=False))

    def tick() -> None:
        live.advance(depsgraph, 1.0 / RATE)

    ticks, begin = 0, time.perf_counter()
    while live.is_waiting(session):
        stops.timed("waiting" if not fields.are_made() else "play begins", tick)
        time.sleep(1.0 / RATE)
        ticks += 1
    waited = time.perf_counter() - begin
    stops.timed("first frame", tick)
    for _ in range(FRAMES):
        stops.timed("frame", tick)
    for name, value in SLIDERS.items():
        drag(stops, hair, name, value)
        stops.timed(f"{name}: read again", lambda: reactions.catch_up(depsgraph))
        stops.timed(f"{name}: frame", tick)
    facts = {
        "longest stops [ms], wall and processor": stops.longest,
        "ticks until the collider was made": ticks,
        "seconds until then": round(waited, 1),
        "computed on": session.computed_on,
        "renderer": gpu.platform.renderer_get(),
        "python": platform.python_version(),
    }
    print(json.dumps(facts))
    hairloom.unregister()


def drag(stops: Stops, hair: bpy.types.Object, name: str, value: float) -> None:
    """Move a slider step by step, as a mouse does."""
    section, parameter = name.split(".")
    owner = hair.hairloom if hasattr(hair.hairloom, section) else hair.data.hairloom
    group = getattr(owner, section)
    before = getattr(group, parameter)
    for step in range(1, MOVES + 1):
        there = before + (value - before) * step / MOVES
        kind = type(before)
        stops.timed(name, lambda there=there, kind=kind: setattr(group, parameter, kind(there)))


main()
