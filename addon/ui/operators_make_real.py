"""Make Real: all drawn hair as Blender's own hair curves."""

from __future__ import annotations

import bpy

from ..blender.strands.make_real import make_real
from .long_work import LongWork, Steps, steps_of_parts
from .reports import report_outcome
from .selection import in_object_mode, make_active, needs_hair, target_hair


class HAIRLOOM_OT_make_real(LongWork, bpy.types.Operator):
    """Convert all strands as combed, with children, curls, widths, colours and a material that
    matches the look, to ordinary hair curves for Cycles, EEVEE and other tools. The original hair
    is kept and hidden. Esc cancels"""

    bl_idname = "hairloom.make_real"
    bl_label = "Make Real"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls.can_start() and in_object_mode(cls, context) and needs_hair(cls, context)

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        parts = make_real(target_hair(context), context.evaluated_depsgraph_get())
        results = yield from steps_of_parts(parts)
        for each in results:
            report_outcome(self, each.outcome)
        make_active(context, [each.hair for each in results])


CLASSES = (HAIRLOOM_OT_make_real,)
