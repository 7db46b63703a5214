"""What operators that grow hair have in common, as scripts call them."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import StringProperty

from ..blender.properties.groups import operator_properties
from ..blender.properties.properties import maps_meant
from .selection import ground_mesh


def names_of_weights(_operator: Any, context: bpy.types.Context, typed: str) -> list[str]:
    return maps_meant(ground_mesh(context), typed)


#: for the `__annotations__` of an operator
GROW_PROPERTIES: dict[str, Any] = {
    **operator_properties("grow"),
    "density_group": StringProperty(
        name="Density",
        description="Vertex group, attribute of the surface, or image on its UVs with the density "
        "of the hair. If empty, combed hair grows on the scalp, other hair everywhere",
        search=names_of_weights,
    ),
    "length_group": StringProperty(
        name="Length Factor",
        description="Vertex group, attribute of the surface, or image on its UVs that the "
        "length is multiplied by. If empty, all hair has the same length",
        search=names_of_weights,
    ),
}


def draw_where_settings_are(layout: bpy.types.UILayout) -> None:
    """Adjust Last Operation is gone at the next click, so that nothing is set there."""
    layout.label(text="Length, count and more: Hairloom > Grow", icon="INFO")
