"""Blending the visible guides between their style and their simulation.

The simulation itself is not affected. Blending positions would shorten a guide that has swung far,
so directions and lengths of segments are blended, and the segments joined from the root on.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from .constraints import TINY

#: A blend of two unit vectors shorter than this has no direction.
MIN_DIRECTION = np.float32(1.0e-4)


def visible_guides(simulated: Floats, style: Floats, fraction: Floats | None) -> Floats:
    """The visible guides, float32: `blended`, or the simulated ones if `fraction` is None."""
    if fraction is None:
        return simulated
    return blended(simulated, style.astype(np.float32), fraction)


def blended(simulated: Floats, style: Floats, fraction: Floats) -> Floats:
    """Blended guides (guide_count, cv_count, 3) [m], with the roots of the style.

    Args:
        fraction: (guide_count,), 0 gives the style and 1 the simulation, both exactly.
    """
    part = fraction.astype(np.float32)[:, None, None]
    segments = blended_segment(np.diff(simulated, axis=1), np.diff(style, axis=1), part)
    guides = np.array(style)
    for cv in range(1, style.shape[1]):
        guides[:, cv] = guides[:, cv - 1] + segments[:, cv - 1]
    return np.where(part == 0.0, style, np.where(part == 1.0, simulated, guides))


def blended_segment(simulated: Floats, style: Floats, fraction: Floats) -> Floats:
    """Vectors (..., 3) [m] blended by direction and length; if their directions cancel out, the
    direction of `simulated` is used."""
    long, rest = (np.linalg.norm(each, axis=-1, keepdims=True) for each in (simulated, style))
    toward, ahead = simulated / np.maximum(long, TINY), style / np.maximum(rest, TINY)
    direction = ahead + (toward - ahead) * fraction
    size = np.linalg.norm(direction, axis=-1, keepdims=True)
    direction = np.where(size > MIN_DIRECTION, direction / np.maximum(size, MIN_DIRECTION), toward)
    length = rest + (long - rest) * fraction
    blend: Floats = direction * length
    return blend
