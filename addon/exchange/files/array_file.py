"""Reading uncompressed .npz files that may be damaged.

numpy's own reader trusts the shapes that a file names, and lets errors of zip files through.
"""

from __future__ import annotations

import io
import math
import struct
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: what reading a damaged file, list of arrays or header of an array may raise
_DAMAGE = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    EOFError,
    LookupError,
    MemoryError,
    OverflowError,
    RuntimeError,
    SyntaxError,
    tokenize.TokenError,
    TypeError,
)
_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """All arrays of a file by name.

    Raises:
        OSError: it cannot be read. ValueError: it is damaged, or claims more than it holds.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            if sum(member.file_size for member in members) > path.stat().st_size:
                raise ValueError("its stated size exceeds its actual size")
            return {
                member.filename.removesuffix(".npy"): _array(archive.read(member))
                for member in members
            }
    except _DAMAGE as error:
        raise ValueError(str(error) or type(error).__name__) from error


def _array(content: bytes) -> NDArray[Any]:
    stream = io.BytesIO(content)
    shape, is_fortran, dtype = _HEADERS[np.lib.format.read_magic(stream)](stream)
    if dtype.hasobject or min(shape, default=0) < 0:
        raise ValueError("it holds Python objects, or a negative size")
    values = np.frombuffer(content, dtype, math.prod(shape), offset=stream.tell())
    return values.reshape(shape, order="F" if is_fortran else "C").copy(order="K")
