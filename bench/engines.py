"""Exported cards in programs that know nothing of Hairloom, and what a user sees there.

See `_engines_plain` for what is compared with what.

Exit code 1: a limit is missed.

make bench NAME=engines
"""

from __future__ import annotations

import sys

from _engines_plain import plain_figures
from _report import start, tell

REFERENCE = "our own picture of the strands, drawn as they come, under the same suns"
#: figure -> the most that it may be
MOST = {"plain_levels_visible": 1, "plain_color_percent": 10.0}


def main() -> int:
    start()
    found = plain_figures()
    tell(found, REFERENCE)
    missed = [name for name, most in MOST.items() if not found[name] <= most]
    print(f"missed: {', '.join(missed) or 'none'}")
    return int(bool(missed))


sys.exit(main())
