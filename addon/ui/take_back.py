"""Buttons that take a tool back: hair gets the shape that was kept before."""

from __future__ import annotations

from typing import Any

import bpy

from ..blender.base.outcome import report
from ..blender.scene.kept_shape import KeptShape
from .reports import reporting
from .selection import chosen_hair, in_object_mode, needs_hair


class TakesBack:
    """Base of an operator, before bpy.types.Operator.

    shape: what was kept. idle: what a greyed button says.
    before: what the hair is again, for the report.
    """

    shape: KeptShape
    idle: str
    before: str

    @classmethod
    def poll(cls: Any, context: bpy.types.Context) -> bool:
        if not (in_object_mode(cls, context) and needs_hair(cls, context)):
            return False
        if any(map(cls.shape.is_there, chosen_hair(context))):
            return True
        cls.poll_message_set(cls.idle)
        return False

    @reporting
    def execute(self: Any, context: bpy.types.Context) -> set[str]:
        for hair in filter(self.shape.is_there, chosen_hair(context)):
            if self.shape.back(hair):
                text = "what other tools and brushes have made of its shape since then is gone too"
                report(self, "WARNING", f"{hair.name}: {text}. Undo brings it back")
            report(self, "INFO", f"{hair.name} is as it was before it {self.before}")
        return {"FINISHED"}
