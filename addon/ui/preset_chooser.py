"""Presets in the panels: a button that shows all presets of a section with their pictures, and one
that saves."""

from __future__ import annotations

import textwrap
from typing import Any

import bpy
from bpy.props import EnumProperty

from ..blender.properties.presets import Entry, own, shipped
from ..blender.scene.principled import has_principled_hair
from .selection import needs_hair

#: section -> what its presets are called, and what they are about
KINDS: dict[str, tuple[str, str]] = {
    "shading": ("Looks", "Colour and shine of the strands"),
    "dynamics": ("Dynamics", "How the hair moves"),
    "volume": ("Shadows", "Shadows from fast to fine"),
    "cards": ("Cards", "How many cards, how fine, and their atlas"),
}
#: for the operators that are about presets of one kind
KIND = EnumProperty(
    name="Kind",
    description="Section that the presets belong to",
    items=[(section, *texts) for section, texts in KINDS.items()],
    options={"SKIP_SAVE"},
)
#: pictures of presets: how many side by side, and how large; the pixels at UI scale 1 and the
#: letters that fit across them all
_ACROSS, _PICTURE_SCALE, _WIDTH, _LETTERS = 3, 5.0, 330, 42


def draw_preset_row(
    layout: bpy.types.UILayout, hair: bpy.types.Object, section: str = "shading", text: str = ""
) -> None:
    """Draw the two buttons; for looks also those from and to a material."""
    row = layout.row(align=True)
    chooser = row.operator("hairloom.choose_preset", text=text or "Presets", icon="PRESET")
    chooser.section = section
    row.operator("hairloom.save_preset", text="", icon="ADD").section = section
    if section != "shading":
        return
    materials = layout.row(align=True)
    if has_principled_hair(hair):
        materials.operator("hairloom.look_from_material", text="From Material", icon="MATERIAL")
    materials.operator("hairloom.look_to_material", text="To Material", icon="MATERIAL")


class HAIRLOOM_OT_choose_preset(bpy.types.Operator):
    """Choose one of Hairloom's presets, or of your own"""

    bl_idname = "hairloom.choose_preset"
    bl_label = "Presets"

    section: KIND

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_popup(self, width=_WIDTH)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        return {"FINISHED"}

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.label(text=KINDS[self.section][0])
        _draw_grid(layout, shipped(self.section))
        entries, warnings = own(self.section)
        if entries:
            layout.separator()
            layout.label(text="Your Own")
            _draw_grid(layout, entries)
        for warning in warnings:
            lines = layout.box().column(align=True)
            for index, line in enumerate(textwrap.wrap(warning, _LETTERS)):
                lines.label(text=line, icon="BLANK1" if index else "ERROR")


def _draw_grid(layout: bpy.types.UILayout, entries: tuple[Entry, ...]) -> None:
    """Draw a button for each preset, below its picture if it has one."""
    grid = layout.grid_flow(row_major=True, columns=_ACROSS, even_columns=True, align=False)
    for entry in entries:
        cell = grid.column(align=True)
        if entry.icon:
            cell.template_icon(icon_value=entry.icon, scale=_PICTURE_SCALE)
        row = cell.row(align=True)
        row.operator("hairloom.apply_preset", text=entry.title).name = entry.name
        if entry.is_own:
            row.operator("hairloom.delete_preset", text="", icon="X").name = entry.name
    for _ in range(-len(entries) % _ACROSS):
        grid.label(text="")


CLASSES: tuple[type[Any], ...] = (HAIRLOOM_OT_choose_preset,)
