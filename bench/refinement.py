"""Refinement: strands carried on the CPU beside Blender's node; adaptive and fixed detail in the
picture.

See `_refinement_node` and `_refinement_views` for what is compared with what.

make bench NAME=refinement          about two minutes
tools/bench.py refinement views        some parts: views, node
"""

from __future__ import annotations

import sys

from _refinement_node import node_figures
from _refinement_views import view_figures
from _report import measured, report, start

REFERENCE = "Blender's Interpolate Hair Curves node; one piece a segment; the exact curve"
#: figure -> upper limit, and lower limit
MAX_LIMITS = {
    "error_px_max": 0.5,
    "vertices_undivided_ratio": 1.5,
    "frame_ratio_undivided": 1.43,
    "gpu_cpu_difference": 1e-5,
    "coverage_eighth_difference": 0.03,
}
MIN_LIMITS = {"vertices_fixed64_ratio": 42.0}
PARTS = {
    "views": view_figures,
    "node": node_figures,
}


def main(names: list[str]) -> int:
    start()
    found = measured(PARTS, names)
    return report(found, REFERENCE, max_limits=MAX_LIMITS, min_limits=MIN_LIMITS)


sys.exit(main(sys.argv[1:]))
