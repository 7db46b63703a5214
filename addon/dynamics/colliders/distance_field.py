"""The signed distance from a closed mesh, sampled once on a grid and interpolated trilinearly.

Distance: exact near the surface, from the closest point of the mesh; farther away, where it only
serves to move out points that start inside, interpolated from fewer nodes, which saves nine tenths
of the time.
Sign: generalised winding number, which is robust to holes, doubled faces and slivers; an opening,
as at a neck, is closed where the number is one half. It is evaluated at nodes nearer to the surface
than one cell, and at one of each STRIDE^3 others, whose neighbours are on the same side; remaining
nodes take the sign of their predecessor along the rows.

No part of the surface lies outside of the interpolated one by more than a twentieth of a cell, see
`cover_points`: hair that stays out of the field stays out of the mesh.

Error of the interpolation: zero where the distance is linear; near edges and corners, and where the
medial axis crosses the cell, below half a cell's diagonal, in practice a tenth of a cell.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ...arrays import Bools, Floats, Ints
from ...errors import HairloomError
from ...strands import Surface
from ...strands.closest_point import search_of
from ...strands.vectors import dot_rows
from ..settings import DynamicsSettings
from .winding import winding_number

#: Cells around the mesh's box, so that the surroundings of the surface are sampled too.
MARGIN = 2
#: Distances of up to this many cells are exact; hair touches the surface within one.
EXACT_CELLS = 6.0
#: Farther away, one node in this many along each axis is exact, and the others are interpolated.
STRIDE = 3
#: If the winding number at a block's middle is this close to one half, other nodes are evaluated.
AMBIGUOUS_WINDING = 0.35
#: How far a part of the surface may lie outside of the interpolated one, in cells.
MAX_UNCOVERED = 0.05
#: Number of nodes around the closure of an opening whose distances take it into account.
CLOSURE_REACH = 16
#: Spacing of the nodes that measure the surface's curvature, in cells.
STEP = 2


class DistanceField:
    """Signed distance on a grid, object space of the surface it was made from.

    values: (nx, ny, nz) float32 [m], negative inside.
    low: (3,) float32 [m], place of node (0, 0, 0).
    cell: edge of a cell [m].
    surface: the mesh, if known.
    """

    def __init__(
        self, values: Floats, low: Floats, cell: float, surface: Surface | None = None
    ) -> None:
        self.surface = surface
        self.values = np.ascontiguousarray(values, np.float32)
        self.low = np.asarray(low, np.float32)
        self.cell = float(cell)
        self._flat = self.values.ravel()
        self._strides = tuple(stride // 4 for stride in self.values.strides)
        self._along_x = np.array([[0], [self._strides[0]]], np.int64)
        self._top = np.array(self.values.shape, np.float32)[:, None] - np.float32(1.0)
        self._below_top = self._top - np.float32(1.0e-3)  # so that there is a next node
        # the values of each node and its neighbours along z, y and both, so that values that are
        # near in space are contiguous in memory
        _, along_y, along_z = self._strides
        offsets = (0, along_z, along_y, along_y + along_z)
        self._squares = np.stack([np.roll(self._flat, -offset) for offset in offsets], axis=1)

    @classmethod
    def from_surface(
        cls, surface: Surface, settings: DynamicsSettings, *, place: str = "mesh collider"
    ) -> DistanceField:
        """Sample a closed mesh; `place` names it in messages.

        Raises:
            HairloomError: no faces, no size, or no inside at this resolution.
        """
        if not len(surface.triangles):
            raise _broken(place, "it has no faces", "Choose a closed mesh as collider")
        used = surface.positions[np.unique(surface.triangles)].astype(np.float64)
        low, high = used.min(axis=0), used.max(axis=0)
        cell = float((high - low).max()) / settings.collider_resolution
        if cell <= 0.0:
            raise _broken(place, "all its vertices lie in one point", "Choose a mesh with volume")
        low = low - MARGIN * cell
        shape = np.ceil((high - low) / cell).astype(int) + MARGIN + 1
        axes = [low[axis] + cell * np.arange(shape[axis]) for axis in range(3)]
        nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        distance = _distances(nodes, surface, cell)
        inside = _inside(nodes, distance, surface, cell)
        if not (inside & (distance > 1.0e-3 * cell)).any():  # a node in a sheet is not inside
            raise _broken(
                place,
                "it encloses no volume at this resolution",
                "Close its holes, or raise the collider resolution",
            )
        values = with_closures(np.where(inside, -distance, distance), cell)
        values = cover_points(values, low, cell, sample_surface(surface, cell / 2.0))
        return cls(values, low, cell, surface)

    @cached_property
    def bounds(self) -> tuple[Floats, float]:
        """Bounding sphere, (3,) and radius [m], of inside nodes and the cells beside them that the
        surface crosses."""
        inside = np.argwhere(self.values < 0.0).astype(np.float32)
        if not len(inside):
            half = self._top[:, 0] * np.float32(self.cell / 2.0)
            return self.low + half, float(np.linalg.norm(half))
        center = (inside.min(axis=0) + inside.max(axis=0)) / np.float32(2.0)
        inside -= center
        farthest = float(np.sqrt((inside * inside).sum(axis=1).max()))
        return self.low + center * np.float32(self.cell), (farthest + 3.0**0.5) * self.cell

    @cached_property
    def curve_radius(self) -> float:
        """See `Collider`; from how far the surface bulges between nodes 2 STEP cells apart."""
        values, max_bulge = self.values, 0.0
        for axis in range(3):
            along = np.moveaxis(values, axis, 0)
            middle = along[STEP:-STEP]
            bulge = (along[2 * STEP :] + along[: -2 * STEP]) / 2.0 - middle
            at_surface = np.abs(middle) < 0.6 * self.cell
            max_bulge = max(max_bulge, float(bulge[at_surface].max(initial=0.0)))
        return (STEP * self.cell) ** 2 / (2.0 * max(max_bulge, 1.0e-3 * self.cell))

    def near(self, points: Floats, reach: Floats | float) -> Ints:
        """Points in half cells with interpolated distances within `reach`, times sqrt(3): the
        largest length of the gradient, by which `world_distance` divides."""
        limit = np.broadcast_to(np.float32(1.7321) * reach, points.shape[1:])
        halves, least = np.float32(2.0 / self.cell), self._min_values
        held = points * halves
        held -= self.low[:, None] * halves
        np.maximum(held, np.float32(0.0), out=held)
        np.minimum(held, self._below_top * np.float32(2.0), out=held)
        x, y, z = held.astype(np.int32)
        x *= least.shape[1]
        x += y
        x *= least.shape[2]
        x += z
        kept = (least.ravel().take(x) < limit).nonzero()[0]
        some, low = points.take(kept, axis=1), self.low[:, None]
        high = low + self._top * np.float32(self.cell)
        outside = np.maximum(low - some, some - high).max(axis=0)  # along one axis
        result: Ints = kept[outside <= np.maximum(limit.take(kept), 0.0)]
        return result

    def distance(self, points: Floats) -> tuple[Floats, Floats]:
        """Trilinear distance [m] (n,) and its exact gradient (3, n).

        Outside of the grid, the distance from the grid's box is added.
        """
        held, beyond = self._split(self._in_cells(points))
        index = self._index(held)
        fx, fy, fz = held - np.trunc(held)
        # the corners of cells, by y and z, and then by x
        corner = self._squares.take(index + self._along_x, axis=0)
        corner = np.ascontiguousarray(corner.transpose(2, 0, 1)).reshape(2, 2, 2, -1)
        # along z, then y, then x; the difference at each step gives a derivative
        values = np.empty((2, *corner.shape[1:]), np.float32)
        np.subtract(corner[:, 1], corner[:, 0], out=values[1])
        np.multiply(values[1], fz, out=values[0])
        values[0] += corner[:, 0]
        change = values[:, 1] - values[:, 0]
        rows = np.empty((3, *change.shape[1:]), np.float32)
        np.multiply(change, fy, out=rows[::2])
        rows[::2] += values[:, 0]
        rows[1] = change[0]
        change = rows[:, 1] - rows[:, 0]
        gradient = change * fx
        gradient += rows[:, 0]  # the distance, and the derivatives along y and z
        distance = gradient[0].copy()
        if beyond.any():
            distance += np.sqrt(dot_rows(beyond, beyond)) * np.float32(self.cell)
        gradient[0] = change[0]
        gradient *= np.float32(1.0 / self.cell)
        return distance, gradient

    def are_outside(self, points: Floats) -> Bools:
        """Whether points (3, n) are outside of the mesh itself, (n,). Slow."""
        if self.surface is None or not points.size:
            return self.distance(points)[0] > 0.0
        return np.abs(winding_number(points.T, self.surface)) <= 0.5

    def _in_cells(self, points: Floats) -> Floats:
        """Points (3, n) in cells relative to the first node."""
        place: Floats = points - self.low[:, None]
        place *= np.float32(1.0 / self.cell)
        return place

    def _split(self, place: Floats) -> tuple[Floats, Floats]:
        """Places (3, n) in cells, clamped to the grid, and their offset from it, which overwrites
        `place`."""
        held = self._clamped(place)
        place -= held
        return np.minimum(held, self._below_top, out=held), place

    @cached_property
    def _min_values(self) -> Floats:
        """The smallest interpolated value in each half cell along x, y and z, that is, in each
        eighth of a cell."""
        result = self.values
        for axis in range(3):
            low, high = np.moveaxis(result, axis, 0)[:-1], np.moveaxis(result, axis, 0)[1:]
            middle = (low + high) * np.float32(0.5)
            halves = np.empty((2 * len(low), *low.shape[1:]), np.float32)
            halves[::2], halves[1::2] = np.minimum(low, middle), np.minimum(middle, high)
            result = np.moveaxis(halves, 0, axis)
        return np.ascontiguousarray(result)

    def _clamped(self, place: Floats) -> Floats:
        """Places (3, n) in cells, clamped to the grid; faster than np.clip."""
        held: Floats = np.maximum(place, np.float32(0.0))
        return np.minimum(held, self._top, out=held)

    def _index(self, place: Floats) -> Ints:
        """Flat index of the node below each place (3, n), which is not negative."""
        x, y, z = place.astype(np.int32)
        return x * self._strides[0] + y * self._strides[1] + z


def _distances(nodes: Floats, surface: Surface, cell: float) -> Floats:
    """Distance of each node (nx, ny, nz) to the surface [m]."""
    search, shape = search_of(surface), nodes.shape[:3]
    exact = search.closest(nodes.reshape(-1, 3), EXACT_CELLS * cell).distance.reshape(shape)
    chosen = [np.union1d(np.arange(0, count, STRIDE), count - 1) for count in shape]
    sparse = nodes[np.ix_(*chosen)]
    distance = search.closest(sparse.reshape(-1, 3)).distance.reshape(sparse.shape[:3])
    for axis in range(3):
        distance = _filled_in(distance, chosen[axis], axis)
    least = EXACT_CELLS * cell
    # Linear interpolation at a distance d overestimates by no more than (STRIDE cell)^2 / 8 d per
    # axis; subtract that, as `near` relies on distances that are not too long.
    distance -= 3.0 * (STRIDE * cell) ** 2 / (8.0 * np.maximum(distance, least))
    return np.where(exact <= least, exact, np.maximum(distance, least))


def with_closures(values: Floats, cell: float) -> Floats:
    """Values (nx, ny, nz), limited by the distance from where openings are closed.

    At a closure the sign changes between two nodes that are far from the surface. There a value is
    at most half a cell, and with each node from there it may grow by 1 / sqrt(3) cells, so that no
    value exceeds the straight distance.
    """
    size, limits = np.abs(values), np.full(values.shape, np.inf)
    for axis in range(3):
        here, there, limit, other = (
            np.moveaxis(rows, axis, 0)[part]
            for rows in (values, limits)
            for part in (slice(None, -1), slice(1, None))
        )
        is_closure = (here * there < 0.0) & (np.abs(here) + np.abs(there) > 1.01 * cell)
        limit[is_closure] = other[is_closure] = cell / 2.0
    if not np.isfinite(limits).any():
        return values
    for _ in range(CLOSURE_REACH):
        for axis in range(3):
            rows = np.moveaxis(limits, axis, 0)
            rows[1:] = np.minimum(rows[1:], rows[:-1] + cell / 3.0**0.5)
            rows[:-1] = np.minimum(rows[:-1], rows[1:] + cell / 3.0**0.5)
    return np.copysign(np.minimum(size, limits), values)


def cover_points(values: Floats, low: Floats, cell: float, points: Floats) -> Floats:
    """Values (nx, ny, nz), lowered where the surface would lie outside of the interpolated one.

    Interpolation cuts off edges and corners, and a sheet thinner than a cell vanishes. Each point
    of the surface that would be outside by e, more than MAX_UNCOVERED, lowers the nodes of its cell
    by w e / sum of w^2, with its interpolation weights w: the smallest change, in least squares,
    that lowers the value at the point by e.

    Args:
        points: (n, 3) on the surface; those outside of the grid are ignored.
    """
    place = (points - low) / cell
    place = place[((place >= 0.0) & (place <= np.array(values.shape) - 1)).all(axis=1)]
    node = np.minimum(place.astype(np.int64), np.array(values.shape) - 2)
    fraction = place - node
    weight = np.ones((8, len(place)))
    index = np.empty((8, len(place)), np.int64)
    for corner, offset in enumerate(np.ndindex(2, 2, 2)):
        for axis, side in enumerate(offset):
            weight[corner] *= fraction[:, axis] if side else 1.0 - fraction[:, axis]
        index[corner] = np.ravel_multi_index((node + offset).T, values.shape)
    flat = values.ravel()
    outside = np.maximum((weight * flat[index]).sum(axis=0) - MAX_UNCOVERED * cell, 0.0)
    lowered = np.zeros_like(flat)
    np.maximum.at(lowered, index, weight * (outside / (weight * weight).sum(axis=0)))
    return (flat - lowered).reshape(values.shape)


def sample_surface(surface: Surface, spacing: float) -> Floats:
    """Points (n, 3) spread over all triangles, at most `spacing` [m] apart along edges."""
    corners = surface.corners.astype(np.float64)
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.ceil(edges / spacing).astype(int)
    found = []
    for count in np.unique(parts[parts > 0]):
        steps = np.array([(i, j) for i in range(count + 1) for j in range(count + 1 - i)]) / count
        a, b, c = np.moveaxis(corners[parts == count], 1, 0)
        u, v = steps[:, :1, None], steps[:, 1:, None]
        found.append((a + u * (b - a) + v * (c - a)).reshape(-1, 3))
    return np.concatenate(found) if found else np.zeros((0, 3))


def _filled_in(values: Floats, chosen: Ints, axis: int) -> Floats:
    """Values at the chosen nodes of an axis, interpolated to all of its nodes."""
    every = np.arange(chosen[-1] + 1)
    right = np.maximum(np.searchsorted(chosen, every), 1)
    weight = (every - chosen[right - 1]) / (chosen[right] - chosen[right - 1])
    last = np.moveaxis(values, axis, -1)
    before, after = last[..., right - 1], last[..., right]
    return np.moveaxis(before + weight * (after - before), -1, axis)


def _inside(nodes: Floats, distance: Floats, surface: Surface, cell: float) -> Bools:
    """Whether each node (nx, ny, nz) lies inside, even if the mesh is turned inside out."""
    is_near = distance <= cell * 1.001
    # the middles of blocks of STRIDE^3 nodes without surface through them
    is_middle = np.zeros(distance.shape, bool)
    is_middle[1::STRIDE, 1::STRIDE, 1::STRIDE] = True
    is_middle &= distance > cell * 1.7321
    winding = np.zeros(distance.shape)
    winding[is_middle] = np.abs(winding_number(nodes[is_middle], surface))
    middles = np.ix_(
        *(np.minimum(1 + STRIDE * (np.arange(n) // STRIDE), n - 1) for n in distance.shape)
    )
    winding = winding[middles]
    of_middle = is_middle[middles] & ~is_near
    is_asked = is_near | (of_middle & (np.abs(winding - 0.5) < AMBIGUOUS_WINDING))
    winding[is_asked] = np.abs(winding_number(nodes[is_asked], surface))
    # each row starts outside because of the margin; remaining nodes take the number of the last one
    # before them, unless that one is beside an opening
    along = np.broadcast_to(np.arange(distance.shape[2]), distance.shape)
    last = np.maximum.accumulate(np.where(is_asked | of_middle, along, 0), axis=2)
    winding = np.take_along_axis(winding, last, axis=2)
    is_left = (last < along) & (np.abs(winding - 0.5) < AMBIGUOUS_WINDING)
    winding[is_left] = np.abs(winding_number(nodes[is_left], surface))
    return winding > 0.5


def _broken(place: str, problem: str, remedy: str) -> HairloomError:
    return HairloomError(problem, place=place, remedy=remedy)
