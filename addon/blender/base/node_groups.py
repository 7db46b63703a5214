"""Our geometry node groups: each once in a file, known by a mark and the version of its nodes."""

from __future__ import annotations

from collections.abc import Callable

import bpy


def own_node_group(
    name: str, mark: str, version: int, fill: Callable[[bpy.types.NodeTree], None]
) -> bpy.types.NodeTree:
    """The group of this file, whatever its name, for a modifier.

    Args:
        fill: gives a new one, which has its sockets for geometry, its nodes.
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
