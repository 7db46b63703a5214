"""The textures of hair cards as files beside their mesh."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Floats
from ...cards.atlas_grid import AtlasGrid
from ...exchange.textures.card_textures import WrittenTexture, write_card_textures
from ..base.images import write_texture


@dataclass(frozen=True)
class TextureFiles:
    """How the textures are written.

    packing: one of exchange.texture_packing.PRESETS.
    format: one of exchange.card_textures.FORMATS.
    """

    packing: str = "hairloom"
    format: str = "png"


def write_textures(
    folder: Path, stem: str, maps: Mapping[str, Floats], grid: AtlasGrid, files: TextureFiles
) -> list[WrittenTexture]:
    """Write all textures of a preset.

    Args:
        maps: name -> (height, width) or (height, width, 3), of any sizes.

    Raises:
        HairloomError: nothing can be written there, or not in this format.
    """
    return [
        texture
        for those in _together(maps, files)
        for texture in write_card_textures(
            folder / stem,
            _of_one_size(those),
            files.packing,
            file_format=files.format,
            grid=grid,
            write=write_texture,
        )
    ]


def texture_roles(
    written: Iterable[WrittenTexture], maps: Collection[str]
) -> dict[str, dict[str, Any]]:
    """Each of these maps -> the file and the channels that hold it, as the sidecar has it."""
    roles: dict[str, dict[str, Any]] = {}
    for texture in written:
        channels = dict(zip("rgba", texture.layout.channels, strict=False))
        for name in sorted(texture.layout.sources & set(maps)):
            mine = [letter for letter, channel in channels.items() if channel.source == name]
            turned = [letter for letter in mine if channels[letter].is_inverted]
            roles[name] = {
                "file": texture.path.name,
                "channels": "".join(mine),
                **({"inverted": "".join(turned)} if turned else {}),
            }
    return roles


def texture_channels(written: Iterable[WrittenTexture]) -> dict[str, dict[str, Any]]:
    """Each file -> what its channels hold."""
    return {
        texture.path.name: {
            "color_space": texture.layout.color_space,
            "channels": texture.layout.roles,
        }
        for texture in written
    }


def _together(maps: Mapping[str, Floats], files: TextureFiles) -> list[Mapping[str, Floats]]:
    """Maps that must be of one size. Those that have a file each need not be, but for mip maps,
    which alpha weighs.
    """
    if files.packing == "hairloom" and not files.format.startswith("dds"):
        return [{name: image} for name, image in maps.items()]
    return [maps]


def _of_one_size(maps: Mapping[str, Floats]) -> dict[str, Floats]:
    """All maps in the largest size; pixels are repeated."""
    height, width = np.max([image.shape[:2] for image in maps.values()], axis=0)
    row, column = np.arange(height)[:, None], np.arange(width)
    return {
        name: image
        if image.shape[:2] == (height, width)
        else image[row * len(image) // height, column * image.shape[1] // width]
        for name, image in maps.items()
    }
