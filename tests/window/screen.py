"""The content of the X screen, read directly through Xlib."""

import ctypes
import struct
import zlib
from typing import Any

import numpy as np

_ALL_PLANES, _Z_PIXMAP = ctypes.c_ulong(-1), 2


class _XImage(ctypes.Structure):
    """The first members of Xlib's structure XImage."""

    _fields_ = (
        *((name, ctypes.c_int) for name in ("width", "height", "xoffset", "format")),
        ("data", ctypes.c_void_p),
        *((name, ctypes.c_int) for name in ("byte_order", "unit", "bit_order", "pad", "depth")),
        *((name, ctypes.c_int) for name in ("bytes_per_line", "bits_per_pixel")),
    )


def _connect() -> tuple[Any, Any]:
    x = ctypes.CDLL("libX11.so.6")
    x.XOpenDisplay.restype = ctypes.c_void_p
    x.XDefaultRootWindow.restype = ctypes.c_ulong
    x.XGetImage.restype = ctypes.POINTER(_XImage)
    display = x.XOpenDisplay(None)
    assert display, "there is no X screen"
    return x, ctypes.c_void_p(display)


_x, _display = _connect()


def size() -> tuple[int, int]:
    """Width and height of the screen in pixels."""
    return _x.XDisplayWidth(_display, 0), _x.XDisplayHeight(_display, 0)


def pixels() -> np.ndarray:
    """The screen, (height, width, 3), uint8, top row first."""
    return part(0, 0, *size())


def part(left: int, top: int, width: int, height: int) -> np.ndarray:
    """As `pixels`, for a rectangle of the screen: reading all of it takes as long as drawing."""
    root = ctypes.c_ulong(_x.XDefaultRootWindow(_display))
    found = _x.XGetImage(_display, root, left, top, width, height, _ALL_PLANES, _Z_PIXMAP)
    image = found.contents
    assert image.bits_per_pixel == 32, f"a screen of {image.bits_per_pixel} bits a pixel"
    raw = ctypes.string_at(image.data, image.bytes_per_line * height)
    _x.XDestroyImage(found)
    rows = np.frombuffer(raw, np.uint8).reshape(height, -1, 4)
    return rows[:, :width, 2::-1].copy()


def png(image: np.ndarray) -> bytes:
    """A PNG file of (height, width, 3), uint8."""
    height, width, _ = image.shape
    lines = np.zeros((height, 1 + 3 * width), np.uint8)  # each begins with its filter, none
    lines[:, 1:] = image.reshape(height, -1)
    header = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(lines.tobytes(), 1)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(*each) for each in chunks)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
