"""What the artist's selection means to Hairloom."""

from __future__ import annotations

import bpy


def selected_hair(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The active and all other selected hair curves, the active first."""
    candidates = [context.active_object, *context.selected_objects]
    hair = [obj for obj in candidates if obj is not None and obj.type == "CURVES"]
    return list(dict.fromkeys(hair))


def active_mesh(context: bpy.types.Context) -> bpy.types.Object | None:
    """The active object if it is a mesh, and selected."""
    active = context.active_object
    is_mesh = active is not None and active.type == "MESH" and active.select_get()
    return active if is_mesh else None


def needs_hair(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """For `poll`: whether hair curves are selected; says so on the greyed-out button."""
    if selected_hair(context):
        return True
    operator.poll_message_set("Select hair curves first (Add > Curve > Empty Hair, or import some)")
    return False
