"""Exported cards in programs that know nothing of Hairloom, what a user sees there, and the page.

See `_engines_plain` and `_engines_page` for what is compared with what.

Exit code 1: a limit is missed.

make bench NAME=engines         both parts; `python tools/bench.py engines page` is one of them
"""

from __future__ import annotations

import sys

from _engines_page import page_figures
from _engines_plain import plain_figures
from _report import start, tell

REFERENCE = "our own picture of the strands, drawn as they come, under the same suns"
PARTS = {"plain": plain_figures, "page": page_figures}
#: figure -> the most that it may be
MOST = {
    "plain_levels_visible": 1,
    "plain_color_percent": 10.0,
    "page_bytes": 6e6,
    "page_errors": 0,
}


def main(names: list[str]) -> int:
    start()
    found = {}
    for name in names or PARTS:
        found |= PARTS[name]()
    tell(found, REFERENCE)
    missed = [name for name, value in found.items() if not value <= MOST.get(name, value)]
    print(f"missed: {', '.join(missed) or 'none'}")
    return int(bool(missed))


sys.exit(main(sys.argv[1:]))
