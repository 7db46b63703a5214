"""Pictures to disk through Blender's own image writer, and the contact sheet."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ..arrays import Floats
from ..exchange.atomic import atomic_write


def write_png(path: Path, linear: Floats) -> None:
    """Write a picture as 8-bit sRGB PNG.

    Args:
        linear: (height, width, 4) scene-linear Rec.709, premultiplied alpha, row 0 at the bottom.

    Raises:
        HairloomError: the folder or file cannot be written.
    """
    height, width = linear.shape[:2]
    image = bpy.data.images.new("Hairloom", width, height, alpha=True)
    try:
        image.pixels.foreach_set(display_encoded(linear).ravel())
        image.file_format = "PNG"
        with atomic_write(path) as temporary:
            image.save(filepath=str(temporary))
    finally:
        bpy.data.images.remove(image)


def display_encoded(linear: Floats) -> Floats:
    """Scene-linear premultiplied to sRGB-coded straight alpha, (..., 4) (IEC 61966-2-1)."""
    alpha = np.clip(linear[..., 3:], 0.0, 1.0)
    straight = np.divide(
        linear[..., :3], alpha, out=np.zeros_like(linear[..., :3]), where=alpha > 0.0
    )
    straight = np.clip(straight, 0.0, 1.0)
    curved = 1.055 * np.power(straight, 1.0 / 2.4) - 0.055
    coded = np.where(straight <= 0.0031308, 12.92 * straight, curved)
    return np.concatenate([coded, alpha], axis=-1).astype(np.float32)


def contact_sheet(pictures: list[Floats], columns: int) -> Floats:
    """Pictures of one size as one, in reading order, (rows * height, columns * width, 4)."""
    height, width, channels = pictures[0].shape
    rows = -(-len(pictures) // columns)
    sheet = np.zeros((rows * height, columns * width, channels), np.float32)
    for index, picture in enumerate(pictures):
        row, column = divmod(index, columns)
        top = (rows - 1 - row) * height  # row 0 of a picture is its bottom
        sheet[top : top + height, column * width : (column + 1) * width] = picture
    return sheet
