"""Dust and water on hair: how they change a look.

Water. A film covers each strand and fills its cuticle. It reflects a fraction p of the light that
leaves the hair back into it, where it is absorbed again: colour c becomes c (1 - p) / (1 - p c)
(Lekner and Dorf 1988, "Why some things are darker when wet", without the reflection of the film
itself). The film is smooth, so its highlight is narrow and does not lean as the scales do, and the
scales under water refract light less.

Dust. The covered fraction shows the dust's colour, without highlights; the remaining highlights are
wider. Water wets dust as it wets hair. The settings have no colour for grey strands. So the
fraction of grey strands that dust covers becomes coloured, and coloured strands get as much more
dust as makes the mean over all strands right.

Limitations: a groom is equally wet and dusty everywhere. In Marschner's model the colour of grey
strands derives from the pigment of the others: a little dust lightens hair that is nearly all grey,
and water darkens grey strands too little. In Kajiya-Kay water does not change grey strands.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Floats
from .drawn_strands import in_color, look_color
from .settings import ShadingSettings

#: Indices of refraction of hair and water.
_HAIR_IOR, _WATER_IOR = 1.55, 1.333
#: Fraction of diffuse light that flat water reflects from outside (Lekner and Dorf 1988).
_OUTER_REFLECTANCE = 0.066
#: The same from within: by reciprocity, the fraction that gets out is smaller by the square of
#: water's index.
FILM_REFLECTANCE = 1.0 - (1.0 - _OUTER_REFLECTANCE) / _WATER_IOR**2
#: Width of the highlight of a film, standard deviation of the half angle [rad].
FILM_WIDTH = float(np.radians(2.0))
#: Refraction at a tilted surface for light that enters hair from water, relative to air.
_REFRACTION_IN_WATER = (_HAIR_IOR / _WATER_IOR - 1.0) / (_HAIR_IOR - 1.0)
#: Exponent of Kajiya-Kay's highlights on a film.
_FILM_GLOSS = 400.0
#: Widening of the remaining highlights under full dust; in Kajiya-Kay, widths are proportional to
#: the inverse square root of exponents.
_DUST_WIDENING = 2.0


def wet_and_dusty_color(color: Floats, look: ShadingSettings) -> Floats:
    """The colour of a mass of hair that is not grey, (..., 3) linear, with the look's dust and
    water.

    NaN stays NaN. Without dust and water, the same array.

    Args:
        look: with grey strands already reduced by dust, see `wet_and_dusty_look`.
    """
    if not is_wet_or_dusty(look):
        return color
    film_reflectance = FILM_REFLECTANCE * look.wetness
    covered = look.dust / max(1.0 - look.grey_fraction, look.dust) if look.dust else 0.0
    dusty = color + covered * (np.array(look.dust_color) - color)
    wet = dusty * (1.0 - film_reflectance) / (1.0 - film_reflectance * np.minimum(dusty, 1.0))
    return wet.astype(color.dtype)


def wet_and_dusty_look(look: ShadingSettings) -> ShadingSettings:
    """The look as its dust and water change it; their amounts stay set. Strands' own colours are up
    to `wet_and_dusty_color`."""
    if not is_wet_or_dusty(look):
        return look
    water, clean = look.wetness, 1.0 - look.dust
    look = replace(look, grey_fraction=clean * look.grey_fraction)
    widening, refraction = (
        1.0 + _DUST_WIDENING * look.dust,
        1.0 + water * (_REFRACTION_IN_WATER - 1.0),
    )
    film_width = look.width_r + water * (min(look.width_r, FILM_WIDTH) - look.width_r)
    tip, brow = (
        wet_and_dusty_color(np.array(color), look).tolist()
        for color in (look.tip_color, look.brow_color)
    )
    colored = in_color(wet_and_dusty_color(look_color(look), look), look)
    return replace(colored, tip_color=tuple(tip), brow_color=tuple(brow)).clipped(
        strength_r=clean * look.strength_r,
        strength_trt=clean * look.strength_trt,
        width_r=widening * film_width,
        width_tt=widening * refraction * look.width_tt,
        width_trt=widening * refraction * look.width_trt,
        offset_r=look.offset_r - water * look.cuticle_tilt,
        primary_strength=clean * look.primary_strength,
        secondary_strength=clean * look.secondary_strength,
        primary_shift=(1.0 - water) * look.primary_shift,
        primary_exponent=_film_exponent(look.primary_exponent, water * clean) / widening**2,
        secondary_exponent=_film_exponent(look.secondary_exponent, water * clean) / widening**2,
        sparkle=clean * look.sparkle,
    )


def is_wet_or_dusty(look: ShadingSettings) -> bool:
    """Whether there is any water or dust."""
    return bool(look.wetness or look.dust)


def _film_exponent(exponent: float, amount: float) -> float:
    return max(exponent, exponent ** (1.0 - amount) * _FILM_GLOSS**amount)
