"""Reading and writing pictures through OpenImageIO, without Blender.

Colours are scene-linear here, and sRGB in files of integers; everything else (alpha, shifts,
directions) is stored as it is. Alpha is straight: OpenImageIO would premultiply colours, which
loses them where alpha is 0. Only EXR files are premultiplied, as all programs expect, except for
packed textures, whose channels are independent values.

OpenImageIO comes with official builds of Blender and is on PyPI as `openimageio`. Where it is
missing, blender/base/images.py uses Blender's own readers and writers instead.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ..files.atomic import atomic_write, write_error, write_failure_reason
from .srgb import srgb_decoded, srgb_encoded

#: The largest side of a texture on every GPU that Blender supports [pixels].
MAX_SIDE = 16384
#: Maximum size, more than anybody paints [pixels]; as four float channels it takes 1 GiB.
MAX_PIXELS = 1 << 26
#: suffix -> the depths that such a file can have, the first being the usual one
DEPTHS = {
    ".png": ("uint8", "uint16"),
    ".exr": ("half", "float"),
    ".tif": ("uint8", "uint16", "float"),
    ".tiff": ("uint8", "uint16", "float"),
}

#: The chunk IEND with its checksum.
_END_OF_PNG = b"\0\0\0\0IEND\xaeB`\x82"
#: Date of EXR and TIFF files, always the same, so that the same pixels give the same bytes.
_NO_DATE = "1970:01:01 00:00:00"
#: Attribute of EXR files whose colours are not premultiplied, as they would be otherwise.
_STRAIGHT = "hairloom_straight_alpha"


def has_openimageio() -> bool:
    """Whether the functions here can work in this Python."""
    try:
        import OpenImageIO  # noqa: F401
    except ImportError:
        return False
    return True


def check_size(width: int, height: int, place: str) -> None:
    """Refuse a picture [pixels] that no GPU can hold, or that fills the memory.

    Raises:
        HairloomError: it is too large.
    """
    if max(width, height) > MAX_SIDE or width * height > MAX_PIXELS:
        raise HairloomError(
            f"{width} x {height} pixels are too many",
            place=place,
            remedy=f"Make it smaller: up to {MAX_SIDE} pixels a side, and 8192 x 8192 in all",
        )


def read_texture(path: Path, *, is_color: bool) -> Floats:
    """Read a picture of any format that OpenImageIO knows.

    Args:
        is_color: integers are decoded by the sRGB curve; without it values come as they are stored.

    Returns:
        (height, width, 1 to 4) float32, row 0 at the bottom: grey, grey and alpha, rgb, or rgb and
        straight alpha; integers as [0, 1]. What a file holds beyond four channels is left out.

    Raises:
        HairloomError: no OpenImageIO, no such file, or no complete picture of a usable size.
    """
    library = _openimageio(path)
    if os.path.isdir(path):
        raise _picture_error(path, "this is a folder, not a file", "Choose a picture")
    if not os.path.isfile(path):
        raise _picture_error(path, "there is no such file", "Check the path")
    if not path.stat().st_size:
        raise _picture_error(path, "the file is empty", "Save the picture again")
    config = library.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    source = library.ImageInput.open(str(path), config)
    if source is None:
        raise _broken_picture(path, library)
    try:
        return _pixels(path, source, library, is_color=is_color)
    finally:
        source.close()


def write_texture(
    path: Path,
    pixels: Floats,
    *,
    is_color: bool,
    depth: str | None = None,
    is_packed: bool = False,
    compression: str | None = None,
) -> None:
    """Write a picture as PNG, EXR or TIFF, by the suffix.

    Args:
        pixels: (height, width) or (height, width, 1 to 4), row 0 at the bottom, straight alpha;
            integers hold [0, 1].
        is_color: integers are coded by the sRGB curve.
        depth: one of DEPTHS for this suffix; None is the usual one.
        is_packed: engines unpack its channels, so that even EXR files are not premultiplied.
        compression: "none" for a file that simple readers can read; None is the usual one.

    Raises:
        HairloomError: no OpenImageIO, another suffix or depth, or nothing can be written there.
    """
    library = _openimageio(path)
    depth = _depth(path, depth)
    image = np.atleast_3d(np.asarray(pixels, np.float32))[::-1]
    if is_color and depth.startswith("uint"):
        image = _with_colors(image, srgb_encoded(np.clip(_colors(image), 0.0, 1.0)))
    height, width, channels = image.shape
    is_multiplied = path.suffix.lower() == ".exr" and not is_packed
    if channels in (2, 4) and is_multiplied:
        image = _with_colors(image, _colors(image) * image[..., -1:])
    spec = library.ImageSpec(width, height, channels, depth)
    if channels in (2, 4):
        spec.alpha_channel = channels - 1
        spec.attribute("oiio:UnassociatedAlpha", int(not is_multiplied))
        spec.attribute(_STRAIGHT, int(not is_multiplied))
    spec.attribute("oiio:ColorSpace", _color_space(is_color=is_color, depth=depth))
    if path.suffix.lower() != ".png":
        spec.attribute("DateTime", _NO_DATE)
    if compression is not None:
        spec.attribute("compression", compression)
    with atomic_write(path) as temporary:
        target = library.ImageOutput.create(str(temporary))
        done = target is not None and target.open(str(temporary), spec)
        done = done and target.write_image(np.ascontiguousarray(image))
        if not (done and target.close() and is_complete_picture(temporary)):
            raise write_error(path, write_failure_reason(path, _reason(target or library)))


def is_complete_picture(path: Path) -> bool:
    """Whether a PNG has its closing chunk, since writers of PNG files do not report a full disk;
    True of other files."""
    if path.suffix.lower() != ".png":
        return True
    with path.open("rb") as file:
        file.seek(0, os.SEEK_END)
        file.seek(-min(len(_END_OF_PNG), file.tell()), os.SEEK_END)
        return file.read() == _END_OF_PNG


def _openimageio(path: Path) -> Any:
    try:
        import OpenImageIO
    except ImportError as error:
        raise HairloomError(
            "OpenImageIO, which reads and writes pictures, is missing in this Python",
            place=str(path),
            remedy="Use an official build of Blender, or install the package 'openimageio'",
        ) from error
    return OpenImageIO


def _pixels(path: Path, source: Any, library: Any, *, is_color: bool) -> Floats:
    """The pixels of an open file, after a check of its header."""
    spec = source.spec()
    width, height, channels = spec.width, spec.height, min(spec.nchannels, 4)
    if spec.deep or spec.depth > 1 or min(width, height, channels) < 1:
        raise _picture_error(path, "this is not a flat picture", "Save it as a plain picture")
    check_size(width, height, str(path))
    image = source.read_image(0, 0, 0, channels, library.FLOAT)
    # What could not be read would come as zeros, or not at all
    if image is None or source.has_error:
        raise _broken_picture(path, source)
    image = np.asarray(image, np.float32).reshape(height, width, channels)
    is_straight = any(map(spec.get_int_attribute, ("oiio:UnassociatedAlpha", _STRAIGHT)))
    if channels in (2, 4) and not (is_straight or source.format_name() == "dds"):
        image = _straight(image)
    if is_color and str(spec.format) not in ("half", "float", "double"):
        image = _with_colors(image, srgb_decoded(_colors(image)))
    return np.ascontiguousarray(image[::-1], np.float32)


def _colors(image: Floats) -> Floats:
    """An image without its alpha."""
    return image[..., :-1] if image.shape[-1] in (2, 4) else image


def _straight(image: Floats) -> Floats:
    """Colours divided by their alpha, where there is any."""
    alpha = image[..., -1:]
    colors = _colors(image)
    return _with_colors(image, np.divide(colors, alpha, out=colors.copy(), where=alpha > 0.0))


def _with_colors(image: Floats, colors: Floats) -> Floats:
    return np.concatenate([colors, image[..., colors.shape[-1] :]], axis=-1)


def _color_space(*, is_color: bool, depth: str) -> str:
    """OpenImageIO's name of the values' colour space."""
    if not is_color:
        return "raw"
    return "sRGB" if depth.startswith("uint") else "lin_rec709"


def _depth(path: Path, depth: str | None) -> str:
    depths = DEPTHS.get(path.suffix.lower())
    if depths is None:
        raise HairloomError(
            f"pictures cannot be written as '{path.suffix}'",
            place=str(path),
            remedy=f"Use {', '.join(DEPTHS)}",
        )
    if depth is None or depth in depths:
        return depth or depths[0]
    raise HairloomError(
        f"{path.suffix} files cannot store {depth}",
        place=str(path),
        remedy=f"Use {' or '.join(depths)}",
    )


def _broken_picture(path: Path, source: Any) -> HairloomError:
    return _picture_error(
        path,
        f"this file cannot be read as a picture ({_reason(source)})",
        "It is damaged or not a picture: save it again, as PNG, TIFF or EXR",
    )


def _picture_error(path: Path, problem: str, remedy: str) -> HairloomError:
    return HairloomError(problem, place=str(path), remedy=remedy)


def _reason(source: Any) -> str:
    """The first line of the error message of OpenImageIO, or of one of its readers or writers."""
    try:
        text = source.geterror()
    except UnicodeDecodeError:  # it quotes what it found in the file
        text = "it holds names that are not text"
    lines = [line.strip().rstrip(".") for line in text.splitlines() if line.strip()]
    return lines[0] if lines else "no reason given"
