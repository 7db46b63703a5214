"""Tolerances of pictures on a GPU, which are bit-identical if a processor draws them.

A GPU processes fragments in another order in each draw, so that order-dependent sums round
differently, and its sines, roots and quotients are only accurate to a few units of the last place.
Measured on an NVIDIA H100 and an H200: the same picture drawn twice differs by up to 2.4e-7.
Corners of triangles lie on a grid of 1/256 of a pixel, and interpolated values are off accordingly.
So are values that a sampler interpolates between texels, along each axis.
"""

from __future__ import annotations

import numpy as np

from hairloom.addon.arrays import Floats

#: spacing of possible places of corners [pixels]
SUBPIXEL = 1.0 / 256.0
#: largest error of a sampler's place between two texels
SUBTEXEL = 1.0 / 512.0
_ROUNDING = 2.0e-6


def is_same(first: Floats, second: Floats) -> bool:
    """Whether two pictures, or other results of a GPU, are the same but for rounding."""
    if _is_software():
        return bool(np.array_equal(first, second))
    largest = np.maximum(np.abs(first), np.abs(second)).astype(np.float64)
    return bool((np.abs(first - second) <= _ROUNDING * np.maximum(largest, 1.0)).all())


def tolerance(processor: float, gpu: float) -> float:
    """The tolerance for the device that draws here."""
    return processor if _is_software() else gpu


def _is_software() -> bool:
    # not above: tests are collected before there is a gpu module
    from hairloom.addon.render.strand_layers import is_software

    return is_software()
