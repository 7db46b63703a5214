"""Draws the parameters of a section in a panel, by their declarations."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

import bpy

from ..blender.properties.groups import OVERLAYS
from ..blender.properties.properties import TRANSLATION_CONTEXT
from ..params import Parameter

#: Draws one section of the panels of a groom.
type Draw = Callable[[bpy.types.UILayout, bpy.types.Object], None]

#: Fraction of a row for its label, as in Blender's own panels, which leave room for a dot at the
#: end; and fraction of the rest for a slider with a mask beside it.
_LABEL_FRACTION, _SLIDER_FRACTION = 0.37, 0.5
#: positions of a curve's five values
_CURVE_LABELS = ("Root", "Quarter", "Middle", "Three Quarters", "Tip")


def draw_section(
    layout: bpy.types.UILayout,
    sections: Any,
    section: str,
    panel: str = "",
    *,
    exclude: Collection[str] = (),
) -> None:
    """Draw the parameters of a section that belong to a panel; those without effect are greyed out.

    Args:
        sections: the properties that hold the section, such as `hair.data.hairloom`.
        exclude: parameters that are drawn elsewhere, such as in the header.
    """
    group, column = getattr(sections, section), layout.column()
    masks = {
        each.masked_parameter: each for each in group.settings.parameters() if each.kind == "mask"
    }
    for parameter in group.settings.parameters():
        is_shown = parameter.shown_when is None or parameter.shown_when(sections)
        is_excluded = parameter.name in exclude or parameter.kind == "mask"
        if parameter.panel != panel or is_excluded or not is_shown:
            continue
        cell, condition, reason = column.column(), parameter.active_when, ""
        if condition is not None and not condition(sections):
            reason = condition.unmet_reason(sections)
        cell.active = not reason
        if parameter.kind == "curve":
            _draw_curve(cell, group, parameter, reason)
            continue
        if parameter.name in masks:
            _draw_masked(cell, group, parameter, masks[parameter.name])
            continue
        icon = "GROUP_VCOL" if parameter.kind == "map" else "NONE"
        is_number = parameter.kind in {"number", "integer"}
        if reason:
            draw_inactive(cell, group, parameter.name, reason)
            continue
        cell.prop(group, parameter.name, slider=is_number, icon=icon)


def _draw_masked(
    layout: bpy.types.UILayout, group: Any, parameter: Parameter, mask: Parameter
) -> None:
    """A slider and its mask side by side, with the label aligned to all labels."""
    row = layout.split(factor=_LABEL_FRACTION)
    row.use_property_split = False
    label = row.row()
    label.alignment = "RIGHT"
    label.label(text=parameter.label, text_ctxt=TRANSLATION_CONTEXT)
    fields = row.split(factor=_SLIDER_FRACTION, align=True)
    fields.prop(group, parameter.name, text="", slider=True)
    fields.prop(group, mask.name, text="", icon="GROUP_VERTEX")


def draw_inactive(
    layout: bpy.types.UILayout, group: Any, name: str, reason: str, *, is_editable: bool = True
) -> None:
    """A field without effect at the moment, as high as usual: it shows why, and can still be set.

    Args:
        reason: why it has no effect.
        is_editable: False: the field shows the value that applies instead, and cannot be set.
    """
    layout.active = False
    layout.enabled = is_editable
    property_rna = group.bl_rna.properties[name]
    row = layout.split(factor=_LABEL_FRACTION)
    row.use_property_split = False
    label = row.row()
    label.alignment = "RIGHT"
    label.label(text=property_rna.name, text_ctxt=TRANSLATION_CONTEXT)
    is_number = property_rna.type in {"INT", "FLOAT"}
    has_text = (is_number or property_rna.type == "BOOLEAN") and not property_rna.array_length
    field = row.row(align=True)
    field.prop(group, name, text=reason if has_text else "", slider=is_number)
    if not has_text:
        field.label(text=reason)


def draw_button(
    layout: bpy.types.UILayout,
    operator: str,
    disabled_text: str = "",
    text: str | None = None,
    *,
    in_all_modes: bool = False,
    **arguments: Any,
) -> Any:
    """A button that shows in its label, not only in its tooltip, why it is greyed out.

    Args:
        operator: such as "hairloom.settle".
        disabled_text: label if its poll fails; outside Object Mode the label is "Object Mode Only".
        in_all_modes: whether it works in all modes, so that the mode is not the reason.
        arguments: for `UILayout.operator`.
    """
    if not getattr(bpy.ops.hairloom, operator.partition(".")[2]).poll():
        is_wrong_mode = bpy.context.mode != "OBJECT" and not in_all_modes
        text = "Object Mode Only" if is_wrong_mode else disabled_text or text
    return (
        layout.operator(operator, **arguments)
        if text is None
        else layout.operator(operator, text=text, **arguments)
    )


def draw_overlays(layout: bpy.types.UILayout, hair: bpy.types.Object) -> None:
    """Switches of the overlays, three in a row, with the painted map beside the last one."""
    column = layout.column(align=True)
    for first in range(0, len(OVERLAYS), 3):
        row = column.row(align=True)
        for kind, _, _ in OVERLAYS[first : first + 3]:
            row.prop_enum(hair.hairloom, "shown_overlays", kind)
    row.prop(hair.hairloom, "shown_map", text="", icon="GROUP_VERTEX")


def _draw_curve(layout: bpy.types.UILayout, group: Any, parameter: Parameter, reason: str) -> None:
    """Five sliders, from root to tip."""
    text = f"{parameter.label}: {reason}" if reason else parameter.label
    layout.label(text=text, text_ctxt=TRANSLATION_CONTEXT)
    sliders = layout.column(align=True)
    for index, label in enumerate(_CURVE_LABELS):
        sliders.prop(group, parameter.name, index=index, text=label, slider=True)
