"""The artist's own pictures in the place of the textures that are generated for hair cards."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...arrays import Floats
from ...errors import HairloomError
from ...shading.textures import TEXTURES, picture_as
from ..base.images import read_image, read_texture


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
