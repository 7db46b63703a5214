"""Panels: session and settings in the sidebar, the same settings in Properties > Data."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import bpy

from ..host import live, timeline, view_transform
from ..host.groom_files import dropped_phrase
from ..host.session import Session
from ..host.source import own_dynamics
from .drawing import Draw
from .messages import draw_lines, draw_message
from .operators_adopted import draw_sort
from .sections import SECTIONS, SUB_SECTIONS
from .selection import active_mesh, chosen_hair


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
    playing, paused = live.is_playing(), live.is_paused()
    row = column.row(align=True)
    text, icon = ("Stop", "SNAP_FACE") if playing else ("Play", "PLAY")
    row.operator("hairloom.play", text=text, icon=icon, depress=playing)
    text, icon = ("Resume", "PLAY") if paused else ("Pause", "PAUSE")
    row.operator("hairloom.pause", text=text, icon=icon, depress=paused)
    row.operator("hairloom.reset", text="Reset", icon="FILE_REFRESH")
    if hair is not None:
        layout.prop(hair.hairloom.bake, "follows")
    if session is not None:
        _draw_state(layout, context, session)
    if live.notice():
        draw_message(layout, context, live.notice(), "ERROR")
    if hair is None:
        layout.operator("hairloom.grow", icon="OUTLINER_OB_CURVES")
        layout.operator("hairloom.import_tfx", icon="IMPORT")
        return
    row = layout.row(align=True)
    row.prop(hair.hairloom, "debug_view")
    row.prop(hair.hairloom, "show_counts", text="", icon="INFO")
    layout.prop(hair.hairloom, "hide_original")
    if own_dynamics(hair):
        layout.operator("hairloom.mute_hair_dynamics", icon="MUTE_IPO_ON")


def _draw_state(layout: bpy.types.UILayout, context: bpy.types.Context, session: Session) -> None:
    rig = session.rig
    layout.label(text=f"{rig.strands.strand_count:,} strands, {len(rig.guides):,} guides")
    draw_lines(layout.column(align=True), context, _moved_by(session))
    if session.source.dropped:
        draw_message(layout, context, dropped_phrase(session.source.dropped).capitalize(), "INFO")
    troubles = filter(None, (timeline.trouble(session.uid), view_transform.trouble()))
    for warning in dict.fromkeys((*session.warnings, *troubles)):
        draw_message(layout, context, warning, "ERROR")


def _moved_by(session: Session) -> str:
    """What moves the hair at the moment, such as "Simulated on the GPU (OpenGL, llvmpipe)"."""
    baked = timeline.baked(session.uid)
    if baked is not None and baked.is_shown:
        return "Shown from the bake" + (", which is out of date" if baked.changed else "")
    computed = "Simulated" if session.is_playing else "To be simulated"
    return f"{computed} on the {session.computed_on}"


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
        section = _sub_panel(parent, name, label, draw_section)
        yield section
        for below in SUB_SECTIONS.get(name, ()):
            yield _sub_panel(section, *below)


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


class HAIRLOOM_PT_sidebar_mesh_cards(bpy.types.Panel):
    """Hair cards that are meshes of your own"""

    bl_label = "Mesh Cards"
    bl_parent_id = "HAIRLOOM_PT_sidebar"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Hairloom"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        mesh = active_mesh(context)
        return mesh is not None and mesh.hairloom.card_object.groom is None

    def draw(self, context: bpy.types.Context) -> None:
        draw_sort(self, context)


def draw_import(self: Any, _context: bpy.types.Context) -> None:
    self.layout.operator("hairloom.import_tfx", text="Hairloom groom (.tfx)")


def draw_exports(self: Any, _context: bpy.types.Context) -> None:
    self.layout.operator("hairloom.export_cards", text="Hair cards (.glb/.fbx/.usd/.obj)")
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
    HAIRLOOM_PT_sidebar_mesh_cards,
    HAIRLOOM_PT_data,
    *_sub_panels(HAIRLOOM_PT_data),
)


def register() -> None:
    for menu, entry in MENUS:
        getattr(bpy.types, menu).append(entry)


def unregister() -> None:
    for menu, entry in reversed(MENUS):
        getattr(bpy.types, menu).remove(entry)
