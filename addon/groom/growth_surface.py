"""Keeping hair outside of the head while it grows.

The skin is looked up at each point of many strands. The nearest triangle is searched only for the
points of a grid, on first use, and kept with the surface: hair that grows again after an edit finds
most of them. A point is then measured exactly, against the triangle of the nearest grid point.

Limitation: at edges, such as an ear's, that triangle may be beside the nearest one. On the built-in
head with cells of 4 mm, 99 of 100 heights are off by less than 0.4 mm, half of them not at all.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..strands import Surface
from ..strands.closest_point import search_of
from ..strands.vectors import unit

#: Minimum distance up to which the nearest triangle is searched, in cells.
_FAR = 30
#: Cells of the grid are numbered along each axis from minus this to this.
_MAX_NUMBER = (1 << 20) - 1


class GrowthSurface:
    """A surface that growing hair may touch but not enter.

    Args:
        reach: how deep inside a point may be, at most [m].
        cell: side of a cell of the grid [m].

    Raises:
        HairloomError: the surface has no triangles.
    """

    def __init__(self, surface: Surface, reach: float, cell: float) -> None:
        self._search = search_of(surface)
        self._triangles = surface.triangles
        self._normals = surface.compute_once(_normals)
        self._reach = reach
        # rounded up to a power of two, so that most edits find what is known
        searched = 2.0 ** np.ceil(np.log2(max(reach, _FAR * cell) + cell))
        self._nearest = surface.compute_if_changed(_NearestTriangles, float(searched), cell)

    def normal(self, triangle: Ints, barycentric: Floats) -> Floats:
        """Smooth unit normals at points of the surface, (n, 3)."""
        return unit(np.einsum("nk,nkj->nj", barycentric, self._normals[self._triangles[triangle]]))

    def nearest_normal(self, points: Floats) -> Floats:
        """Smooth unit normals of the skin nearest to points (n, 3), (n, 3); 0 beyond its reach."""
        closest = self._search.closest_on(points, self._nearest.of(points))
        is_near = closest.distance < self._reach
        return is_near[:, None] * self.normal(closest.triangle, closest.barycentric)

    def outside(self, points: Floats, clearance: Floats) -> Floats:
        """The points (n, 3), those nearer than their clearance (n,) lifted along the normal."""
        closest = self._search.closest_on(points, self._nearest.of(points))
        normal = self.normal(closest.triangle, closest.barycentric)
        height = np.einsum("ij,ij->i", points - closest.point, normal)
        lift = np.where(closest.distance < self._reach, np.maximum(clearance - height, 0.0), 0.0)
        return points + lift[:, None] * normal

    def step(self, start: Floats, direction: Floats, length: Floats, clearance: Floats) -> Floats:
        """The ends of segments from `start` in this direction, led around the surface, (n, 3)."""
        there = self.outside(start + unit(direction) * length[:, None], clearance)
        return start + unit(there - start) * length[:, None]


class _NearestTriangles:
    """The nearest triangles of the points of a grid, each searched on first use.

    Args:
        reach: [m]; for points farther away than this it is any triangle.
        cell: [m].
    """

    def __init__(self, surface: Surface, reach: float, cell: float) -> None:
        self._search = search_of(surface)
        self._reach, self._cell = reach, cell
        self._middle = np.mean(surface.bounds(), axis=0, dtype=np.float64)
        self._known = np.zeros(0, np.int64)
        self._triangle = np.zeros(0, np.int64)

    def of(self, points: Floats) -> Ints:
        """The triangle of the grid point that is nearest to each of the points (n, 3), (n,)."""
        number = np.rint((points - self._middle) / self._cell).astype(np.int64)
        number = np.clip(number, -_MAX_NUMBER, _MAX_NUMBER) + _MAX_NUMBER
        key = (number[:, 0] << 42) | (number[:, 1] << 21) | number[:, 2]
        wanted, first, back = np.unique(key, return_index=True, return_inverse=True)
        is_new = ~np.isin(wanted, self._known, assume_unique=True)
        if is_new.any():
            self._find(wanted[is_new], number[first[is_new]])
        return self._triangle[np.searchsorted(self._known, wanted)[back]]

    def _find(self, key: Ints, number: Ints) -> None:
        there = self._middle + (number - _MAX_NUMBER) * self._cell
        triangle = self._search.nearest(there, self._reach)
        place = np.searchsorted(self._known, key)
        self._known = np.insert(self._known, place, key)
        self._triangle = np.insert(self._triangle, place, triangle)


def _normals(surface: Surface) -> Floats:
    return surface.vertex_normals().astype(np.float64)
