"""The distance field of a mesh that deforms, updated in each frame where its surface has moved.

Each node near a triangle that has moved gets its distance from the nearest triangle, and its sign
from the side of that triangle on which it lies. Triangles are rasterised into the nodes around
them, without a search, so the cost grows with the number of triangles that have moved and their
neighbours. All other nodes keep the values of the mesh at rest. Nodes farther than BAND_CELLS from
every triangle only get the sign, and a distance that grows by 1 / sqrt(3) of the path along the
axes: too short, never too long.

Error: that of `DistanceField` near the surface, if the mesh's faces point outwards. Where faces
point both ways, as on a sheet, the sign is a guess.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ...arrays import Bools, Floats, Ints, number_in_piece
from ...strands import Surface
from ...strands.triangles import area_vectors
from ...strands.vectors import cross_rows, dot_rows
from .distance_field import MARGIN, DistanceField, cover_points, sample_surface

#: Distance from a triangle up to which nodes get its distance, in cells.
BAND_CELLS = 1.5
#: A vertex counts as moved if it is farther from its place at rest than this, in cells.
MIN_MOVE = 0.05
#: How far the grid may be extended at each side, in units of its longest side at rest.
MAX_GROWTH = 1
#: A triangle is a sliver if its height is less than this fraction of its longest edge.
SLIVER = 1.0e-3
#: Pairs of triangles and nodes measured at once.
_PAIRS = 1 << 18
#: Of two triangles equally near, a node takes the one whose plane is farther from it, which it
#: faces more: cost of the angle, as a fraction of the distance.
_ANGLE_COST = 1.0e-3


class DeformedField:
    """Makes the distance field of a mesh in any deformed shape.

    Args:
        field: of the mesh at rest.
        surface: the mesh at rest, in the space of the field.
    """

    def __init__(self, field: DistanceField, surface: Surface) -> None:
        self.field = field
        self._rest = np.asarray(surface.positions, np.float32)
        self._triangles = surface.triangles
        corners = surface.corners.astype(np.float64)
        volume = (corners.mean(axis=1) * area_vectors(corners)).sum()
        self._outwards = np.float32(1.0 if volume >= 0.0 else -1.0)

    def at(self, positions: Floats) -> DistanceField:
        """The field with vertices at (vertex_count, 3), in the space of the mesh at rest; the field
        at rest if none has moved."""
        cell = self.field.cell
        now = np.asarray(positions, np.float32)
        path = now - self._rest
        has_moved = np.einsum("ij,ij->i", path, path) > (MIN_MOVE * cell) ** 2
        is_moved = has_moved[self._triangles].any(axis=1)
        if not is_moved.any():
            return self.field
        low, values, nearest = self._grid_for(now[has_moved])
        corners = now[self._triangles]
        boxes = self._boxes(corners, low, values.shape)
        affected = np.append(is_moved, True)[nearest]  # -1, the last one, for nodes without any
        _mark(affected, *(side[is_moved] for side in boxes))
        beside = (is_moved | _contain_any(affected, *boxes)).nonzero()[0]
        first, last = (side[beside] for side in boxes)
        distance, _ = self._rasterised(corners[beside], first, last, low, affected)
        values = np.where(affected, distance, values)
        values, _ = _filled(values, cell)
        samples = sample_surface(Surface(now, self._triangles[beside]), cell / 2.0)
        surface = Surface(now, self._triangles)
        return DistanceField(cover_points(values, low, cell, samples), low, cell, surface)

    @cached_property
    def _nearest(self) -> Ints:
        """Approximately the nearest triangle at rest of each node, in the shape of the grid."""
        field, corners = self.field, self._rest[self._triangles]
        boxes = self._boxes(corners, field.low, field.values.shape)
        every = np.ones(field.values.shape, bool)
        distance, triangle = self._rasterised(corners, *boxes, field.low, every)
        _, source = _filled(distance, field.cell)
        return triangle.ravel()[source]

    def _grid_for(self, points: Floats) -> tuple[Floats, Floats, Ints]:
        """The grid at rest, extended to contain points (n, 3): its lowest corner, its values,
        infinite at new nodes, and `_nearest`, -1 at new nodes."""
        field, shape = self.field, np.array(self.field.values.shape)
        place = (points - field.low) / field.cell
        more = np.stack([MARGIN - place.min(axis=0), place.max(axis=0) + MARGIN + 1 - shape])
        more = np.clip(np.ceil(more), 0, MAX_GROWTH * shape.max()).astype(np.int64)
        low = field.low - more[0].astype(np.float32) * np.float32(field.cell)
        values = np.pad(field.values, more.T, constant_values=np.inf)
        return low, values, np.pad(self._nearest, more.T, constant_values=-1)

    def _boxes(self, corners: Floats, begin: Floats, shape: tuple[int, ...]) -> tuple[Ints, Ints]:
        """The first and last node (n, 3) within BAND_CELLS of each triangle (n, 3, 3), in the
        grid."""
        top = np.array(shape) - 1
        place = (corners - begin) / np.float32(self.field.cell)
        low = np.ceil(place.min(axis=1) - BAND_CELLS).astype(np.int64)
        high = np.floor(place.max(axis=1) + BAND_CELLS).astype(np.int64)
        return np.clip(low, 0, top + 1), np.clip(high, -1, top)

    def _rasterised(
        self, corners: Floats, low: Ints, high: Ints, begin: Floats, wanted: Bools
    ) -> tuple[Floats, Ints]:
        """Signed distance [m] and nearest triangle of each wanted node; infinite and -1 where none
        is near.

        Args:
            corners: (n, 3, 3). low, high: see `_boxes`. begin: (3,) [m], place of node (0, 0, 0).
        """
        field, shape = self.field, wanted.shape
        key = np.full(wanted.size, np.inf, np.float32)
        signed = np.full(wanted.size, np.inf, np.float32)
        nearest = np.full(wanted.size, -1, np.int64)
        solids, reach = _Triangles(corners), np.float32(BAND_CELLS * field.cell)
        flat, counts = wanted.ravel(), np.maximum(high - low + 1, 0)
        pairs = counts.prod(axis=1)
        ends = np.cumsum(pairs)
        first = 0
        while first < len(pairs):
            last = int(np.searchsorted(ends, ends[first] - pairs[first] + _PAIRS, side="right"))
            last = max(last, first + 1)
            some = slice(first, last)
            triangle = np.repeat(np.arange(first, last), pairs[some])
            within = number_in_piece(pairs[some])
            count = counts[triangle]
            node = np.stack(
                [
                    within // (count[:, 1] * count[:, 2]),
                    within // count[:, 2] % count[:, 1],
                    within % count[:, 2],
                ],
                axis=1,
            )
            node += low[triangle]
            index = np.ravel_multi_index(tuple(node.T), shape)
            is_kept = flat[index]
            index, triangle = index[is_kept], triangle[is_kept]
            points = np.ascontiguousarray(node[is_kept].T, np.float32)
            points *= np.float32(field.cell)
            points += begin[:, None]
            facing = solids.heights(points, triangle)
            is_kept = (np.abs(facing) <= reach).nonzero()[0]
            index, triangle, facing = index[is_kept], triangle[is_kept], facing[is_kept]
            distance = solids.distances(take_columns(points, is_kept), triangle, facing)
            cost = distance * np.float32(1.0 + _ANGLE_COST) - np.abs(facing) * np.float32(
                _ANGLE_COST
            )
            np.minimum.at(key, index, cost)
            best = cost <= key[index]
            signed[index[best]] = np.copysign(distance[best], facing[best] * self._outwards)
            nearest[index[best]] = triangle[best]
            first = last
        is_far = np.abs(signed) > reach
        signed[is_far], nearest[is_far] = np.inf, -1
        return signed.reshape(shape), nearest.reshape(shape)


class _Triangles:
    """Triangles (n, 3, 3) prepared for measuring distances; stored as rows (3, n) float32."""

    def __init__(self, corners: Floats) -> None:
        rows = np.ascontiguousarray(corners.transpose(1, 2, 0), np.float32)
        self._corner = rows
        self._edge = np.roll(rows, -1, axis=0) - rows
        lengths = np.stack([dot_rows(edge, edge) for edge in self._edge])
        normal = cross_rows(self._edge[0], self._edge[1])
        area = np.sqrt(dot_rows(normal, normal))
        # a sliver's direction is only rounding: its neighbours decide instead
        self._has_area = area > np.float32(SLIVER) * lengths.max(axis=0)
        normal *= self._has_area / np.maximum(area, np.float32(1.0e-20))
        self._normal = normal
        self._across = np.stack([cross_rows(normal, edge) for edge in self._edge])  # inwards
        self._over_length = np.float32(1.0) / np.maximum(lengths, np.float32(1.0e-20))

    def heights(self, points: Floats, triangle: Ints) -> Floats:
        """Signed distance [m] of points (3, n) from the plane of a triangle each, (n,)."""
        offset = points - take_columns(self._corner[0], triangle)
        return dot_rows(offset, take_columns(self._normal, triangle))

    def distances(self, points: Floats, triangle: Ints, height: Floats) -> Floats:
        """Distance [m] of points (3, n) from a triangle each, given their `heights`, (n,)."""
        within = self._has_area.take(triangle)
        squared = np.full(len(triangle), np.inf, np.float32)
        for side in range(3):
            offset = points - take_columns(self._corner[side], triangle)
            edge = take_columns(self._edge[side], triangle)
            along = dot_rows(offset, edge)
            along *= self._over_length[side].take(triangle)
            np.clip(along, np.float32(0.0), np.float32(1.0), out=along)
            within &= dot_rows(offset, take_columns(self._across[side], triangle)) >= 0.0
            edge *= along
            offset -= edge
            np.minimum(squared, dot_rows(offset, offset), out=squared)
        return np.where(within, np.abs(height), np.sqrt(squared))


def take_columns(rows: Floats, index: Ints) -> Floats:
    """Columns (3, m) of rows (3, n)."""
    return rows.take(index, axis=1, mode="clip")


def _mark(nodes: Bools, low: Ints, high: Ints) -> None:
    """Set all nodes within boxes (n, 3), in place, by sums over differences along each axis."""
    ends = np.zeros(np.array(nodes.shape) + 1, np.int32)
    for sides in np.ndindex(2, 2, 2):
        corner = np.where(sides, high + 1, low)
        is_real = (high >= low).all(axis=1)
        np.add.at(ends, tuple(corner[is_real].T), -1 if sum(sides) % 2 else 1)
    nodes |= ends.cumsum(0).cumsum(1).cumsum(2)[:-1, :-1, :-1] > 0


def _contain_any(nodes: Bools, low: Ints, high: Ints) -> Bools:
    """Which boxes (n, 3) contain any of the nodes, (n,), by sums up to their corners."""
    sums = np.zeros(np.array(nodes.shape) + 1, np.int64)
    sums[1:, 1:, 1:] = nodes.cumsum(0).cumsum(1).cumsum(2)
    total = np.zeros(len(low), np.int64)
    for sides in np.ndindex(2, 2, 2):
        corner = np.where(sides, high + 1, low)
        total += sums[tuple(corner.T)] * (1 if sum(sides) % 2 else -1)
    result: Bools = (total > 0) & (high >= low).all(axis=1)
    return result


def _filled(values: Floats, cell: float) -> tuple[Floats, Ints]:
    """Values (nx, ny, nz) with infinite ones filled in from the nearest known node along the axes;
    and the flat index of the node that each is from."""
    source = np.arange(values.size).reshape(values.shape)
    unknown = ~np.isfinite(values)
    if not unknown.any():
        return values, source
    step = np.float32(cell / 3.0**0.5)
    away = np.abs(values)
    for _ in range(2):
        for axis in range(3):
            ordered, sources, free = (np.moveaxis(one, axis, 0) for one in (away, source, unknown))
            layers = range(1, len(ordered)), range(len(ordered) - 2, -1, -1)
            for by, numbers in zip((1, -1), layers, strict=True):
                for layer in numbers:
                    there = ordered[layer - by] + step
                    nearer = (there < ordered[layer]) & free[layer]
                    np.copyto(ordered[layer], there, where=nearer)
                    np.copyto(sources[layer], sources[layer - by], where=nearer)
    return np.copysign(away, values.ravel()[source]), source
