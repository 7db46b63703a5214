"""Grow Hair."""

from __future__ import annotations

import bpy

from ..blender.strands import groom_files
from .grow_options import GROW_PROPERTIES, draw_grow
from .reports import reporting, waiting
from .selection import ground_mesh, make_active


class HAIRLOOM_OT_grow(bpy.types.Operator):
    """Grow hair curves on the active mesh"""

    bl_idname = "hairloom.grow"
    bl_label = "Grow Hair"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = GROW_PROPERTIES

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if ground_mesh(context) is not None:
            return True
        cls.poll_message_set("Select the mesh to grow hair on")
        return False

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        head, depsgraph = ground_mesh(context), context.evaluated_depsgraph_get()
        with waiting(context):
            hair = groom_files.grow_on(
                head,
                depsgraph,
                context.collection,
                self,
                density_group=self.density_group,
                length_group=self.length_group,
            )
        make_active(context, [hair])
        return {"FINISHED"}

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        draw_grow(self.layout, self)


CLASSES = (HAIRLOOM_OT_grow,)
