"""Presets in the panels: the picture of the hair's present preset, which opens a choice of all, and
buttons that step through them, save and delete."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import EnumProperty, PointerProperty

from ..blender.properties.presets import Entry, matching_preset, own_presets, shipped_presets
from ..blender.properties.properties import TRANSLATION_CONTEXT
from ..blender.scene.curves import COLOR_ATTRIBUTE
from ..blender.scene.principled import has_principled_hair
from .messages import draw_message
from .selection import target_hair

#: section -> name of its presets, and a description
KINDS: dict[str, tuple[str, str]] = {
    "shading": ("Looks", "Colour and shine of the strands"),
    "dynamics": ("Dynamics", "How the hair moves"),
    "volume": ("Shadows", "Shadow quality, from fast to fine"),
    "cards": ("Cards", "Number and detail of cards, and their atlas"),
}
#: property of operators for presets of one kind
KIND = EnumProperty(
    name="Kind",
    description="Section that the presets belong to",
    items=[(section, *texts) for section, texts in KINDS.items()],
    options={"SKIP_SAVE"},
)
#: scale of the picture in the panel, and of those in the popup
_SCALE, _POPUP_SCALE = 3.0, 5.0
#: enum item for hair that matches no preset; its number is 0, presets count from 1
CUSTOM = ("CUSTOM", "Custom", "Settings that match no preset", "OPTIONS", 0)


def draw_preset_row(
    layout: bpy.types.UILayout, hair: bpy.types.Object, section: str = "shading"
) -> None:
    """Draw the picture of the hair's preset and the buttons; for looks also those that convert from
    and to a material."""
    entries, warnings = _entries(section)
    current = _preset_number(hair, entries)
    row = layout.row(align=True)
    row.template_icon_view(
        bpy.context.window_manager.hairloom_presets,
        section,
        show_labels=True,
        scale=_SCALE,
        scale_popup=_POPUP_SCALE,
    )
    buttons = row.column(align=True)
    steps = buttons.row(align=True)
    for icon, step in (("TRIA_LEFT", -1), ("TRIA_RIGHT", 1)):
        neighbor = entries[(max(current - 1, 0) + step) % len(entries)] if current else entries[0]
        steps.operator("hairloom.apply_preset", text="", icon=icon).name = neighbor.name
    shown = entries[current - 1] if current else None
    buttons.label(
        text=CUSTOM[1] if shown is None else shown.title,
        text_ctxt=TRANSLATION_CONTEXT,
        translate=shown is None or not shown.is_own,
    )
    file_buttons = buttons.row(align=True)
    file_buttons.operator("hairloom.save_preset", text="Save", icon="ADD").section = section
    file_buttons.operator("hairloom.add_preset", text="", icon="FILE_FOLDER")
    if current and entries[current - 1].is_own:
        file_buttons.operator("hairloom.delete_preset", text="", icon="X").name = entries[
            current - 1
        ].name
    for warning in warnings:
        draw_message(layout, bpy.context, warning, "ERROR")
    if section != "shading":
        return
    materials = layout.row(align=True)
    if has_principled_hair(hair):
        materials.operator("hairloom.look_from_material", text="From Material", icon="MATERIAL")
    materials.operator("hairloom.look_to_material", text="To Material", icon="MATERIAL")


def _entries(section: str) -> tuple[tuple[Entry, ...], tuple[str, ...]]:
    """All presets of a section, and warnings about files among the artist's own."""
    entries, warnings = own_presets(section)
    return (*shipped_presets(section), *entries), warnings


def _preset_number(hair: bpy.types.Object, entries: tuple[Entry, ...]) -> int:
    """The number of the preset that the hair's settings match, counted from 1; 0: none.

    `color_source` is ignored on hair without colours of its own, where it has no effect.
    """
    ignored = () if COLOR_ATTRIBUTE in hair.data.attributes else ("color_source",)
    preset = matching_preset(hair, entries, ignored)
    return 0 if preset is None else 1 + entries.index(preset)


def _preset_property(section: str) -> Any:
    """A property that is the preset of the hair in the panels; setting it applies another one."""
    # Blender does not copy the texts of items, so that they must be kept here
    enum_items: list[tuple[str, str, str, str | int, int]] = []

    def items(_presets: Any, _context: bpy.types.Context | None) -> Any:
        entries, _ = _entries(section)
        enum_items[:] = [
            (each.name, each.title, "", each.icon or "PRESET", number)
            for number, each in enumerate(entries, start=1)
        ]
        if get(_presets) == 0:
            enum_items.insert(0, CUSTOM)
        return enum_items

    def get(_presets: Any) -> int:
        hair = target_hair(bpy.context)
        return _preset_number(hair[0], _entries(section)[0]) if hair else 0

    def apply(_presets: Any, number: int) -> None:
        if number > 0:
            name = _entries(section)[0][number - 1].name
            bpy.ops.hairloom.apply_preset("EXEC_DEFAULT", True, name=name)

    title, about = KINDS[section]
    return EnumProperty(
        name=title,
        description=f"{about}. Click to choose",
        items=items,
        get=get,
        set=apply,
        translation_context=TRANSLATION_CONTEXT,
    )


class HAIRLOOM_PG_presets(bpy.types.PropertyGroup):
    """The presets of the selected hair; the scene itself stores only settings, not which preset."""

    __annotations__ = {section: _preset_property(section) for section in KINDS}


CLASSES: tuple[type[Any], ...] = (HAIRLOOM_PG_presets,)


def register() -> None:
    """Add the presets to the window manager; CLASSES must be registered."""
    bpy.types.WindowManager.hairloom_presets = PointerProperty(
        type=HAIRLOOM_PG_presets, name="Presets", description="Presets of the selected hair"
    )


def unregister() -> None:
    del bpy.types.WindowManager.hairloom_presets
