"""Hair cards out: the File menu's operator, which a collection's exporters use too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..errors import HairloomError
from ..host import groom_files
from ..host.card_choices import (
    FORMAT_ITEMS,
    PACKING_ITEMS,
    SUFFIXES,
    TEXTURE_ITEMS,
    card_output,
    file_stem,
    suffix_of,
)
from .reports import reporting, tell, waiting
from .selection import chosen_hair, needs_hair


class HAIRLOOM_OT_export_cards(bpy.types.Operator, ExportHelper):
    """Write hair as textured cards, sorted from inside to outside, for engines"""

    bl_idname = "hairloom.export_cards"
    bl_label = "Export Hair Cards"
    bl_options = {"PRESET"}

    filter_glob: StringProperty(
        default=";".join(f"*{suffix}" for suffix in SUFFIXES), options={"HIDDEN"}
    )
    collection: StringProperty(
        name="Source Collection",
        description="Write the hair of this collection in place of the active one",
        default="",
        options={"HIDDEN"},
    )
    format: EnumProperty(name="Format", description="Format of the file", items=FORMAT_ITEMS)
    own_levels: BoolProperty(
        name="Other Levels of Detail",
        description="Write another number of levels than the groom's settings say",
        default=False,
    )
    levels: IntProperty(
        name="Levels",
        description="How many meshes are written, each with about half the triangles of the one "
        "before",
        default=3,
        min=1,
        max=5,
    )
    packing: EnumProperty(
        name="Packing",
        description="What the channels of the textures hold",
        items=PACKING_ITEMS,
    )
    textures: EnumProperty(
        name="Textures", description="Format of the textures", items=TEXTURE_ITEMS
    )
    attributes: BoolProperty(
        name="Custom Attributes",
        description="Write ambient occlusion as the attribute _AO beside the second UV map, which "
        "some engines refuse",
        default=False,
    )
    index_buffer: BoolProperty(
        name="Index Buffer",
        description="Write the sorted indices as a file of their own too, for engines that keep "
        "their own vertices",
        default=False,
    )

    @property
    def filename_ext(self) -> str:
        """What Blender puts behind a name; one of the format's own stays."""
        return suffix_of(self.format, self.filepath)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        # a collection's exporter has its own hair, and no selection
        return bool(bpy.data.hair_curves) or needs_hair(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        hair = chosen_hair(context)
        if hair and not self.filepath:
            folder = Path(bpy.data.filepath).parent if bpy.data.filepath else Path()
            self.properties.filepath = str(folder / (file_stem(hair[0].name) + self.filename_ext))
        return super().invoke(context, event)

    @reporting
    def execute(self, context: bpy.types.Context) -> set[str]:
        depsgraph, hair = context.evaluated_depsgraph_get(), self._hair(context)
        levels = self.levels if self.own_levels else None
        for each in hair:
            path = self._path(each, is_alone=len(hair) == 1)
            output = card_output(self, path, each.name)
            with waiting(context):
                outcome = groom_files.export_cards(each, depsgraph, path, output, levels=levels)
            tell(self, outcome)
        return {"FINISHED"}

    def _hair(self, context: bpy.types.Context) -> list[bpy.types.Object]:
        if not self.collection:
            return chosen_hair(context)[:1] or _refuse("Nothing selected", "Select hair curves")
        collection = bpy.data.collections.get(self.collection)
        objects = () if collection is None else collection.all_objects
        hair = [obj for obj in objects if obj.type == "CURVES"]
        return hair or _refuse(
            f"Collection '{self.collection}'", "Link hair curves to it, or choose another one"
        )

    def _path(self, hair: bpy.types.Object, *, is_alone: bool) -> Path:
        """Where it goes; of several grooms each has its name behind the file's."""
        path = Path(bpy.path.abspath(self.filepath))
        return path if is_alone else path.with_stem(f"{path.stem}_{file_stem(hair.name)}")

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "format")
        levels = layout.row(heading="Levels of Detail")
        levels.prop(self, "own_levels", text="")
        count = levels.row()
        count.active = self.own_levels
        count.prop(self, "levels", text="")
        for name in ("packing", "textures", "attributes", "index_buffer"):
            layout.prop(self, name)


class HAIRLOOM_FH_cards(bpy.types.FileHandler):
    """Cards of a collection's hair, written with all its exporters"""

    bl_idname = "HAIRLOOM_FH_cards"
    bl_label = "Hair cards (Hairloom)"
    bl_export_operator = "hairloom.export_cards"
    bl_file_extensions = ";".join(SUFFIXES)

    @classmethod
    def poll_drop(cls, _context: bpy.types.Context) -> bool:
        return False  # it reads nothing


def _refuse(place: str, remedy: str) -> Any:
    raise HairloomError("there is no hair to write", place=place, remedy=remedy)


CLASSES = (HAIRLOOM_OT_export_cards, HAIRLOOM_FH_cards)
