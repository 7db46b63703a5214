"""The bust as an object of Blender: its mesh, materials, vertex groups and UVs."""

from __future__ import annotations

from functools import lru_cache

import bpy
import numpy as np

from ...arrays import Floats
from ...exchange.textures.srgb import srgb_encoded
from ..base.vertex_weights import set_vertex_group
from .bust_data import HAIR_GROUPS, Bust, load_bust
from .bust_skin import (
    EYE_IOR,
    EYE_ROUGHNESS,
    RESOLUTION,
    SKIN_IOR,
    SKIN_ROUGHNESS,
    TONES,
    skin_picture,
)

#: fraction of light that scatters below the skin, and how far [m], in Cycles and EEVEE
_SUBSURFACE_WEIGHT, _SUBSURFACE_SCALE = 0.15, 0.004


def bust_object(name: str, tone: str | None) -> bpy.types.Object:
    """The bust around its origin, subdivided once by a modifier; it is in no collection yet.

    Args:
        tone: one of TONES; None leaves the materials out.
    """
    bust = load_bust()
    mesh = _mesh(name, bust)
    obj = bpy.data.objects.new(name, mesh)
    for group in HAIR_GROUPS:
        set_vertex_group(obj, group, bust.weights[group])
    modifier = obj.modifiers.new("Smooth", "SUBSURF")
    modifier.levels = modifier.render_levels = 1
    # the picture is painted for the UV map without smoothing
    modifier.uv_smooth = "NONE"
    if tone is not None:
        picture = _picture(tone)
        for kind in (
            _material("Hairloom Skin", picture, tone, SKIN_ROUGHNESS, SKIN_IOR, _SUBSURFACE_WEIGHT),
            _material("Hairloom Eyes", picture, tone, EYE_ROUGHNESS, EYE_IOR, 0.0),
        ):
            mesh.materials.append(kind)
    return obj


def _mesh(name: str, bust: Bust) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(name)
    polygons = np.split(bust.corner_vertex, np.cumsum(bust.sizes)[:-1])
    mesh.from_pydata(bust.positions.tolist(), [], [polygon.tolist() for polygon in polygons])
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", bust.uv[bust.corner_uv].ravel())
    mesh.polygons.foreach_set("material_index", bust.material)
    mesh.shade_smooth()
    return mesh


@lru_cache(maxsize=1)
def encoded_skin_picture(tone: str) -> Floats:
    """The picture of the skin, sRGB encoded; made from arrays alone, which takes some seconds."""
    picture = skin_picture(tone).copy()
    picture[..., :3] = srgb_encoded(picture[..., :3])
    return picture


def _picture(tone: str) -> bpy.types.Image:
    image = bpy.data.images.new(f"Hairloom Skin {tone}", RESOLUTION, RESOLUTION)
    image.pixels.foreach_set(encoded_skin_picture(tone).ravel())
    image.pack()
    return image


def _material(
    name: str,
    image: bpy.types.Image,
    tone: str,
    roughness: float,
    ior: float,
    subsurface_weight: float,
) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.location = image, (-300.0, 200.0)
    tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    values = {
        "Roughness": roughness,
        "IOR": ior,
        "Subsurface Weight": subsurface_weight,
        "Subsurface Radius": (1.0, 0.36, 0.2),
        "Subsurface Scale": _SUBSURFACE_SCALE,
    }
    for socket, value in values.items():
        shader.inputs[socket].default_value = value
    material.diffuse_color = (*TONES[tone].skin, 1.0)
    return material
