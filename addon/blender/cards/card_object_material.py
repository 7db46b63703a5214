"""The material that cards in the scene start with; afterwards it is the artist's."""

from __future__ import annotations

import bpy
import numpy as np

from ...arrays import Floats
from ...exchange.textures.srgb import srgb_encoded
from .card_scene import ANISOTROPY, ROUGHNESS


def filled_image(image: bpy.types.Image | None, name: str, texture: Floats) -> bpy.types.Image:
    """This picture in an image of the file, packed into it.

    Args:
        image: to be drawn anew, or None for a new one.
        texture: (height, width, 4) linear with straight alpha, row 0 the lowest.
    """
    height, width = texture.shape[:2]
    if image is None or image.library is not None:
        image = bpy.data.images.new(name, width, height, alpha=True)
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
    image.alpha_mode = "CHANNEL_PACKED"  # colour goes on where alpha is 0
    coded = np.array(texture, np.float32)
    coded[..., :3] = srgb_encoded(np.clip(coded[..., :3], 0.0, 1.0))
    image.pixels.foreach_set(coded.ravel())
    image.update()
    image.pack()
    return image


def new_material(
    name: str, image: bpy.types.Image, color: tuple[float, float, float]
) -> bpy.types.Material:
    """Seen from both sides, with the picture's alpha; its colour times the hair's and occlusion."""
    material = bpy.data.materials.new(name)
    material.use_backface_culling = False
    material.surface_render_method = "DITHERED"
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    surface = nodes.new("ShaderNodeBsdfPrincipled")
    surface.inputs["Roughness"].default_value = ROUGHNESS
    surface.inputs["Anisotropic"].default_value = ANISOTROPY
    links.new(surface.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    picture = nodes.new("ShaderNodeTexImage")
    picture.image = image
    picture.extension = "EXTEND"  # else the roots' opaque row shows at the tips
    links.new(picture.outputs["Alpha"], surface.inputs["Alpha"])
    occlusion = nodes.new("ShaderNodeAttribute")
    occlusion.attribute_name = "occlusion"
    tinted = _product(material, picture.outputs["Color"])
    tinted.inputs[7].default_value = (*color, 1.0)
    shaded = _product(material, tinted.outputs[2])
    links.new(occlusion.outputs["Fac"], shaded.inputs[7])
    links.new(shaded.outputs[2], surface.inputs["Base Color"])
    for place, node in enumerate((picture, tinted, shaded, surface, nodes[1])):
        node.location = 260.0 * place, 0.0
    occlusion.location = 260.0, -260.0
    return material


def _product(material: bpy.types.Material, first: bpy.types.NodeSocket) -> bpy.types.Node:
    """A node that multiplies this colour with that of its input 7."""
    node = material.node_tree.nodes.new("ShaderNodeMix")
    node.data_type, node.blend_type = "RGBA", "MULTIPLY"
    node.inputs[0].default_value = 1.0
    material.node_tree.links.new(first, node.inputs[6])
    return node
