"""Shading: Marschner's fibre against traced rays and Cycles, its tables, its GLSL, its cost.

See the modules `_shading_*` for what is compared with what. Writes out/shading_sheet.png, a ball of
hair beside Cycles'.

make bench NAME=shading          about five minutes
tools/bench.py shading cost        some parts: cost, reference, glsl, cycles, ball
"""

from __future__ import annotations

import sys

from _report import measured, report, start
from _shading_ball import ball_figures
from _shading_cost import cost_figures
from _shading_cycles import lobe_figures
from _shading_glsl import glsl_relative_error
from _shading_reference import reference_figures

REFERENCE = "rays through a dielectric cylinder; Cycles' Principled Hair (Chiang); numpy in float64"
#: figure -> upper limit, and lower limit
MAX_LIMITS = {
    "lobe_error_*": 0.01,
    "furnace_worst": 1.01,
    "lut_error": 0.005,
    "glsl_relative_error": 1e-3,
    "cycles_lobe_degrees": 1.0,
    "slider_*_ms": 50.0,
    "frame_ratio_models": 1.6,
}
MIN_LIMITS = {"furnace_energy": 0.98}
PARTS = {
    "cost": cost_figures,
    "reference": reference_figures,
    "glsl": lambda: {"glsl_relative_error": glsl_relative_error()},
    "cycles": lobe_figures,
    "ball": ball_figures,
}


def main(names: list[str]) -> int:
    start()
    found = measured(PARTS, names)
    return report(found, REFERENCE, max_limits=MAX_LIMITS, min_limits=MIN_LIMITS)


sys.exit(main(sys.argv[1:]))
