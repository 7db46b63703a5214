"""Blender's own node groups for hair, as modifiers: they come with every Blender."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import bpy

from ...errors import HairloomError

_LIBRARY = "assets/nodes/procedural_hair_node_assets.blend"
#: types of input sockets that can be set -> Python types of their values
_VALUE_TYPES: dict[str, tuple[type, ...]] = {
    "NodeSocketBool": (bool,),
    "NodeSocketInt": (int,),
    "NodeSocketFloat": (int, float),
    "NodeSocketMenu": (str,),
}
#: the input of curls and braids that is a number of turns per length
_FREQUENCY_INPUT = "Frequency"


def add_hair_nodes(
    hair: bpy.types.Object, nodes: str, values: Mapping[str, Any], scale: float = 1.0
) -> bpy.types.Modifier:
    """Add one of Blender's node groups for hair as a modifier, with these values.

    A group of this name in the file is used if it has these inputs; else Blender's own is added
    again.

    Args:
        values: by the names of inputs, as the artist sees them.
        scale: size of the hair relative to a human's; distances and frequencies are scaled
            accordingly.

    Raises:
        HairloomError: this Blender has no such group, or it has no such inputs.
    """
    group = bpy.data.node_groups.get(nodes)
    if group is None or _unsupported_inputs(group, values):
        group = _from_library(nodes)
    unsupported = _unsupported_inputs(group, values)
    if unsupported:
        raise HairloomError(
            f"Blender's node group '{nodes}' has no input '{unsupported[0]}' for this value",
            place=hair.name,
            remedy=f"Use Blender 5.2; this is {bpy.app.version_string}",
        )
    modifier = hair.modifiers.new(nodes, "NODES")
    modifier.node_group = group
    inputs = _inputs(group)
    for name, value in values.items():
        if getattr(inputs[name], "subtype", "") == "DISTANCE":
            value *= scale
        elif name == _FREQUENCY_INPUT:
            value /= scale
        getattr(modifier.properties.inputs, inputs[name].identifier).value = value
    return modifier


def library_path() -> Path:
    """The file with this Blender's node groups for hair."""
    folder = bpy.utils.system_resource("DATAFILES")
    return Path(folder) / _LIBRARY


def _from_library(nodes: str) -> bpy.types.NodeTree:
    path = library_path()
    if not path.is_file():
        raise HairloomError(
            f"this Blender was built without its hair nodes, so '{nodes}' is missing",
            place=str(path),
            remedy="Install Blender from blender.org, which includes them",
        )
    with bpy.data.libraries.load(str(path), link=False) as (available, loaded):
        loaded.node_groups = [nodes] if nodes in available.node_groups else []
    if not loaded.node_groups or loaded.node_groups[0] is None:
        raise HairloomError(
            f"this Blender has no hair nodes '{nodes}'",
            place=str(path),
            remedy=f"Use Blender 5.2; this is {bpy.app.version_string}",
        )
    return loaded.node_groups[0]


def _inputs(group: bpy.types.NodeTree) -> dict[str, Any]:
    """The input sockets of a node group by name; the first where several share one."""
    found: dict[str, Any] = {}
    for item in group.interface.items_tree:
        if item.item_type == "SOCKET" and item.in_out == "INPUT":
            found.setdefault(item.name, item)
    return found


def _unsupported_inputs(group: bpy.types.NodeTree, values: Mapping[str, Any]) -> list[str]:
    """The names of inputs that the group lacks, or that cannot take the value."""
    inputs = _inputs(group) if group.bl_idname == "GeometryNodeTree" else {}
    return [
        name
        for name, value in values.items()
        if name not in inputs or type(value) not in _VALUE_TYPES.get(inputs[name].socket_type, ())
    ]
