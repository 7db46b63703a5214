"""Drawing the parameters of a section in a panel, as their declarations say."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

import bpy

from ..blender.properties.groups import OVERLAYS
from ..params import Parameter

#: Draws one section of the panels of a groom.
type Draw = Callable[[bpy.types.UILayout, bpy.types.Object], None]

#: How much of its row a slider has that a mask stands beside.
_BESIDE_MASK = 0.65
#: positions of a curve's five values
_PLACES = ("Root", "Quarter", "Middle", "Three Quarters", "Tip")


def draw_section(
    layout: bpy.types.UILayout,
    sections: Any,
    section: str,
    panel: str = "",
    *,
    leave_out: Collection[str] = (),
) -> None:
    """Draw what one panel shows of a section; what does not act now is greyed out.

    Args:
        sections: the properties that hold it, such as `hair.data.hairloom`.
        leave_out: parameters that are drawn elsewhere, such as in the header.
    """
    group, column = getattr(sections, section), layout.column()
    masks = {each.of: each for each in group.settings.parameters() if each.kind == "mask"}
    for parameter in group.settings.parameters():
        is_shown = parameter.shown_when is None or parameter.shown_when(sections)
        is_elsewhere = parameter.name in leave_out or parameter.kind == "mask"
        if parameter.panel != panel or is_elsewhere or not is_shown:
            continue
        own = column.column()
        own.active = parameter.active_when is None or parameter.active_when(sections)
        if parameter.kind == "curve":
            _draw_curve(own, group, parameter)
            continue
        if parameter.name in masks:
            own = own.split(factor=_BESIDE_MASK, align=True)
        own.prop(group, parameter.name, slider=parameter.kind in {"number", "integer"})
        if parameter.name in masks:
            own.prop(group, masks[parameter.name].name, text="", icon="GROUP_VERTEX")


def draw_overlays(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """What may be drawn over the view as lines, three in a row; and beside the last one its map."""
    column = layout.column(align=True)
    for first in range(0, len(OVERLAYS), 3):
        row = column.row(align=True)
        for kind, _, _ in OVERLAYS[first : first + 3]:
            row.prop_enum(hair.hairloom, "shown_overlays", kind)
    row.prop(hair.hairloom, "shown_map", text="", icon="GROUP_VERTEX")


def _draw_curve(layout: bpy.types.UILayout, group: Any, parameter: Parameter) -> None:
    """Five sliders, from root to tip."""
    layout.label(text=parameter.label)
    sliders = layout.column(align=True)
    for index, place in enumerate(_PLACES):
        sliders.prop(group, parameter.name, index=index, text=place, slider=True)
