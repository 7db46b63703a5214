"""Cryptomatte: which objects cover a pixel, and how much each covers.

After Friedman and Jones 2015, "Fully automatic ID mattes with support for motion blur and
transparency", and the specification of Cryptomatte 1.2.0 (Psyop). An object's ID is the hash of its
name, as a float. Pictures hold pairs of ID and coverage, two to a picture, sorted by coverage,
largest first.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

import json
from collections.abc import Iterable

import numpy as np

from ..arrays import Floats

#: pairs of ID and coverage in a four-channel picture
PAIRS = 2
_WORD = 0xFFFFFFFF


def murmur3(key: bytes, seed: int = 0) -> int:
    """MurmurHash3_x86_32 (Appleby)."""
    found = seed
    for start in range(0, len(key), 4):
        part = key[start : start + 4]
        mixed = int.from_bytes(part, "little") * 0xCC9E2D51 & _WORD
        mixed = _rotated_left(mixed, 15) * 0x1B873593 & _WORD
        found ^= mixed
        if len(part) == 4:
            found = (_rotated_left(found, 13) * 5 + 0xE6546B64) & _WORD
    found ^= len(key)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35)):
        found = (found ^ found >> shift) * factor & _WORD
    return found ^ found >> 16


def matte_bits(name: str) -> int:
    """The bits of an ID: the hash of the name, changed where it is not a normal float."""
    found = murmur3(name.encode())
    # a float with exponent 0 may be flushed to 0, and one with 255 is infinite or NaN
    return found ^ 1 << 23 if found >> 23 & 255 in (0, 255) else found


def matte_id(name: str) -> np.float32:
    """The ID of an object."""
    return np.uint32(matte_bits(name)).view(np.float32)


def metadata(layer: str, names: Iterable[str]) -> dict[str, str]:
    """The metadata of a Cryptomatte in a file.

    Args:
        layer: prefix of its pictures' names. names: of all objects.
    """
    # seven digits, as in the specification
    place = f"cryptomatte/{murmur3(layer.encode()) >> 4:07x}"
    manifest = {name: f"{matte_bits(name):08x}" for name in sorted(set(names))}
    return {
        f"{place}/name": layer,
        f"{place}/hash": "MurmurHash3_32",
        f"{place}/conversion": "uint32_to_float32",
        f"{place}/manifest": json.dumps(manifest, ensure_ascii=False, separators=(",", ":")),
    }


class Coverages:
    """The coverage of each pixel by each object, as a sum over samples.

    Args:
        height, width: [pixels].
        levels: number of objects stored per pixel; further ones are dropped.
    """

    def __init__(self, height: int, width: int, levels: int) -> None:
        self._size = height, width
        self._ids = np.zeros((levels, height * width), np.float32)
        self._sums = np.zeros((levels, height * width), np.float32)

    def add(self, name: str, coverage: Floats) -> None:
        """Add the coverage by an object in one sample, (height, width)."""
        flat, own = coverage.ravel(), matte_id(name)
        pixels = np.flatnonzero(flat > 0.0)
        is_left = np.ones(len(pixels), bool)
        for ids, sums in zip(self._ids, self._sums, strict=True):
            # levels fill up in order, so that an object has at most one per pixel
            is_here = is_left & ((ids[pixels] == own) | (sums[pixels] == 0.0))
            here = pixels[is_here]
            ids[here] = own
            sums[here] += flat[here]
            is_left &= ~is_here

    def pictures(self, samples: int) -> list[Floats]:
        """Pictures of IDs and coverages, (height, width, 4) each, largest coverage first.

        Args:
            samples: number of samples that were added.
        """
        order = np.argsort(-self._sums, axis=0, kind="stable")
        ids = np.take_along_axis(self._ids, order, axis=0)
        mean = np.take_along_axis(self._sums, order, axis=0) / np.float32(max(samples, 1))
        height, width = self._size
        spare = np.zeros((-len(ids) % PAIRS, height * width), np.float32)
        pairs = np.stack([np.vstack([ids, spare]), np.vstack([mean, spare])], axis=2)
        return [
            pairs[first : first + PAIRS].swapaxes(0, 1).reshape(height, width, 2 * PAIRS)
            for first in range(0, len(pairs), PAIRS)
        ]


def _rotated_left(word: int, bits: int) -> int:
    return (word << bits | word >> 32 - bits) & _WORD
