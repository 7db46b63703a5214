"""Exported cards in programs without Hairloom: plain viewers, the page, the springs, shells, the
levels of detail, their light, and the exported atlases.

See `_engines_plain`, `_engines_page`, `_engines_light`, `_engines_springs`, `_engines_shells`,
`_engines_levels` and `_engines_atlas` for what is compared with what.

Exit code 1: a limit is missed.

make bench NAME=engines                     all parts
tools/bench.py engines page                 one part: plain, page, light, springs, shells, levels,
                                            or atlas
tools/bench.py engines atlas sintel few     some grooms, of atlas or levels
"""

from __future__ import annotations

import sys
from typing import Any

from _engines_atlas import GROOMS_OF_ATLAS, atlas_figures
from _engines_levels import GROOMS_OF_LEVELS, level_figures
from _engines_light import light_figures
from _engines_page import page_figures
from _engines_plain import plain_figures
from _engines_shells import shell_figures
from _engines_springs import spring_figures
from _report import chosen, report, start

REFERENCE = "our own picture of the strands, drawn as they come, under the same suns"
PARTS = {
    "plain": plain_figures,
    "page": page_figures,
    "light": light_figures,
    "springs": spring_figures,
    "shells": shell_figures,
}
#: figure -> upper limit, and lower limit
MAX_LIMITS = {
    "*plain_levels_visible": 1,
    "*plain_color_percent": 10.0,
    "*page_bytes": 6e6,
    "*page_errors": 0,
    "light_*_percent": 35.0,
    "*fur_triangles": 8.0,
    "*fur_coverage_percent": 10.0,
    "*fur_color_percent": 10.0,
    "shells_triangles": 12_000,
    "shells_coverage_percent": 10.0,
    "shells_color_percent": 10.0,
    "*few_side_texels": 512,
    "*spring_error_percent": 10.0,
    "*spring_joints": 120,
    "levels_pop_flip": 0.05,
}
MIN_LIMITS = {"*opaque_percent": 25.0, "*strand_texels": 1.5}


def main(arguments: list[str]) -> int:
    start()
    names = [each for each in arguments if each in {*GROOMS_OF_LEVELS, *GROOMS_OF_ATLAS}]
    parts = chosen([each for each in arguments if each not in names], (*PARTS, "levels", "atlas"))
    found: dict[str, Any] = {}
    for name, figures in PARTS.items():
        if name in parts:
            found |= figures()
    if "levels" in parts:
        found |= level_figures(names)
    if "atlas" in parts:
        found |= atlas_figures(names)
    return report(found, REFERENCE, max_limits=MAX_LIMITS, min_limits=MIN_LIMITS)


sys.exit(main(sys.argv[1:]))
