"""By what chance hashed meshes are left out in each of the samples of a picture.

A pixel's pattern is shifted from sample to sample along a sequence that fills [0, 1) evenly (Halton
1960), so that the mean of the samples is as dense as alpha says. Meshes that lie before each other,
and the two sides of one, have sequences of their own: else they would be left out together, and
more would be seen behind them than is let through.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

#: of the sequences, which are independent of each other since these are primes
_BASES = (2, 3, 5, 7, 11, 13, 17, 19)


def shifts(number: int, sample: int) -> tuple[float, float]:
    """Of a mesh's front and back, in [0, 1); 0 at the first sample.

    Args:
        number: of the mesh; four have sequences of their own.
        sample: number of the sample, from 0.
    """
    front = 2 * number % len(_BASES)
    return _halton(sample, _BASES[front]), _halton(sample, _BASES[front + 1])


def _halton(index: int, base: int) -> float:
    """The digits of a number behind the point, in reverse."""
    value, fraction = 0.0, 1.0
    while index:
        index, digit = divmod(index, base)
        fraction /= base
        value += fraction * digit
    return value
