"""DDS files: textures as GPUs hold them, with all mip maps, compressed in blocks of 4 x 4 texels.

BC7 holds colours with or without alpha, and any three or four values, in 8 bits a texel; BC5 two
values in 8 bits, BC4 one in 4 bits. etcpak, which comes with the extension's zip, compresses to
BC7. The header follows Microsoft's "Programming Guide for DDS", always with its DX10 part, which is
needed for sRGB and BC7.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...arrays import Floats
from ...errors import HairloomError
from ..files.atomic import write_bytes_atomic
from .srgb import srgb_encoded
from .texture_files import check_size

#: DXGI_FORMAT of each number of channels
_COMPRESSED = {1: 80, 2: 83, 3: 98, 4: 98}  # BC4_UNORM, BC5_UNORM, BC7_UNORM
#: R8G8B8A8_UNORM for all: few programs read fewer channels
_PLAIN = 28
_SRGB = 1  # BC7_UNORM_SRGB and R8G8B8A8_UNORM_SRGB come next to the formats without it
#: bytes of a block of 4 x 4 texels
_BLOCK_BYTES = {80: 8, 83: 16, 98: 16, 99: 16}

_HAS_CAPS, _HAS_HEIGHT, _HAS_WIDTH, _HAS_PITCH = 0x1, 0x2, 0x4, 0x8
_HAS_FORMAT, _HAS_LEVELS, _HAS_SIZE = 0x1000, 0x20000, 0x80000
_IS_FOUR_LETTERS = 0x4
_IS_COMPLEX, _IS_TEXTURE, _IS_MIP_MAPPED = 0x8, 0x1000, 0x400000
_TEXTURE_2D = 3
_STRAIGHT_ALPHA, _NO_ALPHA, _CUSTOM_ALPHA = 1, 3, 4


def write_dds(
    path: Path,
    levels: Sequence[Floats],
    *,
    is_color: bool = False,
    is_normal_map: bool = False,
    has_coverage: bool = False,
    is_compressed: bool = True,
) -> None:
    """Write a texture with its mip maps.

    Args:
        levels: (height, width, 1 to 4) in [0, 1] each, row 0 at the bottom, the full size first;
            each as `mip_maps.level_sizes` has it.
        is_color: red, green and blue are linear, and stored as sRGB.
        is_normal_map: only red and green of the three channels are kept when compressed.
        has_coverage: the fourth channel is straight alpha, not a value of its own.

    Raises:
        HairloomError: no compressor for BC7, too large, or nothing can be written there.
    """
    height, width, channels = levels[0].shape
    check_size(width, height, str(path))
    if is_normal_map and is_compressed:
        levels = [level[..., :2] for level in levels]
        channels = 2
    dxgi_format = (_COMPRESSED[channels] if is_compressed else _PLAIN) + (_SRGB if is_color else 0)
    alpha = _NO_ALPHA if channels < 4 else _STRAIGHT_ALPHA if has_coverage else _CUSTOM_ALPHA
    texels = [_bytes_of(level, is_color=is_color) for level in levels]
    if is_compressed:
        data = [_compressed(each, path) for each in texels]
    else:
        data = [_as_rgba(each).tobytes() for each in texels]
    header = _header(width, height, len(levels), dxgi_format, alpha)
    write_bytes_atomic(path, header + b"".join(data))


def _bytes_of(level: Floats, *, is_color: bool) -> npt.NDArray[np.uint8]:
    """(height, width, channels), the top row first."""
    values = np.clip(level[::-1], 0.0, 1.0)
    if is_color:
        values = np.concatenate([srgb_encoded(values[..., :3]), values[..., 3:]], axis=-1)
    return np.rint(values * 255.0).astype(np.uint8)


def _as_rgba(texels: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Texels with 0 for missing green and blue, and 255 for missing alpha."""
    full = np.zeros((*texels.shape[:2], 4), np.uint8)
    full[..., 3] = 255
    full[..., : texels.shape[2]] = texels
    return full


def _compressed(texels: npt.NDArray[np.uint8], path: Path) -> bytes:
    """The compressed blocks; those that reach beyond the edges repeat the last row and column."""
    height, width, channels = texels.shape
    full = np.pad(texels, ((0, -height % 4), (0, -width % 4), (0, 0)), mode="edge")
    if channels <= 2:
        blocks = [_bc4(full[..., channel]) for channel in range(channels)]
        return np.concatenate(blocks, axis=-1).tobytes()
    library = _compressor(path)
    options = library.BC7CompressBlockParams()
    options.init_linear_weights()  # alpha counts as much as each colour
    rgba = _as_rgba(full)
    return bytes(library.compress_bc7(rgba.tobytes(), rgba.shape[1], rgba.shape[0], options))


def _bc4(values: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """(blocks, 8): the greatest and the least value, and which of 8 steps between is nearest.

    BC4_UNORM in Microsoft's "Texture Block Compression in Direct3D 11"; etcpak's is less exact.
    """
    height, width = values.shape
    blocks = values.reshape(height // 4, 4, width // 4, 4).swapaxes(1, 2).reshape(-1, 16)
    highest, lowest = blocks.max(axis=1), blocks.min(axis=1)
    span = np.maximum(highest - lowest, 1).astype(np.float32)
    steps = np.rint((highest[:, None] - blocks) * (7.0 / span)[:, None]).astype(np.uint8)
    # Steps down from the greatest; the code of the least comes second
    code = np.array([0, 2, 3, 4, 5, 6, 7, 1], np.uint64)[steps]
    bits = np.bitwise_or.reduce(code << np.arange(0, 48, 3, dtype=np.uint64), axis=1)
    indices = bits.astype("<u8").view(np.uint8).reshape(-1, 8)[:, :6]
    return np.column_stack([highest, lowest, indices])


def _header(width: int, height: int, level_count: int, dxgi_format: int, alpha: int) -> bytes:
    """DDS_HEADER and DDS_HEADER_DXT10 with the letters before them."""
    flags = _HAS_CAPS | _HAS_HEIGHT | _HAS_WIDTH | _HAS_FORMAT | _HAS_LEVELS
    if dxgi_format in _BLOCK_BYTES:
        flags |= _HAS_SIZE
        size = -(-width // 4) * -(-height // 4) * _BLOCK_BYTES[dxgi_format]
    else:
        flags |= _HAS_PITCH
        size = width * 4
    caps = _IS_TEXTURE | ((_IS_COMPLEX | _IS_MIP_MAPPED) if level_count > 1 else 0)
    return (
        struct.pack("<4s7I44x", b"DDS ", 124, flags, height, width, size, 0, level_count)
        + struct.pack("<2I4s20x", 32, _IS_FOUR_LETTERS, b"DX10")
        + struct.pack("<I16x", caps)
        + struct.pack("<5I", dxgi_format, _TEXTURE_2D, 0, 1, alpha)
    )


def _compressor(path: Path) -> Any:
    try:
        import etcpak
    except (ImportError, OSError) as error:
        raise HairloomError(
            f"etcpak, which compresses DDS textures, cannot be loaded ({error})",
            place=str(path),
            remedy="Install Hairloom from its zip, which includes it for Windows, macOS and Linux "
            "on the usual processors, or choose PNG, EXR or uncompressed DDS",
        ) from error
    return etcpak
