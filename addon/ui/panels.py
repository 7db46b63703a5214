"""Panels: session and settings in the sidebar, the same settings in Properties > Data."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable
from typing import Any

import bpy

from ..host import live
from ..host.groom_files import dropped_phrase
from ..host.session import Session
from .selection import chosen_hair

type Draw = Callable[[bpy.types.UILayout, bpy.types.Object], None]

#: width of a letter in pixels at UI scale 1, for breaking lines
_LETTER_WIDTH = 7.0


def _hair(context: bpy.types.Context) -> bpy.types.Object | None:
    """The hair that the panels are about."""
    hair = chosen_hair(context)
    return hair[0] if hair else None


def draw_preview(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Buttons, counts, and what the artist should know."""
    hair = _hair(context)
    session = live.session_of(hair)
    column = layout.column(align=True)
    column.scale_y = 1.3
    text, icon = ("Stop Preview", "HIDE_OFF") if session else ("Preview", "HIDE_ON")
    column.operator("hairloom.preview", text=text, icon=icon, depress=session is not None)
    playing = live.is_playing()
    row = column.row(align=True)
    text, icon = ("Stop", "SNAP_FACE") if playing else ("Play", "PLAY")
    row.operator("hairloom.play", text=text, icon=icon, depress=playing)
    row.operator("hairloom.reset", text="Reset", icon="FILE_REFRESH")
    if session is not None:
        _draw_counts(layout, context, session)
    if live.notice():
        _draw_message(layout, context, live.notice(), "ERROR")
    if hair is None:
        layout.operator("hairloom.grow", icon="OUTLINER_OB_CURVES")
        layout.operator("hairloom.import_tfx", icon="IMPORT")
    else:
        layout.prop(hair.hairloom, "hide_original")


def _draw_counts(layout: bpy.types.UILayout, context: bpy.types.Context, session: Session) -> None:
    rig = session.rig
    layout.label(text=f"{rig.strands.strand_count:,} strands, {len(rig.guides):,} guides")
    if session.source.dropped:
        _draw_message(layout, context, dropped_phrase(session.source.dropped).capitalize(), "INFO")
    for warning in session.source.warnings:
        _draw_message(layout, context, warning, "ERROR")


def _draw_message(
    layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str
) -> None:
    """A text in as many lines as the region needs."""
    letters = context.region.width / (_LETTER_WIDTH * context.preferences.system.ui_scale)
    column = layout.box().column(align=True)
    for index, line in enumerate(textwrap.wrap(text, max(int(letters) - 6, 16))):
        column.label(text=line, icon=icon if index == 0 else "BLANK1")


def draw_look(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    layout.menu("HAIRLOOM_MT_looks")
    _draw_group(layout, hair.data.hairloom.shading)


def draw_strands(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    _draw_group(layout, hair.data.hairloom.strands)
    _draw_titled(layout, hair.data.hairloom.ambient)


def draw_guides(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    _draw_group(layout, hair.data.hairloom.guides)


def draw_dynamics(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    layout.menu("HAIRLOOM_MT_dynamics")
    layout.prop(hair.hairloom, "collider")
    _draw_group(layout, hair.hairloom.dynamics)


def draw_export(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    layout.operator("hairloom.export_cards", icon="EXPORT")
    layout.operator("hairloom.export_tfx", icon="EXPORT")
    _draw_titled(layout, hair.data.hairloom.cards)
    _draw_titled(layout, hair.data.hairloom.card_texture)


def _draw_titled(layout: bpy.types.UILayout, group: Any) -> None:
    layout.label(text=group.settings.title)
    _draw_group(layout, group)


def _draw_group(layout: bpy.types.UILayout, group: Any) -> None:
    column = layout.column()
    for parameter in group.settings.parameters():
        column.prop(group, parameter.name, slider=parameter.kind in {"number", "integer"})


SECTIONS: tuple[tuple[str, str, Draw], ...] = (
    ("look", "Look", draw_look),
    ("strands", "Strands", draw_strands),
    ("guides", "Guides", draw_guides),
    ("dynamics", "Dynamics", draw_dynamics),
    ("export", "Export", draw_export),
)


class HAIRLOOM_PT_sidebar(bpy.types.Panel):
    """Preview, Play and the settings of the selected hair"""

    bl_label = "Hairloom"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Hairloom"

    def draw(self, context: bpy.types.Context) -> None:
        draw_preview(self.layout, context)


class HAIRLOOM_PT_data(bpy.types.Panel):
    """The settings of these hair curves"""

    bl_label = "Hairloom"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.object is not None and context.object.type == "CURVES"

    def draw(self, context: bpy.types.Context) -> None:
        draw_preview(self.layout, context)


def _sub_panels(parent: type[bpy.types.Panel]) -> Iterable[type[Any]]:
    for name, label, draw_section in SECTIONS:
        yield _sub_panel(parent, name, label, draw_section)


def _sub_panel(
    parent: type[bpy.types.Panel], name: str, label: str, draw_section: Draw
) -> type[Any]:
    """A panel class below `parent` that draws one section of the settings."""

    def poll(cls: type[Any], context: bpy.types.Context) -> bool:
        return _hair(context) is not None

    def draw(self: Any, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        draw_section(self.layout, _hair(context))

    namespace = {
        "__doc__": f"{label} of the selected hair",
        "bl_label": label,
        "bl_parent_id": parent.__name__,
        "bl_space_type": parent.bl_space_type,
        "bl_region_type": parent.bl_region_type,
        "bl_options": {"DEFAULT_CLOSED"},
        "poll": classmethod(poll),
        "draw": draw,
    }
    for place in ("bl_category", "bl_context"):
        if hasattr(parent, place):
            namespace[place] = getattr(parent, place)
    return type(f"{parent.__name__}_{name}", (bpy.types.Panel,), namespace)


def draw_import(self: Any, _context: bpy.types.Context) -> None:
    self.layout.operator("hairloom.import_tfx", text="Hairloom groom (.tfx)")


def draw_exports(self: Any, _context: bpy.types.Context) -> None:
    self.layout.operator("hairloom.export_cards", text="Hair cards (.glb)")
    self.layout.operator("hairloom.export_tfx", text="TressFX (.tfx)")


def draw_add(self: Any, _context: bpy.types.Context) -> None:
    self.layout.operator("hairloom.grow", text="Hairloom Hair", icon="OUTLINER_OB_CURVES")


MENUS: tuple[tuple[str, Callable[[Any, bpy.types.Context], None]], ...] = (
    ("TOPBAR_MT_file_import", draw_import),
    ("TOPBAR_MT_file_export", draw_exports),
    ("VIEW3D_MT_curve_add", draw_add),
)

CLASSES: tuple[type[Any], ...] = (
    HAIRLOOM_PT_sidebar,
    *_sub_panels(HAIRLOOM_PT_sidebar),
    HAIRLOOM_PT_data,
    *_sub_panels(HAIRLOOM_PT_data),
)


def register() -> None:
    for menu, entry in MENUS:
        getattr(bpy.types, menu).append(entry)


def unregister() -> None:
    for menu, entry in reversed(MENUS):
        getattr(bpy.types, menu).remove(entry)
