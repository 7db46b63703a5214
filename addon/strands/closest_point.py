"""The closest point of a triangle mesh, exact, for many points at once.

The distance to a triangle is a quadratic form in its barycentric coordinates; its minimum lies
inside or on one of the three edges (Ericson, Real-Time Collision Detection 2005, section 5.1.5).
Taking the least of those four candidates, instead of Ericson's region tests, needs no division by
the area, so that slivers, doubled corners and single points are answered like any triangle.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..errors import HairloomError
from .surface import Surface
from .triangle_tree import TriangleTree, build_tree

#: Points searched at once: their pairs with boxes stay in the processor's cache.
_CHUNK = 4096
#: Pairs of points and boxes held at once; more than this halves the chunk.
_PAIR_LIMIT = 2_000_000
#: A triangle whose area^2 is below this part of its edges' product has no inside, only edges.
_FLAT = 1.0e-12


@dataclass(frozen=True)
class ClosestPoints:
    """One answer a point, in the space of the surface.

    point: (point_count, 3) float64 [m].
    triangle: (point_count,) int32, index into the surface's triangles.
    barycentric: (point_count, 3) float64, not negative, summing to 1.
    distance: (point_count,) float64 [m], unsigned.
    """

    point: Floats
    triangle: Ints
    barycentric: Floats
    distance: Floats


class ClosestPointSearch:
    """A surface prepared for many calls of `closest`.

    Raises:
        HairloomError: the surface has no triangles.
    """

    def __init__(self, surface: Surface) -> None:
        if not len(surface.triangles):
            raise HairloomError(
                "the mesh has no faces",
                place="mesh data",
                remedy="Choose a mesh with faces as the surface",
            )
        low, high = surface.bounds()
        self._center = (low.astype(np.float64) + high) / 2.0  # keeps the dot products small
        self._corners = surface.corners - self._center
        self._forms = _forms(self._corners)
        self._tree: TriangleTree = build_tree(self._corners)

    def closest(self, points: Floats, reach: float = np.inf) -> ClosestPoints:
        """The closest point of the surface to each of the finite points (point_count, 3).

        Args:
            reach: [m]; where the surface is farther than this, the answer is some point of it
                that is farther than this as well. Much faster where few points are near.
        """
        local = np.asarray(points, np.float64).reshape(-1, 3) - self._center
        starts = range(0, len(local), _CHUNK)
        chunks = [self._search(local[i : i + _CHUNK], reach) for i in starts]
        triangle = np.concatenate(chunks) if chunks else np.zeros(0, np.int64)
        _, barycentric = self._measure(local, triangle)
        closest = np.einsum("ni,nij->nj", barycentric, self._corners[triangle])
        distance = np.linalg.norm(local - closest, axis=1)
        return ClosestPoints(
            closest + self._center, triangle.astype(np.int32), barycentric, distance
        )

    def _search(self, points: Floats, reach: float) -> Ints:
        """The nearest triangle of each point: a good guess, then all that could be nearer."""
        guess = self._tree.nearest_leaf(points)
        distance, triangle = self._nearest_in_leaves(points, guess)
        # a hair more than the reach, so that a point just within it is found
        within = np.minimum(distance, reach * reach * (1.0 + 1e-9))
        pairs = self._tree.leaves_within(
            points, within, _PAIR_LIMIT if len(points) > 1 else sys.maxsize
        )
        if pairs is None:
            half = len(points) // 2
            halves = (points[:half], points[half:])
            return np.concatenate([self._search(part, reach) for part in halves])
        point, leaf = pairs
        if not len(point):
            return triangle
        pair_distance, pair_triangle = self._nearest_in_leaves(points[point], leaf)
        first = np.flatnonzero(np.diff(point, prepend=-1))
        seen = point[first]
        distance[seen] = np.minimum(distance[seen], np.minimum.reduceat(pair_distance, first))
        is_best = pair_distance == distance[point]
        triangle[point[is_best]] = pair_triangle[is_best]
        return triangle

    def _nearest_in_leaves(self, points: Floats, leaf: Ints) -> tuple[Floats, Ints]:
        """Squared distance and index of the nearest triangle of one leaf a point, (n,) each."""
        triangles = self._tree.leaf_triangles[leaf]
        leaf_size = triangles.shape[1]
        distance, _ = self._measure(np.repeat(points, leaf_size, axis=0), triangles.ravel())
        distance = distance.reshape(triangles.shape)
        best = distance.argmin(axis=1)[:, None]
        return (
            np.take_along_axis(distance, best, axis=1)[:, 0],
            np.take_along_axis(triangles, best, axis=1)[:, 0],
        )

    def _measure(self, points: Floats, triangle: Ints) -> tuple[Floats, Floats]:
        """Squared distance (n,) and barycentric (n, 3) of the closest point, pair by pair."""
        from_a = points - self._corners[triangle, 0]
        ab, ac, form = (part[triangle] for part in self._forms)
        along_ab = np.einsum("ij,ij->i", ab, from_a)
        along_ac = np.einsum("ij,ij->i", ac, from_a)
        v, w = _minimum(along_ab, along_ac, *form.T)
        gap = from_a - v[:, None] * ab - w[:, None] * ac
        return np.einsum("ij,ij->i", gap, gap), np.stack([1.0 - v - w, v, w], axis=1)


def closest_point(points: Floats, surface: Surface) -> ClosestPoints:
    """The closest point of a surface to each point (point_count, 3), both in one space.

    Raises:
        HairloomError: the surface has no triangles.
    """
    return ClosestPointSearch(surface).closest(points)


def _forms(corners: Floats) -> tuple[Floats, Floats, Floats]:
    """Edges ab, ac, and the form (ab.ab, ab.ac, ac.ac, determinant or 0) of each triangle."""
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    bb, bc, cc = ((one * two).sum(axis=1) for one, two in ((ab, ab), (ab, ac), (ac, ac)))
    determinant = bb * cc - bc * bc
    determinant[determinant <= _FLAT * bb * cc] = 0.0
    return ab, ac, np.stack([bb, bc, cc, determinant], axis=1)


def _minimum(
    d1: Floats, d2: Floats, bb: Floats, bc: Floats, cc: Floats, determinant: Floats
) -> tuple[Floats, Floats]:
    """Where v^2 bb + 2 v w bc + w^2 cc - 2 v d1 - 2 w d2 is least over the triangle."""
    v = _divided(cc * d1 - bc * d2, determinant)
    w = _divided(bb * d2 - bc * d1, determinant)
    is_inside = (determinant > 0.0) & (v >= 0.0) & (w >= 0.0) & (v + w <= 1.0)

    on_ab = np.clip(_divided(d1, bb), 0.0, 1.0)
    on_ac = np.clip(_divided(d2, cc), 0.0, 1.0)
    on_bc = np.clip(_divided(d2 - d1 + bb - bc, bb - 2.0 * bc + cc), 0.0, 1.0)
    best = on_ab * (on_ab * bb - 2.0 * d1)
    edge_v, edge_w = on_ab, np.zeros_like(on_ab)
    for other_v, other_w in ((np.zeros_like(on_ac), on_ac), (1.0 - on_bc, on_bc)):
        value = other_v * (other_v * bb + 2.0 * (other_w * bc - d1))
        value += other_w * (other_w * cc - 2.0 * d2)
        is_less = value < best
        best = np.where(is_less, value, best)
        edge_v, edge_w = np.where(is_less, other_v, edge_v), np.where(is_less, other_w, edge_w)
    return np.where(is_inside, v, edge_v), np.where(is_inside, w, edge_w)


def _divided(value: Floats, by: Floats) -> Floats:
    return np.divide(value, by, out=np.zeros_like(value), where=by > 0.0)
