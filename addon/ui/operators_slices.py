"""Show Opacity Map and Show Skin Shadow: the maps of hair's shadows in an Image Editor."""

from __future__ import annotations

import bpy

from ..blender.base.outcome import report
from ..blender.pictures import skin_picture, slices
from ..blender.pictures.skin_picture import skin_shadow_of_view
from ..blender.pictures.slices import filled_image, slices_of_view
from ..blender.preview import previews
from ..blender.sessions.session import Session
from .reports import reporting
from .selection import needs_hair, target_hair


class HAIRLOOM_OT_show_slices(bpy.types.Operator):
    """Show how much of each light the hair lets through, layer by layer, in an Image Editor"""

    bl_idname = "hairloom.show_slices"
    bl_label = "Show Opacity Map"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _needs_preview(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        picture = slices_of_view(_previewed(context).snapshot, context)
        _show(context, filled_image(slices.IMAGE, picture))
        report(
            self, "INFO", "White: no light is blocked. Layers away from the light, from top left"
        )
        return {"FINISHED"}


class HAIRLOOM_OT_show_skin_shadow(bpy.types.Operator):
    """Show the soft shadow of the hair on its head, laid out as the head's UV map, in an Image
    Editor"""

    bl_idname = "hairloom.show_skin_shadow"
    bl_label = "Show Skin Shadow"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _needs_preview(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        session = _previewed(context)
        hair = session.snapshot, session.rig, session.solver.pose
        picture = skin_shadow_of_view(*hair, context, place=self.bl_label)
        _show(context, filled_image(skin_picture.IMAGE, picture))
        report(self, "INFO", "White: all light reaches the skin. One map for each light")
        return {"FINISHED"}


def _needs_preview(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """For `poll`: whether hair is previewed; if not, the greyed-out button says so."""
    if not needs_hair(operator, context):
        return False
    if previews.session_of(target_hair(context)[0]) is None:
        operator.poll_message_set("Press Preview first")
        return False
    return True


def _previewed(context: bpy.types.Context) -> Session:
    session = previews.session_of(target_hair(context)[0])
    assert session is not None, "poll"
    session.finish(context.evaluated_depsgraph_get())
    return session


def _show(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """Show a picture in an open Image Editor, else in a new window."""
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


CLASSES = (HAIRLOOM_OT_show_slices, HAIRLOOM_OT_show_skin_shadow)
