"""The nodes that lay hair over Blender's own picture, in the compositor of the artist's scene."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

NAME = "Hairloom Hair"
IMAGE, HAIR, SHADOW, SHAFTS = "Image", "Hair", "Hair Shadow", "Hair Shafts"
STRENGTH = "Shadow Strength"
#: custom property of node trees that are ours: the group, and a compositor made for it
_KIND = "hairloom"
_LAYERS = "CompositorNodeRLayers"
#: distances of nodes beside and below the node of the picture [pixels]
_X_DISTANCE, _Y_DISTANCE = 340.0, 320.0


def link(scene: bpy.types.Scene, hair: bpy.types.Scene, layer: str) -> None:
    """Lay the hair over each Render Layers node of this view layer; makes a compositor if there is
    none."""
    tree = scene.compositing_node_group or _new_compositor(scene)
    for node in [each for each in _render_layers(tree, scene) if each.layer == layer]:
        hair_layers = tree.nodes.new(_LAYERS)
        hair_layers.scene = hair
        hair_layers.location = node.location.x, node.location.y - _Y_DISTANCE
        group = tree.nodes.new("CompositorNodeGroup")
        group.node_tree = _hair_group()
        group.location = node.location.x + _X_DISTANCE, node.location.y
        picture = node.outputs[IMAGE]
        for old in list(picture.links):
            tree.links.new(group.outputs[IMAGE], old.to_socket)
        tree.links.new(picture, group.inputs[IMAGE])
        tree.links.new(hair_layers.outputs[IMAGE], group.inputs[HAIR])
        for name in (SHADOW, SHAFTS):
            if name in group.inputs:  # a group of an older file has no input for shafts
                tree.links.new(hair_layers.outputs[name], group.inputs[name])


def unlink(scene: bpy.types.Scene, hair: bpy.types.Scene | None) -> None:
    """Link the picture to where it was linked before, and remove our nodes, except those of another
    scene with the same compositor."""
    tree = scene.compositing_node_group
    if tree is None:
        return
    for group in [each for each in _hair_groups(tree) if _composites(each, hair)]:
        sources = [each.from_socket for each in group.inputs[IMAGE].links]
        for old in list(group.outputs[IMAGE].links):
            if sources:
                tree.links.new(sources[0], old.to_socket)
        tree.nodes.remove(group)
    for node in list(_render_layers(tree, hair)):
        tree.nodes.remove(node)
    if tree.get(_KIND) == "compositor" and tree.users <= 1 and len(tree.nodes) == 2:
        scene.compositing_node_group = None
        bpy.data.node_groups.remove(tree)
    group_tree = _existing_group()
    if group_tree is not None and not group_tree.users:
        bpy.data.node_groups.remove(group_tree)


def is_linked(scene: bpy.types.Scene, hair: bpy.types.Scene) -> bool:
    """Whether the compositor has a Render Layers node of the hair and uses it."""
    tree = scene.compositing_node_group
    if tree is None or not any(_render_layers(tree, hair)):
        return False
    groups = (group for group in _hair_groups(tree) if not group.mute)
    return any(group.inputs[HAIR].is_linked and _composites(group, hair) for group in groups)


def _render_layers(tree: Any, scene: bpy.types.Scene | None) -> Iterator[Any]:
    """The Render Layers nodes of a scene; None: nodes without a scene, as it was removed."""
    return (each for each in tree.nodes if each.bl_idname == _LAYERS and each.scene == scene)


def _hair_groups(tree: Any) -> Iterator[Any]:
    group = _existing_group()
    return (
        each
        for each in tree.nodes
        if each.bl_idname == "CompositorNodeGroup" and group and each.node_tree == group
    )


def _composites(group: Any, hair: bpy.types.Scene | None) -> bool:
    """Whether a group lays the hair of this scene, or of no scene, over a picture."""
    scenes, visited = set(), set()
    nodes = [link.from_node for link in group.inputs[HAIR].links]
    while nodes:
        node = nodes.pop()
        if node.bl_idname == _LAYERS:
            scenes.add(node.scene)
        elif node.name not in visited:  # a node of the artist's, such as a blur
            visited.add(node.name)
            nodes += [link.from_node for each in node.inputs for link in each.links]
    return not scenes or hair in scenes


def _new_compositor(scene: bpy.types.Scene) -> Any:
    """A compositor that outputs the picture as rendered, as Blender does without one."""
    tree = bpy.data.node_groups.new(f"{scene.name} Compositing", "CompositorNodeTree")
    tree[_KIND] = "compositor"
    tree.interface.new_socket(IMAGE, in_out="OUTPUT", socket_type="NodeSocketColor")
    picture, output = tree.nodes.new(_LAYERS), tree.nodes.new("NodeGroupOutput")
    picture.scene = scene
    output.location.x = 2.0 * _X_DISTANCE
    tree.links.new(picture.outputs[IMAGE], output.inputs[0])
    scene.compositing_node_group = tree
    return tree


def _existing_group() -> Any:
    return next((each for each in bpy.data.node_groups if each.get(_KIND) == "hair"), None)


def _hair_group() -> Any:
    """The node group: picture times shadow, then hair over it, plus shafts of light."""
    tree = _existing_group()
    if tree is not None:
        return tree
    tree = bpy.data.node_groups.new(NAME, "CompositorNodeTree")
    tree[_KIND] = "hair"
    sockets = tree.interface
    sockets.new_socket(IMAGE, in_out="OUTPUT", socket_type="NodeSocketColor")
    for name, color in (
        *((IMAGE, (0, 0, 0, 1)), (HAIR, (0, 0, 0, 0))),
        *((SHADOW, (1, 1, 1, 1)), (SHAFTS, (0, 0, 0, 1))),
    ):
        socket = sockets.new_socket(name, in_out="INPUT", socket_type="NodeSocketColor")
        socket.default_value = color
    strength = sockets.new_socket(STRENGTH, in_out="INPUT", socket_type="NodeSocketFloat")
    strength.subtype, strength.default_value = "FACTOR", 1.0
    strength.min_value, strength.max_value = 0.0, 1.0
    inputs, output = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    shaded, over = tree.nodes.new("ShaderNodeMix"), tree.nodes.new("CompositorNodeAlphaOver")
    added = tree.nodes.new("ShaderNodeMix")
    for node, blend in ((shaded, "MULTIPLY"), (added, "ADD")):
        node.data_type, node.blend_type, node.clamp_factor = "RGBA", blend, False
    added.inputs[0].default_value = 1.0
    for number, node in enumerate((inputs, shaded, over, added, output)):
        node.location.x = 220.0 * number
    pairs = (
        (inputs.outputs[STRENGTH], shaded.inputs[0]),
        (inputs.outputs[IMAGE], _color_socket(shaded.inputs, 0)),
        (inputs.outputs[SHADOW], _color_socket(shaded.inputs, 1)),
        (_color_socket(shaded.outputs, 0), over.inputs["Background"]),
        (inputs.outputs[HAIR], over.inputs["Foreground"]),
        (over.outputs[0], _color_socket(added.inputs, 0)),
        (inputs.outputs[SHAFTS], _color_socket(added.inputs, 1)),
        (_color_socket(added.outputs, 0), output.inputs[0]),
    )
    for source, target in pairs:
        tree.links.new(source, target)
    return tree


def _color_socket(sockets: Any, number: int) -> Any:
    """A colour's socket by number: those of a Mix node have the same names for all data types."""
    return [each for each in sockets if each.type == "RGBA"][number]
