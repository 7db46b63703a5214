"""What pictures may differ by on a GPU, where they come out bit for bit if a processor draws.

A GPU works on fragments in another order at each draw, so sums that depend on it round otherwise,
and its own sines, roots and quotients are rough by a few units of the last place. Measured on an
NVIDIA H100 and an H200: the same picture twice is apart by up to 2.4e-7. Corners of triangles lie
on a grid of 1/256 of a pixel, and what is interpolated between them is off by as much. So is what
a sampler interpolates between texels, along each axis.
"""

from __future__ import annotations

import numpy as np

from hairloom.addon.arrays import Floats

#: [pixels] between the places at which a corner can be
SUBPIXEL = 1.0 / 256.0
#: most by which a sampler's place between two texels is off
SUBTEXEL = 1.0 / 512.0
_ROUNDING = 2.0e-6


def is_same(one: Floats, other: Floats) -> bool:
    """Whether two pictures, or what else a GPU has made twice, are the same."""
    if _is_software():
        return bool(np.array_equal(one, other))
    largest = np.maximum(np.abs(one), np.abs(other)).astype(np.float64)
    return bool((np.abs(one - other) <= _ROUNDING * np.maximum(largest, 1.0)).all())


def tolerance(processor: float, gpu: float) -> float:
    """The one of two tolerances that is for what draws here."""
    return processor if _is_software() else gpu


def _is_software() -> bool:
    # not above: tests are collected before there is a gpu module
    from hairloom.addon.render.strand_layers import is_software

    return is_software()
