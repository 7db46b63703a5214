"""Random numbers that depend on keys alone, not on how many were drawn before.

So the darts on one triangle and the variation of one child stay the same whatever is added or
removed elsewhere, and however rounding differs. Counter-based random numbers (Salmon et al. 2011,
Parallel random numbers: as easy as 1, 2, 3); the mixing is SplitMix64's (Steele, Lea and Flood
2014, Fast splittable pseudorandom number generators).
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints

_STEP = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)


def key_of(*parts: Ints | int) -> Ints:
    """A uint64 key (...) for these whole numbers together, which are broadcast.

    `key_of(key_of(a, b), c)` is `key_of(a, b, c)`.
    """
    key: Ints = np.asarray(parts[0]).astype(np.uint64)
    for part in parts[1:]:
        key = _mixed(key) + np.asarray(part).astype(np.uint64)
    return key


def uniform(key: Ints, stream: int) -> Floats:
    """A uniform number in [0, 1) for each key (...); streams give independent numbers."""
    found: Floats = (_mixed(_mixed(key_of(key, stream))) >> np.uint64(11)) * 2.0**-53
    return found


def normal(key: Ints, stream: int) -> Floats:
    """A normal number of mean 0 and variance 1 for each key (...) (Box and Muller 1958)."""
    reach = np.sqrt(-2.0 * np.log1p(-uniform(key, 2 * stream)))
    found: Floats = reach * np.cos(2.0 * np.pi * uniform(key, 2 * stream + 1))
    return found


def _mixed(key: Ints) -> Ints:
    key = np.atleast_1d(key) + _STEP  # an array, where uint64 wraps without a warning
    key = (key ^ (key >> np.uint64(30))) * _FIRST
    key = (key ^ (key >> np.uint64(27))) * _SECOND
    return key ^ (key >> np.uint64(31))
