"""How time and memory grow over a long animation that is rendered in the background."""

from __future__ import annotations

import itertools
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import bpy
from _engine_stage import build_stage

FRAMES, SETTLED = 250, 10
WIDTH, HEIGHT, SAMPLES = 96, 72, 1
_PAGE_KIB = 4.0


def frame_figures() -> dict[str, float]:
    """memory_growth_percent: of the process from the 10th frame to the last.
    frame_ms: median time of a frame. frame_growth_percent: of the last quarter's median relative to
    the first quarter's, both of the frames after the 10th.
    """
    scene = build_stage(WIDTH, HEIGHT, SAMPLES)
    head = bpy.data.objects["Head"]
    for frame, x in ((1, -0.1), (FRAMES, 0.1)):
        head.location.x = x
        head.keyframe_insert("location", frame=frame)
    scene.frame_start, scene.frame_end = 1, FRAMES
    memory, times = [], [time.perf_counter()]

    def after_frame(*_: Any) -> None:
        memory.append(_resident())
        times.append(time.perf_counter())

    bpy.app.handlers.render_post.append(after_frame)
    try:
        with tempfile.TemporaryDirectory(prefix="hairloom") as folder:
            scene.render.filepath = str(Path(folder) / "frame_")
            bpy.ops.render.render(animation=True)
    finally:
        bpy.app.handlers.render_post.remove(after_frame)
    took = [1000.0 * (b - a) for a, b in itertools.pairwise(times)][SETTLED:]
    quarter = len(took) // 4
    first_ms, last_ms = statistics.median(took[:quarter]), statistics.median(took[-quarter:])
    return {
        "memory_growth_percent": 100.0 * (memory[-1] / memory[SETTLED - 1] - 1.0),
        "memory_mib": memory[-1] / 1024.0,
        "frame_ms": statistics.median(took),
        "frame_growth_percent": 100.0 * (last_ms / first_ms - 1.0),
        "frames": float(len(memory)),
    }


def _resident() -> float:
    """Memory of this process [KiB], as Linux counts it."""
    return _PAGE_KIB * int(Path("/proc/self/statm").read_text().split()[1])
