"""Measure: stretch and penetration of strands and cards, in the panels."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import bpy

from ..blender.base.redraw import redraw_panels
from ..blender.preview import previews
from ..blender.sessions.measures import card_table_of, table_of
from ..blender.sessions.session import Session
from .drawing import draw_button
from .reports import reporting
from .selection import needs_hair, target_hair
from .texts import translated

#: Fraction of a table's width for the names.
_NAME_FRACTION = 0.34


class HAIRLOOM_OT_measure(bpy.types.Operator):
    """Measure how far strands (and cards, if shown) currently stretch and how deep they are inside
    colliders. Bakes measure all of their frames automatically"""

    bl_idname = "hairloom.measure"
    bl_label = "Measure"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not needs_hair(cls, context):
            return False
        if any(_simulated(target_hair(context))):
            return True
        cls.poll_message_set("The selected hair is not simulated: press Play first")
        return False

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        for session in _simulated(target_hair(context)):
            session.measure()
        redraw_panels()
        return {"FINISHED"}


def _simulated(hair: Iterable[bpy.types.Object]) -> Iterable[Session]:
    sessions = (previews.session_of(each) for each in hair)
    return (each for each in sessions if each is not None and each.is_playing)


def draw_measure(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Draw the button and the last measurement, greyed out once the hair has moved on."""
    session = previews.session_of(hair)
    is_outdated = session is not None and session.figures and not session.are_figures_current
    text = translated("Measure Again: Hair Has Moved") if is_outdated else None
    disabled_text, icon = "Measure: Press Play First", "DRIVER_DISTANCE"
    draw_button(layout, "hairloom.measure", disabled_text, text, in_all_modes=True, icon=icon)
    lines = layout.column(align=True)
    lines.active = not is_outdated
    draw_figures(lines, table_of(None if session is None else session.figures))
    draw_figures(lines, card_table_of(None if session is None else session.card_figures))


def draw_figures(column: bpy.types.UILayout, table: Iterable[Sequence[str]]) -> None:
    """Draw a measurement as a table, see `table_of`."""
    for name, *values in table:
        row = column.split(factor=_NAME_FRACTION)
        row.label(text=name)
        columns = row.row()
        for value in values:
            columns.label(text=value)


CLASSES = (HAIRLOOM_OT_measure,)
