"""GPU memory of hair: 500,000 strands in a picture of 3840 x 2160 pixels.

Grown hair on the built-in head with deep shadows of three lights, as a still draws it. All textures
and buffers count with the size requested.

bytes_500k_4k     peak memory, with the default budget
missing           fragments without room; parts: the number of parts that strands were drawn in
bytes_small       memory in use with 100,000 strands at 1280 x 720, and a budget of 128 MB
small_difference  largest difference of that picture from one with the default budget; without
                  shadow maps, which may be smaller

make bench NAME=memory          a quarter of an hour without a GPU
tools/bench.py memory small     one part: large or small
"""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import numpy as np
from _report import measured, report, start
from _sight_missing import grown_hair

from hairloom.addon.render import gpu_memory, gpu_objects
from hairloom.addon.render.frame import render_image
from hairloom.addon.render.mesh_pass import MeshPass
from hairloom.addon.render.strand_layers import LAYERS_OF_PIXELS
from hairloom.addon.render.strand_pass import StrandPass
from hairloom.addon.shading.lights import three_point_lights
from hairloom.addon.shading.volume.settings import VolumeSettings

REFERENCE = "the budget, and the same picture with more memory"
MAX_LIMITS = {"bytes_500k_4k": 1.5e9, "missing": 0, "small_missing": 0, "small_difference": 0.0}
LITTLE = 128  # [MB]


def large() -> dict[str, float]:
    _, found = drawn(500_000, 3840, 2160, "deep")
    return {
        "bytes_500k_4k": gpu_objects.peak_bytes(),
        "missing": found.missing,
        "parts": found.parts,
        "budget_bytes": gpu_memory.budget(),
    }


def small() -> dict[str, float]:
    LAYERS_OF_PIXELS.release()
    much, _ = drawn(100_000, 1280, 720, "none")
    gpu_memory.choose_budget(LITTLE)
    little, found = drawn(100_000, 1280, 720, "none")
    return {
        "bytes_small": gpu_objects.bytes_in_use(),
        "small_missing": found.missing,
        "small_parts": found.parts,
        "small_difference": float(np.abs(much - little).max()),
    }


PARTS = {"large": large, "small": small}


def main(names: list[str]) -> int:
    start()
    return report(measured(PARTS, names), REFERENCE, max_limits=MAX_LIMITS)


def drawn(strand_count: int, width: int, height: int, shadows: str) -> tuple[np.ndarray, Any]:
    """The picture, and the statistics of its layers."""
    shown, camera = grown_hair(strand_count, width / height, 1.0)
    lights, volume = three_point_lights(camera.view), VolumeSettings(shadows=shadows)
    passes = MeshPass(), StrandPass()
    lit = replace(shown, lights=lights, volume=volume)
    return render_image(lit, camera, width, height, 1, passes=passes), passes[1].statistics.layers


sys.exit(main(sys.argv[1:]))
