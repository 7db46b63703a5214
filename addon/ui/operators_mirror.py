"""Mirror Hair, and its button."""

from __future__ import annotations

import bpy

from ..blender.base.parts import batched
from ..blender.properties.groups import operator_properties
from ..blender.properties.properties import settings_of
from ..blender.sessions.mirroring import mirror_hair
from ..groom.mirror_settings import MirrorSettings
from .drawing import draw_button
from .long_work import LongWork, Steps, draw_progress, steps_of_parts
from .reports import report_outcome
from .selection import in_object_mode, needs_hair, target_hair, without_linked_duplicates
from .texts import translated


class HAIRLOOM_OT_mirror_hair(LongWork, bpy.types.Operator):
    """Mirror the curves of one side of the surface to the other, replacing the curves there. Roots
    are placed on the surface; widths, colours and other attributes are copied. Esc cancels"""

    bl_idname = "hairloom.mirror_hair"
    bl_label = "Mirror Hair"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = operator_properties("mirror")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls.can_start() and in_object_mode(cls, context) and needs_hair(cls, context)

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        settings, depsgraph = settings_of(self, MirrorSettings), context.evaluated_depsgraph_get()
        jobs = (
            mirror_hair(hair, depsgraph, settings)
            for hair in without_linked_duplicates(target_hair(context))
        )
        for outcome in (yield from steps_of_parts(batched(jobs))):
            report_outcome(self, outcome)


def draw_mirror(layout: bpy.types.UILayout) -> None:
    """Draw a button for each direction."""
    if draw_progress(layout, HAIRLOOM_OT_mirror_hair):
        return
    row = layout.row(align=True)
    for side, text, icon in (
        ("positive", translated("Mirror +X to -X"), "TRIA_LEFT"),
        ("negative", translated("Mirror -X to +X"), "TRIA_RIGHT"),
    ):
        button = draw_button(row, "hairloom.mirror_hair", text=text, icon=icon)
        button.side, button.axis = side, "x"


CLASSES = (HAIRLOOM_OT_mirror_hair,)
