"""The fabric of a fin, and the state that its simulation keeps from one frame to the next.

Any mesh becomes cloth: the edges of its triangles keep their length (Nguyen and Donnelly 2005), and
the vertices opposite a common edge of two faces keep their distance, which resists folding. Flat
cloth resists small folds little and sharp ones strongly, as this distance changes with the square
of the fold.

Rows are (3, vertex_count) in world space, in the order of the mesh's vertices. They are float64, as
motions in a small step are a few millionths of a metre, which float32 does not resolve far from the
origin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Bools, Floats, Ints
from ...errors import HairloomError
from ...strands.vectors import cross_rows, unit_rows
from .coloring import distances_along_edges, greedy_colors, opposite_pairs, unique_edges

#: From this pin weight on a vertex has infinite mass; not 1, as Blender's weights are rounded.
PINNED_WEIGHT = 0.9999


@dataclass(frozen=True)
class Color:
    """Pairs that keep their distance, of which no two share a vertex, so that all can move at once.

    Each pair is stored twice, once for each of its vertices, so that no scatter is needed.

    vertices: (m,) the vertices of the pairs; None: all vertices, with those in no pair being their
        own mates.
    mates: (m,) the other vertex of each one's pair.
    length: (m,) float32 [m] to keep.
    """

    vertices: Ints | None
    mates: Ints
    length: Floats


@dataclass(frozen=True)
class Fabric:
    """The cloth itself, as it was when the simulation started; constant.

    position: (3, vertex_count) float64 world [m].
    triangles: (triangle_count, 3) int64.
    pin: (vertex_count,) float32, how firmly the animation holds a vertex: 1 rigidly, 0 not at all.
    pairs, length: the edges that can move (edge_count, 2), and their lengths [m], float64.
    edges, folds: these edges, and pairs of vertices opposite edges, by colour.
    anchor, reach: (vertex_count,) the nearest pinned vertex of each, and the distance to it along
        the edges [m]; without a path to a pinned vertex, the vertex itself, and 0.
    size: a quarter of the cloth's extent [m], the unit of distances in the settings.
    """

    position: Floats
    triangles: Ints
    pin: Floats
    pairs: Ints
    length: Floats
    edges: tuple[Color, ...]
    folds: tuple[Color, ...]
    anchor: Ints
    reach: Floats
    size: float

    @property
    def pinned(self) -> Bools:
        """(vertex_count,) which vertices have infinite mass."""
        return self.pin >= PINNED_WEIGHT


@dataclass(frozen=True)
class ClothState:
    """A fin in motion.

    position, previous: (3, vertex_count) float64 world [m], one small step apart.
    small_step: length [s] of the last small step; 0 if there was none.
    time_left: time [s] that has passed but is not yet simulated, shorter than a substep.
    time: [s] simulated since the start; gusts depend on it.
    """

    position: Floats
    previous: Floats
    fabric: Fabric
    small_step: float = 0.0
    time_left: float = 0.0
    time: float = 0.0

    def __post_init__(self) -> None:
        self.position.flags.writeable = False
        self.previous.flags.writeable = False

    @property
    def vertex_count(self) -> int:
        return int(self.position.shape[1])

    def normals(self) -> Floats:
        """Unit vertex normals (vertex_count, 3), see `vertex_normals`."""
        middle = self.position.mean(axis=1, keepdims=True)
        near = (self.position - middle).astype(np.float32)
        return np.ascontiguousarray(vertex_normals(near, self.fabric.triangles).T)


def start_cloth(
    positions: Floats, triangles: Ints, pin: Floats, edges: Ints | None = None
) -> ClothState:
    """Cloth at rest in its present shape.

    A vertex without any edge is pinned, whatever its weight, as it would only fall.

    Args:
        positions: (vertex_count, 3) world [m].
        triangles: (triangle_count, 3).
        pin: (vertex_count,) weights, from 0, free, to 1, carried by the animation.
        edges: (n, 2) edges that belong to no triangle, such as those of a string.

    Raises:
        HairloomError: no vertices, arrays that do not fit, values that are not finite.
    """
    position = vertex_rows(positions)
    count = position.shape[1]
    triangles = _indices(triangles, 3, count)
    pairs = unique_edges(triangles, None if edges is None else _indices(edges, 2, count))
    pin = _pin_weights(pin, count).copy()
    pin[np.setdiff1d(np.arange(count), pairs)] = 1.0
    pinned = pin >= PINNED_WEIGHT

    length = distances(position, pairs)
    distance, nearest = distances_along_edges(pairs, length, np.flatnonzero(pinned), count)
    tied = nearest >= 0
    moving = ~pinned[pairs].all(axis=1)
    pairs, length = pairs[moving], length[moving]
    folds = opposite_pairs(triangles)
    folds = folds[~pinned[folds].all(axis=1)]
    fabric = Fabric(
        position,
        triangles,
        pin,
        pairs,
        length,
        _colors(position, pairs),
        _colors(position, folds),
        np.where(tied, nearest, np.arange(count)),
        np.where(tied, distance, 0.0).astype(np.float32),
        0.25 * float(np.linalg.norm(np.ptp(position, axis=1))),
    )
    return ClothState(position, position, fabric)


def vertex_rows(positions: Floats) -> Floats:
    """Points (n, 3) as contiguous rows (3, n) float64.

    Raises:
        HairloomError: no points, another shape, or a value that is not finite.
    """
    positions = np.asarray(positions)
    if positions.ndim != 2 or positions.shape[1] != 3 or not len(positions):
        raise _broken(f"vertices have shape {positions.shape} instead of (n, 3)")
    rows = np.ascontiguousarray(positions.T, np.float64)
    if not np.isfinite(rows).all():
        raise _broken("a vertex is not a finite number")
    return rows


def distances(position: Floats, pairs: Ints) -> Floats:
    """The distance [m] between the two vertices of each pair (n, 2), (n,)."""
    displacement = position[:, pairs[:, 1]] - position[:, pairs[:, 0]]
    length: Floats = np.sqrt(np.einsum("ij,ij->j", displacement, displacement))
    return length


def vertex_normals(position: Floats, triangles: Ints) -> Floats:
    """Unit normals (3, vertex_count) float32, weighted by angle (Thuermer and Wuethrich 1998).

    `Surface.vertex_normals` on rows, without merging coincident vertices; zero without area.
    """
    corner = position[:, triangles.T]  # (3, corner, triangle)
    side = unit_rows(corner[:, [1, 2, 0]] - corner)
    cosine = -np.einsum("ijk,ijk->jk", side, side[:, [2, 0, 1]])
    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    face = unit_rows(cross_rows(side[:, 0], side[:, 1]))
    return unit_rows(_summed_at_vertices(face[:, None] * angle, triangles, position))


def area_weighted_normals(position: Floats, triangles: Ints) -> Floats:
    """Unit normals (3, vertex_count) float32, weighted by the area of faces, for drag."""
    corner = position[:, triangles.T]
    area = cross_rows(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    return unit_rows(_summed_at_vertices(np.repeat(area[:, None], 3, axis=1), triangles, position))


def _summed_at_vertices(corners: Floats, triangles: Ints, position: Floats) -> Floats:
    """The sum of corner values (3, corner, triangle) at each vertex."""
    index, total = triangles.T.reshape(-1), np.empty_like(position)
    for row, out in zip(corners.reshape(3, -1), total, strict=True):
        out[:] = np.bincount(index, row, minlength=len(out))
    return total


def _colors(position: Floats, pairs: Ints) -> tuple[Color, ...]:
    """Pairs (n, 2) by colour, with their lengths in `position`."""
    count = position.shape[1]
    length, colors = distances(position, pairs), greedy_colors(pairs)
    result = []
    for color in range(int(colors.max(initial=-1)) + 1):
        chosen = colors == color
        one, other = pairs[chosen].T
        vertices, mates = np.concatenate([one, other]), np.concatenate([other, one])
        both = np.tile(length[chosen], 2).astype(np.float32)
        if len(vertices) * 2 > count:  # moving all is faster than selecting some
            everyone, lengths = np.arange(count), np.zeros(count, np.float32)
            everyone[vertices], lengths[vertices] = mates, both
            result.append(Color(None, everyone, lengths))
        else:
            result.append(Color(vertices, mates, both))
    return tuple(result)


def _indices(rows: Ints, width: int, count: int) -> Ints:
    rows = np.asarray(rows, np.int64).reshape(-1, width)
    if rows.size and not 0 <= rows.min() <= rows.max() < count:
        raise _broken("a face or an edge refers to a vertex that does not exist")
    return rows


def _pin_weights(pin: Floats, count: int) -> Floats:
    pin = np.asarray(pin, np.float32)
    if pin.shape != (count,) or not np.isfinite(pin).all():
        raise _broken(f"{count} vertices cannot be pinned by weights of shape {pin.shape}")
    weights: Floats = np.clip(pin, 0.0, 1.0)
    return weights


def _broken(problem: str) -> HairloomError:
    return HairloomError(problem, place="fin", remedy="Check the mesh (Mesh > Clean Up)")
