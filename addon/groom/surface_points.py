"""Keeping hair outside of the head while it grows."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..strands import Surface
from ..strands.closest_point import search_of
from ..strands.vectors import unit


class GrowthSurface:
    """A surface that growing hair may touch but not enter.

    Args:
        reach: how deep a point may have come inside, at most [m]; smaller is faster.

    Raises:
        HairloomError: the surface has no triangles.
    """

    def __init__(self, surface: Surface, reach: float) -> None:
        self._search = search_of(surface)
        self._triangles = surface.triangles
        self._normals = surface.vertex_normals().astype(np.float64)
        self._reach = reach

    def normal(self, triangle: Ints, barycentric: Floats) -> Floats:
        """Smooth unit normals at points of the surface, (n, 3)."""
        return unit(np.einsum("nk,nkj->nj", barycentric, self._normals[self._triangles[triangle]]))

    def nearest_normal(self, points: Floats) -> Floats:
        """Smooth unit normals of the skin nearest to points (n, 3), (n, 3); 0 beyond its reach."""
        closest = self._search.closest(points, self._reach)
        is_near = closest.distance < self._reach
        return is_near[:, None] * self.normal(closest.triangle, closest.barycentric)

    def outside(self, points: Floats, clearance: Floats) -> Floats:
        """The points (n, 3), those nearer than their clearance (n,) lifted along the normal."""
        closest = self._search.closest(points, self._reach)
        normal = self.normal(closest.triangle, closest.barycentric)
        height = np.einsum("ij,ij->i", points - closest.point, normal)
        lift = np.where(closest.distance < self._reach, np.maximum(clearance - height, 0.0), 0.0)
        return points + lift[:, None] * normal

    def step(self, start: Floats, direction: Floats, length: Floats, clearance: Floats) -> Floats:
        """Where hair arrives that goes this way from here, around the surface, (n, 3)."""
        there = self.outside(start + unit(direction) * length[:, None], clearance)
        return start + unit(there - start) * length[:, None]
