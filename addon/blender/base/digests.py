"""Digests: short texts that are equal for equal content, on every machine."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np


def digest(*parts: Any, size: int = 16) -> str:
    """The digest of parts in order: arrays with dtype and shape, bytes, the `repr` of others.

    Args:
        size: [bytes], two characters each.
    """
    state = hashlib.blake2b(digest_size=size)
    for part in parts:
        if isinstance(part, np.ndarray):
            state.update(f"{part.dtype} {part.shape}".encode())
            state.update(np.ascontiguousarray(part).tobytes())
        else:
            state.update(part if isinstance(part, bytes) else repr(part).encode())
    return state.hexdigest()
