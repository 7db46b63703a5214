"""How far a strand has its tips' colour; both models ask this.

Twin of `tip_fraction` in gpu_shaders/lib_tint.glsl.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from .settings import SharedSettings

#: Where the change begins at or behind its end, it takes this fraction of the strand: a step.
MIN_SPAN = 1.0e-4


def tip_fraction(along: Floats, settings: SharedSettings) -> Floats:
    """How much of the tips' colour a place has, (...), in [0, 1]; `along` is 0 to 1 from the root.

    smoothstep(tint_start, tint_end, along) * tip_tint.
    """
    span = max(settings.tint_end - settings.tint_start, MIN_SPAN)
    rise = np.clip((np.asarray(along) - settings.tint_start) / span, 0.0, 1.0)
    return settings.tip_tint * rise * rise * (3.0 - 2.0 * rise)
