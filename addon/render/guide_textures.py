"""What DynamicsPass keeps of its guides on the GPU, in the layout of textures.strand_rows:

positions      RGBA32F: xyz world [m], w the z of a substep earlier
previous_positions   RG32F: x and y of a substep earlier; software drivers take time for each
               number that is written
bridged        RGBA32F: xyz world [m], at the frame's very end (step.grid_at_frame_end)
styles_earlier, styles_before, styles_now   RGBA32F: xyz world [m], see frame.Drive
rest_shapes    RGBA32F: of CV i xyz curvature [m] and w hold (style.LocalShape); of CV 0 x its
               twist CV
rest_lengths   R32F: [m] to the next CV; at the tip whether it is held
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Floats
from ..dynamics.state import Rest
from .textures import strand_rows, texture_from


def points_texture(grid: Floats, lane: Floats | float = 0.0) -> Any:
    """Points (guide_count, cv_count, 3) as a texture in the layout of strand_rows.

    Args:
        lane: (guide_count, cv_count) what goes with them in w.
    """
    points = np.empty((*grid.shape[:2], 4), np.float32)
    for axis in range(3):  # one by one is three times faster than all three
        points[..., axis] = grid[..., axis]
    points[..., 3] = lane
    return texture_from(strand_rows(points), "RGBA32F")


def rest_shapes(rest: Rest) -> Floats:
    """`rest_shapes`, (guide_count, cv_count, 4)."""
    shapes = np.zeros((*rest.position.shape[:0:-1], 4), np.float32)
    shapes[:, 1:-1, :3] = rest.shape.curvature.transpose(2, 1, 0)
    shapes[:, 1:-1, 3] = rest.shape.hold.T
    shapes[:, 0, 0] = rest.shape.twist_cv
    return shapes


def rest_lengths(rest: Rest) -> Floats:
    """`rest_lengths`, (guide_count, cv_count, 1)."""
    lengths = np.zeros((*rest.position.shape[:0:-1], 1), np.float32)
    lengths[:, :-1, 0] = rest.length.T
    if rest.tip_held is not None:
        lengths[:, -1, 0] = rest.tip_held
    return lengths
