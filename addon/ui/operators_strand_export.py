"""Export of strands: operators in the File menu, which a collection's exporters use too."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import StringProperty

from ..exchange.strand_formats import STRAND_FORMATS, StrandFormat
from .strand_export import MotionOptions, StrandExportOperator, option_properties


def _operator(kind: StrandFormat) -> type[Any]:
    """The operator that writes a format, with the options of that."""
    bases = (StrandExportOperator, bpy.types.Operator)
    name = f"HAIRLOOM_OT_export_{kind.name}"
    glob = ";".join(f"*{suffix}" for suffix in kind.suffixes)
    namespace = {
        "__doc__": kind.about,
        "__annotations__": {
            "filter_glob": StringProperty(default=glob, options={"HIDDEN"}),
            **option_properties(kind),
        },
        "bl_idname": f"hairloom.export_{kind.name}",
        "bl_label": f"Export {kind.title}",
        "kind": kind,
    }
    return type(name, (MotionOptions, *bases) if kind.has_motion else bases, namespace)


def _handler(operator: type[Any]) -> type[bpy.types.FileHandler]:
    """The file handler of a format for the exporters of a collection; it does not import."""
    name, kind = operator.__name__.replace("_OT_", "_FH_"), operator.kind
    return type(
        name,
        (bpy.types.FileHandler,),
        {
            "__doc__": f"{kind.entry} of a collection's hair, written with all its exporters",
            "bl_idname": name,
            "bl_label": f"{kind.entry} (Hairloom)",
            "bl_export_operator": operator.bl_idname,
            "bl_file_extensions": ";".join(kind.suffixes),
            "poll_drop": classmethod(lambda _cls, _context: False),
        },
    )


_OPERATORS = tuple(map(_operator, STRAND_FORMATS))


def draw_strand_exports(layout: bpy.types.UILayout) -> None:
    """Entries for the File menu."""
    for operator in _OPERATORS:
        layout.operator(operator.bl_idname, text=operator.kind.entry)


class HAIRLOOM_MT_export_strands(bpy.types.Menu):
    """Export strands to a file for engines and other programs"""

    bl_label = "Export Strands"

    def draw(self, _context: bpy.types.Context) -> None:
        draw_strand_exports(self.layout)


CLASSES = (*_OPERATORS, *map(_handler, _OPERATORS), HAIRLOOM_MT_export_strands)
