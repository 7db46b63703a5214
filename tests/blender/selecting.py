"""Select objects as a click does."""

from __future__ import annotations

import bpy


def select(obj: bpy.types.Object) -> None:
    """Select only this object and make it active."""
    for other in bpy.context.selected_objects:
        other.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
