"""Drawing parameters in a panel: a group of them, some by name, a curve as sliders."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import bpy

from ..params import Parameter

#: Draws one section of the panels of a groom.
type Draw = Callable[[bpy.types.UILayout, bpy.types.Object], None]

#: positions of a curve's five values
_PLACES = ("Root", "Quarter", "Middle", "Three Quarters", "Tip")


def draw_titled(layout: bpy.types.UILayout, group: Any) -> None:
    layout.label(text=group.settings.title)
    draw_group(layout, group)


def draw_group(layout: bpy.types.UILayout, group: Any) -> None:
    draw_named(layout, group, [parameter.name for parameter in group.settings.parameters()])


def draw_named(layout: bpy.types.UILayout, group: Any, names: Sequence[str]) -> None:
    """Draw the parameters of these names; a curve as five sliders, from root to tip."""
    column = layout.column()
    for parameter in group.settings.parameters():
        if parameter.name not in names:
            continue
        if parameter.kind == "curve":
            _draw_curve(column, group, parameter)
        else:
            column.prop(group, parameter.name, slider=parameter.kind in {"number", "integer"})


def _draw_curve(layout: bpy.types.UILayout, group: Any, parameter: Parameter) -> None:
    layout.label(text=parameter.label)
    sliders = layout.column(align=True)
    for index, place in enumerate(_PLACES):
        sliders.prop(group, parameter.name, index=index, text=place, slider=True)
