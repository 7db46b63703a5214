"""By what chance hashed meshes and strands are left out in each of the samples of a picture.

A pixel's pattern is shifted from sample to sample along a sequence that fills [0, 1) evenly (Halton
1960), so that the mean of the samples is as dense as alpha says. Meshes that lie before each other,
and the two sides of one, have sequences of their own: else they would be left out together, and
more would be seen behind them than is let through.

Strands are too many for that. All have one sequence, the bits of the samples' numbers in reverse,
which each shuffles and scrambles in each pixel (Owen 1995, by the hash of Laine and Karras 2011, as
Burley gives it in 2020, "Practical Hash-based Owen Scrambling"). So a strand alone is as dense as
alpha says within a sample's weight, and strands before each other are left out independently.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from .halton import radical_inverse

#: of the hash: even numbers, so that lower bits alone decide about a bit
_MIXING = (0x6C50B47C, 0xB82F1E52, 0xC7AFE638, 0x8D22F6E6)
#: of the sequences, which are independent of each other since these are primes
_BASES = (2, 3, 5, 7, 11, 13, 17, 19)


def shifts(number: int, sample: int) -> tuple[float, float]:
    """Of a mesh's front and back, in [0, 1); 0 at the first sample.

    Args:
        number: of the mesh; four have sequences of their own.
        sample: number of the sample, from 0.
    """
    first = 2 * number % len(_BASES)
    front, back = (radical_inverse(np.array([sample]), _BASES[first + k]) for k in (0, 1))
    return float(front[0]), float(back[0])


def scrambled(place: Ints, seed: Ints, other_seed: Ints) -> Floats:
    """Of a sequence that fills [0, 1) evenly, the numbers at these places. Each pair of seeds has
    an order of its own. 24 bits, exact in float32.
    """
    shuffled = _reversed_bits(_mixed_upwards(_reversed_bits(np.asarray(place, np.uint32)), seed))
    digits = _reversed_bits(_mixed_upwards(shuffled, other_seed))
    return (digits >> np.uint32(8)).astype(np.float32) / np.float32(1 << 24)


def _mixed_upwards(value: Ints, seed: Ints) -> Ints:
    """Each bit flipped or not by those below it."""
    with np.errstate(over="ignore"):  # uint32 wraps, as in GLSL
        value = value + np.asarray(seed, np.uint32)
        for factor in _MIXING:
            value = value ^ (value * np.uint32(factor))
    return value


def _reversed_bits(value: Ints) -> Ints:
    bits = np.unpackbits(value.astype(">u4")[..., None].view(np.uint8), axis=-1)
    return np.packbits(bits[..., ::-1], axis=-1).view(">u4")[..., 0].astype(np.uint32)
