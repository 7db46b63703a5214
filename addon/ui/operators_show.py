"""Turntable and Contact Sheet, to show a groom to others."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..blender.bakes.groom_hashes import frame_rate
from ..blender.base.file_names import absolute_path, path_to_write
from ..blender.base.outcome import report
from ..blender.pictures.sheet import Sheet
from ..blender.pictures.showing import ShownGroom, file_name, shown_groom
from ..blender.pictures.turntable import (
    FRAME_LIMITS,
    LIGHTS,
    SAMPLE_LIMITS,
    SIDE_LIMITS,
    Turntable,
    TurntableSettings,
    check_limit,
)
from ..errors import HairloomError
from .file_paths import FILE_TO_WRITE, FOLDER_OF_PICTURES
from .long_work import LongWork, Steps, counted, draw_progress
from .reports import reporting, wait_cursor
from .selection import needs_hair, target_hair

_SAMPLES = IntProperty(
    name="Samples",
    description="Subpixels along each side of a pixel",
    default=3,
    soft_min=SAMPLE_LIMITS[0],
    soft_max=SAMPLE_LIMITS[1],
)
#: side of each picture of a contact sheet [pixels], min and max
_SHEET_LIMITS = SIDE_LIMITS[0], SIDE_LIMITS[1] // 4


class HAIRLOOM_OT_turntable(LongWork, bpy.types.Operator):
    """Render a turntable of the active hair, as pictures and as a video. Esc cancels"""

    bl_idname = "hairloom.turntable"
    bl_label = "Turntable"
    bl_options = {"REGISTER", "PRESET"}
    state_after_cancel = "nothing was written"

    directory: FOLDER_OF_PICTURES
    filter_folder: BoolProperty(
        description="Show folders in the file browser",
        default=True,
        options={"HIDDEN", "SKIP_SAVE"},
    )
    frames: IntProperty(
        name="Frames",
        description="Number of pictures in a full turn",
        default=48,
        soft_min=FRAME_LIMITS[0],
        soft_max=360,
    )
    size: IntProperty(
        name="Size",
        description="Width and height of the pictures in pixels",
        default=720,
        soft_min=SIDE_LIMITS[0],
        soft_max=2048,
        subtype="PIXEL",
    )
    samples: _SAMPLES
    lights: EnumProperty(
        name="Lights",
        description="Whether lights move with the camera or stay with the groom",
        items=LIGHTS,
    )
    transparent: BoolProperty(
        name="Transparent", description="Render the pictures without a backdrop", default=False
    )
    video: BoolProperty(
        name="Video",
        description="Also write a video of the pictures, at the scene's frame rate",
        default=True,
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls.can_start() and needs_hair(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if self.directory:
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        if not self.directory:
            raise HairloomError(
                "there is no folder for the pictures", place="Turntable", remedy="Choose one"
            )
        turntable = self._turntable(context)
        count = turntable.settings.frames
        yield from counted(turntable.steps(), count, "pictures")
        for note in (*turntable.notes, *turntable.studio.notes):
            report(self, "WARNING", note)
        video = " and a video" if turntable.has_video else ""
        report(self, "INFO", f"Wrote {count:,} pictures{video} to {turntable.folder}")

    def _turntable(self, context: bpy.types.Context) -> Turntable:
        shown = _shown(self, context)
        settings = TurntableSettings(
            frames=self.frames,
            width=self.size,
            height=self.size,
            samples=self.samples,
            lights=self.lights,
            transparent=self.transparent,
            video=self.video,
            frame_rate=frame_rate(context.scene),
        )
        name = file_name(target_hair(context)[0].name)
        folder = Path(absolute_path(self.directory))
        return Turntable(
            shown.studio, shown.pose, shown.points, settings, folder, name, shown.guides
        )


class HAIRLOOM_OT_contact_sheet(bpy.types.Operator, ExportHelper):
    """Draw the active hair from all sides, or in all looks, in one picture"""

    bl_idname = "hairloom.contact_sheet"
    bl_label = "Contact Sheet"
    bl_options = {"REGISTER", "PRESET"}
    filename_ext = ".png"

    filepath: FILE_TO_WRITE
    filter_glob: StringProperty(default="*.png", options={"HIDDEN"})
    shows: EnumProperty(
        name="Shows",
        description="What varies between the pictures of the sheet",
        items=(
            ("sides", "All Sides", "Front, three-quarter, side, back, top, and a close-up"),
            ("looks", "All Looks", "One view in all looks that come with Hairloom"),
        ),
    )
    size: IntProperty(
        name="Size",
        description="Width and height of each picture on the sheet in pixels",
        default=480,
        soft_min=_SHEET_LIMITS[0],
        soft_max=_SHEET_LIMITS[1],
        subtype="PIXEL",
    )
    samples: _SAMPLES

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        manager = context.window_manager
        path = path_to_write(self.filepath, self.filename_ext, place=self.bl_label)
        check_limit("contact sheet", "size", self.size, _SHEET_LIMITS)
        check_limit("contact sheet", "samples", self.samples, SAMPLE_LIMITS)
        with wait_cursor(context):
            shown = _shown(self, context)
            sheet = Sheet(
                shown.studio,
                shown.pose,
                shown.points,
                (self.size, self.size),
                self.samples,
                by_looks=self.shows == "looks",
                guides=shown.guides,
            )
            manager.progress_begin(0, sheet.count)
            try:
                for done in sheet.steps():
                    manager.progress_update(done)
            finally:
                manager.progress_end()
            shown.studio.write(path, sheet.picture)
        for note in shown.studio.notes:
            report(self, "WARNING", note)
        report(self, "INFO", f"Wrote {sheet.count} pictures to {path}")
        return {"FINISHED"}


def _shown(operator: bpy.types.Operator, context: bpy.types.Context) -> ShownGroom:
    """The active hair in its present state; reports its warnings first."""
    hair = target_hair(context)[0]
    shown = shown_groom(hair, context.evaluated_depsgraph_get())
    for note in shown.notes:
        report(operator, "WARNING", f"{hair.name}: {note}")
    return shown


def draw_show(layout: bpy.types.UILayout, _hair: bpy.types.Object) -> None:
    if not draw_progress(layout, HAIRLOOM_OT_turntable):
        layout.operator("hairloom.turntable", icon="RENDER_ANIMATION")
    layout.operator("hairloom.contact_sheet", icon="IMAGE_DATA")


CLASSES = (HAIRLOOM_OT_turntable, HAIRLOOM_OT_contact_sheet)
