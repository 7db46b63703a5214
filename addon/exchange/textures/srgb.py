"""Conversion between scene-linear values and those in picture files of integers: IEC 61966-2-1."""

from __future__ import annotations

import numpy as np

from ...arrays import Floats


def srgb_encoded(linear: Floats) -> Floats:
    """Values in [0, 1], of any shape, encoded by the sRGB curve."""
    curved = 1.055 * np.power(np.maximum(linear, 0.0031308), 1.0 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, curved)


def srgb_decoded(coded: Floats) -> Floats:
    """Values of any shape, decoded: the inverse of `srgb_encoded`."""
    curved = np.power((np.maximum(coded, 0.04045) + 0.055) / 1.055, 2.4)
    return np.where(coded <= 0.04045, coded / 12.92, curved)
