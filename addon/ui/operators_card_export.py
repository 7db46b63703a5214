"""Export of hair cards: the operator in the File menu, which a collection's exporters use too."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import closing
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..blender.bakes import playback
from ..blender.bakes.bake_settings import frame_range
from ..blender.bakes.stale_bakes import stale_notes
from ..blender.base.file_names import file_paths, file_stem, given_path, in_asset_folder
from ..blender.base.objects import Handle, without_hidden
from ..blender.base.outcome import Outcome, report
from ..blender.cards.files import CardExport, CardOutput
from ..blender.preview.previews import previewed_rigs, previews
from ..blender.properties.groups import operator_properties
from ..blender.properties.properties import settings_of
from ..cards.export_settings import OF_MOTION, CardExportSettings
from ..cards.settings import CardSettings
from ..errors import HairloomError
from ..exchange.cards.card_formats import FORMATS, GLB, SUFFIXES
from .drawing import draw_inactive
from .file_paths import FILE_TO_WRITE
from .long_work import LongWork, Progress, Steps, threaded
from .messages import draw_lines
from .reports import report_outcome
from .selection import needs_hair, target_hair

#: the setting of the groom that the dialog's own number of levels overrides
(_LEVELS,) = (each for each in CardSettings.parameters() if each.name == "levels")
_FORMATS = [(each.name, each.entry, each.about) for each in FORMATS]


class HAIRLOOM_OT_export_cards(LongWork, ExportHelper, bpy.types.Operator):
    """Write hair as textured cards, sorted from inside to outside, for engines"""

    bl_idname = "hairloom.export_cards"
    bl_label = "Export Hair Cards"
    bl_options = {"PRESET"}
    state_after_cancel = "nothing was written"
    #: the hair of the file browser, and notes on its stale bake once these are shown
    hair: Handle | None = None
    stale: tuple[str, ...] | None = None

    filepath: FILE_TO_WRITE
    filter_glob: StringProperty(
        default=";".join(f"*{suffix}" for suffix in SUFFIXES), options={"HIDDEN"}
    )
    collection: StringProperty(
        name="Source Collection",
        description="Export the hair of this collection instead of the active hair",
        default="",
        options={"HIDDEN"},
    )
    format: EnumProperty(name="Format", description="File format", items=_FORMATS)
    own_folder: BoolProperty(
        name="Own Folder",
        description="Write all files into a folder named after the mesh. Scripts and collection "
        "exporters, which give their own path, use that path unless this is on",
        default=False,
    )
    own_levels: BoolProperty(
        name="Other Levels of Detail",
        description="Write a different number of levels than set in the groom",
        default=False,
    )
    levels: IntProperty(
        name="Levels",
        description="Number of meshes to write, each with about half the triangles of the "
        "previous one",
        default=3,
        soft_min=1,
        soft_max=5,
    )
    own_frames: BoolProperty(
        name="Other Frames", description="Write only part of the bake", default=False
    )
    first_frame: IntProperty(name="First", description="First frame to write", default=1)
    last_frame: IntProperty(name="Last", description="Last frame to write", default=250)
    __annotations__ |= operator_properties("cards_export")

    @property
    def filename_ext(self) -> str:
        """The suffix that Blender appends to a name; one that fits the format is kept."""
        (file_format,) = (each for each in FORMATS if each.name == self.format)
        suffix = Path(self.filepath).suffix.lower()
        return suffix if suffix in file_format.suffixes else file_format.suffixes[0]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        # a collection's exporter has its own hair, so it needs no selection
        return cls.can_start() and (bool(bpy.data.hair_curves) or needs_hair(cls, context))

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        hair = target_hair(context)
        if hair and not self.filepath:
            folder = Path(bpy.data.filepath).parent if bpy.data.filepath else Path()
            self.properties.filepath = str(folder / (file_stem(hair[0].name) + self.filename_ext))
        if not self.properties.is_property_set("own_folder"):
            self.own_folder = True
        self.hair = Handle.of(hair[0]) if hair else None
        return super().invoke(context, event)

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        hair = self._hair(context)
        path = given_path(self.filepath, place=self.bl_label)
        files = file_paths(path, [each.name for each in hair])
        if self.own_folder:
            files = [in_asset_folder(path) for path in files]
        plans = [self._plan(context, *each) for each in zip(hair, files, strict=True)]
        outcomes = []
        for plan in plans:
            built = yield from threaded(plan.building())
            outcomes.append((yield from _as_steps(plan.writing(built))))
        for outcome in outcomes:
            report_outcome(self, outcome)

    def _plan(self, context: bpy.types.Context, hair: bpy.types.Object, path: Path) -> CardExport:
        return CardExport.of(
            hair,
            context.evaluated_depsgraph_get(),
            path,
            self._output(path, hair.name),
            levels=self._levels(),
            frames=self._frames(hair),
            cached_rigs=tuple(previewed_rigs().values()),
            cache=previews.built_cards,
        )

    def _output(self, path: Path, hair_name: str) -> CardOutput:
        """The output of a card file; a known suffix overrides the chosen format."""
        is_known = path.suffix.lower() in SUFFIXES
        settings = settings_of(self, CardExportSettings)
        return CardOutput(None if is_known else self.format, file_stem(hair_name), settings)

    def _levels(self) -> int | None:
        if not self.own_levels:
            return None
        return int(_LEVELS.checked(self.levels, self.bl_label, name="Levels"))

    def _frames(self, hair: bpy.types.Object) -> range | None:
        if not self.own_frames or self.motion == "none":
            return None
        return frame_range(self.first_frame, self.last_frame, hair.name)

    def _hair(self, context: bpy.types.Context) -> list[bpy.types.Object]:
        if not self.collection:
            return target_hair(context)[:1] or _raise_no_hair(
                "Nothing selected", "Select hair curves"
            )
        collection = bpy.data.collections.get(self.collection)
        objects = () if collection is None else collection.all_objects
        grooms = [obj for obj in objects if obj.type == "CURVES"]
        hair, left_out = without_hidden(grooms, context.evaluated_depsgraph_get())
        for each in left_out:
            report(self, "WARNING", f"{each}, and is left out.")
        return hair or _raise_no_hair(
            f"Collection '{self.collection}'", "Link hair curves to it, or choose another one"
        )

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        self._draw_folder(layout)
        layout.prop(self, "format")
        levels = layout.row(heading="Levels")
        levels.prop(self, "own_levels", text="")
        count = levels.row()
        count.active = self.own_levels
        count.prop(self, "levels", text="")
        for name in ("packing", "textures", "attributes", "index_buffer"):
            layout.prop(self, name)
        self._draw_page(layout)
        layout.prop(self, "motion")
        if self.motion != "none":
            self._draw_motion(layout, context)

    def _draw_folder(self, layout: bpy.types.UILayout) -> None:
        """The option for a folder of its own, and whether that would replace a file: the file
        browser only warns about a file of the name that it shows, not about one in that folder."""
        layout.prop(self, "own_folder")
        if self.own_folder:
            path = in_asset_folder(Path(bpy.path.abspath(self.filepath)))
            icon, verb = ("ERROR", "Replaces") if path.exists() else ("FILE_FOLDER", "Makes")
            layout.label(text=f"{verb} {path.parent.name}/{path.name}", icon=icon)

    def _draw_page(self, layout: bpy.types.UILayout) -> None:
        page = layout.column()
        if self.format != GLB.name:
            draw_inactive(page, self, "page", "only with .glb")
            return
        page.prop(self, "page")
        for name in ("page_texture", "page_head") if self.page else ():
            page.prop(self, name)

    def _draw_motion(self, layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
        frames = layout.row(heading="Frames")
        frames.prop(self, "own_frames", text="")
        ends = frames.row(align=True)
        ends.active = self.own_frames
        ends.prop(self, "first_frame", text="")
        ends.prop(self, "last_frame", text="")
        for name in OF_MOTION[self.motion]:
            layout.prop(self, name)
        if self.stale is None:
            hair = None if self.hair is None else self.hair.find()
            self.stale = _stale_bake_notes(hair, context.view_layer.depsgraph)
        for note in self.stale:
            draw_lines(layout.column(align=True), context, note, "ERROR")


def _stale_bake_notes(
    hair: bpy.types.Object | None, depsgraph: bpy.types.Depsgraph
) -> tuple[str, ...]:
    """Notes on a stale bake; a bake that cannot be read is reported when the file is written."""
    try:
        cache = None if hair is None else playback.cache_of(hair)
        return () if hair is None or cache is None else stale_notes(hair, cache, depsgraph)
    except HairloomError:
        return ()


def _as_steps(writing: Generator[tuple[str, float | None], None, Outcome]) -> Steps[Outcome]:
    with closing(writing):
        while True:
            try:
                text, fraction = next(writing)
            except StopIteration as end:
                outcome: Outcome = end.value
                return outcome
            yield Progress(text, fraction)


class HAIRLOOM_FH_cards(bpy.types.FileHandler):
    """Cards of a collection's hair, written with all its exporters"""

    bl_idname = "HAIRLOOM_FH_cards"
    bl_label = "Hair cards (Hairloom)"
    bl_export_operator = "hairloom.export_cards"
    bl_file_extensions = ";".join(SUFFIXES)

    @classmethod
    def poll_drop(cls, _context: bpy.types.Context) -> bool:
        return False  # it only exports


def _raise_no_hair(place: str, remedy: str) -> Any:
    raise HairloomError("there is no hair to write", place=place, remedy=remedy)


CLASSES = (HAIRLOOM_OT_export_cards, HAIRLOOM_FH_cards)
