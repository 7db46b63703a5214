"""Whether previewed hair swings, as tests ask that let something happen to it meanwhile."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from grids import grid_of

FRAME = 1.0 / 24.0  # [s]
#: the push of a head in each of some frames [m]
STEP, FRAMES = 0.03, 4


def swings(session: Any) -> bool:
    """Whether hair that plays lags behind its head, pushed from rest, while its roots do not."""
    from hairloom.addon.blender.preview import previews

    previews.rest(bpy.context.evaluated_depsgraph_get(), keep_playing=True)
    head, before = session.head.found(), grid_of(session)
    for _ in range(FRAMES):
        head.location.x += STEP
        previews.advance(bpy.context.evaluated_depsgraph_get(), FRAME)
    offset = grid_of(session) - before - [FRAMES * STEP, 0.0, 0.0]
    return bool(offset[:, -1, 0].mean() < -0.005 and np.abs(offset[:, 0]).max() < 1e-5)
