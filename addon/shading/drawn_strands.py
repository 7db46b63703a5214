"""Strands as they are drawn, for those who bake them: how wide they are, and of which colour."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from .card_look import card_base
from .kajiya_kay import strand_base
from .marschner.look import strand_absorption, strand_color
from .settings import ShadingSettings, StrandSettings
from .strand_noise import strand_noise

#: Channels of the strands' noise, as in gpu_shaders/lib_strand_light.glsl.
_COLOR, _GREY = 2, 3
#: What grey strands may be brighter than hair that is nearly black.
_MAX = 4.0
_DARKEST = 1e-4


def drawn_radius(radius: Floats, settings: StrandSettings) -> Floats:
    """Half the width that strands are drawn with, (n, cv_count) [m], narrower towards the tip.

    Args:
        radius: (n, cv_count) [m].
    """
    taper = np.linspace(1.0, settings.tip_width, radius.shape[1], dtype=np.float32)
    drawn: Floats = radius * (np.float32(settings.fullness) * taper)
    return drawn


def strand_variation(seed: Ints, cv_count: int, shading: ShadingSettings) -> Floats:
    """The colour of strands as a factor of the card's mean, (n, cv_count, 3), up to _MOST.

    Args:
        seed: (n,) what the noise of a strand depends on, as in Snapshot.
    """
    along = np.linspace(0.0, 1.0, cv_count)[None, :]
    color_noise = strand_noise(seed, _COLOR, np.zeros(1))[:, None]
    grey_noise = strand_noise(seed, _GREY, np.zeros(1))[:, None]
    if shading.model == "marschner":
        own = strand_color(strand_absorption(shading, along, color_noise, grey_noise))
        even = np.full_like(along, 0.5)
        colored, grey = (strand_absorption(shading, along, even, even + s) for s in (1.0, -1.0))
        mean = strand_color(colored + (grey - colored) * shading.grey_fraction)
    else:
        own = strand_base(along, color_noise, grey_noise, shading)
        mean = card_base(along, shading)
    return np.clip(own / np.maximum(mean, _DARKEST), 0.0, _MAX)
