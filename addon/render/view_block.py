"""The uniform block `View` that every drawing shader shares (struct_view.glsl)."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from .camera import Camera


def view_values(camera: Camera, width: int, height: int) -> Floats:
    """`View` in std140, (40,) float32; GLSL's matrices are stored by columns.

    Args:
        width, height: of the target [pixels].
    """
    projection = np.asarray(camera.projection, np.float64)
    view_projection = projection @ np.asarray(camera.view, np.float64)
    viewport = np.array([width, height, camera.sample, 0.0])
    return np.concatenate(
        [view_projection.T.ravel(), projection.T.ravel(), camera.eye, viewport]
    ).astype(np.float32)
