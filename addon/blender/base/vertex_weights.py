"""Weights and colours that are painted or computed on a mesh or on hair curves, by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import bpy
import numpy as np

from ...arrays import Floats, Ints, means_by
from ...errors import HairloomError
from ...shading.luminance import LUMINANCE
from .attributes import read_attribute
from .mesh_arrays import triangle_corners, triangle_polygons, triangle_vertices
from .objects import as_mesh

#: Attributes that may be painted; colours count by their luminance.
_NUMBERS, _COLORS = ("FLOAT", "BOOLEAN"), ("FLOAT_COLOR", "BYTE_COLOR")
_DOMAINS = ("POINT", "CORNER", "FACE", "CURVE")
#: Prefixes of Blender's own attributes, which nobody paints; and types of images without pixels.
_BUILT_IN_PREFIXES, _NO_IMAGES = ("sharp_", "radius"), ("RENDER_RESULT", "COMPOSITING")


def weight_names(obj: bpy.types.Object) -> list[str]:
    """The names that `read_weights` accepts for this mesh object before its modifiers: vertex
    groups, then attributes."""
    return [group.name for group in obj.vertex_groups] + attribute_names(obj.data)


def attribute_names(data: bpy.types.Mesh | bpy.types.Curves) -> list[str]:
    """The attributes of a mesh or of curves that are numbers or colours."""
    return [
        attribute.name
        for attribute in data.attributes
        if _is_weight(attribute) and not attribute.name.startswith((".", *_BUILT_IN_PREFIXES))
    ]


def image_names() -> list[str]:
    return [each.name for each in bpy.data.images if each.type not in _NO_IMAGES]


def mask_choices(hair: bpy.types.Object | None, surface: bpy.types.Object | None) -> list[str]:
    """The names of everything that can be a mask for a hair setting, each once."""
    names: list[str] = []
    if surface is not None and surface.type == "MESH":
        names += weight_names(surface)
    if hair is not None:
        names += attribute_names(hair.data)
    return list(dict.fromkeys([*names, *image_names()]))


def color_choices(surface: bpy.types.Object | None) -> list[str]:
    """The names of everything that can colour hair: colours of its surface, and images."""
    names: list[str] = []
    if surface is not None and surface.type == "MESH":
        names += color_names(surface.data)
    return list(dict.fromkeys([*names, *image_names()]))


def color_names(data: bpy.types.Mesh) -> list[str]:
    """The attributes of a mesh that are colours."""
    return [each.name for each in data.attributes if is_color(each)]


def is_color(attribute: bpy.types.Attribute) -> bool:
    return attribute.domain in _DOMAINS and attribute.data_type in _COLORS


def read_weights(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, name: str) -> Floats:
    """Weight of each vertex of the evaluated mesh, (vertex_count,) float32.

    A vertex group gives 0 to 1, and 0 for vertices outside it; an attribute gives its values,
    averaged around each vertex if it is not on points. A group goes before an attribute of the
    same name.

    Raises:
        HairloomError: not a mesh, or neither a group nor such an attribute of this name.
    """
    if obj.type != "MESH":
        raise HairloomError(
            f"it is a {obj.type.lower()} object, so it has no vertex groups",
            place=obj.name,
            remedy="Choose a mesh object",
        )
    with as_mesh(obj, depsgraph) as mesh:
        assert mesh is not None
        values, domain = weights_on(obj, mesh, name)
        if domain == "POINT":
            return values
        corners, triangles = at_corners(mesh, values, domain), triangle_vertices(mesh)
        count = len(mesh.vertices)
    return means_by(triangles.ravel(), corners.ravel(), count).astype(np.float32)


def has_weights(obj: bpy.types.Object, mesh: bpy.types.Mesh, name: str) -> bool:
    """Whether `weights_on` finds this name."""
    attribute = mesh.attributes.get(name)
    return name in obj.vertex_groups or (attribute is not None and _is_weight(attribute))


def weights_on(obj: bpy.types.Object, mesh: bpy.types.Mesh, name: str) -> tuple[Floats, str]:
    """The weights on a mesh of this object, before or after its modifiers, (n,) float32, and the
    domain of the n elements.

    Raises:
        HairloomError: as `read_weights`.
    """
    group = obj.vertex_groups.get(name)
    if group is not None:
        return VertexGroupWeights.of(mesh).weights(group.index), "POINT"
    found = painted_attribute(mesh, name)
    if found is None:
        raise missing_weights(obj, name, mesh.attributes.get(name))
    return found


def painted_attribute(
    data: bpy.types.Mesh | bpy.types.Curves, name: str
) -> tuple[Floats, str] | None:
    """The numbers of an attribute, float32, and its domain; None where it is missing or holds
    neither numbers nor colours."""
    attribute = data.attributes.get(name)
    if attribute is None or not _is_weight(attribute):
        return None
    values = read_attribute(data, name, attribute.domain, None)
    if values.ndim > 1:
        values = values[:, :3] @ LUMINANCE
    return values.astype(np.float32), str(attribute.domain)


def at_corners(mesh: bpy.types.Mesh, values: Floats, domain: str) -> Floats:
    """Values at the corners of the mesh's triangles, (triangle_count, 3)."""
    if domain == "POINT":
        return values[triangle_vertices(mesh)]
    if domain == "CORNER":
        return values[triangle_corners(mesh)]
    return np.repeat(values[triangle_polygons(mesh)][:, None], 3, axis=1)


def set_vertex_group(obj: bpy.types.Object, name: str, weights: Floats) -> None:
    """Assign weights, (vertex_count,), to a vertex group in 255 steps; weights of 0 are skipped."""
    group = obj.vertex_groups.get(name) or obj.vertex_groups.new(name=name)
    steps = np.round(255.0 * weights).astype(np.int64)  # few calls for many vertices
    for step in np.unique(steps[steps > 0]):
        group.add(np.flatnonzero(steps == step).tolist(), float(step) / 255.0, "REPLACE")


@dataclass(frozen=True)
class VertexGroupWeights:
    """The weights of all vertices in all vertex groups, which take as long to read as one group.

    vertex, group: (n,). weight: (n,) float32. vertex_count: of the mesh.
    """

    vertex: Ints
    group: Ints
    weight: Floats
    vertex_count: int

    @classmethod
    def of(cls, mesh: bpy.types.Mesh) -> Self:
        counts: list[int] = []
        groups: list[int] = []
        weights: list[float] = []
        for vertex in mesh.vertices:  # Blender has no faster way to read group weights
            members = vertex.groups
            counts.append(len(members))
            for member in members:
                groups.append(member.group)
                weights.append(member.weight)
        vertex = np.repeat(np.arange(len(counts)), counts)
        return cls(vertex, np.array(groups, int), np.array(weights, np.float32), len(counts))

    def weights(self, index: int) -> Floats:
        """The weights in one group, (vertex_count,) float32; 0 for vertices outside it."""
        weights = np.zeros(self.vertex_count, np.float32)
        is_in = self.group == index
        weights[self.vertex[is_in]] = self.weight[is_in]
        return weights


def _is_weight(attribute: bpy.types.Attribute) -> bool:
    return attribute.domain in _DOMAINS and attribute.data_type in _NUMBERS + _COLORS


def missing_weights(
    obj: bpy.types.Object, name: str, attribute: bpy.types.Attribute | None
) -> HairloomError:
    """The error that a mesh has no weights of this name.

    Args:
        attribute: the attribute of this name that is of another kind; None: there is none.
    """
    if attribute is None:
        problem = f"it has neither a vertex group nor an attribute named '{name}'"
    else:
        problem = (
            f"its attribute '{name}' is {attribute.data_type} on {attribute.domain}, not a number "
            "or colour on points, corners or faces"
        )
    names = ", ".join(weight_names(obj)[:8])
    alternative = "Paint one (Weight Paint), or leave the field empty"
    remedy = f"Use one of: {names}" if names else alternative
    return HairloomError(problem, place=obj.name, remedy=remedy)
