"""The skin that hair grows on, in as many triangles as a layer of shells may have.

The skin is cut finely; its vertices are gathered into cells of about one size (centroidal Voronoi
cells; Lloyd 1982), and cells that meet become a triangle (Valette and Chassery 2004, "Approximated
centroidal Voronoi diagrams for uniform polygonal mesh coarsening"). So the triangles are even,
whatever the skin's own triangles, and as many as wanted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints, sums_by
from ..strands import Surface
from ..strands.closest_point import search_of
from ..strands.morton import morton_code
from ..strands.nearest import nearest_points
from ..strands.triangles import area_vectors, areas_of, quartered
from ..strands.vectors import unit
from ..strands.weld import unique_position_indices

#: Distance from a root up to which skin has hair, in distances between roots.
_REACH = 2.5
#: Factor by which the skin is cut finer than the coarse triangles, and maximum number of pieces.
_REFINEMENT, _MAX_PIECES = 4.0, 400_000
#: Offset along the normal that separates cells on both sides of a sheet, as a fraction of an edge.
_SIDE_OFFSET = 0.4
_ROUNDS, _ATTEMPTS = 10, 5
#: Approximate number of places of the skin that are tested for bulges.
_MAX_BULGES = 20_000
#: Maximum height by which a vertex is raised, in errors of the coarse skin.
_MAX_RAISED = 2.5
#: If a triangle's normal and its patch's have a cosine below this, the patch's triangles become
#: patches of their own.
_MIN_PATCH_COSINE = 0.6
#: Triangles below this fraction of the median area are dropped: they have no direction and show
#: nothing.
_MIN_AREA_RATIO = 0.02


@dataclass(frozen=True, eq=False)
class ShellSkin:
    """A coarse skin under hair.

    positions, normals: (vertex_count, 3) [m], on the skin, and unit normals of the triangles there.
    triangles: (triangle_count, 3), counter-clockwise seen from outside.
    error: nine tenths of the skin under hair are nearer to this one than this [m].
    raised_positions: the positions moved outwards, so that no skin bulges out of the triangles.
    """

    positions: Floats
    normals: Floats
    triangles: Ints
    error: float
    raised_positions: Floats

    @property
    def middles(self) -> Floats:
        """Middles of the triangles, (triangle_count, 3) [m]."""
        middles: Floats = self.positions[self.triangles].mean(axis=1)
        return middles

    @property
    def facings(self) -> Floats:
        """Mean normals of the triangles, (triangle_count, 3)."""
        return unit(self.normals[self.triangles].mean(axis=1))

    @property
    def area_vectors(self) -> Floats:
        """Vectors perpendicular to the triangles, as long as their areas, (triangle_count, 3)
        [m^2]."""
        return area_vectors(self.positions[self.triangles])

    @property
    def areas(self) -> Floats:
        """Areas of the triangles, (triangle_count,) [m^2]."""
        return np.linalg.norm(self.area_vectors, axis=1)

    def patches(self, count: int, layers: Floats) -> Ints:
        """The patch of each triangle, (triangle_count,), from 0 without gaps, all of about one
        size; more than `count` where triangles that lie together face apart.

        Args:
            layers: (layer_count, vertex_count, 3) [m], positions of the vertices in the layers of
                shells.
        """
        label = voronoi_cells(self.middles, self.facings, self.areas, count)
        faces_apart = np.zeros(len(label), bool)
        for positions in (self.positions, *layers):
            vectors = area_vectors(positions[self.triangles])
            across = np.zeros((len(self.triangles), 3))
            np.add.at(across, label, vectors)
            faces_apart |= (
                np.einsum("ti,ti->t", unit(across[label]), unit(vectors)) < _MIN_PATCH_COSINE
            )
        is_split = np.bincount(label, faces_apart)[label] > 0
        label = np.where(is_split, len(label) + np.arange(len(label)), label)
        return np.asarray(np.unique(label, return_inverse=True)[1]).reshape(-1)


@dataclass(frozen=True, eq=False)
class FineSkin:
    """The skin under hair cut finely; as `ShellSkin`, with the area around each vertex [m^2]."""

    positions: Floats
    normals: Floats
    triangles: Ints
    area: Floats


def fine_skin(head: Surface, roots: Floats, spacing: float, triangle_count: int) -> FineSkin:
    """The skin near roots, cut finely enough for this many coarse triangles.

    Args:
        roots: (strand_count, 3) [m]. spacing: their mean distance [m].
    """
    reach = _REACH * spacing
    middle = head.corners.mean(axis=1)
    size = np.linalg.norm(head.corners - middle[:, None], axis=2).max(axis=1)
    away = nearest_points(middle, roots, 1)[1][:, 0]
    chosen = np.flatnonzero(away <= reach + size)
    corners: Floats = head.corners[chosen].astype(np.float64)
    normals: Floats = head.vertex_normals()[head.triangles[chosen]].astype(np.float64)
    edge = _even_edge_length(
        min(float(areas_of(corners).sum()), len(roots) * spacing**2), triangle_count
    )
    while len(corners) and 4 * len(corners) <= _MAX_PIECES:
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        if np.quantile(longest, 0.9) <= edge / _REFINEMENT:
            break
        corners, normals = quartered(corners), quartered(normals)
    number = unique_position_indices(corners.reshape(-1, 3).astype(np.float32))
    _, first = np.unique(number, return_index=True)
    positions, triangles = corners.reshape(-1, 3)[first], number.reshape(-1, 3)
    has_hair = nearest_points(positions, roots, 1)[1][:, 0] <= reach
    triangles = triangles[has_hair[triangles].all(axis=1)]
    used, compact = np.unique(triangles, return_inverse=True)
    triangles = np.asarray(compact).reshape(-1, 3)
    around = np.repeat(areas_of(positions[used][triangles]) / 3.0, 3)
    area = np.bincount(triangles.ravel(), around, len(used))
    return FineSkin(positions[used], unit(normals.reshape(-1, 3)[first][used]), triangles, area)


def coarse_skin(fine: FineSkin, head: Surface, triangle_count: int) -> ShellSkin | None:
    """The skin in at most, and nearly, this many triangles; None if the hair is too small for
    any."""
    cells, best = max(triangle_count // 2, 3), None
    for _ in range(_ATTEMPTS):
        found = _skin_from_cells(fine, head, min(cells, len(fine.positions)))
        count = len(found.triangles)
        if count <= triangle_count and count > (0 if best is None else len(best.triangles)):
            best = found
        if 0.93 * triangle_count <= count <= triangle_count or cells > len(fine.positions):
            break
        wanted = 0.97 * triangle_count / max(count, 1)
        cells = max(int(cells * np.clip(wanted, 0.4, 2.5)), 3)
    return None if best is None else _with_raised_vertices(best, fine)


def voronoi_cells(places: Floats, normals: Floats, area: Floats, count: int) -> Ints:
    """The cell of each place, (n,), of at most `count` cells of about one size.

    Args:
        places, normals: (n, 3); places of opposite normals are kept apart. area: (n,) weights.
    """
    edge = _even_edge_length(float(area.sum()), 2 * count)
    points = places + _SIDE_OFFSET * edge * normals
    order = np.argsort(morton_code(points), kind="stable")
    middle = points[order[np.linspace(0, len(order) - 1, count).round().astype(int)]]
    for _ in range(_ROUNDS):
        label = nearest_points(points, middle, 1)[0][:, 0]
        total = np.bincount(label, area, len(middle))
        sums = sums_by(label, area[:, None] * points, len(middle))
        used = total > 0.0
        middle = sums[used] / total[used, None]
    return nearest_points(points, middle, 1)[0][:, 0]


def _skin_from_cells(fine: FineSkin, head: Surface, count: int) -> ShellSkin:
    label = voronoi_cells(fine.positions, fine.normals, fine.area, count)
    # a cell at the border lies on the border, or hair would recede by half a cell
    weight = np.where(_is_border(fine), 1.0, 1e-6) * fine.area
    has_border = np.bincount(label, _is_border(fine)) > 0
    weight = np.where(has_border[label], weight, fine.area)
    total = np.maximum(np.bincount(label, weight), 1e-30)
    place = sums_by(label, weight[:, None] * fine.positions)
    on_skin = search_of(head).closest(place / total[:, None])
    normals = head.vertex_normals()[head.triangles[on_skin.triangle]]
    normals = unit(np.einsum("nk,nki->ni", on_skin.barycentric, normals))

    cells = label[fine.triangles]
    is_corner = (
        (cells[:, 0] != cells[:, 1]) & (cells[:, 1] != cells[:, 2]) & (cells[:, 2] != cells[:, 0])
    )
    cells = cells[is_corner]
    _, first = np.unique(np.sort(cells, axis=1), axis=0, return_index=True)
    triangles = cells[np.sort(first)]
    face = area_vectors(on_skin.point[triangles])
    is_flipped = np.einsum("ni,ni->n", face, normals[triangles].sum(axis=1)) < 0.0
    triangles[is_flipped] = triangles[is_flipped, ::-1]
    area = areas_of(on_skin.point[triangles])
    triangles = triangles[area > _MIN_AREA_RATIO * np.median(area)] if len(area) else triangles
    used, compact = np.unique(triangles, return_inverse=True)
    triangles = np.asarray(compact).reshape(-1, 3)
    positions = on_skin.point[used]
    # normals of the coarse triangles: the skin's own may be those of a fold that is lost here
    across = np.zeros_like(positions)
    np.add.at(across, triangles, area_vectors(positions[triangles])[:, None])
    error = _error(fine, positions, triangles)
    return ShellSkin(positions, unit(across), triangles, error, positions)


def _with_raised_vertices(skin: ShellSkin, fine: FineSkin) -> ShellSkin:
    """The skin with vertices raised so far that hardly any skin under hair bulges out of the
    triangles: each bulge moves the corners of the triangle below it by the smallest sufficient
    heights."""
    places = np.arange(0, len(fine.positions), max(len(fine.positions) // _MAX_BULGES, 1))
    closest = search_of(Surface(skin.positions, skin.triangles)).closest(fine.positions[places])
    out = skin.facings[closest.triangle]
    height = np.einsum("ni,ni->n", fine.positions[places] - closest.point, out)
    # places beyond the border have no triangle below
    is_over = (height > 0.5 * closest.distance) & (closest.distance > 0.0)
    corner, weight = skin.triangles[closest.triangle], closest.barycentric
    rise = height[:, None] * weight / np.sum(weight**2, axis=1, keepdims=True)
    max_rise = np.zeros(len(skin.positions))
    np.maximum.at(max_rise, corner[is_over], rise[is_over])
    raised = np.minimum(max_rise, _MAX_RAISED * skin.error)[:, None] * skin.normals
    return replace(skin, raised_positions=skin.positions + raised)


def _is_border(fine: FineSkin) -> Bools:
    """Which vertices lie where the hair ends, (vertex_count,)."""
    edges = np.concatenate([fine.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    pairs, times = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    border = np.zeros(len(fine.positions), bool)
    border[pairs[times == 1]] = True
    return border


def _error(fine: FineSkin, positions: Floats, triangles: Ints) -> float:
    if not len(triangles):
        return 0.0
    places = fine.positions[:: max(len(fine.positions) // 4000, 1)]
    found = search_of(Surface(positions, triangles)).closest(places)
    return float(np.percentile(found.distance, 90.0))


def _even_edge_length(area: float, triangle_count: int) -> float:
    """Edge of this many even triangles with this area together [m]."""
    return float((4.0 / 3.0**0.5 * max(area, 1e-30) / max(triangle_count, 1)) ** 0.5)
