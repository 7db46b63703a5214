"""Flow: Add Stroke, Remove Stroke, Comb Along Flow and Revert Flow, and their panel."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty

from ..blender.base.objects import check_settings_editable
from ..blender.base.outcome import report
from ..blender.base.parts import batched
from ..blender.properties.groups import operator_properties
from ..blender.properties.properties import settings_of
from ..blender.scene.drawn_lines import selected_or_new_lines
from ..blender.scene.hair_collections import add_to_collection, remove_from_collection
from ..blender.scene.shape_backup import BEFORE_FLOW
from ..blender.scene.strokes import COLLECTION_LABEL, COLLECTION_PROPERTY, strokes_of
from ..blender.sessions.flow import comb_flow
from ..groom.flow_settings import FlowSettings
from .drawing import draw_button
from .long_work import LongWork, Steps, draw_progress, steps_of_parts
from .object_lists import REMOVED_OBJECT, draw_objects
from .reports import report_outcome, reporting
from .revert_shape import RevertShapeOperator
from .selection import in_object_mode, needs_hair, target_hair, without_linked_duplicates


class HAIRLOOM_OT_add_stroke(bpy.types.Operator):
    """Use the selected curves, drawn on the surface, as strokes to comb the hair along. If none is
    selected, add an editable curve from the forehead to the crown"""

    bl_idname = "hairloom.add_stroke"
    bl_label = "Add Stroke"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return in_object_mode(cls, context) and needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        hair = target_hair(context)[0]
        check_settings_editable(hair)
        strokes = selected_or_new_lines(hair, "Stroke", context)
        add_to_collection(hair, COLLECTION_PROPERTY, COLLECTION_LABEL, strokes, context.scene)
        names = ", ".join(stroke.name for stroke in strokes)
        report(self, "INFO", f"{hair.name} can be combed along {names}")
        return {"FINISHED"}


class HAIRLOOM_OT_remove_stroke(bpy.types.Operator):
    """Stop combing the hair along this stroke. The object stays in the scene, and combed hair keeps
    its shape"""

    bl_idname = "hairloom.remove_stroke"
    bl_label = "Remove Stroke"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        "stroke": StringProperty(name="Stroke", description=REMOVED_OBJECT, options={"SKIP_SAVE"})
    }

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        remove_from_collection(
            target_hair(context)[0],
            COLLECTION_PROPERTY,
            COLLECTION_LABEL,
            self.stroke,
            context,
        )
        return {"FINISHED"}


class HAIRLOOM_OT_comb_flow(LongWork, bpy.types.Operator):
    """Comb the selected hair along its strokes, from first to last point. When pressed again,
    combing starts over from the previous shape. Esc cancels"""

    bl_idname = "hairloom.comb_flow"
    bl_label = "Comb Along Flow"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = operator_properties("flow")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not (cls.can_start() and in_object_mode(cls, context) and needs_hair(cls, context)):
            return False
        if any(map(strokes_of, target_hair(context))):
            return True
        cls.poll_message_set("The selected hair has no strokes: press Add Stroke first")
        return False

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        settings, depsgraph = settings_of(self, FlowSettings), context.evaluated_depsgraph_get()
        grooms = without_linked_duplicates(filter(strokes_of, target_hair(context)))
        jobs = (comb_flow(hair, depsgraph, settings) for hair in grooms)
        for outcome in (yield from steps_of_parts(batched(jobs))):
            report_outcome(self, outcome)


class HAIRLOOM_OT_revert_flow(RevertShapeOperator, bpy.types.Operator):
    """Restore the shape of the selected hair from before it was combed along strokes. Later
    combing, settling and trimming is lost"""

    bl_idname = "hairloom.revert_flow"
    bl_label = "Revert Flow"
    bl_options = {"REGISTER", "UNDO"}
    backup = BEFORE_FLOW
    disabled_text = "The selected hair was not combed along strokes: press Comb Along Flow first"
    change = "followed strokes"


def draw_flow(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Draw the strokes of the hair, and the buttons to comb along them."""
    column = layout.column()
    draw_objects(column, hair, COLLECTION_PROPERTY)
    draw_button(column, "hairloom.add_stroke", icon="CURVE_PATH")
    if draw_progress(column, HAIRLOOM_OT_comb_flow):
        return
    row = column.row(align=True)
    draw_button(row, "hairloom.comb_flow", "No Strokes Yet", icon="FORCE_CURVE")
    draw_button(row, "hairloom.revert_flow", "Not Combed", icon="LOOP_BACK")


CLASSES = (
    HAIRLOOM_OT_add_stroke,
    HAIRLOOM_OT_remove_stroke,
    HAIRLOOM_OT_comb_flow,
    HAIRLOOM_OT_revert_flow,
)
