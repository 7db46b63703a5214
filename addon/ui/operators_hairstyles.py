"""Hairstyles: a menu and a page of pictures to choose from, and adding one to a head."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty

from ..blender.base.objects import objects_in
from ..blender.base.outcome import report
from ..blender.scene.bust_skin import TONES
from ..blender.setup.hairstyles import (
    add_face_hair,
    add_hairstyle,
    add_head,
    grows_anywhere,
    is_bust,
    is_of_face,
    named_hairstyle,
    shipped,
)
from .operators_start import begin, in_object_mode
from .preferences import preferences
from .reports import reporting, waiting
from .selection import ground_mesh

#: pictures: how many side by side, how large, and the width of the page at UI scale 1
_ACROSS, _PICTURE_SCALE, _WIDTH = 4, 5.0, 440


class HAIRLOOM_OT_add_hairstyle(bpy.types.Operator):
    """Add this hairstyle as hair curves to the built-in head: the selected one, or the one in the
    scene. Fur grows on the selected mesh. Without one, a head with brows and lashes is added too"""

    bl_idname = "hairloom.add_hairstyle"
    bl_label = "Hairloom Hairstyle"
    bl_options = {"REGISTER", "UNDO"}

    style: EnumProperty(
        name="Hairstyle",
        description="Hairstyle to add",
        items=[(entry.name, entry.title, "") for entry in shipped()],
    )
    skin: EnumProperty(
        name="Skin",
        description="Skin tone of the head, if one is added",
        items=[(name, name.title(), "") for name in TONES],
        default="light",
    )
    plays: BoolProperty(
        name="Play", description="Simulate the hair as soon as it is there", default=True
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return in_object_mode(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if not self.properties.is_property_set("plays"):
            self.plays = preferences(context).plays
        return self.execute(context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        style, collection = named_hairstyle(self.style), context.collection
        with waiting(context):
            head = ground_mesh(context) if grows_anywhere(style) else built_in_head_of(context)
            is_new = head is None
            if head is None:
                head = add_head(collection, self.skin)
            depsgraph = context.evaluated_depsgraph_get()
            hair = add_hairstyle(style, head, depsgraph, collection)
            grooms = [hair]
            if is_new and not is_of_face(style):
                grooms.insert(0, add_face_hair(head, depsgraph, collection, hair))
            if is_new:
                report(self, "INFO", f"Added a head, {head.name}, for the hair to grow on")
            begin(self, context, grooms, plays=self.plays)
        return {"FINISHED"}


class HAIRLOOM_OT_choose_hairstyle(bpy.types.Operator):
    """Choose a hairstyle and add it to the built-in head, or fur and add it to the selected mesh"""

    bl_idname = "hairloom.choose_hairstyle"
    bl_label = "Add Hairstyle"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return in_object_mode(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_popup(self, width=_WIDTH)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        return {"FINISHED"}

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.label(text="Hairstyles")
        grid = self.layout.grid_flow(row_major=True, columns=_ACROSS, even_columns=True)
        for entry in shipped():
            cell = grid.column(align=True)
            if entry.icon:
                cell.template_icon(icon_value=entry.icon, scale=_PICTURE_SCALE)
            cell.operator("hairloom.add_hairstyle", text=entry.title).style = entry.name
        for _ in range(-len(shipped()) % _ACROSS):
            grid.label(text="")


class HAIRLOOM_MT_hairstyles(bpy.types.Menu):
    """Hair with shape, settings and look, ready to be changed"""

    bl_idname = "HAIRLOOM_MT_hairstyles"
    bl_label = "Hairloom Hairstyle"

    def draw(self, _context: bpy.types.Context) -> None:
        for entry in shipped():
            operator = self.layout.operator(
                "hairloom.add_hairstyle", text=entry.title, icon_value=entry.icon
            )
            operator.style = entry.name


def built_in_head_of(context: bpy.types.Context) -> bpy.types.Object | None:
    """The built-in head that is meant: the active one, or that of the active hair, else the first
    of the view layer; None without any."""
    active = ground_mesh(context)
    if active is not None and is_bust(active):
        return active
    return next((obj for obj in objects_in(context.view_layer) if is_bust(obj)), None)


CLASSES: tuple[type[Any], ...] = (
    HAIRLOOM_OT_add_hairstyle,
    HAIRLOOM_OT_choose_hairstyle,
    HAIRLOOM_MT_hairstyles,
)
