"""The closest point on a triangle mesh, exact, for many points at once.

Points that lie close together share the search (`point_clusters`): moving a point changes its
distance to a triangle by no more than the point moves. So a triangle that is farther from the
middle of a cluster than the nearest triangle, by more than twice the cluster's radius, is nearest
to none of the cluster's points and is skipped for all of them.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints, piece_starts, rows_of_ranges
from ..errors import HairloomError
from .parallel import parallel_map
from .point_clusters import PointClusters, cluster_points
from .surface import Surface
from .triangle_distance import TriangleForms
from .triangle_tree import TriangleTree, build_tree

#: Points searched at once: their pairs with boxes stay in the processor's cache.
_CHUNK = 1024
#: Maximum number of pairs of points and boxes in memory; beyond it, the chunk is halved.
_PAIR_LIMIT = 2_000_000
#: Pairs of points and their cluster's triangles measured at once.
_PAIRS = 1 << 16
#: Clusters pay off from this many points each on average, and up to this many candidate triangles.
_MIN_POINTS_PER_CLUSTER, _MAX_CANDIDATES = 3, 512
#: Factor of distances that makes up for rounding, so that no triangle is missed.
_ROUNDING_FACTOR = 1.0 + 1.0e-9


@dataclass(frozen=True)
class ClosestPoints:
    """The closest point to each query point, in the space of the surface.

    point: (point_count, 3) float64 [m].
    triangle: (point_count,) int32, index into the surface's triangles.
    barycentric: (point_count, 3) float64, not negative, summing to 1.
    distance: (point_count,) float64 [m], unsigned.
    """

    point: Floats
    triangle: Ints
    barycentric: Floats
    distance: Floats


@dataclass
class _Best:
    """The nearest triangle of each point so far: squared distance and index, (point_count,)."""

    distance: Floats
    triangle: Ints


@dataclass(frozen=True)
class _Candidates:
    """Triangles that may be nearest to a point of a cluster, cluster by cluster.

    away: distance of each triangle from the cluster's middle.
    first, count: each cluster's first candidate, and number of them, (cluster_count,).
    """

    triangle: Ints
    away: Floats
    first: Ints
    count: Ints


class ClosestPointSearch:
    """A surface prepared for many calls of `closest`.

    center: (3,) float64 [m], of the surface's box.
    corners: (triangle_count, 3, 3) float64 [m], relative to `center`.
    tree: over these triangles.

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
        self.center = (low.astype(np.float64) + high) / 2.0  # keeps the dot products small
        self.corners = surface.corners - self.center
        self._forms = TriangleForms(self.corners)
        low, high = self.corners.min(axis=1), self.corners.max(axis=1)
        self._size = float(np.median(np.linalg.norm(high - low, axis=1)))
        self._low, self._high = np.ascontiguousarray(low.T), np.ascontiguousarray(high.T)
        self.tree: TriangleTree = build_tree(self.corners)

    def closest(self, points: Floats, reach: float = np.inf) -> ClosestPoints:
        """The closest point of the surface to each of the finite points (point_count, 3).

        Args:
            reach: [m]; for points farther from the surface than this, the result is an arbitrary
                point of it, also beyond reach. Much faster if few points are within reach.
        """
        local = np.asarray(points, np.float64).reshape(-1, 3) - self.center
        return self._closest_on(local, self._nearest(local, reach))

    def nearest(self, points: Floats, reach: float) -> Ints:
        """The nearest triangle only, (point_count,), searched without clusters.

        So the result does not depend on the other points, even if two triangles are equally near.
        """
        return self._search_all(np.asarray(points, np.float64) - self.center, reach)

    def closest_on(self, points: Floats, triangle: Ints) -> ClosestPoints:
        """The closest point to each point (point_count, 3) on its given triangle (point_count,)."""
        return self._closest_on(np.asarray(points, np.float64) - self.center, triangle)

    def _closest_on(self, local: Floats, triangle: Ints) -> ClosestPoints:
        barycentric = self._forms.closest(local, triangle)
        closest = np.einsum("ni,nij->nj", barycentric, self.corners[triangle])
        distance = np.linalg.norm(local - closest, axis=1)
        return ClosestPoints(
            closest + self.center, triangle.astype(np.int32), barycentric, distance
        )

    def _nearest(self, points: Floats, reach: float) -> Ints:
        """The nearest triangle of each point, using clusters if that saves work."""
        if len(points) < _MIN_POINTS_PER_CLUSTER:
            return self._search_all(points, reach)
        clusters = cluster_points(points, self._size)
        if len(points) < _MIN_POINTS_PER_CLUSTER * len(clusters.middle):
            return self._search_all(points, reach)
        nearest = self._search_all(clusters.middle, reach + float(clusters.radius.max()))
        candidates = self._candidates(clusters, nearest, reach)
        is_crowded = (candidates.count > _MAX_CANDIDATES)[clusters.cluster]
        found = np.empty(len(points), np.int64)
        single, shared = np.flatnonzero(is_crowded), np.flatnonzero(~is_crowded)
        found[clusters.order[shared]] = self._of_clusters(
            points, clusters, shared, nearest, candidates, reach
        )
        found[clusters.order[single]] = self._search_all(points[clusters.order[single]], reach)
        return found

    def _search_all(self, points: Floats, reach: float) -> Ints:
        """The nearest triangle of each point, without clusters, in several threads."""
        chunks = (points[i : i + _CHUNK] for i in range(0, len(points), _CHUNK))
        found = parallel_map(lambda chunk: self._search(chunk, reach), chunks)
        return np.concatenate([np.zeros(0, np.int64), *found])

    def _search(self, points: Floats, reach: float) -> Ints:
        """The nearest triangle of each point: a first guess, then all leaves that may be nearer."""
        triangles = self.tree.leaf_triangles
        leaf = triangles[self.tree.nearest_leaf(points)]
        best = _Best(np.full(len(points), np.inf), leaf[:, 0].astype(np.int64))
        self._improve(best, points, *_point_triangle_pairs(np.arange(len(points)), leaf))
        # slightly more than the reach, so that rounding loses no point at its edge
        within = np.minimum(best.distance, reach * reach * _ROUNDING_FACTOR)
        for point, leaf, gap in self._near_leaves(points, within):
            # the nearest box first: its triangles rule out most of the others
            nearest = _first_minimum_rows(point, gap)
            self._improve(
                best, points, *_point_triangle_pairs(point[nearest], triangles[leaf[nearest]])
            )
            is_near = gap < best.distance[point]
            is_near[nearest] = False
            self._improve(
                best, points, *_point_triangle_pairs(point[is_near], triangles[leaf[is_near]])
            )
        return best.triangle

    def _near_leaves(
        self, points: Floats, squared_within: Floats
    ) -> Iterator[tuple[Ints, Ints, Floats]]:
        """Chunks of the pairs of a point and a leaf within reach, ascending by point, and the
        squared distance to the leaf's box."""
        limit = _PAIR_LIMIT if len(points) > 1 else sys.maxsize
        found = self.tree.leaves_within(points, squared_within, limit)
        if found is not None:
            yield found
            return
        half = len(points) // 2
        yield from self._near_leaves(points[:half], squared_within[:half])
        for point, leaf, gap in self._near_leaves(points[half:], squared_within[half:]):
            yield point + half, leaf, gap

    def _candidates(self, clusters: PointClusters, nearest: Ints, reach: float) -> _Candidates:
        """The candidates of each cluster, without the triangle that is nearest to its middle."""
        middle, radius = clusters.middle, clusters.radius
        away = np.sqrt(self._forms.squared_distance(middle, nearest))
        within = np.minimum(away + 2.0 * radius, reach + radius) * _ROUNDING_FACTOR
        found = []
        for start in range(0, len(middle), _CHUNK):
            part = slice(start, start + _CHUNK)
            for near, leaf, _ in self._near_leaves(middle[part], within[part] ** 2):
                near, triangle = _point_triangle_pairs(near, self.tree.leaf_triangles[leaf])
                cluster = near + start
                far = np.sqrt(self._forms.squared_distance(middle.take(cluster, axis=0), triangle))
                is_near = (far <= within[cluster]) & (triangle != nearest[cluster])
                found.append((cluster[is_near], triangle[is_near], far[is_near]))
        cluster, triangle, far = (np.concatenate(each) for each in zip(*found, strict=True))
        count = np.bincount(cluster, minlength=len(middle))
        return _Candidates(triangle, far, piece_starts(count), count)

    def _of_clusters(
        self,
        points: Floats,
        clusters: PointClusters,
        chosen: Ints,
        nearest: Ints,
        candidates: _Candidates,
        reach: float,
    ) -> Ints:
        """The nearest triangle of each chosen point, searched among its cluster's candidates.

        Args:
            chosen: indices into the points in the order of the clusters.
            nearest: (cluster_count,), the triangle nearest to each cluster's middle.
        """
        found: list[Ints] = [np.zeros(0, np.int64)]
        for piece in _pieces(candidates.count[clusters.cluster[chosen]]):
            part = chosen[piece]
            here, cluster = points[clusters.order[part]], clusters.cluster[part]
            triangle = nearest[cluster]
            best = _Best(self._forms.squared_distance(here, triangle), triangle)
            count, first = candidates.count[cluster], candidates.first[cluster]
            point = np.repeat(np.arange(len(here)), count)
            pair = rows_of_ranges(first, count)
            limit = np.minimum(np.sqrt(best.distance), reach) + clusters.away[part]
            is_near = candidates.away[pair] <= (limit * _ROUNDING_FACTOR)[point]
            self._improve(best, here, point[is_near], candidates.triangle[pair[is_near]])
            found.append(best.triangle)
        return np.concatenate(found)

    def _improve(self, best: _Best, points: Floats, point: Ints, triangle: Ints) -> None:
        """Update the best with these pairs of point and triangle, ascending by point."""
        is_near = self._is_near(best, points, point, triangle)
        point, triangle = point[is_near], triangle[is_near]
        if not len(point):
            return
        distance = self._forms.squared_distance(points.take(point, axis=0), triangle)
        first = np.flatnonzero(np.diff(point, prepend=-1))
        seen = point[first]
        best.distance[seen] = np.minimum(best.distance[seen], np.minimum.reduceat(distance, first))
        is_best = distance == best.distance[point]
        best.triangle[point[is_best]] = triangle[is_best]

    def _is_near(self, best: _Best, points: Floats, point: Ints, triangle: Ints) -> Bools:
        """Which pairs are worth measuring: the triangle's box is no farther than the best."""
        gap = np.zeros(len(point))
        for axis in range(3):
            here = points[:, axis].take(point)
            outside = np.maximum(
                self._low[axis].take(triangle) - here, here - self._high[axis].take(triangle)
            )
            np.maximum(outside, 0.0, out=outside)
            outside *= outside
            gap += outside
        return np.asarray(gap <= best.distance.take(point))


def search_of(surface: Surface) -> ClosestPointSearch:
    """The search through this surface, built once and cached on it.

    Raises:
        HairloomError: the surface has no triangles.
    """
    return surface.compute_once(ClosestPointSearch)


def closest_point(points: Floats, surface: Surface) -> ClosestPoints:
    """The closest point of a surface to each point (point_count, 3), both in the same space.

    Raises:
        HairloomError: the surface has no triangles.
    """
    return search_of(surface).closest(points)


def _first_minimum_rows(point: Ints, value: Floats) -> Ints:
    """The row of the first minimum value of each point; rows ascend by point."""
    first = np.flatnonzero(np.diff(point, prepend=-1))
    if not len(first):
        return first
    minimum = np.repeat(np.minimum.reduceat(value, first), np.diff(first, append=len(point)))
    is_minimum = np.flatnonzero(value == minimum)
    return is_minimum[np.flatnonzero(np.diff(point[is_minimum], prepend=-1))]


def _point_triangle_pairs(point: Ints, triangles: Ints) -> tuple[Ints, Ints]:
    """Pairs of point (n,) and each of its triangles (n, width)."""
    return np.repeat(point, triangles.shape[1]), triangles.ravel()


def _pieces(pair_counts: Ints) -> Iterator[slice]:
    """Slices of consecutive points that add up to about _PAIRS pairs, at least one point each."""
    ends = np.cumsum(pair_counts)
    start = 0
    while start < len(ends):
        before = int(ends[start - 1]) if start else 0
        stop = max(int(np.searchsorted(ends, before + _PAIRS, side="right")), start + 1)
        stop = min(stop, start + _PAIRS)
        yield slice(start, stop)
        start = stop
