"""Buttons of the self-test in the Preferences."""

from __future__ import annotations

from typing import Any

import bpy

from ..blender.base.outcome import report
from ..blender.setup import self_test
from .reports import wait_cursor


class HAIRLOOM_OT_self_test(bpy.types.Operator):
    """Test shaders, simulation, drawing and files on this machine. Takes a few seconds and changes
    nothing"""

    bl_idname = "hairloom.self_test"
    bl_label = "Self-Test"

    def execute(self, context: bpy.types.Context) -> set[str]:
        with wait_cursor(context):
            checks = self_test.run()
        failed = [check for check in checks if check.outcome == "failed"]
        for check in failed:
            report(self, "WARNING", f"{check.name}: {check.text}")
        if not failed:
            report(self, "INFO", f"All {len(checks)} checks done, none failed")
        return {"FINISHED"}


class HAIRLOOM_OT_copy_report(bpy.types.Operator):
    """Copy the results of the self-test and the system information as text"""

    bl_idname = "hairloom.copy_report"
    bl_label = "Copy Report"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        if self_test.last_report():
            return True
        cls.poll_message_set("Press Self-Test first")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        context.window_manager.clipboard = self_test.report_text()
        report(self, "INFO", "The report was copied")
        return {"FINISHED"}


CLASSES: tuple[type[Any], ...] = (HAIRLOOM_OT_self_test, HAIRLOOM_OT_copy_report)
