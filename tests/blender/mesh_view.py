"""Dumps an FBX or OBJ file as JSON, read by ufbx, an independent reader.

Run in a separate process:

    python mesh_view.py FILE RESULT.json

For each mesh, in the order of its faces: the corners' positions in the file's space, normals, UV
sets with tangents and bitangents, and colour sets.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import ufbx


def main(path: str, output: str) -> None:
    scene = ufbx.load_file(path)
    # fetched once and kept: the binding frees objects as soon as nothing refers to them
    nodes, materials = list(scene.nodes), list(scene.materials)
    settings, attributes = scene.settings, [node.attrib for node in nodes]
    transforms = [node.local_transform for node in nodes]
    textures = [list(material.textures) for material in materials]
    content: dict[str, Any] = {
        "up": int(settings.axes.up),
        "unit_meters": settings.unit_meters,
        "nodes": {
            node.name: type(attribute).__name__
            for node, attribute in zip(nodes, attributes, strict=True)
            if attribute
        },
        "scales": [list(transform.scale) for transform in transforms],
        "turns": [list(transform.rotation) for transform in transforms],
        "meshes": {
            node.name: mesh_of(attribute)
            for node, attribute in zip(nodes, attributes, strict=True)
            if isinstance(attribute, ufbx.Mesh)
        },
        "textures": {
            each.material_prop: each.texture.relative_filename
            for of_material in textures
            for each in of_material
        },
    }
    with open(output, "w", encoding="utf-8") as file:
        json.dump(content, file)


def mesh_of(mesh: Any) -> dict[str, Any]:
    corners = range(mesh.num_indices)
    layers, colors = list(mesh.uv_sets), list(mesh.color_sets)
    tangents = [layer.vertex_tangent for layer in layers]
    bitangents = [layer.vertex_bitangent for layer in layers]
    return {
        "sizes": [face.num_indices for face in list(mesh.faces)],
        "vertices": mesh.num_vertices,
        "position": per_corner(mesh.vertex_position, corners),
        "normal": per_corner(mesh.vertex_normal, corners),
        "uv": [per_corner(layer.vertex_uv, corners) for layer in layers],
        "tangent": [per_corner(each, corners) for each in tangents if each.exists],
        "bitangent": [per_corner(each, corners) for each in bitangents if each.exists],
        "color": [per_corner(layer.vertex_color, corners) for layer in colors],
    }


def per_corner(attribute: Any, corners: range) -> list[list[float]]:
    values, indices = attribute.values, attribute.indices
    return [list(values[indices[corner]]) for corner in corners]


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
