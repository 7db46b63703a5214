"""Positions of a pixel's samples: a low-discrepancy sequence, distributed by the pixel filter.

Samples whose density is that of the filter have equal weights: their mean is the filtered picture
(Ernst, Stamminger and Greiner 2006, "Filter importance sampling").

Pure numpy: importable without gpu.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats

#: the generalised golden ratio in two dimensions, the real root of x^3 = x + 1
#: (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences")
_PLASTIC = 1.32471795724474602596
#: coefficients of the Blackman-Harris window (Harris 1978), the filter of Blender's engines
_HARRIS = (0.35875, -0.48829, 0.14128, -0.01168)
_TABLE = 4096


def jitters(count: int, filter_size: float) -> Floats:
    """Positions of `count` samples of a pixel, (count, 2) [pixels] from its centre.

    The first one is the centre. More samples begin with those of fewer.

    Args:
        filter_size: width of the filter [pixels], Blender's default is 1.5.
    """
    steps = np.arange(count)[:, None] * np.array([1.0 / _PLASTIC, 1.0 / _PLASTIC**2])
    return filter_size * _fraction_to_place((0.5 + steps) % 1.0)


def _fraction_to_place(fraction: Floats) -> Floats:
    """The place in -0.5..0.5 to the left of which this fraction of the filter's weight lies."""
    edges = np.linspace(0.0, 1.0, _TABLE + 1)
    middles = (edges[:-1] + edges[1:]) / 2.0
    weights = sum(a * np.cos(2.0 * np.pi * k * middles) for k, a in enumerate(_HARRIS))
    total = np.concatenate([[0.0], np.cumsum(weights)])
    return np.interp(fraction, total / total[-1], edges - 0.5)
