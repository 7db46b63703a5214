"""A solid that moves: what it is asked for, and its way during a frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...arrays import Floats, Ints
from ...errors import HairloomError
from ..way import at


class Collider(Protocol):
    """A solid in its own object space, asked for signed distances (negative inside)."""

    @property
    def bounds(self) -> tuple[Floats, float]:
        """Center (3,) and radius [m] of a sphere around it."""

    def near(self, points: Floats, reach: float) -> Ints:
        """Indices of the points (3, n) that may be closer than `reach` [m], quickly."""

    def distance(self, points: Floats) -> tuple[Floats, Floats]:
        """Signed distance [m] (n,) at the points (3, n), and its gradient (3, n)."""


@dataclass(frozen=True)
class PosedCollider:
    """A collider and its way during one frame.

    matrix_before, matrix_now: (4, 4) affine, object to world, at the frame's begin and end.
    matrix_bow: (4, 4), how the way between them is bent, see `way.bow`; None: straight.

    Raises:
        HairloomError: a matrix that is not finite or flattens the collider.
    """

    collider: Collider
    matrix_before: Floats
    matrix_now: Floats
    matrix_bow: Floats | None = None

    def __post_init__(self) -> None:
        for name in ("matrix_before", "matrix_now", "matrix_bow"):
            if getattr(self, name) is None:
                continue
            matrix = np.asarray(getattr(self, name), np.float64)
            object.__setattr__(self, name, matrix)
            if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
                raise _broken("its matrix is not a finite 4 by 4 matrix")
            if name != "matrix_bow" and np.linalg.cond(matrix[:3, :3]) > 1.0e6:
                raise _broken("its scale is zero")

    def matrix_at(self, moment: float) -> Floats:
        """Object to world (4, 4) float64 at `moment`, 0 the frame's begin and 1 its end."""
        way = self.matrix_now - self.matrix_before
        return at(self.matrix_before, way, self.matrix_bow, moment)


def transform_points(matrix: Floats, points: Floats) -> Floats:
    """Points (3, n) moved by an affine (4, 4) matrix, float32, without BLAS."""
    rows = np.asarray(matrix, np.float32)
    result: Floats = np.einsum("ij,jn->in", rows[:3, :3], points)
    result += rows[:3, 3:]
    return result


def _broken(problem: str) -> HairloomError:
    return HairloomError(
        problem, place="collider", remedy="Apply or correct the collider's transform"
    )
