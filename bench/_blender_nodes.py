"""Node groups from the assets that Blender ships."""

from __future__ import annotations

from pathlib import Path

import bpy


def shipped_node_group(name: str, assets: str) -> bpy.types.NodeTree:
    """The node group of this name, loaded from `assets` if the open file has none.

    Args:
        assets: path of the .blend file in Blender's data folder.
    """
    known = bpy.data.node_groups.get(name)
    if known is not None:
        return known
    path = Path(bpy.utils.system_resource("DATAFILES")) / assets
    with bpy.data.libraries.load(str(path)) as (_, wanted):
        wanted.node_groups = [name]
    return bpy.data.node_groups[name]
