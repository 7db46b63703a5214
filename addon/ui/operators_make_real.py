"""Make Real: all hair as Blender's own."""

from __future__ import annotations

import bpy

from ..blender.strands.make_real import make_real
from .reports import reporting, tell, waiting
from .selection import chosen_hair, make_active, needs_hair


class HAIRLOOM_OT_make_real(bpy.types.Operator):
    """Make ordinary hair curves of all strands as they are combed, with children, curls, widths,
    colours and a material like the look, for Cycles, EEVEE and other tools. The hair that they are
    made from is kept, and hidden"""

    bl_idname = "hairloom.make_real"
    bl_label = "Make Real"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.mode != "OBJECT":
            cls.poll_message_set("Return to Object Mode first")
            return False
        return needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        made = []
        with waiting(context):
            for hair in chosen_hair(context):
                real, outcome = make_real(hair, context.evaluated_depsgraph_get())
                made.append(real)
                tell(self, outcome)
        make_active(context, made)
        return {"FINISHED"}


CLASSES = (HAIRLOOM_OT_make_real,)
