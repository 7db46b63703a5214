"""Check for Export: what an engine will see of the hair, in a popup or with the export options."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import EnumProperty

from ..blender.base.outcome import Outcome
from ..blender.colliders.rigs import CachedRig
from ..blender.preview.bake import is_bakeable
from ..blender.preview.previews import previewed_rigs
from ..blender.strands.export_check import ExportCheck
from ..exchange.strand_export_settings import StrandExportSettings
from ..exchange.strand_formats import STRAND_FORMATS, StrandFormat
from .long_work import LongWork, Steps, steps_of_parts
from .messages import draw_lines
from .reports import report_outcome, wait_cursor
from .selection import needs_hair, target_hair

#: the check of the file browser or popup that is open
_check: ExportCheck | None = None


def open_check(check: ExportCheck) -> None:
    """Set the check, when a file browser or popup opens."""
    global _check
    _check = check


def close_check(check: ExportCheck | None = None) -> None:
    """Drop the check when its dialog closes, unless another one has opened since."""
    global _check
    if check is None or check is _check:
        _check = None


def cached_rigs() -> tuple[CachedRig, ...]:
    """Rigs that were made by the open dialog and by previews."""
    return (*(() if _check is None else _check.cached_rigs), *previewed_rigs().values())


def hair_count() -> int:
    """The number of hair objects in the open dialog; 0 without one."""
    return 0 if _check is None else len(_check.hair)


def refresh(context: bpy.types.Context, kind: StrandFormat, settings: StrandExportSettings) -> bool:
    """Check for a format and settings; returns whether the result may have changed."""
    if _check is None:
        return False
    with wait_cursor(context):
        return _check.refresh(context.evaluated_depsgraph_get(), kind, settings)


def draw_motion(layout: bpy.types.UILayout, context: bpy.types.Context, *, use_bake: bool) -> None:
    """Draw what moves the hair over frames; nothing if no dialog is open."""
    if _check is not None:
        column = layout.column(align=True)
        for line in _check.motion_lines(use_bake=use_bake):
            draw_lines(column, context, line)


def exportable_hair(objects: Any) -> list[bpy.types.Object]:
    """The hair among these objects, except copies that show a bake in renders."""
    return [obj for obj in objects if obj.type == "CURVES" and is_bakeable(obj)]


def draw(layout: bpy.types.UILayout, context: bpy.types.Context, panel: str) -> None:
    """Draw what the engine will see, below the options; nothing if no dialog is open."""
    if _check is None:
        return
    header, body = layout.panel(panel)
    severity = "INFO" if _check.lines else "ERROR"
    icon = severity if _check.warnings else "CHECKMARK"
    header.label(text="What the Engine Will See", icon=icon)
    if body is None:
        return
    column = body.column(align=True)
    for line in _check.lines:
        draw_lines(column, context, line)
    for warning in _check.warnings:
        draw_lines(column, context, warning, severity)


def _format_and_settings(engine: str) -> tuple[StrandFormat, StrandExportSettings]:
    """The format and settings for an item of `_engines`."""
    name, _, layout = engine.partition(" ")
    (kind,) = (each for each in STRAND_FORMATS if each.name == name)
    return kind, StrandExportSettings(engine=layout) if layout else StrandExportSettings()


def _refresh_engine(operator: Any, context: bpy.types.Context) -> None:
    """Check the hair for the chosen engine."""
    refresh(context, *_format_and_settings(operator.engine))


def _engines() -> list[tuple[str, str, str]]:
    """Enum items for each engine in each format, named "format engine" or "format"."""
    return [
        (f"{kind.name} {layout.name}", f"{layout.title}, {kind.title}", layout.about)
        if "engine" in kind.options
        else (kind.name, kind.title, layout.about)
        for kind in STRAND_FORMATS
        for layout in kind.layouts
    ]


_ENGINE = {
    "name": "Target",
    "description": "Engine and file format to check for",
    "items": _engines(),
    "default": _engines()[0][0],
}


class HAIRLOOM_OT_check_export(LongWork, bpy.types.Operator):
    """Show what an engine will receive, without writing a file. Esc cancels"""

    bl_idname = "hairloom.check_export"
    bl_label = "Check for Export"

    __annotations__ = {"engine": EnumProperty(**_ENGINE)}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls.can_start() and needs_hair(cls, context)

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        check = ExportCheck.of(exportable_hair(target_hair(context)), previewed_rigs())
        reading = check.read_steps(
            context.evaluated_depsgraph_get(), *_format_and_settings(self.engine)
        )
        yield from steps_of_parts(reading)
        open_check(check)
        if not bpy.app.background and self.options.is_invoke:
            return
        _refresh_engine(self, context)
        report_outcome(self, Outcome("; ".join(check.lines), {}, tuple(check.warnings)))
        close_check(check)

    def on_finished(self, _context: bpy.types.Context) -> None:
        bpy.ops.hairloom.show_export_check("INVOKE_DEFAULT", engine=self.engine)


class HAIRLOOM_OT_show_export_check(bpy.types.Operator):
    """Show what an engine will receive of the checked hair"""

    bl_idname = "hairloom.show_export_check"
    bl_label = "Check for Export"
    bl_options = {"INTERNAL"}

    __annotations__ = {"engine": EnumProperty(**_ENGINE, update=_refresh_engine)}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Open a popup that shows the check, with a button for the export itself."""
        self.export_check = _check
        _refresh_engine(self, context)
        return context.window_manager.invoke_popup(self, width=440)

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.label(text=self.bl_label)
        layout.prop(self, "engine")
        draw(layout, context, "HAIRLOOM_check_export")
        kind, _, engine = self.engine.partition(" ")
        layout.operator_context = "INVOKE_DEFAULT"
        export = layout.operator(f"hairloom.export_{kind}", icon="EXPORT")
        if engine:
            export.engine = engine

    def execute(self, _context: bpy.types.Context) -> set[str]:
        return {"FINISHED"}

    def cancel(self, _context: bpy.types.Context) -> None:
        close_check(self.export_check)


CLASSES = (HAIRLOOM_OT_check_export, HAIRLOOM_OT_show_export_check)
