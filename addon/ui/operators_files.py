"""Grooms in and out: grow, import and export TressFX."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import CollectionProperty, EnumProperty, FloatProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper, poll_file_object_drop

from ..errors import HairloomError
from ..host import groom_files
from ..host.groups import operator_properties
from ..host.objects import head_of
from ..host.vertex_weights import weight_names
from .reports import reporting, tell, waiting
from .selection import active_mesh, chosen_hair, needs_hair

UP_AXES = (
    ("Y", "Y Up", "The file's Y axis points up, as in most engines"),
    ("Z", "Z Up", "The file's Z axis points up, as in Blender"),
)


#: settings that say nothing about hair that stands straight along the normals, and the other way
_COMBED_ONLY: tuple[str, ...] = (
    "lift",
    "comb_back",
    "comb_share",
    "droop",
    "clump",
    "clump_size",
    "wave",
    "wave_length",
    "frizz",
    "clearance",
    "volume",
)
_NORMALS_ONLY: tuple[str, ...] = ("per_vertex", "threshold")


def _weight_names(_operator: Any, context: bpy.types.Context, typed: str) -> list[str]:
    # while the operator is adjusted the hair that it has grown is active
    chosen = chosen_hair(context)
    mesh = active_mesh(context) or (head_of(chosen[0]) if chosen else None)
    names = [] if mesh is None else weight_names(mesh)
    return [name for name in names if typed.lower() in name.lower()]


class HAIRLOOM_OT_grow(bpy.types.Operator):
    """Grow hair curves on the active mesh"""

    bl_idname = "hairloom.grow"
    bl_label = "Grow Hair"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        **operator_properties("grow"),
        "density_group": StringProperty(
            name="Density",
            description="Vertex group or float attribute on points that says how densely hair "
            "grows; empty: on the scalp if combed, else everywhere",
            search=_weight_names,
            search_options={"SUGGESTION"},
        ),
        "length_group": StringProperty(
            name="Length Factor",
            description="Vertex group or float attribute on points that the length is multiplied "
            "by; empty: all as long as said",
            search=_weight_names,
            search_options={"SUGGESTION"},
        ),
    }

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if active_mesh(context) is not None:
            return True
        cls.poll_message_set("Select the mesh to grow hair on")
        return False

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        head, depsgraph = active_mesh(context), context.evaluated_depsgraph_get()
        with waiting(context):
            hair = groom_files.grow_on(
                head,
                depsgraph,
                context.collection,
                self,
                density_group=self.density_group,
                length_group=self.length_group,
            )
        _make_active(context, [hair])
        return {"FINISHED"}

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        hidden = _NORMALS_ONLY if self.way == "combed" else _COMBED_ONLY
        if self.way == "normals" and self.per_vertex:
            hidden += ("strand_count",)
        elif self.way == "normals":
            hidden += ("threshold",)
        for name in self.__annotations__:
            if name not in hidden:
                self.layout.prop(self, name)


class HAIRLOOM_OT_import_tfx(bpy.types.Operator, ImportHelper):
    """Import TressFX grooms as hair curves, onto the active mesh if one is selected"""

    bl_idname = "hairloom.import_tfx"
    bl_label = "Import TressFX"
    bl_options = {"REGISTER", "UNDO"}
    filename_ext = ".tfx"

    filter_glob: StringProperty(default="*.tfx", options={"HIDDEN"})
    files: CollectionProperty(
        type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"}
    )
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    up: EnumProperty(name="Up", description="What points up in the file", items=UP_AXES)
    scale: FloatProperty(
        name="Scale",
        description="Metres in one unit of the file: 0.01 for a groom in centimetres",
        default=1.0,
        min=1.0e-6,
        max=1.0e6,
        soft_min=0.001,
        soft_max=100.0,
        precision=4,
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        head, imported = active_mesh(context), []
        with waiting(context):
            for path in self._paths():
                imported += self._imported(context, path, head)
        if not imported:
            return {"CANCELLED"}
        _make_active(context, imported)
        return {"FINISHED"}

    def _imported(
        self, context: bpy.types.Context, path: Path, head: bpy.types.Object | None
    ) -> list[bpy.types.Object]:
        """The new object; none where the file cannot be used, so that the others still come in."""
        try:
            hair, outcome = groom_files.import_tfx(
                path, head, context.collection, up=self.up, scale=self.scale
            )
        except HairloomError as error:
            self.report({"ERROR"}, str(error))
            return []
        tell(self, outcome)
        return [hair]

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return self.invoke_popup(context)

    def _paths(self) -> list[Path]:
        """Several files chosen or dropped, else the one of `filepath`."""
        named = [Path(self.directory) / file.name for file in self.files if file.name]
        return named or [Path(self.filepath)]


class HAIRLOOM_FH_tfx(bpy.types.FileHandler):
    """Files dropped into the viewport or the outliner"""

    bl_idname = "HAIRLOOM_FH_tfx"
    bl_label = "Hairloom groom (TressFX)"
    bl_import_operator = "hairloom.import_tfx"
    bl_file_extensions = ".tfx"

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        return poll_file_object_drop(context)


class HAIRLOOM_OT_export_tfx(bpy.types.Operator, ExportHelper):
    """Write the strands of the active hair, as Blender shows them, as TressFX"""

    bl_idname = "hairloom.export_tfx"
    bl_label = "Export TressFX"
    filename_ext = ".tfx"

    filter_glob: StringProperty(default="*.tfx", options={"HIDDEN"})
    up: EnumProperty(name="Up", description="What shall point up in the file", items=UP_AXES)
    scale: FloatProperty(
        name="Scale",
        description="Metres in one unit of the file: 0.01 writes centimetres",
        default=1.0,
        min=1.0e-6,
        max=1.0e6,
        soft_min=0.001,
        soft_max=100.0,
        precision=4,
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        hair, depsgraph = chosen_hair(context)[0], context.evaluated_depsgraph_get()
        with waiting(context):
            outcome = groom_files.export_tfx(
                hair, depsgraph, Path(self.filepath), up=self.up, scale=self.scale
            )
        tell(self, outcome)
        return {"FINISHED"}


def _make_active(context: bpy.types.Context, objects: list[bpy.types.Object]) -> None:
    for selected in context.selected_objects:
        selected.select_set(False)
    for obj in objects:
        obj.select_set(True)
        context.view_layer.objects.active = obj


CLASSES = (
    HAIRLOOM_OT_grow,
    HAIRLOOM_OT_import_tfx,
    HAIRLOOM_FH_tfx,
    HAIRLOOM_OT_export_tfx,
)
