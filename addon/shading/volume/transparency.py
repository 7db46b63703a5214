"""Strands that cover only a fraction of a pixel, and strands blended over one another.

    covered   a strip over a unit square, exactly: F(d + h) - F(d - h) with d its middle line's
              distance from the centre, h half its width, and F the fraction of the square below a
              line
    over      C = sum of a_i T_i c_i from near to far, T_i = product of (1 - a_j) of all before it
              (Porter and Duff 1984)

A pixel may hold far more thin strands than can be shaded. `layer_fractions` chooses those that
represent all of them, by their weight in the pixel: the nearest alone would be the outermost
strands in small pictures, which are lit more. They are chosen as in VarOpt (Cohen et al. 2009):
heavy items keep their weights, and a sample divides the weight of the rest; but the sample is
evenly spaced along the ray, not random, so that strands that have not moved are drawn as before.

Twin of lib_coverage.glsl and of strand_layers_order.comp.glsl.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Floats

#: Maximum number of layers of a pixel that are shaded.
LAYERS = 8
#: The same while a view turns with its lights.
TURNING_LAYERS = 3
#: Layers are shaded until no more than this fraction of the pixel's light comes from behind them,
#: as long as there are no more than LAYERS.
UNSEEN_FRACTION = 0.03


def fraction_below(distance: Floats, normal: Floats) -> Floats:
    """The fraction of a unit square that lies below a line, (...) in [0, 1].

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
    """The fraction of a pixel that a strip covers, (...) in [0, 1].

    Args:
        distance: (...) of its middle line from the pixel's centre [pixels].
        half_width: (...) of the strip [pixels].
        normal: (..., 2) the strip's unit normal without its signs.
    """
    above = fraction_below(distance + half_width, normal)
    return above - fraction_below(distance - half_width, normal)


def layer_fractions(
    depths: Floats,
    alphas: Floats,
    layers: int = LAYERS,
    unseen_fraction: float = UNSEEN_FRACTION,
) -> Floats:
    """Weights of the layers that are shaded, (pixel_count, n), which add up to the coverage of all.

    The nearest are shaded, until hardly any light comes from behind them; where these are too many,
    a sample of all layers is.

    Args:
        depths: (pixel_count, n), in any order; ties go by alpha.
        alphas: (pixel_count, n), 0 where there is no layer.
        layers: maximum number that is shaded; exact with n and an unseen_fraction of 0.
    """
    order = np.lexsort((alphas, depths, alphas == 0.0), axis=-1)
    alphas = np.take_along_axis(alphas, order, axis=-1)
    transmittance = np.cumprod(1.0 - alphas, axis=-1)
    before = np.column_stack([np.ones(len(alphas)), transmittance[:, :-1]])
    weights, covered = before * alphas, 1.0 - transmittance[:, -1:]
    is_seen = (alphas > 0.0) & (before - transmittance[:, -1:] >= unseen_fraction)
    is_seen[:, 0] = alphas[:, 0] > 0.0
    nearest = np.where(is_seen, weights, 0.0)
    nearest *= covered / np.maximum(nearest.sum(axis=-1, keepdims=True), 1e-6)
    is_many = is_seen.sum(axis=-1, keepdims=True) > layers
    chosen = np.where(is_many, _sample_weights(weights, covered, layers), nearest)
    fractions: Floats = np.zeros_like(chosen)
    np.put_along_axis(fractions, order, chosen, axis=-1)
    return fractions


def _sample_weights(weights: Floats, covered: Floats, layers: int) -> Floats:
    """Weights of a sample of all layers, (pixel_count, n); 0 for layers that are not in it.

    Args:
        weights: (pixel_count, n) of the light, nearest first. covered: (pixel_count, 1), their sum.
    """
    threshold = np.maximum(covered / layers, 1e-6)
    for _ in range(layers):
        is_large = weights > threshold
        remaining = covered - np.where(is_large, weights, 0.0).sum(axis=-1, keepdims=True)
        slots = np.maximum(layers - is_large.sum(axis=-1, keepdims=True), 1)
        threshold = np.clip(remaining / slots, 1e-6, threshold)
    is_large = weights > threshold
    cumulative = 0.5 + np.cumsum(np.where(is_large, 0.0, weights / threshold), axis=-1)
    is_next = np.diff(np.floor(cumulative), axis=-1, prepend=0.0) > 0.0
    return np.where(is_large, weights, np.where(is_next, threshold, 0.0))
