"""What a card makes of the models of strands: the reference.

Twin of gpu_shaders/lib_card.glsl: same names, same order. A card stands for many strands, so what
differs from strand to strand is in its textures, and of its colours it has the mean.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..strands.vectors import unit_or
from .kajiya_kay import strand_base
from .marschner.pigment import COLOR_FACTOR
from .settings import ShadingSettings
from .volume.card_opacity import MEAN_TURN, MIN_FACING, turned_facing

#: How dense a card is that faces the eye, in what it is on the mean of all turns: 2 / pi, the mean
#: of |cos|; and a quarter more, for what is lost behind cards that are nearly clear and still write
#: depth (measured, Sintel).
MEAN_FACING = 1.25 * MEAN_TURN
#: both, by the names that sidecars have for them
VIEW_COMPENSATED_ALPHA = {"mean_facing": MEAN_FACING, "min_facing": MIN_FACING}
#: Darkest texel of a base texture of which an absorption is made.
DARKEST = 1.0e-3


def mapped_tangent(texel: Floats, tangent: Floats, normal: Floats, shift_noise: float) -> Floats:
    """The way of a strand by a tangent map, (..., 3) unit vectors, see textures.HairTextures.

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
    """The normal by a normal map, (..., 3) unit vectors, see textures.HairTextures.

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
    """What a card covers that is seen at a slant, (...).

    The slant narrows a card, but no strand: what it shows lies closer together. n layers of alpha
    cover 1 - (1 - alpha)^n, and n goes with 1 / |cos| of the turn about the strands.

    Args:
        alpha: (...) what it covers on the mean of all turns about its strands.
        across: (..., 3) normal of its plane, of any length.
        tangent, to_eye: (..., 3) unit vectors.
    """
    facing = turned_facing(across, tangent, to_eye)
    compensated: Floats = 1.0 - (1.0 - alpha) ** (MEAN_FACING / np.maximum(facing, MIN_FACING))
    return compensated


def card_base(along: Floats, shading: ShadingSettings) -> Floats:
    """Mean colour of the strands at places of a card, (..., 3); `along` is 0 at the root.

    Times the base texture it is what `strand_base` is for a strand. Of Kajiya-Kay alone: see
    `drawn_strands.card_color`.
    """
    even = np.full(np.shape(along), 0.5)
    colored = strand_base(along, even, even + 1.0, shading)
    grey = strand_base(along, even, even - 1.0, shading)
    return colored + (grey - colored) * shading.grey_fraction


def plain_albedo(color: Floats) -> Floats:
    """The albedo with which a plain surface sends back as much light as hair of this colour,
    (..., 3).

    It knows no shadows between strands, so it would be too bright: the more, the brighter the hair.
    Fitted to brown and blond hair on a head under three suns, see `bench engines`.
    """
    albedo: Floats = 1.1 * color / (1.0 + 2.0 * color)
    return albedo


def own_absorption(absorption: Floats, base: Floats) -> Floats:
    """The absorption of strands whose colour is `base` times that of the card's mean, (..., 3).

    So the base texture colours what passes through a fibre, and no light that it reflects. The
    inverse of marschner.look.strand_color; nothing is brighter than white.

    Args:
        absorption: (..., 3) mean of the card, per radius.
        base: (..., 3) texel of the base texture.
    """
    root = np.sqrt(np.maximum(absorption, 0.0)) - np.log(np.maximum(base, DARKEST)) / COLOR_FACTOR
    own: Floats = np.maximum(root, 0.0) ** 2
    return own
