"""Hair cards of Sintel: how long they take, order, occlusion, passes, and cards beside strands.

See `_cards_build`, `_cards_atlas`, `_cards_order`, `_cards_occlusion`, `_cards_passes` and
`_cards_strands` for what is compared with what. Limits are twice the values measured when they were
set.

make bench NAME=cards           some minutes; writes out/cards_sheet.png
tools/bench.py cards build        some parts: build, atlas, order, occlusion, passes, strands
"""

from __future__ import annotations

import sys

from _cards_atlas import atlas_figures
from _cards_build import build_figures
from _cards_occlusion import occlusion_figures
from _cards_order import order_figures
from _cards_passes import passes_figures
from _cards_strands import strands_figures
from _report import measured, report, start

REFERENCE = (
    "rays one by one; cards sorted for each view and pixels sorted; the strands "
    "themselves; the three-pass scheme"
)
#: fractions of pixels that blend in the wrong order, with the orders of the files
MAX_LIMITS = {
    "order_wrong_sorted": 0.038,
    "order_wrong_baked_sorted": 0.088,
    "order_wrong_guides_sorted": 0.035,
}
PARTS = {
    "build": build_figures,
    "atlas": atlas_figures,
    "order": order_figures,
    "occlusion": occlusion_figures,
    "passes": passes_figures,
    "strands": strands_figures,
}


def main(names: list[str]) -> int:
    start()
    found = measured(PARTS, names)
    return report(found, REFERENCE, max_limits=MAX_LIMITS)


sys.exit(main(sys.argv[1:]))
