"""How long the main thread blocks the window while hair is shown, played and edited.

The sample scene with default settings, then with 100,000 children. For each action of an artist,
the longest block of the main thread, in wall time and in its own processor time; under other load
the latter counts. Drawing is left out. Play waits for its collider as in a window; the ticks of
that time are `waiting`. Hair is made in a thread: `arrives` is the main thread's work to show it.
The heartbeat is a sleep of a millisecond, which the thread delays; it is to be compared with the
heartbeat without a thread, which only other load delays. Its second number excludes the wait for a
processor, if the system (Linux) reports it: the rest is due to the thread. Programs are compiled
before, which the bench `compile` times.

make bench NAME=freeze
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import bpy
import numpy as np
from _report import report, start

import hairloom
from hairloom.addon.blender.base import latest_job
from hairloom.addon.blender.base.parts import run_parts
from hairloom.addon.blender.colliders import fields
from hairloom.addon.blender.preview import previews, scene_events
from hairloom.addon.blender.preview.phases import Phase
from hairloom.addon.blender.scene.surfaces import read_surface
from hairloom.addon.blender.sessions.session import Session
from hairloom.addon.blender.setup.sample_scene import add_sample_scene

REFERENCE = "a heartbeat without a thread, and what Blender itself takes"
#: longest block of the main thread [ms of processor time]: with default settings, while 100,000
#: children arrive, and while these are combed
MAX_LIMITS = {"default_ms": 40.0, "arrival_100k_ms": 100.0, "combing_100k_ms": 100.0}
RATE, FRAMES, MOVES, BEATS = 24.0, 24, 8, 2000
#: section and name of a slider -> the value that it is dragged to
SLIDERS = {
    "dynamics.damping": 0.3,
    "shading.sparkle": 0.5,
    "strands.fullness": 1.5,
    "guides.guide_count": 400,
}


class Stops:
    """The longest block of each kind, (wall, processor) [ms]."""

    def __init__(self) -> None:
        self.longest: dict[str, tuple[float, float]] = {}

    def timed[T](self, kind: str, action: Callable[[], T]) -> T:
        wall, used = time.perf_counter(), time.thread_time()
        result = action()
        self._note(kind, time.perf_counter() - wall, time.thread_time() - used)
        return result

    def beat(self, kind: str, pause: float = 0.001) -> None:
        """Note how late a sleep of this long [s] ends, with and without its wait for a
        processor."""
        begin, queued = time.perf_counter(), queued_time()
        time.sleep(pause)
        late = time.perf_counter() - begin - pause
        self._note(kind, late, late - (queued_time() - queued))

    def _note(self, kind: str, one: float, other: float) -> None:
        known = self.longest.get(kind, (0.0, 0.0))
        now = round(1000.0 * one, 1), round(1000.0 * other, 1)
        self.longest[kind] = max(known[0], now[0]), max(known[1], now[1])

    def figures(self) -> dict[str, float]:
        """The blocks of each kind, and the figures with limits: the longest [ms of processor
        time]."""
        ours = {
            kind: cpu
            for kind, (_, cpu) in self.longest.items()
            if "heartbeat" not in kind and "Blender" not in kind
        }
        many = {
            start: [cpu for kind, cpu in ours.items() if kind.startswith(start)]
            for start in ("children", "comb")
        }
        default = [cpu for kind, cpu in ours.items() if not kind.startswith(tuple(many))]
        found = {
            "default_ms": max(default),
            "arrival_100k_ms": max(many["children"]),
            "combing_100k_ms": max(many["comb"]),
        }
        for kind, (wall, cpu) in self.longest.items():
            found |= {f"{_slug(kind)}_wall_ms": wall, f"{_slug(kind)}_cpu_ms": cpu}
        return found


def main() -> int:
    options = argparse.ArgumentParser()
    options.add_argument("--device", default="automatic", help="automatic, compute or numpy")
    options.add_argument("--children", type=int, default=100_000)
    given = options.parse_args()
    start()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    hairloom.register()
    latest_job.is_blocking = lambda: False  # as in a window
    compile_programs(given.device)
    scene, hair = run_parts(add_sample_scene(()))
    hair.hairloom.dynamics.device = given.device
    depsgraph = scene.view_layers[0].depsgraph
    stops = Stops()
    session = stops.timed("preview", lambda: previews.start(hair, depsgraph))
    stops.timed("fields are started", lambda: session.make_fields(depsgraph))
    stops.timed("play", lambda: previews.play(depsgraph, blocking=False))

    def tick() -> None:
        previews.advance(depsgraph, 1.0 / RATE)

    def arrive(kind: str) -> None:
        """Play frames until hair in the making is shown, and one with it."""
        begin = time.perf_counter()
        while session.is_pending:
            due = time.perf_counter() + 1.0 / RATE
            is_there = session.has_result
            stops.timed(f"{kind}: arrives" if is_there else f"{kind}: is made", take)
            stops.timed(f"{kind}: frame meanwhile", tick)
            stops.beat(f"{kind}: heartbeat")
            time.sleep(max(due - time.perf_counter(), 0.0))
        seconds[kind] = time.perf_counter() - begin
        stops.timed(f"{kind}: frame", tick)

    def take() -> None:
        attempt = partial(session.take_made, depsgraph)
        if session.has_result:
            previews.attempt(previews.previews[session.uid], depsgraph, attempt)

    seconds: dict[str, float] = {}
    arrive("preview")
    ticks, begin = 0, time.perf_counter()
    while previews.previews[session.uid].phase is Phase.WAITING:
        stops.timed("waiting" if not fields.are_ready() else "play begins", tick)
        time.sleep(1.0 / RATE)
        ticks += 1
    waited = time.perf_counter() - begin
    stops.timed("first frame", tick)
    for _ in range(FRAMES):
        stops.timed("frame", tick)
    for _ in range(BEATS):
        stops.beat("heartbeat without a thread")

    def read_again(kind: str) -> None:
        stops.timed(f"{kind}: read again", lambda: scene_events.catch_up(depsgraph))
        arrive(kind)

    for name, value in SLIDERS.items():
        drag(stops, hair, name, value)
        read_again(name)
    hair.data.hairloom.children.strand_count = given.children
    hair.data.hairloom.children.method = "multi"
    read_again("children")
    for kind in ("comb", "comb again"):
        stops.timed(f"{kind}: Blender evaluates", lambda: comb(hair, scene))
        session.is_stale = True
        read_again(kind)
    figures = stops.figures() | {
        "strands": session.rig.strands.strand_count,
        "device": session.device_name,
        "collider_ticks": ticks,
        "collider_seconds": waited,
        **{f"{_slug(kind)}_seconds": taken for kind, taken in seconds.items()},
    }
    previews.stop_all()
    hairloom.unregister()
    return report(figures, REFERENCE, max_limits=MAX_LIMITS)


def compile_programs(device: str) -> None:
    """Play the sample scene once, and drop it with all that is cached of its head."""
    scene, hair = run_parts(add_sample_scene(()))
    hair.hairloom.dynamics.device = device
    depsgraph = scene.view_layers[0].depsgraph
    session = Session(hair, depsgraph)
    session.play(depsgraph)
    for _ in range(2):
        session.advance(depsgraph, 1.0 / RATE)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_cube_add()
    cube, depsgraph = bpy.context.object, bpy.context.evaluated_depsgraph_get()
    read_surface(cube, depsgraph, need_uv=False, place="cube")  # the last surface is kept
    bpy.data.objects.remove(cube)


def _slug(kind: str) -> str:
    """A kind of stop as the name of a figure."""
    return kind.replace(": ", "_").replace(" ", "_").replace(".", "_")


def queued_time() -> float:
    """How long this thread has waited for a processor so far [s]; 0 if the system does not report
    it."""
    schedstat = Path("/proc/thread-self/schedstat")
    return int(schedstat.read_text().split()[1]) / 1e9 if schedstat.exists() else 0.0


def comb(hair: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Move all points, as a brush does."""
    points = np.empty(len(hair.data.points) * 3, np.float32)
    hair.data.position_data.foreach_get("vector", points)
    hair.data.position_data.foreach_set("vector", points * 1.01)
    scene.view_layers[0].update()


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


sys.exit(main())
