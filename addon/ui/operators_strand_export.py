"""Strands out: the File menu's operators, which a collection's exporters use too."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..blender.strands.strand_choices import (
    ALEMBIC_ENGINES,
    BASES,
    COUNTS,
    FORMATS,
    PARTS,
    UP_AXES,
    USD_ENGINES,
)
from .strand_export import MovingExport, StrandExportOperator


def _scale(usual: float) -> Any:
    return FloatProperty(
        name="Scale",
        description="Metres in one unit of the file: 0.01 writes centimetres",
        default=usual,
        min=1.0e-6,
        max=1.0e6,
        soft_min=0.001,
        soft_max=100.0,
        precision=4,
    )


class HAIRLOOM_OT_export_alembic(MovingExport, StrandExportOperator, bpy.types.Operator):
    """Write hair as an Alembic groom, with all that engines ask of one"""

    bl_idname = "hairloom.export_alembic"
    bl_label = "Export Groom Alembic"
    kind = "alembic"
    sections = (
        ("Engine", ("engine", "basis")),
        ("Include", ("parts", "several", "by_group")),
        ("Animation", ("frames", "first", "last", "use_bake")),
    )

    filter_glob: StringProperty(default="*.abc", options={"HIDDEN"})
    engine: EnumProperty(
        name="For", description="Which program the file is for", items=ALEMBIC_ENGINES
    )
    basis: EnumProperty(name="Curves", description="Between the points", items=BASES)
    parts: EnumProperty(name="What", description="What is written", items=PARTS)
    by_group: BoolProperty(
        name="Split by Group",
        description="A curves object for each group, in place of one for all; Unity always gets it",
        default=False,
    )


class HAIRLOOM_OT_export_usd(MovingExport, StrandExportOperator, bpy.types.Operator):
    """Write hair as USD curves, with all that engines ask of a groom as primvars"""

    bl_idname = "hairloom.export_usd"
    bl_label = "Export USD Strands"
    kind = "usd"
    sections = (
        ("Engine", ("engine", "basis", "own_space", "up", "scale")),
        ("Include", ("parts", "several", "by_group")),
        ("Animation", ("frames", "first", "last", "use_bake")),
    )

    filter_glob: StringProperty(default="*.usdc;*.usd;*.usda", options={"HIDDEN"})
    engine: EnumProperty(name="For", description="Which program the file is for", items=USD_ENGINES)
    basis: EnumProperty(name="Curves", description="Between the points", items=BASES)
    own_space: BoolProperty(
        name="Other Axes and Unit",
        description="In place of those of the program",
        default=False,
    )
    up: EnumProperty(name="Up", description="What shall point up in the file", items=UP_AXES)
    scale: _scale(1.0)
    parts: EnumProperty(name="What", description="What is written", items=PARTS)
    by_group: BoolProperty(
        name="Split by Group",
        description="A prim for each group, by its name, in place of one for all",
        default=False,
    )


class HAIRLOOM_OT_export_tfx(StrandExportOperator, bpy.types.Operator):
    """Write hair as TressFX, as many points on each strand"""

    bl_idname = "hairloom.export_tfx"
    bl_label = "Export TressFX"
    kind = "tressfx"
    sections = (
        ("Space", ("up", "scale")),
        ("Include", ("parts", "several", "by_group", "bones")),
        ("TressFX", ("vertex_count", "held_count", "fills_groups", "point_uv")),
    )

    filter_glob: StringProperty(default="*.tfx", options={"HIDDEN"})
    up: EnumProperty(name="Up", description="What shall point up in the file", items=UP_AXES)
    scale: _scale(1.0)
    parts: EnumProperty(
        name="What", description="What is written; TressFX calls all of it guides", items=PARTS
    )
    by_group: BoolProperty(
        name="A File a Group",
        description="A file for each group, by its name, since .tfx holds no groups",
        default=False,
    )
    bones: BoolProperty(
        name="Bones",
        description="Where armature and vertex groups move the head, write which bones carry each "
        "strand beside it, as .tfxbone",
        default=True,
    )
    vertex_count: EnumProperty(
        name="Vertices",
        description="On each strand; strands with other counts are resampled",
        items=COUNTS,
    )
    held_count: IntProperty(
        name="Held Vertices",
        description="Vertices at the root that TressFX does not move; AMD's exporter holds two",
        default=1,
        min=0,
        max=8,
    )
    fills_groups: BoolProperty(
        name="Fill up to 64",
        description="Repeat the last strand until there is a multiple of 64, as TressFX simulates "
        "64 at a time; its own loader does so by itself, others may not",
        default=False,
    )
    point_uv: BoolProperty(
        name="UVs of Points",
        description="Write u across the strands and v along them, beside the root's UV",
        default=False,
    )


class HAIRLOOM_OT_export_hair(StrandExportOperator, bpy.types.Operator):
    """Write hair in Cem Yuksel's format, which renderers and papers read"""

    bl_idname = "hairloom.export_hair"
    bl_label = "Export .hair"
    kind = "hair"
    sections = (
        ("Space", ("up", "scale")),
        ("Include", ("parts", "several", "by_group", "point_uv")),
    )

    filter_glob: StringProperty(default="*.hair", options={"HIDDEN"})
    up: EnumProperty(
        name="Up", description="What shall point up in the file", items=UP_AXES, default="Z"
    )
    scale: _scale(1.0)
    parts: EnumProperty(name="What", description="What is written", items=PARTS)
    by_group: BoolProperty(
        name="A File a Group",
        description="A file for each group, by its name, since .hair holds no groups",
        default=False,
    )
    point_uv: BoolProperty(
        name="Root UVs",
        description="Write them as LuxCore does; other programs may refuse such a file",
        default=False,
    )


def _handler(operator: type[Any], label: str) -> type[bpy.types.FileHandler]:
    """For the exporters of a collection; it reads nothing."""
    name = operator.__name__.replace("_OT_", "_FH_")
    return type(
        name,
        (bpy.types.FileHandler,),
        {
            "__doc__": f"{label} of a collection's hair, written with all its exporters",
            "bl_idname": name,
            "bl_label": f"{label} (Hairloom)",
            "bl_export_operator": operator.bl_idname,
            "bl_file_extensions": ";".join(FORMATS[operator.kind].suffixes),
            "poll_drop": classmethod(lambda _cls, _context: False),
        },
    )


#: operator, and what the File menu calls it
MENU: tuple[tuple[type[Any], str], ...] = (
    (HAIRLOOM_OT_export_alembic, "Hair groom (.abc)"),
    (HAIRLOOM_OT_export_usd, "Hair strands (.usdc/.usd/.usda)"),
    (HAIRLOOM_OT_export_tfx, "TressFX (.tfx)"),
    (HAIRLOOM_OT_export_hair, "Cem Yuksel's hair (.hair)"),
)


def draw_strand_exports(layout: bpy.types.UILayout) -> None:
    """For the File menu."""
    for operator, label in MENU:
        layout.operator(operator.bl_idname, text=label)


class HAIRLOOM_MT_export_strands(bpy.types.Menu):
    """Strands as a file for engines and other programs"""

    bl_label = "Export Strands"

    def draw(self, _context: bpy.types.Context) -> None:
        draw_strand_exports(self.layout)


CLASSES = (
    *(operator for operator, _ in MENU),
    *(_handler(operator, label) for operator, label in MENU),
    HAIRLOOM_MT_export_strands,
)
