"""Stores pictures of hair as small files: JPEG compresses their noise, PNG hardly does."""

from pathlib import Path

#: of a JPEG, up to 100; the lowest at which strands are clean
QUALITY = 92


def write_small(drawn: Path, kept: Path) -> None:
    """Write a picture, without its alpha, as a JPEG.

    Raises:
        OSError: it cannot be read or written.
    """
    import bpy  # noqa: F401  OpenImageIO lives inside it
    import OpenImageIO as oiio

    picture = oiio.ImageBufAlgo.channels(oiio.ImageBuf(str(drawn)), (0, 1, 2))
    picture.specmod().attribute("Compression", f"jpeg:{QUALITY}")
    if picture.has_error or not picture.write(str(kept), "uint8"):
        raise OSError(f"{drawn} cannot be kept as {kept}: {picture.geterror()}")
