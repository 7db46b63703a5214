"""How strands are attached to the head, as the GPU wants it.

Pure numpy: importable without gpu.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..strands import StrandSet, Surface


class RootHolds:
    """Which vertices hold the roots of strands, and how.

    Args:
        strands: bound to the head.

    vertices: (n,) indices of the head's vertices that any root is attached to.
    texels: (strand_count, 2, 4) as root_holds, triangles by place in `vertices`.
    rest_positions: (vertex_count, 3) [m] of the head.
    """

    def __init__(self, strands: StrandSet, head: Surface) -> None:
        assert strands.root_triangle is not None and strands.root_barycentric is not None
        corners = head.triangles[strands.root_triangle]
        self.vertices, place = np.unique(corners, return_inverse=True)
        place = place.reshape(corners.shape)
        self.rest_positions = head.positions
        self.texels = np.zeros((len(corners), 2, 4), np.float32)
        self.texels[:, 0, :3] = place
        self.texels[:, 1, :2] = weight = strands.root_barycentric[:, 1:]
        fractions = np.column_stack([1.0 - weight.sum(axis=1, dtype=np.float64), weight])
        self._fraction = np.bincount(place.ravel(), fractions.ravel()) / max(len(corners), 1)
        surface_mean = self._fraction @ head.positions[self.vertices]
        self._lift = strands.roots.mean(axis=0, dtype=np.float64) - surface_mean

    def center(self, head_positions: Floats) -> Floats:
        """The middle of all roots (3,) [m]; how far they stand off the surface does not turn."""
        middle = self._fraction @ head_positions[self.vertices] + self._lift
        return np.asarray(middle, np.float32)


def matrix_motion(matrix: Floats) -> Floats:
    """An affine (4, 4) motion of the world as the one root motion of all strands, (1, 4, 4).

    As ride_roots.comp.glsl writes it: xyz a column of the turn and w a coordinate of the shift,
    three times, then xyz the rest origin.
    """
    motion = np.zeros((1, 4, 4))
    motion[0, :3, :3] = (matrix[:3, :3] - np.eye(3)).T
    motion[0, :3, 3] = matrix[:3, 3]
    return motion
