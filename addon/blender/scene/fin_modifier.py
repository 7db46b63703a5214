"""How Blender shows a fin: a Geometry Nodes modifier that reads an attribute of the mesh.

    Store `hairloom_carried`   where the modifiers above and the animation put each vertex
    Store `hairloom_index`     the vertex's index, to find it again after subdivision or mirroring
    Set Position               to `hairloom_position`, if the mesh has that attribute

The simulation adds `hairloom_position` to the original mesh and removes it again. The artist's data
stays untouched, modifiers below work on the cloth, and the result renders, saves and opens without
Hairloom.
"""

from __future__ import annotations

from itertools import pairwise

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ..base.node_groups import own_node_group
from ..base.objects import Handle

NAME = "Hairloom Cloth"
POSITION = "hairloom_position"
CARRIED = "hairloom_carried"
INDEX = "hairloom_index"
#: custom property that marks our node group, whatever its name, and holds its version
_MARK = "hairloom_fin"
_VERSION = 1


def fin_modifier(obj: bpy.types.Object) -> bpy.types.Modifier | None:
    """The modifier that makes this object a fin."""
    for modifier in obj.modifiers if obj.type == "MESH" else ():
        nodes = modifier.node_group if modifier.type == "NODES" else None
        if nodes is not None and nodes.get(_MARK):
            return modifier
    return None


def has_fins() -> bool:
    """Whether the file has any fin; far cheaper than checking each of its objects."""
    return any(group.users and group.get(_MARK) for group in bpy.data.node_groups)


def add_modifier(obj: bpy.types.Object) -> bpy.types.Modifier:
    """Make this mesh a fin, with the modifier last in the stack; an existing one is kept."""
    modifier = fin_modifier(obj)
    if modifier is None:
        modifier = obj.modifiers.new(NAME, "NODES")
        modifier.node_group = own_node_group(NAME, _MARK, _VERSION, _fill_node_tree)
        modifier.show_in_editmode = False
    return modifier


def remove_modifier(obj: bpy.types.Object) -> None:
    """Make it a plain mesh again."""
    clear(obj.data)
    modifier = fin_modifier(obj)
    if modifier is None:
        return
    nodes = modifier.node_group
    obj.modifiers.remove(modifier)
    if not nodes.users:
        bpy.data.node_groups.remove(nodes)


def is_shown(obj: bpy.types.Object) -> bool:
    """Whether the mesh holds a simulated frame."""
    return obj.type == "MESH" and obj.data.attributes.get(POSITION) is not None


def show(mesh: bpy.types.Mesh, positions: Floats) -> None:
    """Move the vertices to (vertex_count, 3) float32, object space, from our modifier onwards.

    Raises:
        HairloomError: the mesh is being edited, or has another attribute of this name.
    """
    attribute = mesh.attributes.get(POSITION)
    if attribute is None:
        attribute = mesh.attributes.new(POSITION, "FLOAT_VECTOR", "POINT")
    if attribute.data_type != "FLOAT_VECTOR" or len(attribute.data) != len(positions):
        raise HairloomError(
            f"its attribute '{POSITION}' does not hold {len(positions):,} vectors",
            place=mesh.name,
            remedy="Leave Edit Mode, or rename that attribute",
        )
    attribute.data.foreach_set("vector", np.ascontiguousarray(positions, np.float32).ravel())
    mesh.update_tag()


def clear(mesh: bpy.types.Mesh) -> None:
    """Remove the simulated frame; the mesh is then bit for bit what it was before."""
    attribute = mesh.attributes.get(POSITION)
    if attribute is not None:
        mesh.attributes.remove(attribute)
        mesh.update_tag()


def read_carried(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Floats:
    """The vertices as they enter our modifier, (vertex_count, 3) float32, object space.

    Raises:
        HairloomError: the modifier is missing or off, or modifiers above or below it change the
            number or the order of vertices.
    """
    mesh = obj.evaluated_get(depsgraph).data
    carried, index = mesh.attributes.get(CARRIED), mesh.attributes.get(INDEX)
    if carried is None or index is None or not len(index.data):
        raise _not_evaluated(obj)
    count = len(obj.data.vertices)
    order = np.empty(len(index.data), np.int32)
    index.data.foreach_get("value", order)
    if order.max() + 1 != count:
        raise HairloomError(
            f"a modifier above {NAME} makes {order.max() + 1:,} vertices of {count:,}"
            f"{_suspect_modifiers(obj, above=True)}",
            place=obj.name,
            remedy=f"Move it below {NAME}, or apply it",
        )
    if not np.array_equal(order[:count], np.arange(count)):
        raise HairloomError(
            f"a modifier below {NAME} changes the order of the "
            f"vertices{_suspect_modifiers(obj, above=False)}",
            place=obj.name,
            remedy="Turn it off while simulating, or apply it",
        )
    positions = np.empty((len(order), 3), np.float32)
    carried.data.foreach_get("vector", positions.ravel())
    return positions[:count]


def other_fin_with(mesh: bpy.types.Mesh, handle: Handle) -> bpy.types.Object | None:
    """Another fin with the same mesh, which would show the same motion."""
    if mesh.users < 2:
        return None
    others = (obj for obj in bpy.data.objects if obj.data == mesh)
    return next((o for o in others if o.session_uid != handle.uid and fin_modifier(o)), None)


def _not_evaluated(obj: bpy.types.Object) -> HairloomError:
    if fin_modifier(obj) is None:
        return HairloomError(
            f"it has no modifier {NAME}",
            place=obj.name,
            remedy="Press Make Cloth in its Physics tab",
        )
    return HairloomError(
        f"its modifier {NAME} is turned off, or the object hidden or edited",
        place=obj.name,
        remedy="Turn both on in the viewport, and leave Edit Mode",
    )


#: modifiers that create vertices
_GENERATE = frozenset(
    ("ARRAY", "BEVEL", "BOOLEAN", "BUILD", "DECIMATE", "EDGE_SPLIT", "MASK", "MIRROR", "MULTIRES")
    + ("NODES", "REMESH", "SCREW", "SKIN", "SOLIDIFY", "SUBSURF", "WELD", "WIREFRAME")
)


def _suspect_modifiers(obj: bpy.types.Object, *, above: bool) -> str:
    """The modifiers that may be the cause, for a message."""
    own = fin_modifier(obj)
    place = len(obj.modifiers) if own is None else list(obj.modifiers).index(own)
    stack = obj.modifiers[:place] if above else obj.modifiers[place + 1 :]
    names = [each.name for each in stack if each.show_viewport and each.type in _GENERATE]
    return f" ({', '.join(names)})" if names else ""


def _fill_node_tree(tree: bpy.types.NodeTree) -> None:
    names = (
        "NodeGroupInput",
        "GeometryNodeStoreNamedAttribute",
        "GeometryNodeStoreNamedAttribute",
        "GeometryNodeSetPosition",
        "NodeGroupOutput",
    )
    chain = [tree.nodes.new(name) for name in names]
    for place, (one, other) in enumerate(pairwise(chain)):
        one.location.x = place * 200.0
        tree.links.new(one.outputs["Geometry"], other.inputs["Geometry"])
    chain[-1].location.x = len(chain) * 200.0
    stores = (
        (chain[1], "FLOAT_VECTOR", CARRIED, "GeometryNodeInputPosition", "Position"),
        (chain[2], "INT", INDEX, "GeometryNodeInputIndex", "Index"),
    )
    for store, kind, attribute, source, socket in stores:
        store.data_type = kind
        store.inputs["Name"].default_value = attribute
        value = tree.nodes.new(source)
        value.location = (store.location.x, -250.0)
        tree.links.new(value.outputs[socket], store.inputs["Value"])
    simulated = tree.nodes.new("GeometryNodeInputNamedAttribute")
    simulated.location = (chain[3].location.x, -250.0)
    simulated.data_type = "FLOAT_VECTOR"
    simulated.inputs["Name"].default_value = POSITION
    tree.links.new(simulated.outputs["Exists"], chain[3].inputs["Selection"])
    tree.links.new(simulated.outputs["Attribute"], chain[3].inputs["Position"])
