"""Reports: what Hairloom's operators have reported, to read again and to copy."""

from __future__ import annotations

from typing import Any

import bpy

from ..blender.base.outcome import past_reports, report
from .messages import draw_lines

#: width of the popup, in pixels at UI scale 1
_WIDTH = 480
_ICONS = {"INFO": "INFO", "WARNING": "ERROR", "ERROR": "CANCEL"}


def _has_reports(cls: type[Any]) -> bool:
    if past_reports:
        return True
    cls.poll_message_set("There are no reports since Blender was started")
    return False


class HAIRLOOM_OT_show_reports(bpy.types.Operator):
    """Show the latest reports by Hairloom, such as warnings of an export"""

    bl_idname = "hairloom.show_reports"
    bl_label = "Reports"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return _has_reports(cls)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_popup(self, width=_WIDTH)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        return {"FINISHED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        row = layout.row()
        row.label(text="Reports, latest first")
        row.operator("hairloom.copy_reports", text="Copy", icon="COPYDOWN")
        for each in reversed(past_reports):
            column = layout.box().column(align=True)
            column.label(text=f"{each.time}  {each.source}")
            draw_lines(column, context, each.text, _ICONS[each.kind], width=_WIDTH)


class HAIRLOOM_OT_copy_reports(bpy.types.Operator):
    """Copy the latest reports by Hairloom as text"""

    bl_idname = "hairloom.copy_reports"
    bl_label = "Copy Reports"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return _has_reports(cls)

    def execute(self, context: bpy.types.Context) -> set[str]:
        lines = (f"{each.time} {each.source}, {each.kind}: {each.text}" for each in past_reports)
        context.window_manager.clipboard = "\n".join(lines)
        report(self, "INFO", "The reports were copied")
        return {"FINISHED"}


CLASSES: tuple[type[Any], ...] = (HAIRLOOM_OT_show_reports, HAIRLOOM_OT_copy_reports)
