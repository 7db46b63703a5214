"""Drawing the parameters of a section in a panel, as their declarations say."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

import bpy

from ..blender.properties.groups import OVERLAYS
from ..params import Parameter

#: Draws one section of the panels of a groom.
type Draw = Callable[[bpy.types.UILayout, bpy.types.Object], None]

#: How much of a row its label has, as in all of Blender's panels, which leave room for a dot at the
#: end; and of the rest a slider that a mask stands beside.
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
        own, condition = column.column(), parameter.active_when
        lack = "" if condition is None or condition(sections) else condition.lack(sections)
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
    """A slider and its mask side by side, with the label where all labels are."""
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
    """A field that does not act now, as high as if it did: it says why, and can be set all the
    same.

    Args:
        is_own: False: it shows what holds instead, and is not to be set here.
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
    """A button that says on its face why it is greyed out, not only to a mouse that waits.

    Args:
        operator: such as "hairloom.settle".
        idle: its text where it can do nothing; in other modes it says that these are why.
        anywhere: it is for all modes.
        how: as `UILayout.operator` takes it.
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
    """What may be drawn over the view as lines, three in a row; and beside the last one its map."""
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
