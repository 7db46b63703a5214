"""The longest time for which jobs in the window neither report progress nor handle keys.

Measured is the longest time for which a job keeps Blender's main thread: until its first report of
progress, and from one report to the next. Drawing is left out.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import bpy

from hairloom.addon.blender.base import latest_job
from hairloom.addon.blender.preview import previews
from hairloom.addon.ui import long_work

#: strands of the groom that grows again
STRANDS = 20_000
#: faces along each side of a cloth
FACES = 100
_FRAME = 1.0 / 24.0
_LOOK = 0.01


def silent() -> dict[str, float]:
    """The longest time without progress of each job [s], and of all."""
    found = {}
    for name, job in JOBS.items():
        longest: list[float] = []
        # as in a window, where nothing blocks on a thread
        latest_job.is_blocking = lambda: False
        long_work._run_blocking = lambda steps, to=longest: to.append(_longest(steps))
        job()
        found[f"silent_{name}_seconds"] = max(longest)
        while any(not session.is_made for session in previews.sessions()):
            latest_job.run_steps()
            time.sleep(_LOOK)
    return {"silent_seconds_max": max(found.values()), **found}


def _longest(steps: Iterator[Any]) -> float:
    """The duration of a job's longest step [s]."""
    longest = 0.0
    while True:
        began = time.perf_counter()
        step = next(steps, None)
        longest = max(longest, time.perf_counter() - began)
        if step is None:
            return longest
        if step.is_idle:
            time.sleep(_LOOK)


def _grow_again() -> None:
    previews.stop_all()
    bpy.context.object.data.hairloom.grow.strand_count = STRANDS
    bpy.ops.hairloom.grow_again()


def _clear() -> None:
    previews.stop_all()
    bpy.ops.wm.read_homefile(use_empty=True)


def _add_hairstyle() -> None:
    _clear()
    bpy.ops.hairloom.add_hairstyle(style="long_straight", skin="dark", plays=False)


def _add_groom() -> None:
    bpy.context.view_layer.objects.active = bpy.context.object.parent
    bpy.context.object.select_set(True)
    bpy.ops.hairloom.add_groom(plays=False)


def _sample_scene() -> None:
    _clear()
    bpy.ops.hairloom.sample_scene(skin="light")


def _play_cloth() -> None:
    _clear()
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=FACES, y_subdivisions=FACES, size=0.2)
    bpy.ops.hairloom.fin_add()
    long_work._run_blocking(_cloth_steps())


def _cloth_steps() -> long_work.Steps[None]:
    """Preview cloth and play it, until its first frame."""
    bpy.ops.hairloom.fin_preview()
    yield long_work.Progress("previewed")
    depsgraph = bpy.context.evaluated_depsgraph_get()
    previews.play(depsgraph, blocking=False)
    while previews.waiting_names():
        yield long_work.Progress("Making the cloth", is_idle=True)
        previews.advance(depsgraph, _FRAME)
    previews.stop_all()


JOBS: dict[str, Callable[[], Any]] = {
    "add_hairstyle": _add_hairstyle,
    "make_real": lambda: bpy.ops.hairloom.make_real(),
    "add_groom": _add_groom,
    "grow_again": _grow_again,
    "sample_scene": _sample_scene,
    "play_cloth": _play_cloth,
}
