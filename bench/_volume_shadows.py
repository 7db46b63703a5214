"""Errors of opacity maps, against counting the strands between light and point one by one.

On a ball of combed hair, and on Sintel's head if the shared data is there, with strands of several
widths: the mean error of T at 10,000 random points of strands, relative to the mean of T.
"""

from __future__ import annotations

import numpy as np
from _refinement_views import groom
from hair_ball import combed_strands
from shadow_errors import errors

from hairloom.addon.shading.lights import Light

STRANDS, RADIUS = 14_000, 0.003
SUN = Light.sun((-0.45, -0.5, -0.8), (1.0, 1.0, 1.0), 1.0)
HEAD_SUN = Light.sun((0.4, -0.8, -0.5), (1.0, 1.0, 1.0), 1.0)
#: radii of Sintel's strands [m]
HEAD_RADII = {"thin": 4.0e-5, "middle": 1.0e-4, "thick": 2.0e-4}


def shadow_figures() -> dict[str, float]:
    """t_error_<method>: on the ball; t_error_<groom>_<width>_<method>: on the head.
    Methods of layers are slicesN and deepN; none is light without shadow.
    """
    ball = combed_strands(STRANDS).astype(np.float64)
    found = {f"t_error_{method}": error for method, error in errors(ball, RADIUS, SUN).items()}
    head = groom()
    strands = head.strands.astype(np.float64)
    for width, radius in HEAD_RADII.items():
        of_head = errors(strands, radius, HEAD_SUN, slices=(16,), layers=(4, 8, 16))
        name = f"t_error_{head.name.lower()}_{width}"
        found |= {f"{name}_{method}": error for method, error in of_head.items()}
    return found
