"""Partings: Add Parting, Remove Parting and Comb from Partings, and their panel."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty

from ..blender.base.objects import check_settings_editable
from ..blender.base.outcome import report
from ..blender.base.parts import batched
from ..blender.properties.groups import operator_properties
from ..blender.properties.properties import settings_of
from ..blender.scene import partings
from ..blender.scene.drawn_lines import selected_or_new_lines
from ..blender.sessions.parting import comb_parting
from ..groom.parting_settings import PartingSettings
from .drawing import draw_button
from .long_work import LongWork, Steps, draw_progress, steps_of_parts
from .object_lists import REMOVED_OBJECT, draw_objects
from .reports import report_outcome, reporting
from .selection import in_object_mode, needs_hair, target_hair, without_linked_duplicates


class HAIRLOOM_OT_add_parting(bpy.types.Operator):
    """Part the hair along the selected curves, drawn on its surface. If none is selected, add an
    editable curve from the forehead to the crown"""

    bl_idname = "hairloom.add_parting"
    bl_label = "Add Parting"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return in_object_mode(cls, context) and needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        hair = target_hair(context)[0]
        check_settings_editable(hair)
        lines = selected_or_new_lines(hair, "Parting", context)
        partings.add_partings(hair, lines, context.scene)
        names = ", ".join(line.name for line in lines)
        report(self, "INFO", f"{hair.name} is parted along {names}")
        return {"FINISHED"}


class HAIRLOOM_OT_remove_parting(bpy.types.Operator):
    """Stop parting the hair along this line. The object stays in the scene"""

    bl_idname = "hairloom.remove_parting"
    bl_label = "Remove Parting"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        "line": StringProperty(name="Line", description=REMOVED_OBJECT, options={"SKIP_SAVE"})
    }

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        partings.remove_parting(target_hair(context)[0], self.line, context)
        return {"FINISHED"}


class HAIRLOOM_OT_comb_parting(LongWork, bpy.types.Operator):
    """Comb the roots of the selected hair away from its partings, to both sides. Esc cancels"""

    bl_idname = "hairloom.comb_parting"
    bl_label = "Comb from Partings"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = operator_properties("parting")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not (cls.can_start() and in_object_mode(cls, context) and needs_hair(cls, context)):
            return False
        if any(map(partings.partings_of, target_hair(context))):
            return True
        cls.poll_message_set("The selected hair has no partings: press Add Parting first")
        return False

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        settings, depsgraph = settings_of(self, PartingSettings), context.evaluated_depsgraph_get()
        grooms = without_linked_duplicates(filter(partings.partings_of, target_hair(context)))
        jobs = (comb_parting(hair, depsgraph, settings) for hair in grooms)
        for outcome in (yield from steps_of_parts(batched(jobs))):
            report_outcome(self, outcome)


def draw_partings(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Draw the partings of the hair, and the buttons to add one and to comb."""
    column = layout.column()
    draw_objects(column, hair, "parting_collection")
    draw_button(column, "hairloom.add_parting", icon="CURVE_DATA")
    if not draw_progress(column, HAIRLOOM_OT_comb_parting):
        draw_button(column, "hairloom.comb_parting", "No Partings Yet", icon="ARROW_LEFTRIGHT")


CLASSES = (HAIRLOOM_OT_add_parting, HAIRLOOM_OT_remove_parting, HAIRLOOM_OT_comb_parting)
