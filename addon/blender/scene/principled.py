"""A material's Principled Hair BSDF, read as a starting point for a look."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

from ...errors import HairloomError
from ...params import Settings
from ...shading.marschner.principled import PrincipledHair, settings_from
from ...shading.settings import ShadingSettings

_NODE = "BSDF_HAIR_PRINCIPLED"
#: input of the node -> field of `PrincipledHair`; inputs that the node's options hide are not read
INPUTS = {
    "Color": "color",
    "Melanin": "melanin",
    "Melanin Redness": "melanin_redness",
    "Tint": "tint",
    "Absorption Coefficient": "absorption_coefficient",
    "Roughness": "roughness",
    "Radial Roughness": "radial_roughness",
    "Coat": "coat",
    "IOR": "ior",
    "Offset": "offset",
    "Random Color": "random_color",
    "Random Roughness": "random_roughness",
    "Aspect Ratio": "aspect_ratio",
    "Reflection": "reflection",
    "Transmission": "transmission",
    "Secondary Reflection": "secondary_reflection",
}


def has_principled_hair(hair: bpy.types.Object) -> bool:
    """Whether its material has such a node; fast enough for a panel."""
    material = hair.active_material
    return material is not None and _node_of(material) is not None


def look_from_material(
    hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph, base: ShadingSettings | None = None
) -> tuple[ShadingSettings, tuple[str, ...]]:
    """Settings that look like its material, and notes on what could not be read.

    Args:
        base: source of settings that have no equivalent in a material.

    Raises:
        HairloomError: there is no material with a Principled Hair.
    """
    material = hair.evaluated_get(depsgraph).active_material
    node = None if material is None else _node_of(material)
    if node is None:
        raise HairloomError(
            "its material has no Principled Hair BSDF",
            place=hair.name,
            remedy="Give the hair a material with that node, or choose a preset",
        )
    values, notes = _values(node)
    settings, more = settings_from(PrincipledHair(**values), base)
    if len({slot.material for slot in hair.material_slots} - {None}) > 1:
        more += (
            f"it has several materials; the look was taken from the active one, {material.name}",
        )
    return settings, (*notes, *more)


def look_from_named(name: str | None, base: Settings) -> tuple[ShadingSettings, tuple[str, ...]]:
    """`look_from_material` for a hair object of the open scene, by name.

    Raises:
        HairloomError: there is no such hair object, or see `look_from_material`.
    """
    hair = None if name is None else bpy.data.objects.get(name)
    if hair is None or hair.type != "CURVES":
        raise HairloomError(
            "there is no hair object of this name",
            place=f"--groom {name or ''}",
            remedy="Open a scene and name its hair curves with --groom",
        )
    assert isinstance(base, ShadingSettings)
    return look_from_material(hair, bpy.context.evaluated_depsgraph_get(), base)


def _node_of(material: bpy.types.Material) -> bpy.types.Node | None:
    """The node nearest to the output, through mix nodes and groups."""
    tree = material.node_tree
    output = None if tree is None else tree.get_output_node("ALL")
    if output is None:
        return None
    ends = [link.from_node for link in output.inputs["Surface"].links]
    return next((each for each in _upstream_nodes(ends, {tree}) if each.type == _NODE), None)


def _upstream_nodes(
    ends: list[bpy.types.Node], entered: set[bpy.types.NodeTree]
) -> Iterator[bpy.types.Node]:
    """These nodes and all nodes that feed them, nearest first, also those inside groups."""
    queue, visited = list(ends), set()
    while queue:
        node = queue.pop(0)
        if node in visited or node.mute:
            continue
        visited.add(node)
        yield node
        tree = node.node_tree if node.type == "GROUP" else None
        if tree is not None and tree not in entered:
            entered.add(tree)
            outputs = (each for each in tree.nodes if each.type == "GROUP_OUTPUT")
            yield from _upstream_nodes(
                [source for each in outputs for source in _linked_nodes(each)], entered
            )
        queue += _linked_nodes(node)


def _linked_nodes(node: bpy.types.Node) -> list[bpy.types.Node]:
    return [link.from_node for socket in node.inputs for link in socket.links]


def _values(node: bpy.types.Node) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The node's own values, and notes on inputs that other nodes drive."""
    values: dict[str, Any] = {"model": node.model, "parametrization": node.parametrization}
    notes = []
    for socket in node.inputs:
        if socket.name not in INPUTS or not socket.enabled:
            continue
        value = _constant(socket)
        if value is None:
            value = socket.default_value
            notes.append(f"{socket.name} comes from other nodes, so its own value was used")
        is_color = socket.type in ("RGBA", "VECTOR")
        values[INPUTS[socket.name]] = tuple(value)[:3] if is_color else float(value)
    return values, tuple(notes)


def _constant(socket: bpy.types.NodeSocket) -> Any:
    """The input's own value, or that of a linked Value or RGB node; else None."""
    if not socket.links:
        return socket.default_value
    source = socket.links[0].from_node
    return source.outputs[0].default_value if source.type in ("VALUE", "RGB") else None
