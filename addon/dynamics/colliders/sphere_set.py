"""A union of balls as one collider, a fast approximation of a mesh.

The distance is that of the nearest ball, min_i |x - c_i| - r_i. A grid narrows down which ball is
nearest (see `ball_grid.py`), so that a query tests a few balls instead of all.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...arrays import Floats, Ints, piece_starts, rows_of_ranges
from ...errors import HairloomError
from .ball_grid import PAIR_LIMIT, BallGrid, ball_distances, ball_grid, box_of
from .shapes import distance_from, is_solid


@dataclass(frozen=True, eq=False)
class SphereSetCollider:
    """A union of balls.

    centers: (n, 3) float32 object space [m]. radii: (n,) float32 [m].

    Raises:
        HairloomError: no balls, arrays that do not fit each other, a place that is not finite, or
            a radius that is not above zero.
    """

    centers: Floats
    radii: Floats

    def __post_init__(self) -> None:
        for name in ("centers", "radii"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), np.float32))
        count = len(self.radii) if self.radii.ndim == 1 else 0
        if not count or self.centers.shape != (count, 3):
            raise _broken(
                f"centers of shape {self.centers.shape} and radii of shape {self.radii.shape} are "
                "not a set of balls",
                "Give centers (n, 3) and radii (n,), one ball or more",
            )
        if not is_solid(self.radii, self.centers):
            raise _broken(
                "one of its balls has no volume or no finite place",
                "Give finite places and radii above zero",
            )

    @property
    def bounds(self) -> tuple[Floats, float]:
        low, high = box_of(self.centers, self.radii)
        middle = (low + high) / np.float32(2.0)
        displacement = np.sqrt(((self.centers - middle) ** 2).sum(axis=1))
        return middle, float((displacement + self.radii).max())

    @property
    def curve_radius(self) -> float:
        return float(self.radii.min())

    def near(self, points: Floats, reach: Floats | float) -> Ints:
        """See `Collider.near`; tests the cell of each point, or the cell nearest to it.

        All balls lie within the grid's box, so no point is nearer to a ball than to the box.
        """
        index, outside = self._cells(points)
        kept: Ints = np.flatnonzero(
            (self._grid.min_distance.take(index) < reach) & (outside < reach * reach)
        )
        return kept

    def distance(self, points: Floats) -> tuple[Floats, Floats]:
        """Signed distance [m] (n,) of the nearest ball at points (3, n), and gradient (3, n)."""
        index, outside = self._cells(points)
        nearest = self._nearest_in_cells(points, index)
        away = np.flatnonzero(outside > 0.0)
        if away.size:
            nearest[away] = self._nearest_of_all(points[:, away])
        return distance_from(points - self.centers[nearest].T, self.radii[nearest])

    @cached_property
    def _grid(self) -> BallGrid:
        """Made with the first query: the GPU needs none."""
        return ball_grid(self.centers, self.radii)

    def _cells(self, points: Floats) -> tuple[Ints, Floats]:
        """Flat cell of each point, clamped to the grid, and its squared distance from it [m^2]."""
        grid, size = self._grid, np.float32(1.0 / self._grid.cell)
        index = np.zeros(points.shape[1], np.int32)
        outside = np.zeros(points.shape[1], np.float32)
        for axis, row in enumerate(points):
            place = (row - grid.low[axis]) * size
            held = np.clip(place, np.float32(0.0), np.float32(grid.shape[axis]))
            place -= held
            outside += place * place
            index *= grid.shape[axis]
            index += np.minimum(held.astype(np.int32), grid.shape[axis] - 1)
        outside *= np.float32(grid.cell * grid.cell)
        return index, outside

    def _nearest_in_cells(self, points: Floats, cells: Ints) -> Ints:
        """The nearest ball (n,) among those of the points' cells."""
        row, begin = self._grid.cell_row.take(cells), self._grid.row_begin
        first = begin.take(row)
        count = begin.take(row + 1) - first
        start = piece_starts(count)  # of each point's pairs
        ball = self._grid.ball_index.take(rows_of_ranges(first, count))
        squared = np.zeros(len(ball), np.float32)
        for axis, row in enumerate(points):
            displacement = np.repeat(row, count)
            displacement -= self.centers[:, axis].take(ball)
            squared += displacement * displacement
        distance = np.sqrt(squared)
        distance -= self.radii.take(ball)
        if not len(start):
            return start
        is_least = distance == np.repeat(np.minimum.reduceat(distance, start), count)
        nearest = np.zeros(len(start), ball.dtype)
        nearest[np.repeat(np.arange(len(start)), count)[is_least]] = ball[is_least]
        return nearest

    def _nearest_of_all(self, points: Floats) -> Ints:
        parts = np.array_split(points, -(-points.shape[1] * len(self.radii) // PAIR_LIMIT), axis=1)
        return np.concatenate(
            [ball_distances(part, self.centers, self.radii).argmin(axis=0) for part in parts]
        )


def _broken(problem: str, remedy: str) -> HairloomError:
    return HairloomError(problem, place="sphere set collider", remedy=remedy)
