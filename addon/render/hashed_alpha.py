"""Hashed alpha: thresholds by which meshes and strands are discarded in the samples of a picture.

For meshes, a pixel's threshold is shifted from sample to sample along a sequence that fills [0, 1)
evenly (Halton 1960), so that the mean of the samples has the density of alpha. Meshes that overlap,
and the two sides of a mesh, have different sequences: otherwise they would be discarded together,
and too much would be visible behind them.

Strands are too many for that. They share one sequence, the bit-reversed sample indices, which is
shuffled and scrambled for each strand and pixel (Owen 1995, by the hash of Laine and Karras 2011 as
in Burley 2020, "Practical Hash-based Owen Scrambling"). So the density of a single strand is that
of alpha within one sample's weight, and overlapping strands are discarded independently.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from .halton import radical_inverse

#: factors of the hash: even numbers, so that a bit only depends on lower bits
_MIXING = (0x6C50B47C, 0xB82F1E52, 0xC7AFE638, 0x8D22F6E6)
#: bases of the sequences: primes, so that the sequences are independent
_BASES = (2, 3, 5, 7, 11, 13, 17, 19)


def shifts(number: int, sample: int) -> tuple[float, float]:
    """The shifts of a mesh's front and back, in [0, 1); 0 at the first sample.

    Args:
        number: of the mesh; numbers that differ by four share sequences.
        sample: index of the sample, from 0.
    """
    first = 2 * number % len(_BASES)
    front, back = (radical_inverse(np.array([sample]), _BASES[first + k]) for k in (0, 1))
    return float(front[0]), float(back[0])


def scrambled(place: Ints, seed: Ints, other_seed: Ints) -> Floats:
    """Elements `place`, (...), of a sequence that fills [0, 1) evenly. Each pair of seeds has its
    own order of the sequence. 24 bits, exact in float32.
    """
    shuffled = _reversed_bits(_mixed_upwards(_reversed_bits(np.asarray(place, np.uint32)), seed))
    digits = _reversed_bits(_mixed_upwards(shuffled, other_seed))
    return (digits >> np.uint32(8)).astype(np.float32) / np.float32(1 << 24)


def _mixed_upwards(value: Ints, seed: Ints) -> Ints:
    """Flips each bit, or not, depending on the bits below it."""
    with np.errstate(over="ignore"):  # uint32 wraps, as in GLSL
        value = value + np.asarray(seed, np.uint32)
        for factor in _MIXING:
            value = value ^ (value * np.uint32(factor))
    return value


def _reversed_bits(value: Ints) -> Ints:
    bits = np.unpackbits(value.astype(">u4")[..., None].view(np.uint8), axis=-1)
    return np.packbits(bits[..., ::-1], axis=-1).view(">u4")[..., 0].astype(np.uint32)
