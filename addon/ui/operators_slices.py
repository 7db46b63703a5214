"""Show Slices: what the lights' shadow maps hold, in an Image Editor."""

from __future__ import annotations

import bpy

from ..host import live
from ..host.slices import slices_image, slices_of_view
from .reports import reporting
from .selection import chosen_hair, needs_hair


class HAIRLOOM_OT_show_slices(bpy.types.Operator):
    """Show what the hair lets through of each light, layer by layer, in an Image Editor"""

    bl_idname = "hairloom.show_slices"
    bl_label = "Show Slices"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not needs_hair(cls, context):
            return False
        if live.session_of(chosen_hair(context)[0]) is None:
            cls.poll_message_set("Press Preview first")
            return False
        return True

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        session = live.session_of(chosen_hair(context)[0])
        assert session is not None, "poll"
        _show(context, slices_image(slices_of_view(session.snapshot, context)))
        self.report({"INFO"}, "White: all light is left. Layers from the light on, from top left")
        return {"FINISHED"}


def _show(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """In an Image Editor that is open, else in a window of its own."""
    windows = context.window_manager.windows
    areas = [area for window in windows for area in window.screen.areas]
    editor = next((area for area in areas if area.type == "IMAGE_EDITOR"), None)
    if editor is None:
        if bpy.app.background:
            return
        bpy.ops.wm.window_new()
        editor = context.window_manager.windows[-1].screen.areas[0]
        editor.type = "IMAGE_EDITOR"
    editor.spaces.active.image = image


CLASSES = (HAIRLOOM_OT_show_slices,)
