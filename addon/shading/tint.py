"""The fraction of the tip colour along a strand, for both models.

Twin of `tip_fraction` in gpu_shaders/lib_tint.glsl.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from .settings import SharedSettings

#: Minimum length of the change, as a fraction of the strand: a step if it begins at or behind its
#: end.
MIN_SPAN = 1.0e-4


def tip_fraction(along: Floats, settings: SharedSettings) -> Floats:
    """The fraction of the tip colour at places, (...), in [0, 1]; `along` is 0 to 1 from the root.

    smoothstep(tint_start, tint_end, along) * tip_tint.
    """
    span = max(settings.tint_end - settings.tint_start, MIN_SPAN)
    rise = np.clip((np.asarray(along) - settings.tint_start) / span, 0.0, 1.0)
    return settings.tip_tint * rise * rise * (3.0 - 2.0 * rise)
