"""Blender's own Alembic and USD of as many strands, as the reference: positions and widths only.

It has its own process, since Blender brings another USD library than the one used here.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

STRANDS, POINTS, ROUNDS = 100_000, 16, 3


def blender_figures() -> dict[str, float]:
    """Seconds to write and to read, the minimum over ROUNDS."""
    done = subprocess.run([sys.executable, __file__], capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def _measure() -> dict[str, float]:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    random = np.random.default_rng(1)
    curves = bpy.data.hair_curves.new("Hair")
    curves.add_curves([POINTS] * STRANDS)
    steps = random.normal(0.0, 0.01, (STRANDS, POINTS, 3)).astype(np.float32)
    curves.points.foreach_set("position", np.cumsum(steps, axis=1).ravel())
    radius = curves.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.full(STRANDS * POINTS, 5.0e-5, np.float32))
    bpy.context.collection.objects.link(bpy.data.objects.new("Hair", curves))
    wm = bpy.ops.wm
    figures = {}
    with tempfile.TemporaryDirectory() as folder:
        abc, usd = str(Path(folder) / "a.abc"), str(Path(folder) / "a.usdc")
        acts = {
            "alembic_write": lambda: wm.alembic_export(filepath=abc, as_background_job=False),
            "usd_write": lambda: wm.usd_export(filepath=usd),
            "alembic_read": lambda: wm.alembic_import(filepath=abc, as_background_job=False),
            "usd_read": lambda: wm.usd_import(filepath=usd),
        }
        for name, act in acts.items():
            figures[f"blender_{name}_seconds"] = min(_seconds(act) for _ in range(ROUNDS))
    return figures


def _seconds(act: Callable[[], object]) -> float:
    start = time.perf_counter()
    act()
    return time.perf_counter() - start


if __name__ == "__main__":
    print("\n" + json.dumps(_measure()))
