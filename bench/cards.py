"""Hair cards of Sintel: how long they take, order, occlusion, passes, and cards beside strands.

See `_cards_build`, `_cards_atlas`, `_cards_order`, `_cards_occlusion`, `_cards_passes` and
`_cards_strands` for what is compared with what.

make bench NAME=cards           some minutes; writes out/cards_sheet.png
"""

from __future__ import annotations

import sys
from typing import Any

from _cards_atlas import atlas_figures
from _cards_build import build_figures
from _cards_occlusion import occlusion_figures
from _cards_order import order_figures
from _cards_passes import passes_figures
from _cards_strands import strands_figures
from _report import report, start

REFERENCE = (
    "rays one by one; cards sorted for each view and pixels sorted; the strands "
    "themselves; the three-pass scheme"
)


def main() -> int:
    start()
    found: dict[str, Any] = {
        **build_figures(),
        **atlas_figures(),
        **order_figures(),
        **occlusion_figures(),
        **passes_figures(),
        **strands_figures(),
    }
    return report(found, REFERENCE)


sys.exit(main())
