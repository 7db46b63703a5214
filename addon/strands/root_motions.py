"""How the roots of strands have moved since rest, and what that adds to what they carry.

Vectors lie as planes here, (3, n), so that a motion is not repeated for each point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class RootMotions:
    """Affine motions, one for each of n strands, or a single one for all of them.

    turn: (3, 3, n) float32, what turning adds to a vector, as a matrix: zero for no turn.
    shift: (3, n) float32 [m], of the origin.
    origin: (3, n) float32 [m], the place at rest that does not turn.
    """

    turn: Floats
    shift: Floats
    origin: Floats

    @classmethod
    def of_matrix(cls, matrix: Floats) -> RootMotions:
        """The single one of a (4, 4) matrix."""
        turn = (matrix[:3, :3] - np.eye(3))[..., None].astype(np.float32)
        return cls(turn, matrix[:3, 3:].astype(np.float32), np.zeros((3, 1), np.float32))

    def change(self, rows: Floats, strands: Ints | slice) -> Floats:
        """What moving with their roots adds to points at rest.

        Args:
            rows: (3, n) one point of each strand, or (3, m, n) m of each.
            strands: (n,) which.
        """
        of = self.of(strands, rows.ndim)
        local = rows - of.origin
        result = of.turn[:, 0] * local[0]
        result += of.shift
        for axis in (1, 2):
            result += of.turn[:, axis] * local[axis]
        return result

    def carried(self, points: Floats, index: Ints, strands: Ints) -> Floats:
        """Where some points (point_count, 3) of strands at rest are carried, (n, 3).

        Args:
            index: (n,), which points.
            strands: (n,), which strand each belongs to.
        """
        rest = points.take(index, axis=0)
        return rest + self.change(np.ascontiguousarray(rest.T), strands).T

    def of(self, strands: Ints | slice, dimensions: int = 2) -> RootMotions:
        """Those of some strands, for arrays of two or three dimensions."""
        found = []
        for values in (self.turn, self.shift, self.origin):
            if values.shape[-1] > 1:
                if isinstance(strands, slice):
                    values = values[..., strands]
                else:
                    values = values.take(strands, axis=-1)
            found.append(values if dimensions == 2 else values[..., None, :])
        return RootMotions(*found)
