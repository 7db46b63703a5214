"""The upper limit of the distance that guides keep from colliders: that at which they were combed.

The collision radius of a CV depends on the length of all hair. Brows, and hair that lies close to
the head, are nearer than that; without this limit, a motion would begin by lifting them off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Floats
from .colliders import PosedCollider, signed_distance
from .contacts import SEGMENT_POINTS
from .settings import DynamicsSettings


@dataclass(frozen=True, eq=False)
class GuideClearance:
    """Distances from colliders when a motion began.

    max_distance: [m], upper limit of the distances.
    distances: (guide_count, cv_count, 1 + len(SEGMENT_POINTS)) float32 [m], of each CV, and of the
        points of the segment that ends there; 0 for points inside, which are moved out to the
        surface.
    """

    max_distance: float
    distances: Floats

    @cached_property
    def rows(self) -> Floats:
        """The same as (1 + len(SEGMENT_POINTS), cv_count, guide_count)."""
        return np.ascontiguousarray(self.distances.transpose(2, 1, 0))


def max_clearance(settings: DynamicsSettings, size: float) -> float:
    """The largest distance [m] that a CV keeps from colliders, for hair of this size [m]."""
    return size * max(settings.radius_root, settings.radius_tip)


def guide_clearance(
    grid: Floats, colliders: Sequence[PosedCollider], max_distance: float
) -> GuideClearance:
    """The clearance of a motion that begins now.

    Args:
        grid: (guide_count, cv_count, 3) world [m], at rest.
        colliders: used in their poses at the frame's end.
        max_distance: [m], see `max_clearance`.
    """
    before = grid[:, np.maximum(np.arange(grid.shape[1]) - 1, 0)]
    points = [grid, *(before + (grid - before) * np.float32(along) for along in SEGMENT_POINTS)]
    distance, _ = signed_distance(np.stack(points, axis=2).reshape(-1, 3), colliders, max_distance)
    shape = (*grid.shape[:2], len(points))
    return GuideClearance(max_distance, np.maximum(distance, np.float32(0.0)).reshape(shape))
