"""Pictures of hair cards: the artist's own, and those written as files beside a mesh."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from ...arrays import Floats
from ...cards.atlas_grid import AtlasGrid
from ...cards.export_settings import CardExportSettings
from ...errors import HairloomError
from ...exchange.textures import texture_files
from ...exchange.textures.card_textures import (
    WrittenTexture,
    resized_to_largest,
    write_card_textures,
)
from ...shading.marschner.look import fibre_of
from ...shading.marschner.tables import marschner_tables, shape_of
from ...shading.settings import ShadingSettings
from ...shading.textures import TEXTURES, picture_as
from ..base.images import read_image, read_texture, write_texture

#: Texels along a side of a table: half of what our own renderer uses, with no visible difference.
TABLE_SIZE = 128


def chosen_pictures(group: Any) -> tuple[dict[str, Floats], tuple[str, ...]]:
    """The pictures of a HAIRLOOM_PG_card_images that can be used, and a warning for each of the
    others.

    Pictures are (height, width) or (height, width, 3), as `picture_as` returns them.
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
            warnings.append(f"{error} Until then the generated {name} texture is used.")
    return pictures, tuple(warnings)


def picture_files(group: Any) -> list[Path]:
    """The files of an artist's own pictures."""
    images = [getattr(group, name) for name in TEXTURES]
    paths = [image.filepath_from_user() for image in images if image is not None]
    return [Path(path) for path in paths if path]


def named_pictures(arguments: list[str]) -> dict[str, Floats]:
    """The pictures from command line arguments NAME=FILE, shaped as `picture_as` does.

    Raises:
        HairloomError: an unknown name, or a file that cannot be used.
    """
    pictures = {}
    for argument in arguments:
        name, _, file = argument.partition("=")
        if name not in TEXTURES or not file:
            raise HairloomError(
                f"'{argument}' does not name a texture and a file",
                place="--texture",
                remedy=f"Write NAME=FILE with one of {', '.join(TEXTURES)}",
            )
        picture = read_texture(Path(file), is_color=name == "base")
        pictures[name] = picture_as(name, picture, place=file)
    return pictures


def write_textures(
    folder: Path,
    stem: str,
    maps: Mapping[str, Floats],
    grid: AtlasGrid,
    settings: CardExportSettings,
) -> list[WrittenTexture]:
    """Write all textures of a packing preset.

    Args:
        maps: name -> (height, width) or (height, width, 3), of any sizes.

    Raises:
        HairloomError: the folder cannot be written, or the format is not available.
    """
    return [
        texture
        for those in _groups_of_one_size(maps, settings)
        for texture in write_card_textures(
            folder / stem,
            resized_to_largest(those),
            settings.packing,
            file_format=settings.textures,
            grid=grid,
            write=write_texture,
        )
    ]


def texture_roles(
    written: Iterable[WrittenTexture], maps: Collection[str]
) -> dict[str, dict[str, Any]]:
    """Each of these maps -> the file and the channels that hold it, for the sidecar."""
    roles: dict[str, dict[str, Any]] = {}
    for texture in written:
        channels = dict(zip("rgba", texture.layout.channels, strict=False))
        for name in sorted(texture.layout.sources & set(maps)):
            mine = sorted(
                (letter for letter, channel in channels.items() if channel.source == name),
                key=lambda letter: channels[letter].component,
            )
            turned = [letter for letter in mine if channels[letter].is_inverted]
            roles[name] = {
                "file": texture.path.name,
                "channels": "".join(mine),
                **({"inverted": "".join(turned)} if turned else {}),
                **({"color_space": "linear"} if texture.color_space == "linear" else {}),
            }
    return roles


def texture_channels(written: Iterable[WrittenTexture]) -> dict[str, dict[str, Any]]:
    """Each file -> its colour space and the content of its channels."""
    return {
        texture.path.name: {
            "color_space": texture.color_space,
            "channels": texture.layout.roles,
        }
        for texture in written
    }


def _groups_of_one_size(
    maps: Mapping[str, Floats], settings: CardExportSettings
) -> list[Mapping[str, Floats]]:
    """Groups of maps that must have one size: all, as they share files, or as alpha weighs their
    mip maps in DDS. Maps with a file each and no mip maps can have any sizes.
    """
    if settings.packing == "hairloom" and not settings.textures.startswith("dds"):
        return [{name: image} for name, image in maps.items()]
    return [maps]


def png_of(path: Path, pixels: Floats, *, is_color: bool = False) -> bytes:
    """An 8-bit PNG of (height, width, channels); a temporary file is written beside `path`.

    Raises:
        HairloomError: it cannot be written there.
    """
    picture = path.with_name(".picture.png")
    try:
        write_texture(picture, pixels, is_color=is_color, depth="uint8", is_packed=True)
    except HairloomError as error:  # name the file that it is for, not the temporary one
        raise error.at(error.place.replace(picture.name, path.name)) from error
    data = picture.read_bytes()
    picture.unlink()
    return data


def write_tables(folder: Path, stem: str, shading: ShadingSettings) -> dict[str, str]:
    """Marschner's tables as 32-bit EXR files, name -> file; none for the other model, or without
    OpenImageIO. They are uncompressed, so that games made with Godot read them without a library.

    Raises:
        HairloomError: the folder cannot be written.
    """
    if not texture_files.has_openimageio():
        return {}
    pixels = look_tables(shading)
    files = {name: f"{stem}_{name}.exr" for name in pixels}
    for name, file in files.items():
        texture_files.write_texture(
            folder / file,
            pixels[name],
            is_color=False,
            depth="float",
            is_packed=True,
            compression="none",
        )
    return files


def look_tables(shading: ShadingSettings) -> dict[str, Floats]:
    """Marschner's tables, (side, side, 4), row 0 the lowest; none for the other model."""
    if shading.model != "marschner":
        return {}
    tables = marschner_tables(shape_of(fibre_of(shading)), TABLE_SIZE)
    return {
        "longitudinal": tables.longitudinal[0],
        "azimuthal": tables.azimuthal,
        "paths": tables.paths,
    }
