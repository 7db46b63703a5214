"""A sequence that fills [0, 1) evenly (Halton 1960, "On the Efficiency of Certain Quasi-Random
Sequences of Points in Evaluating Multi-Dimensional Integrals").

Pure numpy: importable without gpu.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints


def radical_inverse(number: Ints, base: int) -> Floats:
    """The radical inverses of whole numbers (n,): their digits mirrored at the point, (n,)."""
    found, left, place = np.zeros(len(number)), number.astype(np.int64), 1.0 / base
    while left.any():
        left, digit = np.divmod(left, base)
        found, place = found + place * digit, place / base
    return found
