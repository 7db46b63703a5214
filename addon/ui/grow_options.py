"""What operators that grow hair have in common, as scripts call them."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import StringProperty

from ..blender.base.vertex_weights import weight_names
from ..blender.properties.groups import operator_properties
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
    ),
    "length_group": StringProperty(
        name="Length Factor",
        description="Vertex group or float attribute on points that the length is multiplied "
        "by. If empty, all hair has the same length",
        search=names_of_weights,
    ),
}


def draw_where_settings_are(layout: bpy.types.UILayout) -> None:
    """Adjust Last Operation is gone at the next click, so that nothing is set there."""
    layout.label(text="Length, count and more: Hairloom > Grow", icon="INFO")
