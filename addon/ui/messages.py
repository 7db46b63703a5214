"""Text in panels, wrapped to the width of the region."""

from __future__ import annotations

import math
import textwrap

import bpy

#: width of a letter in pixels at UI scale 1, for breaking lines
_LETTER_WIDTH = 7.0
#: width of a panel's margins, in letters
_MARGIN_LETTERS = 6


def draw_message(
    layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str
) -> None:
    """A text in a box."""
    draw_lines(layout.box().column(align=True), context, text, icon)


def draw_lines(
    column: bpy.types.UILayout,
    context: bpy.types.Context,
    text: str,
    icon: str = "NONE",
    *,
    reserved_letters: int = 0,
    width: float = 0.0,
) -> None:
    """Draw a text as lines.

    Args:
        reserved_letters: number of letters to reserve lines for, even if the text is shorter, so
            that the layout below keeps its place.
        width: of a popup, in pixels at UI scale 1; 0: the width of the region.
    """
    region = context.region.width / context.preferences.system.ui_scale
    letters = max(int((width or region) / _LETTER_WIDTH) - _MARGIN_LETTERS, 16)
    lines = textwrap.wrap(text, letters)
    lines += [""] * (math.ceil(reserved_letters / letters) - len(lines))
    for index, line in enumerate(lines):
        column.label(text=line, icon="BLANK1" if index and icon != "NONE" else icon)
