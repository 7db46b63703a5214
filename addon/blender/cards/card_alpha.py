"""Where cards of the scene are clear: the picture that their material has for its alpha."""

from __future__ import annotations

import bpy

from ...arrays import Floats
from ...errors import HairloomError
from ...shading.textures import picture_as
from ..base.images import read_image


def alpha_of(
    obj: bpy.types.Object, chosen: bpy.types.Image | None = None
) -> tuple[Floats | None, list[str]]:
    """Where cards are clear, (height, width), and why not; None where they cover all over."""
    image = chosen or alpha_image(obj)
    if image is None:
        problem = "No material has a picture for its alpha"
        return None, [f"{problem}, so cards counted as covered all over"]
    place = f"Image '{image.name}'"
    try:
        picture = read_image(image, is_color=False, place=place)
        return picture_as("alpha", picture, place=place), []
    except HairloomError as error:
        return None, [f"{error} Until then cards counted as covered all over"]


def alpha_image(obj: bpy.types.Object) -> bpy.types.Image | None:
    """The picture that is linked to the alpha of a Principled BSDF of the object's materials."""
    for slot in obj.material_slots:
        tree = None if slot.material is None else slot.material.node_tree
        for node in tree.nodes if tree is not None else ():
            if node.type == "BSDF_PRINCIPLED":
                for link in node.inputs["Alpha"].links:
                    if link.from_node.type == "TEX_IMAGE" and link.from_node.image is not None:
                        return link.from_node.image
    return None
