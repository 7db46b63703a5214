"""Reading hair curves from Blender, 100,000 of 16 points, against Blender's own slow accessor.

The reference is `curves.points.foreach_get("position")` on the same evaluated curves, the obvious
call for an add-on. It only copies positions; ours also reads offsets and radii, transforms all into
world space and checks every curve.
"""

import statistics
import sys
import time
from collections.abc import Callable

import bpy
import numpy as np
from _report import report, start

from hairloom.addon.blender.scene.curves import read_curves, write_curves
from hairloom.addon.strands import StrandSet

REFERENCE = "points.foreach_get('position')"
MAX_LIMITS = {"read_ms": 50.0}
CURVES, POINTS, ROUNDS = 100_000, 16, 9


def median_ms(work: Callable[[], object]) -> float:
    times = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        work()
        times.append((time.perf_counter() - begin) * 1000.0)
    return statistics.median(times)


def combed(seed: int = 0) -> StrandSet:
    """Random strands of one length."""
    step = np.random.default_rng(seed).normal(0.0, 0.01, (CURVES, POINTS, 3))
    return StrandSet(
        points=np.cumsum(step, axis=1, dtype=np.float32).reshape(-1, 3),
        offsets=np.arange(CURVES + 1) * POINTS,
        radius=np.full(CURVES * POINTS, 4.0e-5),
        group=np.zeros(CURVES),
    )


def main() -> int:
    start()
    hair = write_curves("bench", combed(), None, bpy.context.scene.collection)
    hair.matrix_world = ((0.6, -0.8, 0, 1), (0.8, 0.6, 0, 2), (0, 0, 2, 3), (0, 0, 0, 1))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    points = hair.evaluated_get(depsgraph).data.points
    buffer = np.empty(len(points) * 3, np.float32)
    assert read_curves(hair, depsgraph).strands.strand_count == CURVES
    read_ms = median_ms(lambda: read_curves(hair, depsgraph))
    reference_ms = median_ms(lambda: points.foreach_get("position", buffer))
    found = {
        "read_ms": read_ms,
        "points": CURVES * POINTS,
        "reference_ms": reference_ms,
        "ratio": reference_ms / read_ms,
    }
    return report(found, REFERENCE, max_limits=MAX_LIMITS)


sys.exit(main())
