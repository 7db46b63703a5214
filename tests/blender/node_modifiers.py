"""Geometry nodes modifiers, added as an artist adds them."""

import bpy


def add_nodes_modifier(obj, *nodes):
    """Add a geometry nodes modifier that passes the curves through these nodes in turn."""
    tree = bpy.data.node_groups.new("Nodes", "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    source = tree.nodes.new("NodeGroupInput").outputs[0]
    for kind, inputs in nodes:
        node = tree.nodes.new(kind)
        for name, value in inputs.items():
            node.inputs[name].default_value = value
        tree.links.new(source, node.inputs[0])
        source = node.outputs[0]
    tree.links.new(source, tree.nodes.new("NodeGroupOutput").inputs[0])
    obj.modifiers.new("Nodes", "NODES").node_group = tree


def hair_dynamics_mode(modifier):
    """The input "Mode" of a modifier that uses Blender's Hair Dynamics."""
    sockets = modifier.node_group.interface.items_tree
    (mode,) = (each for each in sockets if each.item_type == "SOCKET" and each.name == "Mode")
    return getattr(modifier.properties.inputs, mode.identifier)
