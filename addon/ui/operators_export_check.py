"""Check for Export: what an engine will see of the hair, in a popup or with the export options."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass
from typing import Any

import bpy
from bpy.props import EnumProperty

from ..blender.base.latest_job import (
    POLL_INTERVAL,
    STEP_INTERVAL,
    is_scheduled,
    schedule,
    unschedule,
)
from ..blender.base.outcome import Outcome
from ..blender.base.redraw import redraw_file_browsers
from ..blender.colliders.rigs import CachedRig
from ..blender.preview.bake import is_bakeable
from ..blender.preview.previews import previewed_rigs
from ..blender.strands.export_check import ExportCheck
from ..errors import HairloomError
from ..exchange.strand_export_settings import StrandExportSettings
from ..exchange.strand_formats import STRAND_FORMATS, StrandFormat
from .long_work import LongWork, Steps, steps_of_parts
from .messages import draw_lines
from .reports import report_outcome, wait_cursor
from .selection import needs_hair, target_hair


@dataclass(eq=False)
class _OpenCheck:
    """The check of a file browser or popup that is open, and its work in the background.

    window: the one in which it was opened, whose view layer it reads.
    options: what to check for next.
    """

    check: ExportCheck
    window: bpy.types.Window | None
    options: tuple[StrandFormat, StrandExportSettings] | None = None
    work: Steps[None] | None = None

    def refresh_in_background(self, kind: StrandFormat, settings: StrandExportSettings) -> None:
        """Check for a format and settings while the dialog stays responsive."""
        self.options = kind, settings
        if not is_scheduled(self):
            self.work = self._steps()
            schedule(self, self._step)

    def remaining_work(self) -> Steps[None]:
        """What is left of the work in the background, to be done now."""
        work, self.work = self.work, None
        unschedule(self)
        if work is not None:
            yield from work

    def stop(self) -> None:
        """Cancel the work in the background."""
        work, self.work = self.work, None
        unschedule(self)
        if work is not None:
            work.close()

    def _steps(self) -> Steps[None]:
        """Check for the options that were chosen last; those chosen meanwhile come next."""
        while self.options is not None and self.check.options != self.options:
            yield from steps_of_parts(self.check.refresh_parts(*self.options))

    def _step(self) -> float | None:
        """Continue the work; a timer of Blender's has no window of its own."""
        assert self.work is not None
        with (
            nullcontext() if self.window is None else bpy.context.temp_override(window=self.window)
        ):
            step = next(self.work, None)
        redraw_file_browsers()
        if step is not None:
            return POLL_INTERVAL if step.is_idle else STEP_INTERVAL
        self.stop()
        return None


_open: _OpenCheck | None = None


def open_check(check: ExportCheck) -> None:
    """Set the check, when a file browser or popup opens."""
    global _open
    close_check()
    _open = _OpenCheck(check, bpy.context.window)


def close_check(check: ExportCheck | None = None) -> None:
    """Drop the check when its dialog closes, unless another one has opened since."""
    global _open
    if _open is not None and (check is None or check is _open.check):
        _open.stop()
        _open = None


def cached_rigs() -> tuple[CachedRig, ...]:
    """Rigs that were made by the open dialog and by previews."""
    return (*(() if _open is None else _open.check.cached_rigs), *previewed_rigs().values())


def hair_count() -> int:
    """The number of hair objects in the open dialog; 0 without one."""
    return 0 if _open is None else len(_open.check.hair)


def refresh_in_background(kind: StrandFormat, settings: StrandExportSettings) -> None:
    """Check for a format and settings while the dialog stays responsive."""
    if _open is not None:
        _open.refresh_in_background(kind, settings)


def show_error(error: HairloomError) -> None:
    """Show why these settings cannot be used."""
    if _open is not None:
        _open.stop()
        check = _open.check
        check.lines, check.warnings, check.options = [], [str(error)], None


def finish_refresh() -> Steps[None]:
    """What is left of the work in the background, for an export that uses its strands."""
    if _open is not None:
        yield from _open.remaining_work()


def draw_motion(layout: bpy.types.UILayout, context: bpy.types.Context, *, use_bake: bool) -> None:
    """Draw what moves the hair over frames; nothing if no dialog is open."""
    if _open is not None:
        column = layout.column(align=True)
        for line in _open.check.motion_lines(use_bake=use_bake):
            draw_lines(column, context, line)


def exportable_hair(objects: Any) -> list[bpy.types.Object]:
    """The hair among these objects, except copies that show a bake in renders."""
    return [obj for obj in objects if obj.type == "CURVES" and is_bakeable(obj)]


def draw(layout: bpy.types.UILayout, context: bpy.types.Context, panel: str) -> None:
    """Draw what the engine will see, below the options; nothing if no dialog is open."""
    if _open is None:
        return
    check, is_busy = _open.check, _open.work is not None
    header, body = layout.panel(panel)
    severity = "INFO" if check.lines else "ERROR"
    icon = severity if check.warnings else "CHECKMARK"
    header.label(text="What the Engine Will See", icon="SORTTIME" if is_busy else icon)
    if body is None:
        return
    column = body.column(align=True)
    column.active = not is_busy  # until then, it is of other options
    if is_busy and check.options is None:
        column.label(text="Reading hair")
    for line in check.lines:
        draw_lines(column, context, line)
    for warning in check.warnings:
        draw_lines(column, context, warning, severity)


def _format_and_settings(engine: str) -> tuple[StrandFormat, StrandExportSettings]:
    """The format and settings for an item of `_engines`."""
    name, _, layout = engine.partition(" ")
    (kind,) = (each for each in STRAND_FORMATS if each.name == name)
    return kind, StrandExportSettings(engine=layout) if layout else StrandExportSettings()


def _refresh_engine(operator: Any, context: bpy.types.Context) -> None:
    """Check the hair for the chosen engine, at once: a popup is not drawn again by itself."""
    if _open is not None:
        with wait_cursor(context):
            _open.check.refresh(*_format_and_settings(operator.engine))


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
        yield from steps_of_parts(check.refresh_parts(*_format_and_settings(self.engine)))
        if not bpy.app.background and self.options.is_invoke:
            open_check(check)
            return
        report_outcome(self, Outcome("; ".join(check.lines), {}, tuple(check.warnings)))

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
        self.export_check = None if _open is None else _open.check
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
