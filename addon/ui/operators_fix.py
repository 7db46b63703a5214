"""Buttons beside warnings: each fixes a problem of the active hair."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

from ..blender.bakes.baked_copy import remove_copy, render_problem
from ..blender.base.objects import head_of, is_shape_editable, objects_in
from ..blender.base.outcome import report
from ..blender.preview.diagnostics import is_unevenly_scaled, nearest_surface, set_surface
from ..errors import HairloomError
from .reports import reporting, wait_cursor
from .selection import in_object_mode, needs_hair, target_hair

#: for Smart UV Project: the largest angle within an island [rad], the margin between islands
_ANGLE_LIMIT, _ISLAND_MARGIN = 1.15, 0.02


class HAIRLOOM_OT_set_surface(bpy.types.Operator):
    """Attach the active hair to the selected mesh, or to the closest mesh if none is selected"""

    bl_idname = "hairloom.set_surface"
    bl_label = "Set Surface"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _can_fix(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        hair, depsgraph = target_hair(context)[0], context.evaluated_depsgraph_get()
        selected = [obj for obj in context.selected_objects if obj.type == "MESH"]
        visible = [obj for obj in objects_in(context.view_layer) if obj.visible_get()]
        mesh = nearest_surface(hair, selected or visible, depsgraph)
        set_surface(hair, mesh)
        report(self, "INFO", f"{hair.name} now grows from {mesh.name}")
        return {"FINISHED"}


class HAIRLOOM_OT_snap_roots(bpy.types.Operator):
    """Move the strands of the active hair so that their roots lie on the surface"""

    bl_idname = "hairloom.snap_roots"
    bl_label = "Snap to Surface"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not (_is_shown(cls, context) and _needs_surface(cls, context)):
            return False
        if _surface_of(context).data.uv_layers.active is not None:
            return True
        cls.poll_message_set("The surface has no UVs: press Unwrap first")
        return False

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        hair = target_hair(context)[0]
        set_surface(hair, _surface_of(context))
        with wait_cursor(context), _only_selected(context, hair):
            bpy.ops.curves.snap_curves_to_surface(attach_mode="NEAREST")
        return {"FINISHED"}


class HAIRLOOM_OT_unwrap_surface(bpy.types.Operator):
    """Give the surface of the active hair non-overlapping UVs by Smart UV Project"""

    bl_idname = "hairloom.unwrap_surface"
    bl_label = "Unwrap Surface"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not (_can_fix(cls, context) and _needs_surface(cls, context)):
            return False
        head = _surface_of(context)
        if head.data.uv_layers.active is not None:
            cls.poll_message_set("The surface has UVs already")
        elif not head.data.polygons:
            cls.poll_message_set("The surface has no faces")
        elif not is_shape_editable(head) or not head.visible_get():
            cls.poll_message_set("The surface is hidden, or linked from another file")
        else:
            return True
        return False

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        hair, head = target_hair(context)[0], _surface_of(context)
        with wait_cursor(context), _only_selected(context, head):
            bpy.ops.object.mode_set(mode="EDIT")
            try:
                bpy.ops.mesh.select_all(action="SELECT")
                bpy.ops.uv.smart_project(angle_limit=_ANGLE_LIMIT, island_margin=_ISLAND_MARGIN)
            finally:
                bpy.ops.object.mode_set(mode="OBJECT")
        set_surface(hair, head)
        return {"FINISHED"}


class HAIRLOOM_OT_show_in_renders(bpy.types.Operator):
    """Show the hair itself in renders again, after its bake or the copy that showed it was
    deleted"""

    bl_idname = "hairloom.show_in_renders"
    bl_label = "Show in Renders"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not _can_fix(cls, context):
            return False
        if any(map(render_problem, target_hair(context))):
            return True
        cls.poll_message_set("Renders show it already, or a copy that shows its bake")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        for hair in filter(render_problem, target_hair(context)):
            remove_copy(hair)
        return {"FINISHED"}


class HAIRLOOM_OT_apply_scale(bpy.types.Operator):
    """Apply the scale of the active hair's object to its curves. The hair does not move"""

    bl_idname = "hairloom.apply_scale"
    bl_label = "Apply Scale"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not _is_shown(cls, context):
            return False
        hair = target_hair(context)[0]
        if hair.data.users > 1:
            cls.poll_message_set("Several objects share these curves: make them single first")
        elif not is_unevenly_scaled(hair):
            cls.poll_message_set("It is scaled evenly")
        else:
            return True
        return False

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        hair = target_hair(context)[0]
        if hair.parent is not None and is_unevenly_scaled(hair.parent):
            raise HairloomError(
                f"its parent, {hair.parent.name}, is scaled unevenly too",
                place=hair.name,
                remedy="Apply the scale of the parent (Ctrl A) first; until then widths are "
                "averaged",
            )
        with _only_selected(context, hair):
            bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
        return {"FINISHED"}


@contextmanager
def _only_selected(context: bpy.types.Context, obj: bpy.types.Object) -> Iterator[None]:
    """Select this object alone, for Blender's operators; then restore the selection."""
    selected, active = context.selected_objects, context.view_layer.objects.active
    for other in selected:
        other.select_set(False)
    obj.select_set(True)
    context.view_layer.objects.active = obj
    try:
        yield
    finally:
        obj.select_set(False)
        for other in selected:
            other.select_set(True)
        context.view_layer.objects.active = active


def _can_fix(operator: type[Any], context: bpy.types.Context) -> bool:
    if not (needs_hair(operator, context) and in_object_mode(operator, context)):
        return False
    if is_shape_editable(target_hair(context)[0]):
        return True
    operator.poll_message_set("It is linked from another file: make it local first")
    return False


def _is_shown(operator: type[Any], context: bpy.types.Context) -> bool:
    """Whether the hair can be selected, as Blender's own operators work on the selection."""
    if not _can_fix(operator, context):
        return False
    if target_hair(context)[0].visible_get():
        return True
    operator.poll_message_set("The hair is hidden: show it first")
    return False


def _surface_of(context: bpy.types.Context) -> bpy.types.Object:
    head = head_of(target_hair(context)[0])
    assert head is not None, "poll has looked"
    return head


def _needs_surface(operator: type[Any], context: bpy.types.Context) -> bool:
    if head_of(target_hair(context)[0]) is not None:
        return True
    operator.poll_message_set("The hair has no surface: press Set Surface first")
    return False


CLASSES: tuple[type[Any], ...] = (
    HAIRLOOM_OT_set_surface,
    HAIRLOOM_OT_snap_roots,
    HAIRLOOM_OT_unwrap_surface,
    HAIRLOOM_OT_apply_scale,
    HAIRLOOM_OT_show_in_renders,
)
