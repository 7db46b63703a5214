"""Stores pictures of hair as small files: JPEG compresses their noise, PNG hardly does."""

from pathlib import Path

#: of a JPEG, up to 100; the lowest at which strands are clean
QUALITY = 92


def write_small(source: Path, path: Path) -> None:
    """Write a picture, without its alpha, as a JPEG.

    Raises:
        OSError: it cannot be read or written.
    """
    import bpy  # noqa: F401  OpenImageIO lives inside it
    import OpenImageIO as oiio

    picture = oiio.ImageBufAlgo.channels(oiio.ImageBuf(str(source)), (0, 1, 2))
    picture.specmod().attribute("Compression", f"jpeg:{QUALITY}")
    if picture.has_error or not picture.write(str(path), "uint8"):
        raise OSError(f"{source} cannot be kept as {path}: {picture.geterror()}")
