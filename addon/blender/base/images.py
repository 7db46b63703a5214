"""Pictures to and from files and Blender's images, and contact sheets.

Textures are read and written by OpenImageIO where this Python has it, else by Blender's images.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...exchange.files.atomic import DISK_FULL, atomic_write, write_error
from ...exchange.textures import texture_files
from ...exchange.textures.srgb import srgb_decoded, srgb_encoded


def write_png(path: Path, linear: Floats) -> None:
    """Write a picture as 8-bit sRGB PNG.

    Args:
        linear: (height, width, 4) scene-linear Rec.709, premultiplied alpha, row 0 at the bottom.

    Raises:
        HairloomError: the folder or file cannot be written.
    """
    write_encoded_png(path, display_encoded(linear))


def write_texture(
    path: Path, pixels: Floats, *, is_color: bool, depth: str, is_packed: bool = False
) -> None:
    """Write a texture, see `texture_files.write_texture`; without OpenImageIO only as 8-bit PNG.

    Args:
        pixels: (height, width) or (height, width, 1, 3 or 4), row 0 at the bottom.

    Raises:
        HairloomError: the folder or file cannot be written.
    """
    if texture_files.has_openimageio():
        texture_files.write_texture(
            path, pixels, is_color=is_color, depth=depth, is_packed=is_packed
        )
        return
    if path.suffix.lower() != ".png":
        raise HairloomError(
            f"without OpenImageIO textures cannot be written as '{path.suffix}'",
            place=str(path),
            remedy="Choose PNG, or use an official build of Blender",
        )
    values = np.clip(np.atleast_3d(pixels).astype(np.float32), 0.0, 1.0)
    encoded = np.ones((*values.shape[:2], 4), np.float32)
    encoded[..., :3] = srgb_encoded(values[..., :3]) if is_color else values[..., :3]
    encoded[..., 3:] = values[..., 3:] if values.shape[2] == 4 else 1.0
    write_encoded_png(path, encoded, has_alpha=values.shape[2] == 4)


def read_texture(path: Path, *, is_color: bool) -> Floats:
    """Read a picture from a file, see `texture_files.read_texture`.

    Raises:
        HairloomError: no such file, or none that can be read as a picture.
    """
    if texture_files.has_openimageio():
        return texture_files.read_texture(path, is_color=is_color)
    try:
        image = bpy.data.images.load(str(path))
    except RuntimeError as error:
        raise HairloomError(
            "there is no such file, or it cannot be read", place=str(path), remedy="Check the path"
        ) from error
    try:
        return read_image(image, is_color=is_color, place=str(path))
    finally:
        bpy.data.images.remove(image)


def read_image(image: bpy.types.Image, *, is_color: bool, place: str) -> Floats:
    """The pixels of one of Blender's images, saved or not, in its own size.

    Args:
        is_color: convert to scene-linear colour; else values as stored, whatever the colour space.
        place: the picture's name in error messages.

    Returns:
        (height, width, 4) float32, row 0 at the bottom, straight alpha.

    Raises:
        HairloomError: its file is missing or broken, or it is too large.
    """
    width, height = image.size  # loads the image, if necessary
    if not (width and height and image.has_data):
        raise HairloomError(
            "this picture has no pixels: its file is missing or broken",
            place=place,
            remedy="Find it by File > External Data > Find Missing Files, or choose another one",
        )
    texture_files.check_size(width, height, place)
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, 4)
    is_srgb = image.colorspace_settings.name == "sRGB"
    if not image.is_float:  # pixels are the stored values
        if is_color and is_srgb:
            pixels[..., :3] = srgb_decoded(pixels[..., :3])
        return pixels
    # float images are scene-linear already, and premultiplied
    if image.alpha_mode != "CHANNEL_PACKED":
        alpha = pixels[..., 3:]
        np.divide(pixels[..., :3], alpha, out=pixels[..., :3], where=alpha > 0.0)
    if is_srgb and not is_color:
        pixels[..., :3] = srgb_encoded(pixels[..., :3])
    return pixels


def display_encoded(linear: Floats) -> Floats:
    """Scene-linear premultiplied to sRGB-encoded straight alpha, (..., 4) (IEC 61966-2-1)."""
    straight = straight_alpha(linear)
    encoded = srgb_encoded(np.clip(straight[..., :3], 0.0, 1.0))
    return np.concatenate([encoded, straight[..., 3:]], axis=-1).astype(np.float32)


def straight_alpha(premultiplied: Floats) -> Floats:
    """Colours (..., 4) with straight alpha in [0, 1]; black where alpha is 0."""
    color, alpha = premultiplied[..., :3], np.clip(premultiplied[..., 3:], 0.0, 1.0)
    straight = np.divide(color, alpha, out=np.zeros_like(color), where=alpha > 0.0)
    return np.concatenate([straight, alpha], axis=-1)


def contact_sheet(pictures: list[Floats], columns: int) -> Floats:
    """Pictures of equal size in one, in reading order, (rows * height, columns * width, 4)."""
    height, width, channels = pictures[0].shape
    rows = -(-len(pictures) // columns)
    sheet = np.zeros((rows * height, columns * width, channels), np.float32)
    for index, picture in enumerate(pictures):
        row, column = divmod(index, columns)
        top = (rows - 1 - row) * height  # row 0 of a picture is its bottom
        sheet[top : top + height, column * width : (column + 1) * width] = picture
    return sheet


def write_encoded_png(path: Path, encoded: Floats, *, has_alpha: bool = True) -> None:
    """Write values that are sRGB-encoded already, (height, width, 4), in 8 bits.

    Raises:
        HairloomError: the folder or file cannot be written.
    """
    with _temporary_image(encoded, has_alpha=has_alpha) as image:
        image.file_format = "PNG"
        with atomic_write(path) as temporary:
            image.save(filepath=str(temporary))
            if not texture_files.is_complete_picture(temporary):
                raise write_error(path, DISK_FULL)


def webp_bytes(path: Path, encoded: Floats, max_side: int, quality: int) -> bytes:
    """The bytes of a small WebP file of a picture.

    Args:
        path: a temporary file is written beside it.
        encoded: (height, width, 4), sRGB-encoded already, row 0 at the bottom.
        max_side: a larger picture is scaled down to this [pixels].
        quality: up to 100.

    Raises:
        HairloomError: the folder cannot be written.
    """
    height, width = encoded.shape[:2]
    scale = min(max_side / max(height, width), 1.0)
    file = path.with_name(".picture.webp")
    with _temporary_image(encoded, has_alpha=bool((encoded[..., 3] < 1.0).any())) as image:
        if scale < 1.0:
            image.scale(max(round(width * scale), 1), max(round(height * scale), 1))
        image.file_format = "WEBP"
        try:
            image.save(filepath=str(file), quality=quality)
            return file.read_bytes()
        except (RuntimeError, OSError) as error:
            raise write_error(path, str(error)) from error
        finally:
            file.unlink(missing_ok=True)


@contextmanager
def _temporary_image(encoded: Floats, *, has_alpha: bool) -> Iterator[bpy.types.Image]:
    height, width = encoded.shape[:2]
    image = bpy.data.images.new("Hairloom", width, height, alpha=has_alpha)
    try:
        image.pixels.foreach_set(np.ascontiguousarray(encoded, np.float32).ravel())
        yield image
    finally:
        bpy.data.images.remove(image)
