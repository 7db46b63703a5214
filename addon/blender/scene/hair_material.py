"""A material for Blender's own engines that shades hair as a look does.

One Principled Hair node shapes the highlights. It has no inputs for the tint of the tips and the
differences between strands, which are nodes before its colour.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

from ...arrays import Floats
from ...shading.drawn_strands import look_color
from ...shading.marschner.look import GREY_ABSORPTION, root_absorption, tip_absorption
from ...shading.marschner.pigment import color_exponent
from ...shading.marschner.principled import PrincipledHair, hair_from
from ...shading.settings import ShadingSettings
from ..base.attributes import read_attribute, set_attribute
from ..base.digests import digest
from .curves import COLOR_ATTRIBUTE
from .principled import INPUTS

#: Attribute from which the material reads the curves' colours: Cycles takes "color" for that of a
#: volume, and reads black (Blender 5.2).
MATERIAL_COLOR = "hair_color"
#: property that marks a material of ours
_MARK = "hairloom_look"
#: properties with digests of its look and of the nodes that were made for it
_LOOK_DIGEST, _NODES_DIGEST = "hairloom_look_settings", "hairloom_look_nodes"
_COLUMN_WIDTH, _ROW_HEIGHT = 190.0, 180.0


def has_look_material(curves: bpy.types.Curves) -> bool:
    """Whether hair curves have a material that `set_look_material` would overwrite."""
    return look_material(curves) is not None


def set_look_material(
    curves: bpy.types.Curves,
    shading: ShadingSettings,
    *,
    has_final_colors: bool = False,
    painted: Floats | None = None,
) -> tuple[bpy.types.Material, tuple[str, ...]]:
    """Give hair curves the material of a look; their material of an earlier look is overwritten.

    A material of the artist's own is not changed: ours replaces it in the first slot.

    Args:
        has_final_colors: whether the curves' own colours include the look's effects on colour.
        painted: (curve_count, 4), see `painted_colors.colors_of_curves`, instead of their own.

    Returns:
        the material, and notes on what it lacks of the look.
    """
    has_colors = set_material_colors(curves, shading, painted)
    slots, material = curves.materials, _single_user_material(curves)
    if material is None:
        material = bpy.data.materials.new(f"{curves.name} Look")
        material[_MARK] = True
        if len(slots):
            slots[0] = material
        else:
            slots.append(material)
    notes = _write(material, shading, has_colors=has_colors, has_final_colors=has_final_colors)
    if not has_final_colors:
        material[_LOOK_DIGEST] = digest(shading, size=8)
        material[_NODES_DIGEST] = digest(_nodes(material), size=8)
    return material, notes


def set_material_colors(
    curves: bpy.types.Curves, shading: ShadingSettings, painted: Floats | None
) -> bool:
    """Give hair curves the colours that their material reads, as `set_look_material` does; returns
    whether they have any."""
    if painted is not None:
        set_attribute(curves, MATERIAL_COLOR, "CURVE", painted)
        return True
    has_own = COLOR_ATTRIBUTE in curves.attributes and bool(
        shading.color_source == "own" or shading.color_map
    )
    if has_own:
        _copy_colors(curves)
    return has_own


def has_unchanged_nodes(material: bpy.types.Material) -> bool:
    """Whether its nodes have not been changed since it was made from a look."""
    return bool(material.get(_NODES_DIGEST) == digest(_nodes(material), size=8))


def is_outdated(material: bpy.types.Material, look: ShadingSettings) -> bool:
    """Whether it was made from another look and its nodes have not been changed since; with changed
    nodes it is the artist's own."""
    stored = material.get(_LOOK_DIGEST)
    return stored not in (None, digest(look, size=8)) and has_unchanged_nodes(material)


def _nodes(material: bpy.types.Material) -> list[object]:
    """Everything about the nodes that an artist can change, except their places."""
    state: list[object] = []
    for node in material.node_tree.nodes:
        state.append((node.bl_idname, getattr(node, "parametrization", ""), node.mute))
        for socket in node.inputs:
            value = getattr(socket, "default_value", None)
            state.append(value if isinstance(value, float | int | str) else repr(_as_floats(value)))
    for link in material.node_tree.links:
        ends = (link.from_node.name, link.from_socket.identifier)
        state.append((*ends, link.to_node.name, link.to_socket.identifier))
    return state


def _as_floats(value: Any) -> list[float]:
    return [float(each) for each in value] if hasattr(value, "__len__") else []


def look_material(curves: bpy.types.Curves) -> bpy.types.Material | None:
    """The material of a look that the curves have, if it can be edited."""
    materials = (each for each in curves.materials if each is not None and _MARK in each)
    return next((each for each in materials if each.is_editable), None)


def _single_user_material(curves: bpy.types.Curves) -> bpy.types.Material | None:
    """As `look_material`, but a copy for these curves if others use it too, such as those of a
    duplicate, which may have another look. Copies that show their bake in renders share it."""
    material = look_material(curves)
    if material is None or material.users - material.use_fake_user == 1:
        return material
    users = bpy.data.user_map(subset=[material])[material]
    baked = {
        obj.hairloom.bake.copy.data
        for obj in bpy.data.objects
        if obj.data == curves and obj.hairloom.bake.copy is not None
    }
    if users <= {curves, *baked}:
        return material
    copy = material.copy()
    for each in (curves, *baked):
        for number, other in enumerate(each.materials):
            if other == material:
                each.materials[number] = copy
    return copy


def _copy_colors(curves: bpy.types.Curves) -> None:
    for domain in ("POINT", "CURVE"):
        colors = read_attribute(curves, COLOR_ATTRIBUTE, domain, 4)
        if colors is not None:
            set_attribute(curves, MATERIAL_COLOR, domain, colors)


def _write(
    material: bpy.types.Material,
    shading: ShadingSettings,
    *,
    has_colors: bool,
    has_final_colors: bool,
) -> tuple[str, ...]:
    hair, notes = hair_from(shading)
    nodes = _Nodes(material.node_tree)
    node = nodes.hair(hair)
    # for Workbench and the Solid view
    material.diffuse_color = (*hair.color, 1.0)
    material.roughness = hair.roughness
    if has_colors:
        node.parametrization = "COLOR"
        nodes.link(
            nodes.curve_color(hair, shading, has_final_colors=has_final_colors),
            node.inputs["Color"],
        )
        is_changed = shading.tip_tint > 0.0 or shading.grey_fraction > 0.0
        if is_changed and not has_final_colors:
            notes += (
                "Tip Tint and Grey Strands are left out for strands with colours of their own",
            )
    elif _needs_absorption_nodes(shading, hair):
        node.parametrization = "ABSORPTION"
        nodes.link(nodes.absorption(shading), node.inputs["Absorption Coefficient"])
    return notes


def _needs_absorption_nodes(shading: ShadingSettings, hair: PrincipledHair) -> bool:
    """Whether colour varies between strands or along them in ways the node has no input for."""
    has_own_variation = shading.color_variation > 0.0 and hair.parametrization != "MELANIN"
    return has_own_variation or shading.tip_tint > 0.0 or shading.grey_fraction > 0.0


@dataclass
class _Nodes:
    """Fills an empty node tree, right to left."""

    tree: bpy.types.NodeTree
    column: int = 0

    def __post_init__(self) -> None:
        self.tree.nodes.clear()

    def add(self, kind: str, **values: Any) -> bpy.types.Node:
        node = self.tree.nodes.new(kind)
        node.location = -_COLUMN_WIDTH * self.column, -_ROW_HEIGHT * (self.column % 2)
        self.column += 1
        for name, value in values.items():
            setattr(node, name, value)
        return node

    def link(self, source: bpy.types.NodeSocket, target: bpy.types.NodeSocket) -> None:
        self.tree.links.new(source, target)

    def set_input(self, socket: bpy.types.NodeSocket, value: Any) -> None:
        """Set an input to a number or a colour, or link it to an output."""
        if isinstance(value, bpy.types.NodeSocket):
            self.link(value, socket)
        else:
            socket.default_value = value

    def hair(self, hair: PrincipledHair) -> bpy.types.Node:
        """The Principled Hair node with these inputs, linked to the material's output."""
        output = self.add("ShaderNodeOutputMaterial")
        node = self.add(
            "ShaderNodeBsdfHairPrincipled", model=hair.model, parametrization=hair.parametrization
        )
        for socket in node.inputs:
            if socket.name in INPUTS:
                value = getattr(hair, INPUTS[socket.name])
                is_color = socket.type == "RGBA"
                socket.default_value = (*value, 1.0) if is_color else value
        self.link(node.outputs[0], output.inputs["Surface"])
        return node

    def curve_color(
        self, hair: PrincipledHair, shading: ShadingSettings, *, has_final_colors: bool
    ) -> bpy.types.NodeSocket:
        """The curves' colours for this node. Colour is exp(-c sqrt(absorption)), so that a factor
        on absorption becomes an exponent of colour."""
        color = self.add("ShaderNodeAttribute", attribute_name=MATERIAL_COLOR).outputs["Color"]
        exponent: Any = color_exponent(hair.azimuthal_roughness)
        if not has_final_colors:
            color = self._with_look_color(color, tuple(look_color(shading).tolist()))
            if shading.color_variation > 0.0:
                root = self._math("POWER", self._variation(shading), 0.5)
                exponent = self._math("MULTIPLY", root, exponent)
        if exponent == 1.0:
            return color
        gamma = self.add("ShaderNodeGamma")
        self.set_input(gamma.inputs["Color"], color)
        self.set_input(gamma.inputs["Gamma"], exponent)
        return gamma.outputs["Color"]

    def absorption(self, shading: ShadingSettings) -> bpy.types.NodeSocket:
        """`marschner.look.strand_absorption` as nodes."""
        value: Any = tuple(root_absorption(shading).tolist())
        if shading.tip_tint > 0.0:
            tip = tuple(tip_absorption(shading).tolist())
            value = self._mix(self._tip_fraction(shading), value, tip)
        if shading.grey_fraction > 0.0:
            third = (1.0 / 3.0,) * 3
            mean = self._vector("DOT_PRODUCT", value, third).outputs["Value"]
            grey = self._vector("SCALE", (GREY_ABSORPTION,) * 3, mean).outputs["Vector"]
            value = self._mix(self._is_grey(shading), value, grey)
        amount = self._variation(shading)
        return self._vector("SCALE", value, amount).outputs["Vector"]

    def _with_look_color(
        self, color: bpy.types.NodeSocket, look: tuple[float, ...]
    ) -> bpy.types.NodeSocket:
        """The colour, replaced by the look's for curves without one, which have -1."""
        red = self.add("ShaderNodeSeparateColor")
        self.set_input(red.inputs["Color"], color)
        is_own = self._math("GREATER_THAN", red.outputs["Red"], -0.5)
        mix = self.add("ShaderNodeMix", data_type="RGBA")
        for name, value in (("Factor", is_own), ("A", (*look, 1.0)), ("B", color)):
            self.set_input(_socket(mix, name), value)
        return _output(mix)

    def _variation(self, shading: ShadingSettings) -> bpy.types.NodeSocket:
        """1 + v (1 - 2 n): each strand's factor on absorption."""
        amount = shading.color_variation
        return self._range(self._strand("Random"), 0.0, 1.0, 1.0 + amount, 1.0 - amount)

    def _is_grey(self, shading: ShadingSettings) -> bpy.types.NodeSocket:
        other = self.add("ShaderNodeTexWhiteNoise", noise_dimensions="1D")
        self.set_input(other.inputs["W"], self._strand("Random"))
        return self._math("LESS_THAN", other.outputs["Value"], shading.grey_fraction)

    def _tip_fraction(self, shading: ShadingSettings) -> bpy.types.NodeSocket:
        start, end = shading.tint_start, shading.tint_end
        intercept = self._strand("Intercept")
        return self._range(intercept, start, end, 0.0, shading.tip_tint, "SMOOTHSTEP")

    def _strand(self, name: str) -> bpy.types.NodeSocket:
        return self.add("ShaderNodeHairInfo").outputs[name]

    def _range(
        self,
        value: Any,
        low: float,
        high: float,
        to_low: float,
        to_high: float,
        interpolation: str = "LINEAR",
    ) -> bpy.types.NodeSocket:
        node = self.add("ShaderNodeMapRange", interpolation_type=interpolation)
        for name, number in (
            ("Value", value),
            ("From Min", low),
            ("From Max", max(high, low + 1e-4)),
            ("To Min", to_low),
            ("To Max", to_high),
        ):
            self.set_input(node.inputs[name], number)
        return node.outputs["Result"]

    def _math(self, operation: str, one: Any, other: Any) -> bpy.types.NodeSocket:
        node = self.add("ShaderNodeMath", operation=operation)
        self.set_input(node.inputs[0], one)
        self.set_input(node.inputs[1], other)
        return node.outputs["Value"]

    def _vector(self, operation: str, one: Any, other: Any) -> bpy.types.Node:
        node = self.add("ShaderNodeVectorMath", operation=operation)
        self.set_input(node.inputs[0], one)
        self.set_input(node.inputs["Scale"] if operation == "SCALE" else node.inputs[1], other)
        return node

    def _mix(self, factor: Any, one: Any, other: Any) -> bpy.types.NodeSocket:
        node = self.add("ShaderNodeMix", data_type="VECTOR")
        for name, value in (("Factor", factor), ("A", one), ("B", other)):
            self.set_input(_socket(node, name), value)
        return _output(node)


def _socket(mix: bpy.types.Node, name: str) -> bpy.types.NodeSocket:
    """The enabled socket of this name; a Mix node has one for each type of data."""
    return next(each for each in mix.inputs if each.name == name and each.enabled)


def _output(mix: bpy.types.Node) -> bpy.types.NodeSocket:
    return next(each for each in mix.outputs if each.enabled)
