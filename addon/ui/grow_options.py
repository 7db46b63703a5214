"""Properties that all operators which grow hair share, for scripts."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import StringProperty

from ..blender.properties.groups import operator_properties
from ..blender.properties.properties import matching_maps
from .selection import growth_mesh


def search_weight_names(_operator: Any, context: bpy.types.Context, edit_text: str) -> list[str]:
    return matching_maps(growth_mesh(context), edit_text)


#: part of the `__annotations__` of such an operator
GROW_PROPERTIES: dict[str, Any] = {
    **operator_properties("grow"),
    "density_group": StringProperty(
        name="Density",
        description="Vertex group, attribute of the surface, or image on its UVs with the density "
        "of the hair. If empty, combed hair grows on the scalp, other hair everywhere",
        search=search_weight_names,
    ),
    "length_group": StringProperty(
        name="Length Factor",
        description="Vertex group, attribute of the surface, or image on its UVs that the "
        "length is multiplied by. If empty, all hair has the same length",
        search=search_weight_names,
    ),
}


def draw_settings_hint(layout: bpy.types.UILayout) -> None:
    """A hint instead of settings in Adjust Last Operation, which closes at the next click."""
    layout.label(text="Length, count and more: Hairloom > Grow", icon="INFO")
