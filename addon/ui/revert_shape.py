"""Buttons that undo a tool: they restore the shape that hair had before it."""

from __future__ import annotations

from typing import Any

import bpy

from ..blender.base.outcome import report
from ..blender.scene.shape_backup import ShapeBackup
from .reports import reporting
from .selection import in_object_mode, needs_hair, target_hair


class RevertShapeOperator:
    """Base of an operator, before bpy.types.Operator.

    backup: the saved shape. disabled_text: of a greyed-out button.
    change: what the tool has done to the hair, for the report "as it was before it ...".
    """

    backup: ShapeBackup
    disabled_text: str
    change: str

    @classmethod
    def poll(cls: Any, context: bpy.types.Context) -> bool:
        if not (in_object_mode(cls, context) and needs_hair(cls, context)):
            return False
        if any(map(cls.backup.exists, target_hair(context))):
            return True
        cls.poll_message_set(cls.disabled_text)
        return False

    @reporting
    def execute(self: Any, context: bpy.types.Context) -> set[str]:
        for hair in filter(self.backup.exists, target_hair(context)):
            if self.backup.restore(hair):
                text = (
                    "changes that other tools and brushes have made to its shape since then are "
                    "lost, too"
                )
                report(self, "WARNING", f"{hair.name}: {text}. Undo brings it back")
            report(self, "INFO", f"{hair.name} is as it was before it {self.change}")
        return {"FINISHED"}
