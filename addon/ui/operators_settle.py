"""Settle and Revert Settle, and their buttons."""

from __future__ import annotations

import bpy

from ..blender.properties.groups import operator_properties
from ..blender.properties.properties import settings_of
from ..blender.scene.shape_backup import BEFORE_SETTLE
from ..blender.sessions.settling import settle_hair
from ..dynamics.settle_settings import SettleSettings
from .drawing import draw_button
from .long_work import LongWork, Progress, Steps, as_progress, draw_progress
from .reports import report_outcome
from .revert_shape import RevertShapeOperator
from .selection import in_object_mode, needs_hair, target_hair, without_linked_duplicates


class HAIRLOOM_OT_settle(LongWork, bpy.types.Operator):
    """Let the selected hair fall under gravity onto head and shoulders, and keep the result as its
    shape. Ties and colliders act as in motion"""

    bl_idname = "hairloom.settle"
    bl_label = "Settle"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = operator_properties("settle")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls.can_start() and in_object_mode(cls, context) and needs_hair(cls, context)

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        settings, depsgraph = settings_of(self, SettleSettings), context.evaluated_depsgraph_get()
        writes = []
        for hair in without_linked_duplicates(target_hair(context)):
            yield Progress("Reading the hair")
            writes.append((yield from as_progress(settle_hair(hair, depsgraph, settings))))
        for write in writes:
            report_outcome(self, write())


class HAIRLOOM_OT_revert_settle(RevertShapeOperator, bpy.types.Operator):
    """Restore the shape of the selected hair from before it settled. Later combing and trimming is
    lost"""

    bl_idname = "hairloom.revert_settle"
    bl_label = "Revert Settle"
    bl_options = {"REGISTER", "UNDO"}
    backup = BEFORE_SETTLE
    disabled_text = "The selected hair has not settled: press Settle first"
    change = "settled"


def draw_settle(layout: bpy.types.UILayout) -> None:
    """Draw the buttons, or the progress of settling."""
    if draw_progress(layout, HAIRLOOM_OT_settle):
        return
    row = layout.row(align=True)
    draw_button(row, "hairloom.settle", icon="SORT_ASC")
    draw_button(row, "hairloom.revert_settle", "Not Settled", icon="LOOP_BACK")


CLASSES = (HAIRLOOM_OT_settle, HAIRLOOM_OT_revert_settle)
