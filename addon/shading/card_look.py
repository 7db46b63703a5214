"""The strands' shading models on cards: the reference.

Twin of gpu_shaders/lib_card.glsl: same names, same order. A card represents many strands: what
differs between strands is in its textures, and its colour is their mean.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..strands.vectors import unit_or
from .kajiya_kay import strand_base
from .marschner.pigment import COLOR_FACTOR
from .settings import ShadingSettings
from .volume.card_opacity import MEAN_TURN, MIN_FACING, turned_facing

#: Density of a card that faces the eye, relative to its mean over all turns about its strands:
#: 2 / pi, the mean of |cos|, and a quarter more, because cards that are nearly transparent still
#: write depth and hide what lies behind them (measured, Sintel).
MEAN_FACING = 1.25 * MEAN_TURN
#: Both constants, by their names in sidecars.
VIEW_COMPENSATED_ALPHA = {"mean_facing": MEAN_FACING, "min_facing": MIN_FACING}
#: Minimum of a base texel that is converted to absorption.
DARKEST = 1.0e-3


def mapped_tangent(texel: Floats, tangent: Floats, normal: Floats, shift_noise: float) -> Floats:
    """Directions of strands from a tangent map, (..., 3) unit vectors, see textures.HairTextures.

    Args:
        texel: (..., 3) of the map.
        tangent, normal: (..., 3) of the card, unit vectors.
        shift_noise: how much the map tilts strands.
    """
    direction = 2.0 * texel - 1.0
    side = np.cross(tangent, normal)
    strand = direction[..., 0:1] * side + direction[..., 1:2] * tangent
    strand = strand + direction[..., 2:3] * (shift_noise * normal)
    return unit_or(strand, tangent)


def mapped_normal(texel: Floats, tangent: Floats, normal: Floats) -> Floats:
    """Normals from a normal map, (..., 3) unit vectors, see textures.HairTextures.

    Args:
        texel: (..., 3) of the map.
        tangent, normal: (..., 3) of the card, unit vectors.
    """
    direction = 2.0 * texel - 1.0
    side = np.cross(tangent, normal)
    bent = direction[..., 0:1] * side + direction[..., 1:2] * tangent + direction[..., 2:3] * normal
    return unit_or(bent, normal)


def view_compensated_alpha(
    alpha: Floats, across: Floats, tangent: Floats, to_eye: Floats
) -> Floats:
    """Alpha of a card that is seen at an angle, (...).

    Turned about its strands, a card gets narrower, but its strands do not: they appear closer
    together. n layers of alpha cover 1 - (1 - alpha)^n, with n proportional to 1 / |cos| of the
    turn.

    Args:
        alpha: (...) mean over all turns about its strands.
        across: (..., 3) normal of its plane, of any length.
        tangent, to_eye: (..., 3) unit vectors.
    """
    facing = turned_facing(across, tangent, to_eye)
    compensated: Floats = 1.0 - (1.0 - alpha) ** (MEAN_FACING / np.maximum(facing, MIN_FACING))
    return compensated


def card_base(along: Floats, shading: ShadingSettings) -> Floats:
    """Mean colour of the strands at places of a card, (..., 3); `along` is 0 at the root.

    Times the base texture, it corresponds to `strand_base` of a strand. For Kajiya-Kay only;
    `drawn_strands.card_color` serves both models.
    """
    even = np.full(np.shape(along), 0.5)
    colored = strand_base(along, even, even + 1.0, shading)
    grey = strand_base(along, even, even - 1.0, shading)
    return colored + (grey - colored) * shading.grey_fraction


def plain_albedo(color: Floats) -> Floats:
    """The albedo with which a plain surface reflects as much light as hair of this colour,
    (..., 3).

    A plain surface has no shadows between strands: in the hair's colour it would be too bright,
    most of all for bright hair. Fitted to brown and blond hair on a head under three suns, see
    `bench engines`.
    """
    albedo: Floats = 1.1 * color / (1.0 + 2.0 * color)
    return albedo


def own_absorption(absorption: Floats, base: Floats) -> Floats:
    """The absorption of strands whose colour is `base` times the card's mean colour, (..., 3).

    With it the base texture colours light that passes through a fibre, not light that the fibre
    reflects. Inverts marschner.look.strand_color; no colour exceeds white.

    Args:
        absorption: (..., 3) mean of the card, per radius.
        base: (..., 3) texel of the base texture.
    """
    root = np.sqrt(np.maximum(absorption, 0.0)) - np.log(np.maximum(base, DARKEST)) / COLOR_FACTOR
    own: Floats = np.maximum(root, 0.0) ** 2
    return own
