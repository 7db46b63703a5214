"""Options of growing hair, shared by the operators that do."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy
from bpy.props import StringProperty

from ..blender.base.vertex_weights import weight_names
from ..blender.properties.groups import operator_properties
from .selection import ground_mesh

#: settings that say nothing about hair that stands straight along the normals, and the other way
_COMBED_ONLY: tuple[str, ...] = (
    "lift",
    "comb_back",
    "comb_share",
    "droop",
    "clump",
    "clump_size",
    "wave",
    "wave_length",
    "frizz",
    "clearance",
    "volume",
)
_NORMALS_ONLY: tuple[str, ...] = ("per_vertex", "threshold")


def _weight_names(_operator: Any, context: bpy.types.Context, typed: str) -> list[str]:
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
        search=_weight_names,
        search_options={"SUGGESTION"},
    ),
    "length_group": StringProperty(
        name="Length Factor",
        description="Vertex group or float attribute on points that the length is multiplied "
        "by. If empty, all hair has the same length",
        search=_weight_names,
        search_options={"SUGGESTION"},
    ),
}


def draw_grow(
    layout: bpy.types.UILayout, operator: Any, names: Iterable[str] = GROW_PROPERTIES
) -> None:
    """Draw only the options of the chosen method."""
    hidden = _NORMALS_ONLY if operator.way == "combed" else _COMBED_ONLY
    if operator.way == "normals" and operator.per_vertex:
        hidden += ("strand_count",)
    elif operator.way == "normals":
        hidden += ("threshold",)
    for name in names:
        if name not in hidden:
            layout.prop(operator, name)
