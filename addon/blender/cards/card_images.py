"""The artist's own pictures in the place of the textures that are generated for hair cards."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import PointerProperty

from ...arrays import Floats
from ...errors import HairloomError
from ...shading.textures import TEXTURES, picture_as
from ..base.images import read_image, read_texture
from ..properties.properties import OVERRIDABLE

_ABOUT = {
    "base": ("Base", "Brightness of the strands, or their colour: multiplied by the hair's"),
    "alpha": ("Alpha", "Where there is hair: the alpha of this picture, or its red without one"),
    "shift": ("Shift", "Where the highlights lie along each strand; middle grey leaves them"),
    "noise": ("Noise", "What the second highlight is broken up by"),
    "tangent": ("Tangent", "Direction of the strands in place of the shift, as in a normal map"),
}


class HAIRLOOM_PG_card_images(bpy.types.PropertyGroup):
    """Pictures for hair cards; what is empty is generated"""

    __annotations__ = {
        name: PointerProperty(
            type=bpy.types.Image,
            name=label,
            description=f"{about}; empty: generated",
            override=OVERRIDABLE,
        )
        for name, (label, about) in _ABOUT.items()
    }


def chosen_pictures(group: Any) -> tuple[dict[str, Floats], tuple[str, ...]]:
    """Those pictures of a HAIRLOOM_PG_card_images that can be used, and a warning for each other.

    Pictures are (height, width) or (height, width, 3), as `picture_as` has them.
    """
    pictures, warnings = {}, []
    for name in TEXTURES:
        image = getattr(group, name)
        if image is None:
            continue
        place = f"Image '{image.name}'"
        try:
            picture = read_image(image, is_color=name == "base", place=place)
            pictures[name] = picture_as(name, picture, place=place)
        except HairloomError as error:
            warnings.append(f"{error} Until then the generated {name} texture takes its place.")
    return pictures, tuple(warnings)


def named_pictures(arguments: list[str]) -> dict[str, Floats]:
    """The pictures that the command line names as NAME=FILE.

    Raises:
        HairloomError: another name, or a file that cannot be used.
    """
    pictures = {}
    for argument in arguments:
        name, _, file = argument.partition("=")
        if name not in TEXTURES or not file:
            raise HairloomError(
                f"'{argument}' names no texture and file",
                place="--texture",
                remedy=f"Write NAME=FILE with one of {', '.join(TEXTURES)}",
            )
        picture = read_texture(Path(file), is_color=name == "base")
        pictures[name] = picture_as(name, picture, place=file)
    return pictures
