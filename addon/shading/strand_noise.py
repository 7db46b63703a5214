"""Noise that depends on a strand's seed alone, so that it stays with the strand as it moves.

Twin of gpu_shaders/lib_strand_noise.glsl: the hash agrees bit by bit.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints

#: seeds are whole numbers below this: exact in a float32 texture
SEED_LIMIT = 1 << 24


def hash_integer(value: Ints) -> Ints:
    """The integer hash "lowbias32" (Wellons 2018), on uint32 of any shape."""
    value = np.array(value, np.uint32)
    value ^= value >> np.uint32(16)
    value *= np.uint32(0x7FEB352D)
    value ^= value >> np.uint32(15)
    value *= np.uint32(0x846CA68B)
    value ^= value >> np.uint32(16)
    return value


def hash_unit(seed: Ints, cell: Ints) -> Floats:
    """A number in [0, 1) for each seed and cell: 24 bits, exact in float32."""
    with np.errstate(over="ignore"):  # uint32 wraps, as in GLSL
        mixed = hash_integer(hash_integer(seed) + np.asarray(cell, np.uint32))
    return (mixed >> np.uint32(8)).astype(np.float32) / np.float32(SEED_LIMIT)


def strand_noise(seed: Ints, channel: int, along: Floats) -> Floats:
    """Value noise along strands, in [0, 1].

    Args:
        seed: whole numbers below SEED_LIMIT.
        channel: 0 to 3, each a different noise.
        along: cells from the root, not negative; broadcasts with seed.
    """
    own = np.asarray(seed, np.uint32) * np.uint32(4) + np.uint32(channel)
    floor = np.floor(along)
    cell, inside = floor.astype(np.uint32), along - floor
    blend = inside * inside * (3.0 - 2.0 * inside)
    here, there = hash_unit(own, cell), hash_unit(own, cell + np.uint32(1))
    return here + (there - here) * blend
