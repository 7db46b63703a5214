"""Trim to Shape, Remove Trim Shape and Revert Trim, and their panel."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty

from ..blender.base.objects import check_settings_editable
from ..blender.base.parts import batched
from ..blender.scene.hair_collections import add_to_collection, remove_from_collection
from ..blender.scene.shape_backup import BEFORE_TRIM
from ..blender.scene.trim_shapes import (
    COLLECTION_LABEL,
    COLLECTION_PROPERTY,
    may_trim,
    read_shape,
    trim_shapes_of,
)
from ..blender.sessions.trimming import trim_to_shapes
from .drawing import draw_button
from .long_work import LongWork, Steps, draw_progress, steps_of_parts
from .object_lists import REMOVED_OBJECT, draw_objects
from .reports import report_outcome, reporting
from .revert_shape import RevertShapeOperator
from .selection import in_object_mode, needs_hair, target_hair, without_linked_duplicates


class HAIRLOOM_OT_trim_to_shape(LongWork, bpy.types.Operator):
    """Cut the selected hair where it leaves a closed mesh, or passes a flat mesh or the XY plane of
    an Empty. Meshes and Empties selected with the hair become its trim shapes. When pressed again,
    trimming starts over from the previous lengths. Esc cancels"""

    bl_idname = "hairloom.trim_to_shape"
    bl_label = "Trim to Shape"
    bl_options = {"REGISTER", "UNDO"}
    state_after_cancel = "the hair is as long as before"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not (cls.can_start() and in_object_mode(cls, context) and needs_hair(cls, context)):
            return False
        if any(
            trim_shapes_of(hair) or _selected_trim_shapes(hair, context)
            for hair in target_hair(context)
        ):
            return True
        cls.poll_message_set("Select a closed mesh, a flat mesh or an Empty together with the hair")
        return False

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        depsgraph, chosen = context.evaluated_depsgraph_get(), target_hair(context)
        selected = {hair: _selected_trim_shapes(hair, context) for hair in chosen}
        for hair, shapes in selected.items():
            for obj in shapes:
                check_settings_editable(hair)
                read_shape(obj, depsgraph)
        for hair, shapes in selected.items():
            if shapes:
                add_to_collection(
                    hair, COLLECTION_PROPERTY, COLLECTION_LABEL, shapes, context.scene
                )
        grooms = [hair for hair in chosen if trim_shapes_of(hair)]
        jobs = (trim_to_shapes(hair, depsgraph) for hair in without_linked_duplicates(grooms))
        for outcome in (yield from steps_of_parts(batched(jobs))):
            report_outcome(self, outcome)


class HAIRLOOM_OT_remove_trim_shape(bpy.types.Operator):
    """Stop trimming the hair to this shape. The object stays in the scene, and trimmed hair keeps
    its length"""

    bl_idname = "hairloom.remove_trim_shape"
    bl_label = "Remove Trim Shape"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        "shape": StringProperty(name="Shape", description=REMOVED_OBJECT, options={"SKIP_SAVE"})
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
            self.shape,
            context,
        )
        return {"FINISHED"}


class HAIRLOOM_OT_revert_trim(RevertShapeOperator, bpy.types.Operator):
    """Restore the shape of the selected hair from before it was trimmed. Later combing and settling
    is lost"""

    bl_idname = "hairloom.revert_trim"
    bl_label = "Revert Trim"
    bl_options = {"REGISTER", "UNDO"}
    backup = BEFORE_TRIM
    disabled_text = "The selected hair is not trimmed: press Trim to Shape first"
    change = "was trimmed"


def _selected_trim_shapes(
    hair: bpy.types.Object, context: bpy.types.Context
) -> list[bpy.types.Object]:
    """Selected objects that are meant to trim this hair; none unless the hair is selected too."""
    selected = context.selected_objects
    return [obj for obj in selected if may_trim(obj, hair)] if hair in selected else []


def draw_trim(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Draw the trim shapes of the hair, and the buttons."""
    column = layout.column()
    draw_objects(column, hair, COLLECTION_PROPERTY)
    if draw_progress(column, HAIRLOOM_OT_trim_to_shape):
        return
    row = column.row(align=True)
    draw_button(row, "hairloom.trim_to_shape", "Select a Shape", icon="MOD_BOOLEAN")
    draw_button(row, "hairloom.revert_trim", "Not Trimmed", icon="LOOP_BACK")


CLASSES = (
    HAIRLOOM_OT_trim_to_shape,
    HAIRLOOM_OT_remove_trim_shape,
    HAIRLOOM_OT_revert_trim,
)
