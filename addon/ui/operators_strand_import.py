"""Import of strands: File > Import, and files that are dropped into the viewport.

In a window, a thread reads the files, and Esc cancels it. All files are added to the scene in one
step at the end.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    StringProperty,
)
from bpy_extras.io_utils import ImportHelper, poll_file_object_drop

from ..blender.base.file_names import absolute_path, given_path
from ..blender.base.outcome import report
from ..blender.strands.import_groom import (
    FILE_KINDS,
    FileStrands,
    StrandImport,
    add_to_scene,
    apply_head_scale,
    read_import_surface,
    read_in_thread,
)
from .drawing import draw_inactive
from .file_paths import FILE_TO_READ, FOLDER_TO_READ
from .long_work import LongWork, Steps, threaded
from .reports import report_outcome
from .selection import active_mesh, growth_mesh, in_object_mode, make_active

SUFFIXES = tuple(suffix for _, suffixes in FILE_KINDS for suffix in suffixes)
UP_AXES = (
    ("FILE", "From File", "Up axis given in the file; if there is none, Z for .hair files, else Y"),
    ("Y", "Y Up", "The file's Y axis points up, as in most engines"),
    ("Z", "Z Up", "The file's Z axis points up, as in Blender"),
)
GUIDES = (
    (
        "LEAVE",
        "Ignore",
        "Import only visible strands, or the guides if the file holds nothing else",
    ),
    ("APART", "Own Object", "Import guides as a separate hair curves object"),
    (
        "AMONG",
        "With Strands",
        "Import guides with the strands, marked by the attribute groom_guide",
    ),
)


def _filter(suffixes: Iterable[str]) -> str:
    return ";".join(f"*{suffix}" for suffix in suffixes)


class HAIRLOOM_OT_import_strands(LongWork, ImportHelper, bpy.types.Operator):
    """Import grooms as hair curves, onto the active mesh if one is selected. Esc cancels"""

    bl_idname = "hairloom.import_strands"
    bl_label = "Import Hair Strands"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    filepath: FILE_TO_READ
    filter_glob: StringProperty(default=_filter(SUFFIXES), options={"HIDDEN", "SKIP_SAVE"})
    files: CollectionProperty(
        type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"}
    )
    directory: FOLDER_TO_READ
    up: EnumProperty(name="Up", description="Axis that points up in the file", items=UP_AXES)
    scale: FloatProperty(
        name="Scale",
        description="Factor on all lengths, in addition to the unit given in the file: 0.01 for a "
        "TressFX groom in centimetres",
        default=1.0,
        soft_min=0.001,
        soft_max=100.0,
        precision=4,
    )
    head_scale: FloatProperty(
        name="Scale of Head",
        description="Factor on the size of the active mesh, about the scene's origin: 0.01 for a "
        "head in centimetres",
        default=1.0,
        soft_min=0.001,
        soft_max=100.0,
        precision=4,
    )
    guides: EnumProperty(
        name="Guides", description="How guides in Alembic and USD files are imported", items=GUIDES
    )
    onto_mesh: BoolProperty(
        name="Onto Active Mesh",
        description="Bind the roots to the active mesh, so that the hair moves with it",
        default=True,
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return cls.can_start() and in_object_mode(cls, context)

    def steps(self, context: bpy.types.Context) -> Steps[None]:
        """Import the files; if one cannot be used, the others are still imported."""
        head = active_mesh(context) if self.onto_mesh else None
        surface = head and read_import_surface(
            head, context.evaluated_depsgraph_get(), self.head_scale
        )
        options = StrandImport(
            up=None if self.up == "FILE" else self.up,
            scale=self.scale,
            guides=self.guides.lower(),
        )
        results = yield from threaded(read_in_thread(self._paths(), surface, options))
        if surface is not None and any(isinstance(each, FileStrands) for each in results):
            apply_head_scale(surface)
            for note in surface.notes:
                report(self, "WARNING", note)
        imported: list[bpy.types.Object] = []
        for each in results:
            if isinstance(each, FileStrands):
                hair, outcome = add_to_scene(each, surface, context.collection)
                imported += hair
                report_outcome(self, outcome)
            elif each is results[-1] and not imported:
                raise each  # nothing was imported, so there is nothing to undo
            else:
                report(self, "ERROR", each)
        make_active(context, imported[::-1])

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return self.invoke_popup(context)

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(self, "up")
        layout.prop(self, "scale")
        layout.prop(self, "guides")
        mesh = growth_mesh(context)  # in Adjust Last Operation, the imported hair is active
        if mesh is None:
            draw_inactive(layout.row(), self, "onto_mesh", "no mesh is active")
        else:
            layout.row(heading=mesh.name).prop(self, "onto_mesh")
        row = layout.row()
        if mesh is None or not self.onto_mesh:
            draw_inactive(row, self, "head_scale", "not onto a mesh")
        else:
            row.prop(self, "head_scale")

    def _paths(self) -> list[Path]:
        """The files that were chosen or dropped, else the one in `filepath`.

        Raises:
            HairloomError: none is named.
        """
        names = [file.name for file in self.files if file.name]
        folder = Path(absolute_path(self.directory)) if names else Path()
        return [folder / name for name in names] or [given_path(self.filepath, place=self.bl_label)]


class HAIRLOOM_FH_strands(bpy.types.FileHandler):
    """Files dropped into the viewport or the outliner"""

    bl_idname = "HAIRLOOM_FH_strands"
    bl_label = "Hairloom Hair Strands"
    bl_import_operator = "hairloom.import_strands"
    bl_file_extensions = ";".join(SUFFIXES)

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        return poll_file_object_drop(context)


def draw_imports(layout: bpy.types.UILayout) -> None:
    """The entries of File > Import, one per format."""
    for title, suffixes in FILE_KINDS:
        text = f"Hairloom {title} ({'/'.join(suffixes)})"
        entry = layout.operator("hairloom.import_strands", text=text)
        entry.filter_glob = _filter(suffixes)


CLASSES = (HAIRLOOM_OT_import_strands, HAIRLOOM_FH_strands)
