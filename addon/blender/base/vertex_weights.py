"""Weights that an artist has painted or computed on a mesh, by name."""

from __future__ import annotations

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError


def weight_names(obj: bpy.types.Object) -> list[str]:
    """The names that `read_weights` knows on this mesh object before its modifiers: its vertex
    groups, then its float attributes on points."""
    attributes = [one.name for one in obj.data.attributes if _is_weight(one)]
    return [group.name for group in obj.vertex_groups] + attributes


def read_weights(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, name: str) -> Floats:
    """Weight of each vertex of the evaluated mesh, (vertex_count,) float32.

    A vertex group gives 0 to 1, and 0 where a vertex is not in it; a float attribute on points
    gives its values. Where both have the name it is the group.

    Raises:
        HairloomError: not a mesh, or neither a group nor such an attribute of this name.
    """
    if obj.type != "MESH":
        raise HairloomError(
            f"it is a {obj.type.lower()} object, so it has no vertex groups",
            place=obj.name,
            remedy="Choose a mesh object",
        )
    evaluated = obj.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        return weights_on(obj, mesh, name)
    finally:
        evaluated.to_mesh_clear()


def weights_on(obj: bpy.types.Object, mesh: bpy.types.Mesh, name: str) -> Floats:
    """Like `read_weights`, on a mesh of this object, before or after its modifiers."""
    group = obj.vertex_groups.get(name)
    if group is not None:
        return _group_weights(mesh, group.index)
    attribute = mesh.attributes.get(name)
    if attribute is None or not _is_weight(attribute):
        raise _missing(obj, name, attribute)
    weights = np.empty(len(mesh.vertices), np.float32)
    attribute.data.foreach_get("value", weights)
    return weights


def set_group(obj: bpy.types.Object, name: str, weights: Floats) -> None:
    """A vertex group with these weights, (vertex_count,), those above 0."""
    group = obj.vertex_groups.get(name) or obj.vertex_groups.new(name=name)
    steps = np.round(255.0 * weights).astype(np.int64)  # few calls for many vertices
    for step in np.unique(steps[steps > 0]):
        group.add(np.flatnonzero(steps == step).tolist(), float(step) / 255.0, "REPLACE")


def _group_weights(mesh: bpy.types.Mesh, index: int) -> Floats:
    weights = np.zeros(len(mesh.vertices), np.float32)
    for vertex in mesh.vertices:  # Blender gives the weights of groups in no faster way
        for member in vertex.groups:
            if member.group == index:
                weights[vertex.index] = member.weight
    return weights


def _is_weight(attribute: bpy.types.Attribute) -> bool:
    return attribute.domain == "POINT" and attribute.data_type == "FLOAT"


def _missing(
    obj: bpy.types.Object, name: str, attribute: bpy.types.Attribute | None
) -> HairloomError:
    if attribute is None:
        problem = f"it has neither a vertex group nor an attribute named '{name}'"
    else:
        problem = (
            f"its attribute '{name}' is {attribute.data_type} on {attribute.domain}, "
            "not FLOAT on POINT"
        )
    there = ", ".join(weight_names(obj)[:8])
    paint = "Paint one (Weight Paint), or leave the field empty"
    remedy = f"Use one of: {there}" if there else paint
    return HairloomError(problem, place=obj.name, remedy=remedy)
