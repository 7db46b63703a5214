"""Draws the parameters of a section in a panel, by their declarations."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

import bpy

from ..blender.properties.groups import OVERLAYS
from ..params import Parameter

#: Draws one section of the panels of a groom.
type Draw = Callable[[bpy.types.UILayout, bpy.types.Object], None]

#: Fraction of a row for its label, as in Blender's own panels, which leave room for a dot at the
#: end; and fraction of the rest for a slider with a mask beside it.
_LABEL, _BESIDE_MASK = 0.37, 0.5
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
    """Draw the parameters of a section that belong to a panel; those without effect are greyed out.

    Args:
        sections: the properties that hold the section, such as `hair.data.hairloom`.
        leave_out: parameters that are drawn elsewhere, such as in the header.
    """
    group, column = getattr(sections, section), layout.column()
    masks = {each.of: each for each in group.settings.parameters() if each.kind == "mask"}
    for parameter in group.settings.parameters():
        is_shown = parameter.shown_when is None or parameter.shown_when(sections)
        is_elsewhere = parameter.name in leave_out or parameter.kind == "mask"
        if parameter.panel != panel or is_elsewhere or not is_shown:
            continue
        own, condition = column.column(), parameter.active_when
        lack = "" if condition is None or condition(sections) else condition.unmet_reason(sections)
        own.active = not lack
        if parameter.kind == "curve":
            _draw_curve(own, group, parameter, lack)
            continue
        if parameter.name in masks:
            _draw_painted(own, group, parameter, masks[parameter.name])
            continue
        icon = "GROUP_VCOL" if parameter.kind == "map" else "NONE"
        is_number = parameter.kind in {"number", "integer"}
        if lack:
            draw_idle(own, group, parameter.name, lack)
            continue
        own.prop(group, parameter.name, slider=is_number, icon=icon)


def _draw_painted(
    layout: bpy.types.UILayout, group: Any, parameter: Parameter, mask: Parameter
) -> None:
    """A slider and its mask side by side, with the label aligned to all labels."""
    row = layout.split(factor=_LABEL)
    row.use_property_split = False
    label = row.row()
    label.alignment = "RIGHT"
    label.label(text=parameter.label)
    fields = row.split(factor=_BESIDE_MASK, align=True)
    fields.prop(group, parameter.name, text="", slider=True)
    fields.prop(group, mask.name, text="", icon="GROUP_VERTEX")


def draw_idle(
    layout: bpy.types.UILayout, group: Any, name: str, lack: str, *, is_own: bool = True
) -> None:
    """A field without effect at the moment, as high as usual: it shows why, and can still be set.

    Args:
        lack: the reason.
        is_own: False: the field shows the value that applies instead, and cannot be set.
    """
    layout.active = False
    layout.enabled = is_own
    known = group.bl_rna.properties[name]
    row = layout.split(factor=_LABEL)
    row.use_property_split = False
    label = row.row()
    label.alignment = "RIGHT"
    label.label(text=known.name)
    has_place = known.type in {"INT", "FLOAT", "BOOLEAN"} and not known.array_length
    field = row.row(align=True)
    field.prop(group, name, text=lack if has_place else "", slider=known.type in {"INT", "FLOAT"})
    if not has_place:
        field.label(text=lack)


def draw_button(
    layout: bpy.types.UILayout,
    operator: str,
    idle: str = "",
    text: str | None = None,
    *,
    anywhere: bool = False,
    **how: Any,
) -> Any:
    """A button that shows in its label, not only in its tooltip, why it is greyed out.

    Args:
        operator: such as "hairloom.settle".
        idle: label if its poll fails; outside Object Mode the label is "Object Mode Only".
        anywhere: whether it works in all modes, so that the mode is not the reason.
        how: arguments for `UILayout.operator`.
    """
    if not getattr(bpy.ops.hairloom, operator.partition(".")[2]).poll():
        is_mode = bpy.context.mode != "OBJECT" and not anywhere
        text = "Object Mode Only" if is_mode else idle or text
    return (
        layout.operator(operator, **how)
        if text is None
        else layout.operator(operator, text=text, **how)
    )


def draw_overlays(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Switches of the overlays, three in a row, with the painted map beside the last one."""
    column = layout.column(align=True)
    for first in range(0, len(OVERLAYS), 3):
        row = column.row(align=True)
        for kind, _, _ in OVERLAYS[first : first + 3]:
            row.prop_enum(hair.hairloom, "shown_overlays", kind)
    row.prop(hair.hairloom, "shown_map", text="", icon="GROUP_VERTEX")


def _draw_curve(layout: bpy.types.UILayout, group: Any, parameter: Parameter, lack: str) -> None:
    """Five sliders, from root to tip."""
    layout.label(text=f"{parameter.label}: {lack}" if lack else parameter.label)
    sliders = layout.column(align=True)
    for index, place in enumerate(_PLACES):
        sliders.prop(group, parameter.name, index=index, text=place, slider=True)
