"""Counts of what is drawn, as text in a corner of a 3D view."""

from __future__ import annotations

from typing import Any

import blf

from ...render.strand_pass import Statistics

#: In pixels at UI scale 1: from the edges, and from line to line as a factor of the letters' size.
_MARGIN, _LINE = 12.0, 1.5
_OF_CARDS = ("cards", "triangles", "vertices")
_FONT = 0  # Blender's own


def counts_line(name: str, guide_count: int, strand_count: int, drawn: Statistics) -> str:
    """Such as "Hairloom Hair   guides 762   strands 4,095 of 4,857   pieces 61,425   vertices
    131,040"."""
    counts = (
        f"guides {guide_count:,}",
        f"strands {drawn.strands:,} of {strand_count:,}",
        f"pieces {drawn.pieces:,}",
        f"vertices {drawn.vertices:,}",
    )
    return "   ".join((f"Hairloom {name}", *counts))


def card_counts_line(name: str, guide_count: int, drawn: tuple[int, ...]) -> str:
    """Such as "Hairloom Hair   guides 762   cards 800   triangles 9,600   vertices 13,200".

    Args:
        drawn: cards, triangles and vertices.
    """
    counts = (f"{kind} {n:,}" for kind, n in zip(_OF_CARDS, drawn, strict=True))
    return "   ".join((f"Hairloom {name}", f"guides {guide_count:,}", *counts))


def write_lines(context: Any, lines: list[str]) -> None:
    """Write into the view's lower left corner, where Blender itself writes nothing."""
    system = context.preferences.system
    size = context.preferences.ui_styles[0].widget.points * system.ui_scale
    left, bottom = free_corner(context.area, context.region)
    margin = _MARGIN * system.ui_scale
    blf.size(_FONT, size)
    blf.color(_FONT, *context.preferences.themes[0].view_3d.space.text_hi, 1.0)
    blf.enable(_FONT, blf.SHADOW)
    try:
        blf.shadow(_FONT, 5, 0.0, 0.0, 0.0, 0.8)
        blf.shadow_offset(_FONT, 1, -1)
        for index, line in enumerate(reversed(lines)):
            blf.position(_FONT, left + margin, bottom + margin + index * _LINE * size, 0.0)
            blf.draw(_FONT, line)
    finally:
        blf.disable(_FONT, blf.SHADOW)


def free_corner(area: Any, region: Any) -> tuple[int, int]:
    """The lower left corner (x, y) [pixels of the region] of what toolbars, shelves and the panel
    of the last operation leave free where they lie over the view."""
    left = bottom = 0
    for other in area.regions:
        if other.type == "WINDOW" or min(other.width, other.height) <= 1:
            continue
        right, top = other.x + other.width - region.x, other.y + other.height - region.y
        if right <= 0 or top <= 0 or other.x >= region.x + region.width:
            continue  # beside the view
        if other.alignment == "LEFT":
            left = max(left, right)
        elif other.alignment == "BOTTOM" or other.type == "HUD":
            bottom = max(bottom, top)
    return left, bottom
