"""Hairloom's entries in Blender's menus, its pie menu, and shortcuts that artists can assign."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import rna_keymap_ui

from ..blender.preview import previews
from ..blender.properties.presets import shipped_presets
from ..blender.properties.properties import TRANSLATION_CONTEXT
from .drawing import draw_overlays
from .operators_card_edits import draw_menu
from .operators_strand_export import draw_strand_exports
from .operators_strand_import import draw_imports
from .selection import active_mesh, target_hair

_PIE = "HAIRLOOM_MT_pie"
#: (operator, settings) of shortcuts that are offered in the keymap of the 3D view, without keys
SHORTCUTS: tuple[tuple[str, dict[str, str]], ...] = (
    ("wm.call_menu_pie", {"name": _PIE}),
    ("hairloom.preview", {}),
    ("hairloom.play", {}),
    ("hairloom.pause", {}),
    ("hairloom.reset", {}),
    ("hairloom.settle", {}),
    ("hairloom.make_cards", {}),
)
_KEYMAP = "3D View"


class HAIRLOOM_MT_import(bpy.types.Menu):
    """Import grooms from files"""

    bl_idname = "HAIRLOOM_MT_import"
    bl_label = "Import Hair"

    def draw(self, _context: bpy.types.Context) -> None:
        draw_imports(self.layout)


class HAIRLOOM_MT_looks(bpy.types.Menu):
    """Looks that come with Hairloom"""

    bl_idname = "HAIRLOOM_MT_looks"
    bl_label = "Look"

    def draw(self, _context: bpy.types.Context) -> None:
        for entry in shipped_presets("shading"):
            operator = self.layout.operator(
                "hairloom.apply_preset",
                text=entry.title,
                text_ctxt=TRANSLATION_CONTEXT,
                icon_value=entry.icon,
            )
            operator.name = entry.name


class HAIRLOOM_MT_object(bpy.types.Menu):
    """Tools for the selected hair, or for the mesh that hair is to grow on"""

    bl_idname = "HAIRLOOM_MT_object"
    bl_label = "Hairloom"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        if active_mesh(context) is not None:
            layout.operator("hairloom.add_groom", text="Add Hair", icon="OUTLINER_OB_CURVES")
            layout.operator("hairloom.choose_hairstyle", icon="USER")
            layout.operator("hairloom.sort_cards", icon="SORTSIZE")
            layout.separator()
        layout.operator("hairloom.preview", icon="HIDE_OFF")
        layout.operator("hairloom.play", icon="PLAY")
        layout.operator("hairloom.settle")
        layout.menu("HAIRLOOM_MT_looks", icon="SHADING_RENDERED")
        layout.separator()
        layout.operator("hairloom.make_cards", icon="MESH_GRID")
        layout.operator("hairloom.add_card_along_curve", icon="CURVE_DATA")
        layout.operator("hairloom.discard_card_edits", icon="LOOP_BACK")
        layout.operator("hairloom.make_real", icon="OUTLINER_OB_CURVES")
        layout.operator("hairloom.export_cards", icon="EXPORT")
        layout.operator("hairloom.show_settings", icon="PROPERTIES")


class HAIRLOOM_MT_pie(bpy.types.Menu):
    """Tools needed while combing, around the mouse"""

    bl_idname = _PIE
    bl_label = "Hairloom"

    def draw(self, context: bpy.types.Context) -> None:
        pie, active = self.layout.menu_pie(), context.active_object
        pie.operator("hairloom.preview", icon="HIDE_OFF")
        pie.operator("hairloom.play", icon="PLAY")
        if active is not None and active.type == "CURVES":  # other types lack this mode
            comb = pie.operator("object.mode_set", text="Comb", icon="SCULPTMODE_HLT")
            comb.mode, comb.toggle = "SCULPT_CURVES", True
        else:
            pie.separator()
        pie.operator("hairloom.settle")
        pie.operator("hairloom.reset", icon="FILE_REFRESH")
        pie.operator("hairloom.pause", icon="PAUSE")
        pie.operator("hairloom.make_cards", icon="MESH_GRID")
        pie.operator("hairloom.show_settings", icon="PROPERTIES")


def _draw_import(self: Any, _context: bpy.types.Context) -> None:
    draw_imports(self.layout)


def _draw_exports(self: Any, _context: bpy.types.Context) -> None:
    self.layout.operator("hairloom.export_cards", text="Hair cards (.glb/.fbx/.usd/.obj)")
    draw_strand_exports(self.layout)


def _draw_add(self: Any, _context: bpy.types.Context) -> None:
    self.layout.operator("hairloom.add_groom", icon="OUTLINER_OB_CURVES")
    self.layout.menu("HAIRLOOM_MT_hairstyles", icon="USER")
    self.layout.operator("hairloom.sample_scene", icon="SCENE_DATA")


def _draw_object(self: Any, context: bpy.types.Context) -> None:
    obj = context.active_object
    if obj is not None and obj.type in {"CURVES", "MESH"}:
        self.layout.separator()
        self.layout.menu("HAIRLOOM_MT_object", icon="OUTLINER_OB_CURVES")


def _draw_overlays(self: Any, context: bpy.types.Context) -> None:
    """Overlays of the selected hair, below Blender's own overlays of objects."""
    hair = target_hair(context)
    if not hair:
        return
    column = self.layout.column()
    column.separator()
    is_shown = previews.session_of(hair[0]) is not None
    column.operator("hairloom.preview", text="Hairloom", icon="HIDE_OFF", depress=is_shown)
    draw_overlays(column, hair[0])
    column.prop(hair[0].hairloom, "show_counts")
    column.prop(hair[0].hairloom, "hide_original")


MENUS: tuple[tuple[str, Callable[[Any, bpy.types.Context], None]], ...] = (
    ("TOPBAR_MT_file_import", _draw_import),
    ("TOPBAR_MT_file_export", _draw_exports),
    ("VIEW3D_MT_curve_add", _draw_add),
    ("VIEW3D_MT_object", _draw_object),
    ("VIEW3D_MT_object_context_menu", _draw_object),
    ("VIEW3D_MT_edit_mesh", draw_menu),
    ("VIEW3D_MT_edit_mesh_context_menu", draw_menu),
    ("VIEW3D_PT_overlay_object", _draw_overlays),
)


def draw_shortcuts(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """The suggested shortcuts, each with a field to assign a key."""
    keys = context.window_manager.keyconfigs.user
    keymap = None if keys is None else keys.keymaps.get(_KEYMAP)
    if keymap is not None:
        for item in filter(_is_ours, keymap.keymap_items):
            rna_keymap_ui.draw_kmi([], keys, keymap, item, layout, 0)


def _is_ours(item: bpy.types.KeyMapItem) -> bool:
    if item.idname == "wm.call_menu_pie":
        return bool(item.properties.name == _PIE)
    return item.idname.startswith("hairloom.")


CLASSES: tuple[type[Any], ...] = (
    HAIRLOOM_MT_import,
    HAIRLOOM_MT_looks,
    HAIRLOOM_MT_object,
    HAIRLOOM_MT_pie,
)


def register() -> None:
    for menu, entry in MENUS:
        getattr(bpy.types, menu).append(entry)
    keys = bpy.context.window_manager.keyconfigs.addon
    if keys is None:  # without a window
        return
    keymap = keys.keymaps.new(name=_KEYMAP, space_type="VIEW_3D")
    for operator, settings in SHORTCUTS:
        item = keymap.keymap_items.new(operator, "NONE", "PRESS")
        for name, value in settings.items():
            setattr(item.properties, name, value)


def unregister() -> None:
    keys = bpy.context.window_manager.keyconfigs.addon
    keymap = None if keys is None else keys.keymaps.get(_KEYMAP)
    if keymap is not None:
        for item in filter(_is_ours, tuple(keymap.keymap_items)):
            keymap.keymap_items.remove(item)
    for menu, entry in reversed(MENUS):
        getattr(bpy.types, menu).remove(entry)
