"""Hair ties: Add Hair Tie and Remove Hair Tie, and the panel of ties and held tips."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty

from ..blender.base.objects import check_settings_editable, head_of
from ..blender.base.outcome import report
from ..blender.colliders import ties
from .drawing import draw_section
from .object_lists import REMOVED_OBJECT, draw_objects
from .reports import reporting
from .selection import needs_hair, target_hair


class HAIRLOOM_OT_add_hair_tie(bpy.types.Operator):
    """Hold the hair that passes through the selected rings: Empties, curves or meshes. If none is
    selected, add a ring at the 3D cursor as a child of the surface"""

    bl_idname = "hairloom.add_hair_tie"
    bl_label = "Add Hair Tie"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        hair = target_hair(context)[0]
        check_settings_editable(hair)
        rings = [obj for obj in context.selected_objects if _can_be_tie(obj, hair)]
        if not rings:
            rings = [ties.new_ring(hair, context)]
        depsgraph = context.evaluated_depsgraph_get()
        holds = [
            ties.count_held_curves(hair, ring, depsgraph) for ring in rings
        ]  # raises if one is no tie
        ties.add_ties(hair, rings, context.scene)
        for ring, (held, count) in zip(rings, holds, strict=True):
            level = "INFO" if held else "WARNING"
            remedy = "" if held else ". Move it so that hair passes through it"
            report(self, level, f"{ring.name} holds {held:,} of {count:,} strands{remedy}")
        return {"FINISHED"}


class HAIRLOOM_OT_remove_hair_tie(bpy.types.Operator):
    """Release the hair held by this tie. The object stays in the scene"""

    bl_idname = "hairloom.remove_hair_tie"
    bl_label = "Remove Hair Tie"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        "tie": StringProperty(name="Tie", description=REMOVED_OBJECT, options={"SKIP_SAVE"})
    }

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        ties.remove_tie(target_hair(context)[0], self.tie, context)
        return {"FINISHED"}


def draw_ties(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Draw ties and held tips, which hold hair beside its roots."""
    draw_objects(layout, hair, "tie_collection")
    layout.operator("hairloom.add_hair_tie", icon="MESH_CIRCLE")
    layout.column().prop(hair.hairloom, "tip_surface")
    if hair.hairloom.tip_surface is not None:
        layout.column().prop(hair.hairloom, "tip_group")
        draw_section(layout, hair.data.hairloom, "guides", "Ties")


def _can_be_tie(obj: bpy.types.Object, hair: bpy.types.Object) -> bool:
    return obj.type in ties.TIE_TYPES and obj not in (hair, head_of(hair))


CLASSES = (HAIRLOOM_OT_add_hair_tie, HAIRLOOM_OT_remove_hair_tie)
