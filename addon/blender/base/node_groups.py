"""Our geometry node groups: once per file, found by a custom property with the nodes' version."""

from __future__ import annotations

from collections.abc import Callable

import bpy


def own_node_group(
    name: str, mark: str, version: int, fill: Callable[[bpy.types.NodeTree], None]
) -> bpy.types.NodeTree:
    """The group of this file for a modifier, whatever its name; made if there is none.

    Args:
        mark: the custom property that holds the version.
        fill: adds the nodes to a new group, which has its geometry sockets already.
    """
    known = (each for each in bpy.data.node_groups if each.get(mark) == version)
    found = next((each for each in known if each.library is None), None)
    if found is not None:
        return found
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree[mark] = version
    tree.is_modifier = True
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    fill(tree)
    return tree
