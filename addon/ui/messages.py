"""Text in panels, wrapped to the width of the region."""

from __future__ import annotations

import textwrap

import bpy

#: width of a letter in pixels at UI scale 1, for breaking lines
_LETTER_WIDTH = 7.0


def draw_message(
    layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str
) -> None:
    """A text in a box."""
    draw_lines(layout.box().column(align=True), context, text, icon)


def draw_lines(
    column: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str = "NONE"
) -> None:
    letters = context.region.width / (_LETTER_WIDTH * context.preferences.system.ui_scale)
    for index, line in enumerate(textwrap.wrap(text, max(int(letters) - 6, 16))):
        column.label(text=line, icon="BLANK1" if index and icon != "NONE" else icon)
