"""The section Look: which parameters act in a model, and where they stand."""

from __future__ import annotations

import textwrap
from typing import Any

import bpy

from ..host.presets import Entry, own, shipped
from ..host.principled import has_principled_hair
from .selection import needs_hair

_VARIATION = ("color_variation", "grey_share", "shift_noise", "sparkle", "noise_cells")
#: section below Look ("" is Look itself) -> model -> its parameters in order; a model that is not
#: named has none
LOOK: dict[str, dict[str, tuple[str, ...]]] = {
    "": {
        "kajiya_kay": ("model", "ambient"),
        "marschner": ("model", "ambient", "scattered", "volume_shade"),
    },
    "Colour": {
        "kajiya_kay": ("base_color", "tip_tint", "tip_color", "tint_start", "tint_end"),
        "marschner": ("pigment", "base_color", "melanin", "redness", "absorption")
        + ("tip_tint", "tip_color", "tint_start", "tint_end"),
    },
    "First Highlight": {
        "kajiya_kay": ("primary_color", "primary_strength", "primary_exponent", "primary_shift"),
        "marschner": ("strength_r", "width_r", "offset_r"),
    },
    "Second Highlight": {
        "kajiya_kay": ("secondary_color", "secondary_strength", "secondary_exponent")
        + ("secondary_shift",),
        "marschner": ("strength_trt", "width_trt", "offset_trt", "glint_strength", "glint_width"),
    },
    "Rim Light": {"marschner": ("strength_tt", "width_tt", "offset_tt", "strength_rest")},
    "Fibre": {
        "marschner": ("index_of_refraction", "cuticle_tilt", "eccentricity", "azimuthal_width"),
    },
    "Variation": {"kajiya_kay": _VARIATION, "marschner": _VARIATION},
}
#: parameter -> the pigment with which alone it acts in Marschner
_OF_PIGMENT = {
    "base_color": "color",
    "melanin": "melanin",
    "redness": "melanin",
    "absorption": "absorption",
}
_OF_TINT = ("tip_color", "tint_start", "tint_end")
#: pictures of presets: so many beside each other, so large; the pixels at UI scale 1 and the
#: letters that fit across them all
_ACROSS, _PICTURE_SCALE, _WIDTH, _LETTERS = 3, 5.0, 330, 42


def look_names(section: str, shading: Any) -> list[str]:
    """The parameters that act by these settings, in the order in which they are drawn."""
    names = LOOK[section].get(shading.model, ())
    if shading.model != "marschner":
        return list(names)
    return [name for name in names if _OF_PIGMENT.get(name, shading.pigment) == shading.pigment]


def is_idle(name: str, shading: Any, volume: Any) -> bool:
    """Whether it does nothing at the moment, but would if another setting were changed."""
    if name in _OF_TINT:
        return shading.tip_tint == 0.0
    if volume.shadows == "none":
        return False
    return name == "volume_shade" or (name == "scattered" and volume.scattering)


def draw_preset_row(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    row = layout.row(align=True)
    row.operator("hairloom.choose_look", icon="PRESET")
    row.operator("hairloom.save_preset", text="", icon="ADD")
    if has_principled_hair(hair):
        layout.operator("hairloom.look_from_material", icon="MATERIAL")


class HAIRLOOM_OT_choose_look(bpy.types.Operator):
    """Choose among the looks that come with Hairloom, and your own"""

    bl_idname = "hairloom.choose_look"
    bl_label = "Presets"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return needs_hair(cls, context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_popup(self, width=_WIDTH)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        return {"FINISHED"}

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        _draw_grid(layout, shipped("shading"))
        entries, warnings = own("shading")
        if entries:
            layout.separator()
            layout.label(text="Your Own")
            _draw_grid(layout, entries)
        for warning in warnings:
            lines = layout.box().column(align=True)
            for index, line in enumerate(textwrap.wrap(warning, _LETTERS)):
                lines.label(text=line, icon="BLANK1" if index else "ERROR")


def _draw_grid(layout: bpy.types.UILayout, entries: tuple[Entry, ...]) -> None:
    """A button a preset, below its picture where it has one."""
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


CLASSES = (HAIRLOOM_OT_choose_look,)
