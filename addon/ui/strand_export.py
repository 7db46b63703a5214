"""What the operators that export strands share: options, and writing motion in steps."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..blender.bakes.bake_settings import frame_range
from ..blender.base.file_names import file_paths, file_stem, given_path
from ..blender.base.objects import without_hidden
from ..blender.base.outcome import Outcome, report
from ..blender.colliders.rigs import CachedRig
from ..blender.preview.previews import previewed_rigs
from ..blender.properties.properties import property_annotations, settings_of
from ..blender.strands.export_check import ExportCheck
from ..blender.strands.strand_export import StrandExport
from ..errors import HairloomError
from ..exchange.strand_export_settings import FORMAT_DEFAULT, StrandExportSettings
from ..exchange.strand_formats import StrandFormat
from ..params import Parameter
from . import operators_export_check as export_check
from .file_paths import FILE_TO_WRITE
from .long_work import LongWork, Progress, Steps, threaded
from .operators_export_check import exportable_hair
from .reports import report_outcome
from .selection import needs_hair, target_hair

_MULTIPLE_OBJECTS = (
    ("one", "One File", "All hair in one file, with separate groups for each object"),
    ("each", "A File Each", "One file for each hair object, named after it"),
)
_FRAMES = (
    ("still", "This Frame", "Only the current frame"),
    ("scene", "Scene Range", "All frames of the scene"),
    ("own", "Frames", "A range of frames"),
)
#: panel -> options of the dialog itself, drawn before those of the settings
_DIALOG_OPTIONS = {"Include": ("several",), "Animation": ("frames", "first", "last")}


def option_properties(kind: StrandFormat) -> dict[str, Any]:
    """The options in the `__annotations__` of the operator that writes a format."""
    options = (_for_format(kind, each) for each in _options(kind))
    return property_annotations(options, clamps=False)


def _for_format(kind: StrandFormat, option: Parameter) -> Parameter:
    """An option with a format's defaults and choices: its engines, or else its axis and unit."""
    if option.name == "engine":
        engines = tuple((each.name, each.title, each.about) for each in kind.layouts)
        return replace(option, default=engines[0][0], choices=engines)
    if "engine" not in kind.options and option.name in ("up", "scale"):
        space = kind.layouts[0].space
        defaults = {"up": space.up, "scale": 1.0 / space.units_per_metre}
        choices = tuple(each for each in option.choices if each[0] != FORMAT_DEFAULT)
        return replace(option, default=defaults[option.name], choices=choices)
    return option


def _options(kind: StrandFormat) -> list[Parameter]:
    return [each for each in StrandExportSettings.parameters() if each.name in kind.options]


class StrandExportOperator(LongWork, ExportHelper):
    """Base of the export operators of all formats. Files are written in threads; Esc cancels."""

    bl_options: ClassVar[set[str]] = {"PRESET"}
    state_after_cancel = "the file is as it was before"
    kind: ClassVar[StrandFormat]

    filepath: FILE_TO_WRITE
    collection: StringProperty(
        name="Source Collection",
        description="Export the hair of this collection instead of the selected hair",
        default="",
        options={"HIDDEN"},
    )
    several: EnumProperty(
        name="Multiple Objects",
        description="How to write more than one hair object",
        items=_MULTIPLE_OBJECTS,
    )

    @property
    def filename_ext(self) -> str:
        """The suffix that Blender appends to a name; one that fits the format is kept."""
        suffix, suffixes = Path(self.filepath).suffix.lower(), self.kind.suffixes
        return suffix if suffix in suffixes else suffixes[0]

    @classmethod
    def poll(cls: Any, context: bpy.types.Context) -> bool:
        if not cls.can_start():
            return False
        # a collection's exporter has its own hair, so it needs no selection
        return bool(bpy.data.hair_curves) or needs_hair(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        hair = exportable_hair(target_hair(context))
        if hair and not self.filepath:
            folder = Path(bpy.data.filepath).parent if bpy.data.filepath else Path()
            self.properties.filepath = str(folder / (file_stem(hair[0].name) + self.filename_ext))
        export_check.open_check(ExportCheck.of(hair, previewed_rigs()))
        self._refresh()
        return super().invoke(context, event)

    def check(self, context: bpy.types.Context) -> bool:
        """Called by Blender when an option has changed."""
        self._refresh()
        return bool(super().check(context))

    def _refresh(self) -> None:
        try:
            settings = settings_of(self, StrandExportSettings)
        except HairloomError as error:
            export_check.show_error(error)
        else:
            export_check.refresh_in_background(self.kind, settings)

    def steps(self: Any, context: bpy.types.Context) -> Steps[None]:
        try:
            yield from export_check.finish_refresh()
            cached_rigs = export_check.cached_rigs()
        finally:
            export_check.close_check()
        plans = self._plans(context, cached_rigs)
        for done, (path, plan) in enumerate(plans):
            if done:
                self.state_after_cancel = f"{done:,} of {len(plans):,} files are written"
            write = _write_still if plan.frames is None else _write_motion
            report_outcome(self, (yield from write(path, plan)))

    def cancel(self, context: bpy.types.Context) -> None:
        export_check.close_check()
        super().cancel(context)

    def _plans(
        self, context: bpy.types.Context, cached_rigs: tuple[CachedRig, ...]
    ) -> list[tuple[Path, StrandExport]]:
        """The files to write, with their contents: one for all hair, or one for each."""
        hair, path = self._hair(context), given_path(self.filepath, place=self.bl_label)
        parts = [hair] if self.several == "one" else [[each] for each in hair]
        depsgraph = context.evaluated_depsgraph_get()
        files = file_paths(path, [part[0].name for part in parts])
        return [
            (
                file,
                StrandExport.of(
                    part,
                    depsgraph,
                    self.kind,
                    settings_of(self, StrandExportSettings),
                    frames=self._frames(context.scene),
                    cached_rigs=cached_rigs,
                ),
            )
            for file, part in zip(files, parts, strict=True)
        ]

    def _frames(self: Any, scene: bpy.types.Scene) -> range | None:
        frames = getattr(self, "frames", "still")
        if frames == "still":
            return None
        uses_own_range = frames == "own"
        first, last = (
            (self.first, self.last) if uses_own_range else (scene.frame_start, scene.frame_end)
        )
        return frame_range(first, last, "Frames")

    def _hair(self, context: bpy.types.Context) -> list[bpy.types.Object]:
        if not self.collection:
            return exportable_hair(target_hair(context)) or _raise_no_hair(
                "Nothing selected", "Select hair curves"
            )
        scene_collection = context.scene.collection
        collection = bpy.data.collections.get(
            self.collection, scene_collection if self.collection == scene_collection.name else None
        )
        objects = () if collection is None else collection.all_objects
        hair, left_out = without_hidden(exportable_hair(objects), context.evaluated_depsgraph_get())
        for each in left_out:
            report(self, "WARNING", f"{each}, and is left out.")
        return hair or _raise_no_hair(
            f"Collection '{self.collection}'", "Link hair curves to it, or choose another one"
        )

    def draw(self: Any, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        for label in StrandExportSettings.panels:
            names = self._names(label)
            if not names:
                continue
            header, body = layout.panel(f"{self.bl_idname}_{label}")
            header.label(text=label)
            if body is not None:
                for name in names:
                    self._draw_option(body, name)
                if "frames" in names and self.frames != "still" and not self.collection:
                    export_check.draw_motion(body, context, use_bake=self.use_bake)
        if not self.collection:
            export_check.draw(layout, context, f"{self.bl_idname}_check")

    def _names(self, panel: str) -> list[str]:
        """The options in a panel."""
        dialog_options = [name for name in _DIALOG_OPTIONS.get(panel, ()) if hasattr(self, name)]
        return dialog_options + [each.name for each in _options(self.kind) if each.panel == panel]

    def _draw_option(self: Any, layout: bpy.types.UILayout, name: str) -> None:
        """Draw an option, unless it has no effect with the present choices."""
        if name in ("first", "last") and self.frames != "own":
            return
        if name == "use_bake" and self.frames == "still":
            return
        if name == "several" and export_check.hair_count() == 1:
            return
        layout.prop(self, name)


class MotionOptions:
    """Options of formats that hold motion."""

    frames: EnumProperty(name="Frames", description="Frames to write", items=_FRAMES)
    first: IntProperty(name="First", description="First frame", default=1)
    last: IntProperty(name="Last", description="Last frame", default=250)


def _write_still(path: Path, plan: StrandExport) -> Steps[Outcome]:
    """Write in a thread, so that the window responds while a large file is written."""
    work = plan.write_in_thread(path)
    work.stage = "Writing the file"
    return (yield from threaded(work))


def _write_motion(path: Path, plan: StrandExport) -> Steps[Outcome]:
    """Read frames here, in the main thread, while another thread writes them."""
    total = plan.frame_count
    yield Progress(f"0 of {total:,} frames", 0.0)
    with closing(plan.positions()) as positions:
        work = plan.write_in_thread(path, positions)
        try:
            while not work.run_main_thread_steps():
                yield Progress(
                    f"{plan.frames_read:,} of {total:,} frames",
                    plan.frames_read / total,
                    is_idle=not work.wants_main_thread,
                    is_committed=work.is_committed,
                )
            return work.result()
        finally:
            work.cancel()


def _raise_no_hair(place: str, remedy: str) -> Any:
    raise HairloomError("there is no hair to write", place=place, remedy=remedy)
