"""First sight: how third-party grooms look with default settings.

See `_sight_missing`, `_sight_cover`, `_sight_pictures` and `_sight_patches` for what is compared
with what.

make bench NAME=sight               some twenty minutes
tools/bench.py sight cover          one part: missing, lost, cover, scale, count, cycles or
                                    patches
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from _report import measured, report, start
from _sight_cover import cover
from _sight_grooms import GROOMS, lost_curves
from _sight_missing import missing_percent
from _sight_patches import patch_figures
from _sight_pictures import count_figures, cycles_figures, scale_flip

REFERENCE = "hashed strands, which keep no lists; strands as wide as they are apart; Cycles"
#: figure -> upper limit, and lower limit
MAX_LIMITS = {
    "missing_percent": 0.0,
    "lost_curves": 0,
    "scale_flip": 0.02,
    "count_flip_excess": 0.05,
    "count_light_percent": 5.0,
    "cycles_flip_hair": 0.15,
}
MIN_LIMITS = dict.fromkeys((f"cover_{name}" for name in GROOMS), 0.9)
#: strands, width and height of the picture, factor on the widths with which strands grow
CROWDED = (
    (100_000, 1920, 1440, 1.0),
    (200_000, 960, 720, 1.0),
    (500_000, 3840, 2160, 1.0),
    (20_000, 960, 720, 100.0),
)


def missing() -> dict[str, float]:
    return {"missing_percent": max(missing_percent(*crowd) for crowd in CROWDED)}


def covers() -> dict[str, float]:
    """Figures of each groom: the worst of its own size, and of it a thousand times smaller and
    larger."""
    return {
        f"cover_{name}": min(cover(read(), name, factor) for factor in (1.0, 1e-3, 1e3))
        for name, read in GROOMS.items()
    }


PARTS: dict[str, Callable[[], dict[str, Any]]] = {
    "missing": missing,
    "lost": lambda: {"lost_curves": lost_curves()},
    "cover": covers,
    "scale": lambda: {"scale_flip": max(scale_flip(GROOMS[n](), n) for n in ("sintel", "bear"))},
    "count": count_figures,
    "cycles": cycles_figures,
    "patches": patch_figures,
}


def main(names: list[str]) -> int:
    start()
    found = measured(PARTS, names)
    return report(found, REFERENCE, max_limits=MAX_LIMITS, min_limits=MIN_LIMITS)


sys.exit(main(sys.argv[1:]))
