"""From melanin or a colour to the absorption inside the fibre.

The formulas are those of Blender's Principled Hair (its manual gives them), so that the same
numbers give the same hair in Cycles. Absorption is per fibre radius.

References:
    Chiang, Bitterli, Tappan and Burley 2016, "A Practical and Controllable Hair and Fur Model
        for Production Path Tracing", section 4.2: colour.
    d'Eon, Francois, Hill, Letteri and Aubry 2011, "An Energy-Conserving Hair Reflectance Model",
        section 6.1: absorption of the two pigments, which Blender scales to amounts in [0, 1].
"""

from __future__ import annotations

import numpy as np

from ...arrays import Floats

#: red, green, blue, per radius, at an amount of 1
EUMELANIN = np.array([0.506, 0.841, 1.653])
PHEOMELANIN = np.array([0.343, 0.733, 1.924])

#: Blender's minimum of 1 - melanin
MIN_LIGHTNESS = 1e-4

#: Darkest colour: black itself would need infinite absorption.
MIN_COLOR = 1e-4

#: Chiang et al. 2016, section 4.2: coefficients of rising powers of the azimuthal roughness
_COLOR_FIT = (5.969, -0.215, 2.532, -10.73, 5.574, 0.245)


def melanin_absorption(melanin: Floats | float, redness: Floats | float) -> Floats:
    """Absorption of natural hair, (..., 3).

    Args:
        melanin: in [0, 1]: white 0, blond 0.25, brown 0.75, black 1; linear to the eye.
        redness: in [0, 1]: the fraction of pheomelanin.
    """
    lightness = np.maximum(1.0 - np.asarray(melanin), MIN_LIGHTNESS)
    amount, redness = -np.log(np.minimum(lightness, 1.0))[..., None], np.asarray(redness)[..., None]
    return amount * ((1.0 - redness) * EUMELANIN + redness * PHEOMELANIN)


def color_absorption(color: Floats, azimuthal_roughness: float = 0.3) -> Floats:
    """Absorption that gives a mass of hair this colour, (..., 3).

    Args:
        color: linear rgb, (..., 3), clamped to [MIN_COLOR, 1].
        azimuthal_roughness: Blender's radial roughness, in [0, 1].
    """
    logarithm = np.log(np.clip(color, MIN_COLOR, 1.0))
    return (logarithm / _color_fit(azimuthal_roughness)) ** 2


def absorption_color(absorption: Floats, azimuthal_roughness: float = 0.3) -> Floats:
    """Colour of a mass of hair with this absorption, (..., 3): the inverse of color_absorption."""
    return np.exp(-np.sqrt(np.maximum(absorption, 0.0)) * _color_fit(azimuthal_roughness))


def color_exponent(azimuthal_roughness: float) -> float:
    """The exponent that turns a colour at Blender's default roughness, 0.3, into the colour of the
    same absorption at another roughness."""
    return _color_fit(azimuthal_roughness) / COLOR_FACTOR


def roughness_widths(roughness: float) -> tuple[float, float, float]:
    """Widths of R, TT, TRT, as in Fibre, for Blender's roughness in [0, 1], [rad].

    Chiang et al. 2016, equation 7: the root of the variance in theta_r; theta_h has half of it.
    TT is half as wide as R and TRT twice.
    """
    width = 0.5 * (0.726 * roughness + 0.812 * roughness**2 + 3.7 * roughness**20)
    return (width, 0.5 * width, 2.0 * width)


def _color_fit(roughness: float) -> float:
    return sum(factor * roughness**power for power, factor in enumerate(_COLOR_FIT))


#: Minus the logarithm of a colour over the square root of its absorption, at Blender's default
#: roughness.
COLOR_FACTOR = _color_fit(0.3)
