"""Digests: short texts that are the same for the same content, on every machine."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np


def digest(*parts: Any, size: int = 16) -> str:
    """Of arrays with their dtypes and shapes, of bytes as they are, and of anything else by its
    `repr`, one after the other.

    Args:
        size: bytes, each of which is two characters.
    """
    state = hashlib.blake2b(digest_size=size)
    for part in parts:
        if isinstance(part, np.ndarray):
            state.update(f"{part.dtype} {part.shape}".encode())
            state.update(np.ascontiguousarray(part).tobytes())
        else:
            state.update(part if isinstance(part, bytes) else repr(part).encode())
    return state.hexdigest()
