"""Guides between their style and their simulation, for what is shown: the simulation goes on as if
all of it were seen.

Blending places would shorten a guide that has swung far. So each segment has a direction between
both, and a length between both, and the segments are put together from the root on.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from .constraints import TINY

#: Sums of two unit vectors that are shorter than this have no direction.
OPPOSITE = np.float32(1.0e-4)


def seen(simulated: Floats, style: Floats, fraction: Floats | None) -> Floats:
    """What is seen of simulated guides, see `blended`, float32; None: all of all."""
    if fraction is None:
        return simulated
    return blended(simulated, style.astype(np.float32), fraction)


def blended(simulated: Floats, style: Floats, fraction: Floats) -> Floats:
    """Guides (guide_count, cv_count, 3) [m], the root that of the style.

    Args:
        fraction: (guide_count,), 0 is the style and 1 the simulation, each to the bit.
    """
    part = fraction.astype(np.float32)[:, None, None]
    segments = blended_segment(np.diff(simulated, axis=1), np.diff(style, axis=1), part)
    guides = np.array(style)
    for cv in range(1, style.shape[1]):
        guides[:, cv] = guides[:, cv - 1] + segments[:, cv - 1]
    return np.where(part == 0.0, style, np.where(part == 1.0, simulated, guides))


def blended_segment(simulated: Floats, style: Floats, fraction: Floats) -> Floats:
    """Vectors (..., 3) [m] between two others; where these point against each other, the
    simulated one's direction."""
    long, rest = (np.linalg.norm(each, axis=-1, keepdims=True) for each in (simulated, style))
    toward, ahead = simulated / np.maximum(long, TINY), style / np.maximum(rest, TINY)
    direction = ahead + (toward - ahead) * fraction
    size = np.linalg.norm(direction, axis=-1, keepdims=True)
    direction = np.where(size > OPPOSITE, direction / np.maximum(size, OPPOSITE), toward)
    length = rest + (long - rest) * fraction
    blend: Floats = direction * length
    return blend
