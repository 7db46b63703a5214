"""How much hair a card stands for in opacity maps.

Strands that cover a place at random, tau times over, leave exp(-tau) of it open (Poisson). A card
whose texture covers alpha of a place leaves 1 - alpha open, so it stands for -log(1 - alpha)
strands, one behind the other. Twin of gpu_shaders/lib_card_opacity.glsl and
lib_card_shadows.glsl.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Floats

#: a card lets at least as much light through as this leaves: four strands are as good as a wall
MOST_ALPHA = 0.98


def card_optical_depth(alpha: Floats) -> Floats:
    """tau that light meets in a card, (...)."""
    return -np.log1p(-np.minimum(alpha, MOST_ALPHA))


def own_share(depth: Floats, bias: float, ends: Floats) -> Floats:
    """How much of a card counts towards tau at the card itself, (...).

    It is part of the sum of the layer in which it lies, and tau grows evenly through that. A card
    has all its hair in one place, where this matters, unlike strands.

    Args:
        depth, bias: of the card behind the start of the layers, (...), and how close in front of
            it nothing counts, in shares of how thick they are together.
        ends: of the layers, (n,).
    """
    layer = np.minimum(np.searchsorted(ends, depth), len(ends) - 1)
    start = np.concatenate([[0.0], ends[:-1]])[layer]
    return np.clip((depth - bias - start) / (ends[layer] - start), 0.0, 1.0)
