"""Fins, meshes that move as cloth: their buttons, and their panels in Physics and the sidebar."""

from __future__ import annotations

from typing import Any

import bpy

from ..blender.bakes.simulation import Simulation
from ..blender.base.outcome import report
from ..blender.preview import fins, previews
from ..blender.scene.fin_modifier import (
    add_modifier,
    clear,
    fin_modifier,
    is_shown,
    remove_modifier,
)
from .drawing import draw_button, draw_section
from .help import WithHelp
from .messages import draw_message
from .reports import reporting, wait_cursor
from .selection import active_mesh


class HAIRLOOM_OT_fin_add(bpy.types.Operator):
    """Make the active mesh move as cloth, pinned by a vertex group"""

    bl_idname = "hairloom.fin_add"
    bl_label = "Make Cloth"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _can_change_modifiers(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        obj = active_mesh(context)
        assert obj is not None
        add_modifier(obj)
        fin = obj.hairloom.fin
        if not fin.pin_group and obj.vertex_groups.active is not None:
            fin.pin_group = obj.vertex_groups.active.name
            report(self, "INFO", f"Pinned by the vertex group {fin.pin_group}")
        elif not fin.pin_group:
            report(
                self, "WARNING", "Nothing is pinned yet: choose a Pin Group, or the mesh will fall"
            )
        return {"FINISHED"}


class HAIRLOOM_OT_fin_remove(bpy.types.Operator):
    """Turn the active cloth back into a plain mesh, in its original shape"""

    bl_idname = "hairloom.fin_remove"
    bl_label = "Remove Cloth"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _can_change_modifiers(cls, context) and _needs_fin(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        obj = active_mesh(context)
        assert obj is not None
        session = previews.simulation_of(obj)
        if session is not None:
            previews.stop(session)
        remove_modifier(obj)
        return {"FINISHED"}


class HAIRLOOM_OT_fin_preview(bpy.types.Operator):
    """Toggle simulation of the active cloth with Play and during playback"""

    bl_idname = "hairloom.fin_preview"
    bl_label = "Preview Cloth"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _needs_fin(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        obj, depsgraph = active_mesh(context), context.evaluated_depsgraph_get()
        assert obj is not None
        session = previews.simulation_of(obj)
        if session is not None:
            previews.stop(session)
            return {"FINISHED"}
        with wait_cursor(context):
            fins.start(obj, depsgraph)
        return {"FINISHED"}


class HAIRLOOM_OT_fin_reset(bpy.types.Operator):
    """Move the active cloth back to its animated shape"""

    bl_idname = "hairloom.fin_reset"
    bl_label = "Reset Cloth"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not _needs_fin(cls, context):
            return False
        obj = active_mesh(context)
        if obj is not None and is_shown(obj):
            return True
        cls.poll_message_set("It is at rest")
        return False

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        obj = active_mesh(context)
        assert obj is not None
        session = previews.simulation_of(obj)
        if session is None:
            clear(obj.data)
        else:
            session.rest(context.evaluated_depsgraph_get())
        return {"FINISHED"}


def draw_fin(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    """Draw the buttons and settings of a mesh that is, or may become, a fin."""
    if fin_modifier(obj) is None:
        layout.operator("hairloom.fin_add", icon="MOD_CLOTH")
        return
    fin, session = obj.hairloom.fin, previews.simulation_of(obj)
    _draw_buttons(layout.row(align=True), session)
    for warning in session.warnings if session is not None else ():
        draw_message(layout, bpy.context, warning, "ERROR")
    column = layout.column()
    column.active = fin.enabled
    column.prop_search(fin, "pin_group", obj, "vertex_groups")
    for label in fin.settings.panels:
        header, body = column.panel(f"hairloom_fin_{label}")
        header.label(text=label)
        if body is None:
            continue
        if label == "Collisions":
            body.prop(obj.hairloom, "collider")
            body.prop(obj.hairloom, "collider_collection")
        if label == "Medium & Wind":
            body.prop(obj.hairloom, "field_collection")
        draw_section(body, obj.hairloom, "fin", label)


def _draw_buttons(row: bpy.types.UILayout, session: Simulation | None) -> None:
    if session is not None and not session.is_made:
        row.label(text="Making the cloth", icon="SORTTIME")
        row.operator("hairloom.fin_preview", text="", icon="X")
        return
    is_on = session is not None
    row.operator(
        "hairloom.fin_preview",
        text="Stop Preview" if is_on else "Preview",
        icon="HIDE_OFF" if is_on else "HIDE_ON",
        depress=is_on,
    )
    draw_button(
        row, "hairloom.fin_reset", "At Rest", "Reset", in_all_modes=True, icon="FILE_REFRESH"
    )
    row.operator("hairloom.fin_remove", text="", icon="TRASH")


def draw_switch(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    """Draw the switch of the fin's simulation, in the header of its panel."""
    if fin_modifier(obj) is not None:
        layout.prop(obj.hairloom.fin, "enabled", text="")


class _FinPanel(WithHelp):
    """A panel of the cloth that the active mesh is, or may become."""

    help_section = "fin"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self: Any, context: bpy.types.Context) -> None:
        draw_switch(self.layout, context.object)

    def draw(self: Any, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        draw_fin(self.layout, context.object)


class HAIRLOOM_PT_fin(_FinPanel, bpy.types.Panel):
    """A mesh that moves as cloth"""

    bl_label = "Hairloom Cloth"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "physics"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.object is not None and context.object.type == "MESH"


class HAIRLOOM_PT_sidebar_fin(_FinPanel, bpy.types.Panel):
    """A mesh that moves as cloth"""

    bl_label = "Cloth"
    bl_parent_id = "HAIRLOOM_PT_sidebar"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Hairloom"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return active_mesh(context) is not None


def _can_change_modifiers(operator: type[Any], context: bpy.types.Context) -> bool:
    """For `poll`: whether modifiers of the active mesh can be added or removed; the greyed-out
    button says why not."""
    obj = active_mesh(context)
    if obj is None:
        operator.poll_message_set("Select a mesh")
    elif not obj.is_editable or not obj.data.is_editable:
        operator.poll_message_set("It is linked from another file: make it local first")
    elif obj.mode == "EDIT":
        operator.poll_message_set("Leave Edit Mode first")
    else:
        return True
    return False


def _needs_fin(operator: type[Any], context: bpy.types.Context) -> bool:
    obj = active_mesh(context)
    if obj is not None and fin_modifier(obj) is not None:
        return True
    operator.poll_message_set(
        "Select a mesh that is cloth (Make Cloth, in the Physics tab of a mesh)"
    )
    return False


CLASSES = (
    HAIRLOOM_OT_fin_add,
    HAIRLOOM_OT_fin_remove,
    HAIRLOOM_OT_fin_preview,
    HAIRLOOM_OT_fin_reset,
    HAIRLOOM_PT_fin,
    HAIRLOOM_PT_sidebar_fin,
)
