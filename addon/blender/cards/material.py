"""The material of hair cards: its nodes, pictures and alpha."""

from __future__ import annotations

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...exchange.textures.srgb import srgb_encoded
from ...shading.textures import picture_as
from ..base.images import read_image

ROUGHNESS = 0.5
#: glTF elongates the highlight along u, across the strands, as hair does.
ANISOTROPY = 0.5


def new_material(
    name: str,
    base: bpy.types.Image | None,
    alpha: bpy.types.Image | None,
    *,
    blending: str,
    occlusion: str = "",
) -> bpy.types.Material:
    """A two-sided material.

    Args:
        base: the colour.
        alpha: if it is `base`, its alpha channel is used, else its colour.
        blending: "BLENDED", which Blender's glTF exporter writes as such, or "DITHERED".
        occlusion: an attribute that `base` is multiplied by; "" for none.
    """
    material = bpy.data.materials.new(name)
    material.use_backface_culling = False
    material.surface_render_method = blending
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    surface = nodes.new("ShaderNodeBsdfPrincipled")
    surface.inputs["Roughness"].default_value = ROUGHNESS
    surface.inputs["Anisotropic"].default_value = ANISOTROPY
    links.new(surface.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    picture = None
    if base is not None:
        picture = _new_picture(material, base)
        shown = picture.outputs["Color"]
        if occlusion:
            shown, factor = _product(material, shown)
            attribute = nodes.new("ShaderNodeAttribute")
            attribute.attribute_name = occlusion
            links.new(attribute.outputs["Fac"], factor)
        links.new(shown, surface.inputs["Base Color"])
    if picture is not None and alpha == base:
        links.new(picture.outputs["Alpha"], surface.inputs["Alpha"])
    elif alpha is not None:
        links.new(_new_picture(material, alpha).outputs["Color"], surface.inputs["Alpha"])
    _arrange(material)
    return material


def _new_picture(material: bpy.types.Material, image: bpy.types.Image) -> bpy.types.Node:
    picture = material.node_tree.nodes.new("ShaderNodeTexImage")
    picture.image = image
    picture.extension = "EXTEND"  # else the root's opaque row wraps around to the tip
    return picture


def _product(
    material: bpy.types.Material, first: bpy.types.NodeSocket
) -> tuple[bpy.types.NodeSocket, bpy.types.NodeSocket]:
    """Multiply a colour by another: the socket of the product, and the socket of the factor."""
    node = material.node_tree.nodes.new("ShaderNodeMix")
    node.data_type, node.blend_type = "RGBA", "MULTIPLY"
    node.inputs[0].default_value = 1.0
    material.node_tree.links.new(first, node.inputs[6])
    return node.outputs[2], node.inputs[7]


def _arrange(material: bpy.types.Material) -> None:
    """Place nodes from left to right, with attributes below."""
    surface, output, *before = material.node_tree.nodes
    row = [node for node in before if node.type != "ATTRIBUTE"]
    for place, node in enumerate((*row, surface, output)):
        node.location = 260.0 * place, 0.0
    for node in set(before) - set(row):
        node.location = 260.0, -260.0


def named_image(file: str, space: str) -> bpy.types.Image:
    """An image with a file name, which is all that exporters need; the file need not exist yet."""
    image = bpy.data.images.new(file, 1, 1, alpha=True)
    image.source = "FILE"
    image.filepath = file
    image.colorspace_settings.name = space
    return image


def fill_image(image: bpy.types.Image, texture: Floats) -> None:
    """Write a texture into an image: (height, width, 4), linear with straight alpha, row 0 the
    lowest, with colours also where alpha is 0."""
    coded = np.array(texture, np.float32)
    coded[..., :3] = srgb_encoded(np.clip(coded[..., :3], 0.0, 1.0))
    image.pixels.foreach_set(coded.ravel())


def read_alpha(
    obj: bpy.types.Object, chosen: bpy.types.Image | None = None
) -> tuple[Floats | None, list[str]]:
    """The alpha of cards, (height, width), and notes; None: they count as opaque."""
    images = [chosen] if chosen is not None else alpha_images(obj)
    image = images[0] if images else None
    if image is None:
        problem = "No material has an alpha picture"
        return None, [f"{problem}, so cards were treated as opaque"]
    place = f"Image '{image.name}'"
    try:
        picture = read_image(image, is_color=False, place=place)
        others = "Its materials have several alpha pictures"
        notes = [f"{others}: image '{image.name}' was used for all"] if images[1:] else []
        return picture_as("alpha", picture, place=place), notes
    except HairloomError as error:
        return None, [f"{error} Until then cards are treated as opaque"]


def alpha_images(obj: bpy.types.Object) -> list[bpy.types.Image]:
    """The pictures linked to the alpha of a Principled BSDF in the object's materials."""
    found: list[bpy.types.Image] = []
    for slot in obj.material_slots:
        tree = None if slot.material is None else slot.material.node_tree
        for node in tree.nodes if tree is not None else ():
            if node.type == "BSDF_PRINCIPLED":
                for link in node.inputs["Alpha"].links:
                    image = link.from_node.image if link.from_node.type == "TEX_IMAGE" else None
                    if image is not None and image not in found:
                        found.append(image)
    return found
