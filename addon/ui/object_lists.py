"""Lists of objects that act on hair: its ties, partings, strokes and trim shapes.

A list has the same height for one object as for thirty, scrolls, and can be searched by name.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import bpy
from bpy.props import IntProperty, PointerProperty

#: rows of a list
ROWS = 3
#: description of the property of an operator that names the object to remove from a list
REMOVED_OBJECT = "Name of the object; if empty, the selected one, or the only one"


class _Kind(NamedTuple):
    """One kind of list. icon: of a row. remove: operator that removes an object from the list.
    named: property of that operator with the object's name."""

    icon: str
    remove: str
    object_property: str


#: setting of the hair that names the collection -> its kind of list
KINDS = {
    "tie_collection": _Kind("MESH_CIRCLE", "hairloom.remove_hair_tie", "tie"),
    "parting_collection": _Kind("CURVE_DATA", "hairloom.remove_parting", "line"),
    "stroke_collection": _Kind("CURVE_PATH", "hairloom.remove_stroke", "stroke"),
    "trim_collection": _Kind("MOD_BOOLEAN", "hairloom.remove_trim_shape", "shape"),
}


class HAIRLOOM_UL_objects(bpy.types.UIList):
    """Objects that act on hair, each with a button to remove it"""

    def draw_item(
        self,
        _context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _collection: bpy.types.Collection,
        obj: bpy.types.Object,
        _icon: int,
        _active: Any,
        _active_name: str,
    ) -> None:
        kind = KINDS[self.list_id]
        layout.prop(obj, "name", text="", emboss=False, icon=kind.icon)
        button = layout.operator(kind.remove, text="", icon="X", emboss=False)
        setattr(button, kind.object_property, obj.name)


class HAIRLOOM_PG_list_rows(bpy.types.PropertyGroup):
    """The active row of each list; not saved in files."""

    __annotations__ = {
        setting: IntProperty(name="Row", description="Row that was clicked last")
        for setting in KINDS
    }


def draw_objects(layout: bpy.types.UILayout, hair: bpy.types.Object, setting: str) -> None:
    """The field of a setting that names a collection, and the list of its objects."""
    column = layout.column()
    column.prop(hair.hairloom, setting)
    collection = getattr(hair.hairloom, setting)
    if collection is None:
        return
    rows = bpy.context.window_manager.hairloom_list_rows
    size = {"rows": ROWS, "maxrows": ROWS}
    column.template_list(
        HAIRLOOM_UL_objects.__name__, setting, collection, "all_objects", rows, setting, **size
    )


CLASSES: tuple[type[Any], ...] = (HAIRLOOM_UL_objects, HAIRLOOM_PG_list_rows)


def register() -> None:
    """Add the rows to the window manager; CLASSES must be registered."""
    bpy.types.WindowManager.hairloom_list_rows = PointerProperty(
        type=HAIRLOOM_PG_list_rows, name="Rows", description="Active rows of the lists"
    )


def unregister() -> None:
    del bpy.types.WindowManager.hairloom_list_rows
