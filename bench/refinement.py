"""Refinement: strands carried on the CPU beside Blender's node, detail in the picture or fixed.

See `_refinement_node` and `_refinement_views` for what is compared with what.

make bench NAME=refinement          about two minutes
"""

from __future__ import annotations

from typing import Any

from _refinement_node import node_figures
from _refinement_views import view_figures
from _report import start, tell

REFERENCE = "Blender's Interpolate Hair Curves node; one piece a segment; the exact curve"


def main() -> None:
    start()
    found: dict[str, Any] = {**view_figures(), **node_figures()}
    tell(found, REFERENCE)


main()
