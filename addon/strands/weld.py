"""Merging coincident vertices, which files split along seams of UVs and normals."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints

#: odd numbers, so that places become different keys
_HASH_FACTORS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)


def unique_position_indices(positions: Floats) -> Ints:
    """A number from 0 for each of the positions (n, 3) float32, the same for equal ones, (n,)."""
    bits = (positions + np.float32(0.0)).view(np.uint32).astype(np.uint64)  # -0 becomes 0
    key = (bits * _HASH_FACTORS).sum(axis=1, dtype=np.uint64)
    key ^= key >> np.uint64(29)
    _, first, number = np.unique(key, return_index=True, return_inverse=True)
    number = np.asarray(number).reshape(-1)
    if np.array_equal(positions[first[number]], positions):
        return number
    # two places have the same key: sort by all three coordinates instead
    return np.asarray(np.unique(positions, axis=0, return_inverse=True)[1]).reshape(-1)
