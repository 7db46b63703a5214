"""How the roots of strands have moved since rest, and the displacement that carries points along.

Vectors are stored as planes, (3, n), so that a motion broadcasts over the points of its strand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class RootMotions:
    """Affine motions, one for each of n strands, or a single one for all of them.

    turn: (3, 3, n) float32, the linear part minus the identity: zero for no turn.
    shift: (3, n) float32 [m], the displacement of the origin.
    origin: (3, n) float32 [m], the point at rest that the motion turns about.
    """

    turn: Floats
    shift: Floats
    origin: Floats

    @classmethod
    def of_matrix(cls, matrix: Floats) -> RootMotions:
        """The single motion of a (4, 4) matrix."""
        turn = (matrix[:3, :3] - np.eye(3))[..., None].astype(np.float32)
        return cls(turn, matrix[:3, 3:].astype(np.float32), np.zeros((3, 1), np.float32))

    def displacement(self, rows: Floats, strands: Ints | slice) -> Floats:
        """The displacement of points at rest when they move with their roots, shaped like `rows`.

        Args:
            rows: (3, n) one point of each strand, or (3, m, n) m points of each.
            strands: (n,) the strand of each column.
        """
        motions = self.take(strands, rows.ndim)
        local = rows - motions.origin
        result = motions.turn[:, 0] * local[0]
        result += motions.shift
        for axis in (1, 2):
            result += motions.turn[:, axis] * local[axis]
        return result

    def carried(self, points: Floats, index: Ints, strands: Ints) -> Floats:
        """Where some of the points (point_count, 3) at rest are carried to, (n, 3).

        Args:
            index: (n,), the points to carry.
            strands: (n,), the strand that each belongs to.
        """
        rest = points.take(index, axis=0)
        return rest + self.displacement(np.ascontiguousarray(rest.T), strands).T

    def take(self, strands: Ints | slice, dimensions: int = 2) -> RootMotions:
        """The motions of strands (k,), which broadcast over `dimensions`: 2 for planes (3, k), or 3
        for (3, m, k).
        """
        found = []
        for values in (self.turn, self.shift, self.origin):
            if values.shape[-1] > 1:
                if isinstance(strands, slice):
                    values = values[..., strands]
                else:
                    values = values.take(strands, axis=-1)
            found.append(values if dimensions == 2 else values[..., None, :])
        return RootMotions(*found)
