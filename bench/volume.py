"""Hair as a volume: shadows against counting strands, scattering against Cycles, transparency
against sorting, the cost beside EEVEE.

See `_volume_shadows`, `_volume_balls`, `_volume_sintel`, `_volume_transparency` and `_volume_cost`
for what is compared with what. Limits are twice the values measured when they were set; layers,
which must not depend on the order of strands, were bit-identical.

make bench NAME=volume          some minutes; writes out/volume_sheet.png and out/volume_sintel.png
tools/bench.py volume cost        some parts: cost, shadows, transparency, balls, sintel
"""

from __future__ import annotations

import sys

from _report import measured, report, start
from _volume_balls import ball_figures
from _volume_cost import cost_figures
from _volume_shadows import shadow_figures
from _volume_sintel import sintel_figures
from _volume_transparency import transparency_figures

REFERENCE = (
    "strands counted one by one; Cycles' Principled Hair, path traced; ribbons "
    "sorted; EEVEE at 1 sample"
)
MAX_LIMITS = {"transparency_error": 0.19, "permutation_difference": 1.0e-6}
PARTS = {
    "cost": cost_figures,
    "shadows": shadow_figures,
    "transparency": transparency_figures,
    "balls": ball_figures,
    "sintel": sintel_figures,
}


def main(names: list[str]) -> int:
    start()
    found = measured(PARTS, names)
    return report(found, REFERENCE, max_limits=MAX_LIMITS)


sys.exit(main(sys.argv[1:]))
