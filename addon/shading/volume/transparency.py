"""Strands that hide only a share of what lies behind them: of a pixel, and one over another.

    covered   a strip over a unit square, exactly: F(d + h) - F(d - h) with d its middle line's
              distance from the centre, h half its width, and F the share of the square below a line
    over      C = sum of a_i T_i c_i from near to far, T_i = product of (1 - a_j) of all before it
              (Porter and Duff 1984)

`over_nearest` is what the GPU does: it needs no order but that of the nearest. Twin of
lib_coverage.glsl and of strand_layers_order.comp.glsl.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Floats

#: Layers of a pixel that are shaded, at most.
LAYERS = 8
#: Layers are shaded until no more than this share of the pixel's light comes from behind them.
UNSEEN_SHARE = 0.03


def share_below(distance: Floats, normal: Floats) -> Floats:
    """The share of a unit square that lies below a line, (...) in [0, 1].

    Args:
        distance: (...) of the line from the square's centre, positive above it.
        normal: (..., 2) the line's unit normal without its signs.
    """
    wide, narrow = normal.max(axis=-1), normal.min(axis=-1)
    inner, reach = 0.5 * (wide - narrow), 0.5 * (wide + narrow)
    away = np.minimum(np.abs(distance), reach)
    corner = (reach - away) ** 2 / (2.0 * wide * np.maximum(narrow, 1e-6))
    beyond = np.where(away <= inner, 0.5 - away / wide, corner)
    return np.where(distance < 0.0, beyond, 1.0 - beyond)


def strip_coverage(distance: Floats, half_width: Floats, normal: Floats) -> Floats:
    """The share of a pixel that a strip covers, (...) in [0, 1].

    Args:
        distance: (...) of its middle line from the pixel's centre [pixels].
        half_width: (...) of the strip [pixels].
        normal: (..., 2) the strip's unit normal without its signs.
    """
    above = share_below(distance + half_width, normal)
    return above - share_below(distance - half_width, normal)


def over_nearest(
    depths: Floats,
    alphas: Floats,
    colors: Floats,
    layers: int = LAYERS,
    unseen_share: float = UNSEEN_SHARE,
) -> Floats:
    """Layers of pixels one over the other, premultiplied (pixel_count, 4).

    The nearest count in full, until hardly any light comes from behind them; what lies deeper
    covers as much as it does, in the mean colour of those.

    Args:
        depths: (pixel_count, n), in any order; ties go by alpha.
        alphas: (pixel_count, n), 0 where there is no layer.
        colors: (pixel_count, n, 3).
        layers: how many count in full, at most; n of them and an unseen_share of 0 are exact.
    """
    order = np.lexsort((alphas, depths, alphas == 0.0), axis=-1)
    alphas = np.take_along_axis(alphas, order, axis=-1)
    colors = np.take_along_axis(colors, order[..., None], axis=-2)
    behind_all = np.prod(1.0 - alphas, axis=-1)
    through = np.ones(len(alphas))
    light = np.zeros((len(alphas), 3))
    for layer in range(min(layers, alphas.shape[-1])):
        is_seen = (layer == 0) | (through - behind_all >= unseen_share)
        alpha = np.where(is_seen, alphas[:, layer], 0.0)
        light += (through * alpha)[:, None] * colors[:, layer]
        through = through * (1.0 - alpha)
    covered = 1.0 - behind_all
    light *= (covered / np.maximum(1.0 - through, 1e-6))[:, None]
    return np.column_stack([light, covered])
