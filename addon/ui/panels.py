"""Panels: tools for hair in the sidebar, and all of its settings in Properties > Data."""

from __future__ import annotations

from collections.abc import Container, Iterable
from typing import Any

import bpy

from ..blender.preview import previews
from ..blender.scene.particle_hair import hair_systems
from ..blender.setup.foreign_heads import may_be_head
from .drawing import Draw, draw_button, draw_overlays
from .help import draw_help
from .long_work import draw_progress
from .operators_hairstyles import (
    HAIRLOOM_OT_add_hairstyle,
    HAIRLOOM_OT_fit_again,
    HAIRLOOM_OT_place_landmarks,
)
from .operators_start import (
    HAIRLOOM_OT_add_groom,
    HAIRLOOM_OT_convert_particles,
    HAIRLOOM_OT_sample_scene,
    HAIRLOOM_OT_use_groom,
)
from .sections import SECTIONS, SESSION_SECTIONS, SUB_SECTIONS, SWITCHES
from .selection import active_mesh, pinned_hair, target_hair
from .state import NAME_FRACTION, draw_notice, draw_problems_row, draw_state


def _hair(context: bpy.types.Context) -> bpy.types.Object | None:
    """The hair that the panels show."""
    hair = target_hair(context)
    return hair[0] if hair else None


def draw_preview(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the buttons of the preview, counts, problems and overlays."""
    hair = _hair(context)
    session = previews.session_of(hair)
    column = layout.column(align=True)
    column.scale_y = 1.3
    is_on = session is not None
    draw_button(
        column,
        "hairloom.preview",
        "Preview: Select Hair First",
        "Stop Preview" if is_on else "Preview",
        in_all_modes=True,
        icon="HIDE_OFF" if is_on else "HIDE_ON",
        depress=is_on,
    )
    playing, paused = previews.is_playing(), previews.is_paused()
    row = column.row(align=True)
    icon = "SNAP_FACE" if playing else "PLAY"
    row.operator("hairloom.play", text="Stop" if playing else "Play", icon=icon, depress=playing)
    icon = "PLAY" if paused else "PAUSE"
    row.operator("hairloom.pause", text="Resume" if paused else "Pause", icon=icon, depress=paused)
    row.operator("hairloom.reset", text="Reset", icon="FILE_REFRESH")
    if hair is not None:
        layout.prop(hair.hairloom.bake, "follows")
    if hair is None:
        draw_start(layout, context)
        draw_notice(layout, context)
        return
    draw_state(layout, session)
    draw_problems_row(layout, hair, session)
    if not draw_progress(layout, HAIRLOOM_OT_use_groom):
        icon, operator = "OUTLINER_OB_CURVES", "hairloom.use_groom"
        draw_button(layout, operator, "Uses Hairloom" if session is not None else "", icon=icon)
    draw_more(layout)
    if hair.hairloom.hairstyle:
        row = layout.row(align=True)
        if not draw_progress(row, HAIRLOOM_OT_place_landmarks):
            draw_button(row, "hairloom.place_landmarks", text="Landmarks", icon="EMPTY_AXIS")
        if not draw_progress(row, HAIRLOOM_OT_fit_again):
            draw_button(row, "hairloom.fit_again", icon="FILE_REFRESH")
    parts = layout.split(factor=NAME_FRACTION)
    parts.label(text="Colour By")
    row = parts.row(align=True)
    row.prop(hair.hairloom, "debug_view", text="")
    row.prop(hair.hairloom, "show_counts", text="", icon="INFO")
    draw_overlays(layout, hair)
    layout.prop(hair.hairloom, "hide_original")


def draw_start(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the buttons that add the first hair."""
    column = layout.column(align=True)
    column.scale_y = 1.3
    if not draw_progress(column, HAIRLOOM_OT_add_groom):
        column.operator("hairloom.add_groom", text="Add Hair", icon="OUTLINER_OB_CURVES")
    if not draw_progress(column, HAIRLOOM_OT_add_hairstyle):
        column.operator("hairloom.choose_hairstyle", icon="USER")
    mesh = active_mesh(context)
    is_head = mesh is not None and may_be_head(mesh)
    if is_head and not draw_progress(column, HAIRLOOM_OT_place_landmarks):
        column.operator("hairloom.place_landmarks", icon="EMPTY_AXIS")
    has_particles = mesh is not None and hair_systems(mesh)
    if has_particles and not draw_progress(column, HAIRLOOM_OT_convert_particles):
        column.operator("hairloom.convert_particles", icon="PARTICLES")
    if not draw_progress(column, HAIRLOOM_OT_sample_scene):
        column.operator("hairloom.sample_scene", text="Sample Scene", icon="SCENE_DATA")
    column.menu("HAIRLOOM_MT_import", text="Import", icon="IMPORT")


def draw_more(layout: bpy.types.UILayout) -> None:
    """Draw the buttons that add more hair to the same head, such as a hairstyle to its brows."""
    row = layout.row(align=True)
    if any(draw_progress(row, each) for each in (HAIRLOOM_OT_add_groom, HAIRLOOM_OT_add_hairstyle)):
        return
    draw_button(row, "hairloom.add_groom", "Select a Head", "Add Hair", icon="ADD")
    draw_button(row, "hairloom.choose_hairstyle", icon="USER")


class HAIRLOOM_PT_sidebar(bpy.types.Panel):
    """Preview, Play and tools for the selected hair"""

    bl_label = "Hairloom"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Hairloom"

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        draw_help(self.layout, "")

    def draw(self, context: bpy.types.Context) -> None:
        draw_preview(self.layout, context)
        if _hair(context) is not None:
            self.layout.operator("hairloom.show_settings", icon="PROPERTIES")


class HAIRLOOM_PT_data(bpy.types.Panel):
    """Settings of these hair curves"""

    bl_label = "Hairloom"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        is_hair = context.object is not None and context.object.type == "CURVES"
        return is_hair or pinned_hair(context) is not None

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        draw_help(self.layout, "")

    def draw(self, context: bpy.types.Context) -> None:
        draw_preview(self.layout, context)


def _sub_panels(
    parent: type[bpy.types.Panel], *, only: Container[str] | None = None
) -> Iterable[type[Any]]:
    for name, label, draw_section in SECTIONS:
        if only is not None and name not in only:
            continue
        section = _sub_panel(parent, name, label, draw_section)
        yield section
        for sub_section in SUB_SECTIONS.get(name, ()):
            if only is None or sub_section[0] in only:
                yield _sub_panel(section, *sub_section)


def _sub_panel(
    parent: type[bpy.types.Panel], name: str, label: str, draw_section: Draw
) -> type[Any]:
    """A panel class below `parent` that draws one section of the settings."""

    def poll(cls: type[Any], context: bpy.types.Context) -> bool:
        return _hair(context) is not None

    is_in_properties = parent.bl_space_type == "PROPERTIES"

    def draw(self: Any, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        self.layout.use_property_decorate = is_in_properties
        draw_section(self.layout, _hair(context))

    def draw_header_preset(self: Any, _context: bpy.types.Context) -> None:
        draw_help(self.layout, name)

    def draw_header(self: Any, context: bpy.types.Context) -> None:
        owner, switch = SWITCHES[name]
        self.layout.prop(owner(_hair(context)), switch, text="")

    namespace = {
        "__doc__": f"{label} of the selected hair",
        "bl_label": label,
        "bl_parent_id": parent.__name__,
        "bl_space_type": parent.bl_space_type,
        "bl_region_type": parent.bl_region_type,
        "bl_options": {"DEFAULT_CLOSED"},
        "poll": classmethod(poll),
        "draw": draw,
        "draw_header_preset": draw_header_preset,
    }
    if name in SWITCHES:
        namespace["draw_header"] = draw_header
    for attribute in ("bl_category", "bl_context"):
        if hasattr(parent, attribute):
            namespace[attribute] = getattr(parent, attribute)
    return type(f"{parent.__name__}_{name}", (bpy.types.Panel,), namespace)


class HAIRLOOM_PT_sidebar_mesh_cards(bpy.types.Panel):
    """Hair cards in your own meshes"""

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

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        draw_help(self.layout, "mesh_cards")

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.operator("hairloom.sort_cards", icon="SORTSIZE")


CLASSES: tuple[type[Any], ...] = (
    HAIRLOOM_PT_sidebar,
    *_sub_panels(HAIRLOOM_PT_sidebar, only=SESSION_SECTIONS),
    HAIRLOOM_PT_sidebar_mesh_cards,
    HAIRLOOM_PT_data,
    *_sub_panels(HAIRLOOM_PT_data),
)
