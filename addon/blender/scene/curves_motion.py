"""Motion of imported hair curves: one attribute per frame, and a modifier that shows the scene's.

So the file depends on no other file, and curves move without Hairloom too.
"""

from __future__ import annotations

import bpy

from ...arrays import Floats
from ..base.attributes import set_attribute
from ..base.node_groups import own_node_group

#: name of the modifier and of its node group
NAME = "Hairloom Motion"
#: prefix of the attributes; the number of the frame follows
PREFIX = "motion_"
_FIRST, _LAST = "First Frame", "Last Frame"
_MARK, _VERSION = "hairloom_curves_motion", 2


def store_motion(hair: bpy.types.Object, first: int, positions: Floats) -> None:
    """Store a motion on hair curves, with the modifier that shows it.

    Args:
        first: the scene frame of the first positions.
        positions: (frames, point_count, 3) [m] object space.
    """
    for frame, points in enumerate(positions, first):
        set_attribute(hair.data, f"{PREFIX}{frame}", "POINT", points)
    modifier = hair.modifiers.new(NAME, "NODES")
    modifier.node_group = nodes = own_node_group(NAME, _MARK, _VERSION, _fill_node_tree)
    for socket, value in ((_FIRST, first), (_LAST, first + len(positions) - 1)):
        identifier = nodes.interface.items_tree[socket].identifier
        getattr(modifier.properties.inputs, identifier).value = value


def _fill_node_tree(tree: bpy.types.NodeTree) -> None:
    """Nodes that interpolate linearly between frames, and hold the first and the last frame."""
    new_socket, new, link = tree.interface.new_socket, tree.nodes.new, tree.links.new
    for name in (_FIRST, _LAST):
        new_socket(name, in_out="INPUT", socket_type="NodeSocketInt")
    begin, end, time = (
        new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeInputSceneTime")
    )
    clamped, part, mix = new("ShaderNodeClamp"), new("ShaderNodeMath"), new("ShaderNodeMix")
    whole, following = _rounding_node(tree, "FLOOR"), _rounding_node(tree, "CEILING")
    place = new("GeometryNodeSetPosition")
    part.operation = "FRACT"
    link(time.outputs["Frame"], clamped.inputs["Value"])
    link(begin.outputs[_FIRST], clamped.inputs["Min"])
    link(begin.outputs[_LAST], clamped.inputs["Max"])
    for each in (part, whole, following):
        link(clamped.outputs[0], each.inputs[0])
    mix.data_type = "VECTOR"
    near, far = _frame_attribute_node(tree, whole), _frame_attribute_node(tree, following)
    link(part.outputs[0], mix.inputs["Factor"])
    for value, socket in ((near, "A"), (far, "B")):
        own = next(each for each in mix.inputs if each.name == socket and each.type == "VECTOR")
        link(value.outputs["Attribute"], own)
    result = next(each for each in mix.outputs if each.type == "VECTOR")
    link(result, place.inputs["Position"])
    link(near.outputs["Exists"], place.inputs["Selection"])
    link(begin.outputs["Geometry"], place.inputs["Geometry"])
    link(place.outputs["Geometry"], end.inputs["Geometry"])
    rows = ((begin, time), (clamped,), (whole, following, part), (near, far), (mix,), (place,))
    for across, nodes in enumerate((*rows, (end,))):
        for down, node in enumerate(nodes):
            node.location = 220.0 * across, -220.0 * down


def _rounding_node(tree: bpy.types.NodeTree, mode: str) -> bpy.types.Node:
    """A node that rounds to an integer: as floats, frames between -1 and 0 would be rounded up to
    -0, and "-0" names no attribute."""
    node = tree.nodes.new("FunctionNodeFloatToInt")
    node.rounding_mode = mode
    return node


def _frame_attribute_node(tree: bpy.types.NodeTree, frame: bpy.types.Node) -> bpy.types.Node:
    """The node that reads the attribute of an integer frame."""
    new, link = tree.nodes.new, tree.links.new
    text, name, attribute = (
        new("FunctionNodeValueToString"),
        new("GeometryNodeStringJoin"),
        new("GeometryNodeInputNamedAttribute"),
    )
    prefix = new("FunctionNodeInputString")
    prefix.string, text.data_type = PREFIX, "INT"
    attribute.data_type = "FLOAT_VECTOR"
    link(frame.outputs[0], text.inputs["Value"])
    link(text.outputs[0], name.inputs["Strings"])
    link(prefix.outputs[0], name.inputs["Strings"])  # what is linked last comes first
    link(name.outputs[0], attribute.inputs["Name"])
    return attribute
