"""Options of growing hair, shared by the operators that do."""

from __future__ import annotations

from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any

import bpy
from bpy.props import StringProperty

from ..blender.base.vertex_weights import weight_names
from ..blender.properties.groups import operator_properties
from ..parameters import ALL_SETTINGS
from .selection import ground_mesh


def names_of_weights(_operator: Any, context: bpy.types.Context, typed: str) -> list[str]:
    mesh = ground_mesh(context)
    names = [] if mesh is None else weight_names(mesh)
    return [name for name in names if typed.lower() in name.lower()]


#: for the `__annotations__` of an operator
GROW_PROPERTIES: dict[str, Any] = {
    **operator_properties("grow"),
    "density_group": StringProperty(
        name="Density",
        description="Vertex group or float attribute on points that sets how densely hair "
        "grows. If empty, combed hair grows on the scalp, other hair everywhere",
        search=names_of_weights,
        search_options={"SUGGESTION"},
    ),
    "length_group": StringProperty(
        name="Length Factor",
        description="Vertex group or float attribute on points that the length is multiplied "
        "by. If empty, all hair has the same length",
        search=names_of_weights,
        search_options={"SUGGESTION"},
    ),
}


def draw_grow(
    layout: bpy.types.UILayout, operator: Any, names: Iterable[str] = GROW_PROPERTIES
) -> None:
    """Draw only the options of the chosen method."""
    sections = SimpleNamespace(grow=operator)
    hidden = {
        parameter.name
        for parameter in ALL_SETTINGS["grow"].parameters()
        if parameter.shown_when is not None and not parameter.shown_when(sections)
    }
    for name in names:
        if name not in hidden:
            layout.prop(operator, name)
