"""Strands that the head hides are not drawn.

A ball inside the head hides from the eye everything that lies behind the plane of its horizon and
within the cone of its tangents; in an orthographic view, within a cylinder:

                     .-'''-.
    eye    _ _ - - - |  c   | - - _        a strand is left out when all control points
     *<- - - - - - - | - - -| - - - - ->   of its segments are in here, behind one ball
             - - _ _ |      | _ - -
                   horizon-'

That region is convex, so it contains a Bezier curve, and every chord of it, if it contains the
control points. Then each point of the curve is hidden by the ball, and so by the head around it.

Limits: a head that is transparent, or clipped by the near plane, hides nothing, so culling must be
off. Balls that reach in front of the near plane are not used. Through a hole, such as an eye socket
without an eye, hair that has come through the back of the head would be visible, but is culled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import Surface
from ..strands.closest_point import search_of
from ..strands.triangles import area_vectors, areas_of
from .detail import PictureView
from .smooth import bezier

#: Strands processed at once, so that they stay in the processor's cache.
_CHUNK = 1024
#: Number of places along each axis of the surface's box where a ball may start to grow.
_PLACES = 12
#: Samples of the surface from which the distance of those places is estimated.
_SAMPLES = 512
#: Number of steps by which a ball moves away from the surface, and the factor of each next step.
_STEPS, _SHORTER = 8, 0.65
#: A ball must protrude from the others by this fraction of the largest one's radius.
_MIN_PROTRUSION = 0.2
#: Balls are shrunk by this factor, so that they are well inside the mesh.
INNER_PART = 0.95


@dataclass(frozen=True)
class HiddenRegions:
    """The regions hidden by some balls. A point p, with s = (p - origin) . axis, is in one if

        s >= nearest  and  |p - origin - s axis|^2 <= width + slope s^2

    origin: (k, 3) [m, world], the eye, or the ball's centre for an orthographic picture.
    axis: (k, 3), unit vectors away from the eye.
    nearest: (k,) [m]. width: (k,) [m^2]. slope: (k,).
    """

    origin: Floats
    axis: Floats
    nearest: Floats
    width: Floats
    slope: Floats


def hidden_regions(
    spheres: Floats, view: PictureView, half_width: float, radius: float
) -> HiddenRegions:
    """The regions that occluder spheres hide in one view, without spheres that hide nothing.

    Args:
        spheres: (k, 4) xyz centre and w radius [m, world].
        half_width: the largest half width that a strand is drawn with [pixels].
        radius: the largest radius of the strands [m].
    """
    balls = np.asarray(spheres, np.float64).reshape(-1, 4)
    eye = np.linalg.inv(np.asarray(view.view, np.float64))
    # [pixels] per metre; in perspective per unit of slope
    scale = np.abs(np.diag(view.projection)[:2]) * view.half_size
    if view.projection[3, 3] == 0.0:
        away = balls[:, :3] - eye[:3, 3]
        distance = np.linalg.norm(away, axis=1)
        size = balls[:, 3] - 2.0 * radius - half_width / scale.min() * distance
        is_before = (size > 0.0) & (distance > size)
        balls, away, distance, size = (part[is_before] for part in (balls, away, distance, size))
        axis = away / distance[:, None]
        squared = distance * distance - size * size
        origin = np.tile(eye[:3, 3], (len(balls), 1))
        regions = HiddenRegions(origin, axis, squared / distance, 0.0 * size, size * size / squared)
    else:
        size = balls[:, 3] - radius - half_width / scale.min()
        balls, size = balls[size > 0.0], size[size > 0.0]
        axis = np.tile(-eye[:3, 2], (len(balls), 1))
        regions = HiddenRegions(balls[:, :3], axis, 0.0 * size, size * size, 0.0 * size)
    front = balls[:, :3] - regions.axis * balls[:, 3:]
    clip = np.column_stack([front, np.ones(len(front))]) @ view.view_projection.T
    is_drawn = clip[:, 2] >= -clip[:, 3]
    return HiddenRegions(*(part[is_drawn] for part in _parts(regions)))


def are_hidden(points: Floats, regions: HiddenRegions) -> Bools:
    """Which strands lie entirely within one of the regions, (strand_count,).

    Args:
        points: (strand_count, cv_count, 3) [m], world space.
    """
    result = np.zeros(len(points), bool)
    for start in range(0, len(points), _CHUNK):
        control = bezier(np.asarray(points[start : start + _CHUNK], np.float64))
        control = control.reshape(len(control), -1, 3)
        for origin, axis, nearest, width, slope in zip(*_parts(regions), strict=True):
            away = control - origin
            along = away @ axis
            across = away - along[..., None] * axis
            is_within = (across * across).sum(axis=-1) <= width + slope * along * along
            result[start : start + _CHUNK] |= (is_within & (along >= nearest)).all(axis=1)
    return result


def are_facing_away(root: Floats, center: Floats, eye: Floats) -> Bools:
    """Which strands grow on the far side of the head, (strand_count,).

    Seen from the middle of all roots, their roots lie in a direction away from the eye.

    Args:
        root: (strand_count, 3) [m, world].
        center: (3,) [m, world], the middle of all roots.
        eye: (4,), homogeneous, as Camera.eye.
    """
    to_eye = eye[:3] - eye[3] * root
    return np.einsum("ij,ij->i", root - center, to_eye) < 0.0


def occluder_spheres_of(surface: Surface, count: int = 8, roots: Floats | None = None) -> Floats:
    """The largest balls inside a mesh that differ from each other, (k <= count, 4) float32.

    xyz centre, w radius [m], in the space of the surface; the largest first. Holes count as closed
    by caps, so that no ball protrudes from one; a line through a ball still crosses the mesh unless
    it enters by one hole and leaves by another. A mesh without an inside gives no balls.

    Args:
        roots: (n, 3), same space; only the region around them is searched, so that there are no
            balls in feet and hands.
    """
    surface = surface.compute_once(_capped)
    if not len(surface.triangles):
        return np.zeros((0, 4), np.float32)
    low, high = _box(surface, roots)
    first = _first_places(surface, low, high, count + count // 2)
    centers, distance = _grown(first, surface, float(np.max(high - low)) / _PLACES)
    is_inside = _winding(centers, surface) > 0.5
    balls = np.column_stack([centers, INNER_PART * distance])[is_inside]
    return _select_distinct(balls, count).astype(np.float32)


def transform_spheres(spheres: Floats, matrix: Floats) -> Floats:
    """Spheres (k, 4) moved by an affine (4, 4) matrix, shrunk to fit into the ellipsoids that the
    matrix makes of them."""
    matrix = np.asarray(matrix, np.float64)
    centers = spheres[:, :3] @ matrix[:3, :3].T + matrix[:3, 3]
    min_scale = np.linalg.svd(matrix[:3, :3], compute_uv=False).min()
    return np.column_stack([centers, spheres[:, 3] * min_scale]).astype(np.float32)


def _box(surface: Surface, roots: Floats | None) -> tuple[Floats, Floats]:
    """The box to search for balls, two corners: the roots, and half their extent around them."""
    low, high = surface.bounds()
    if roots is None or not len(roots):
        return low, high
    first, last = roots.min(axis=0), roots.max(axis=0)
    room = np.max(last - first) / 2.0
    return np.clip(first - room, low, high), np.clip(last + room, low, high)


def _first_places(surface: Surface, low: Floats, high: Floats, count: int) -> Floats:
    """Places (n <= count, 3) in a box for roughly the largest balls, estimated by samples."""
    fractions = (np.arange(_PLACES) + 0.5) / _PLACES
    cells = np.stack(np.meshgrid(fractions, fractions, fractions, indexing="ij"), axis=-1).reshape(
        -1, 3
    )
    places = low + cells * (high - low)
    points, normals = _samples(surface)
    squared = sum((places[:, None, axis] - points[:, axis]) ** 2 for axis in range(3))
    nearest = np.asarray(squared).argmin(axis=1)
    away = places - points[nearest]
    is_inside = np.einsum("ij,ij->i", away, normals[nearest]) < 0.0
    balls = np.column_stack([places, np.linalg.norm(away, axis=1)])[is_inside]
    return _select_distinct(balls, count)[:, :3]


def _samples(surface: Surface) -> tuple[Floats, Floats]:
    """Middles and normals of triangles spread evenly over the surface, (n <= _SAMPLES, 3) each."""
    corners = surface.corners.astype(np.float64)
    area = areas_of(corners).cumsum()
    chosen = np.searchsorted(area, area[-1] * (np.arange(_SAMPLES) + 0.5) / _SAMPLES)
    chosen = np.unique(np.minimum(chosen, len(corners) - 1))
    return corners[chosen].mean(axis=1), surface.triangle_normals()[chosen]


def _grown(centers: Floats, surface: Surface, step: float) -> tuple[Floats, Floats]:
    """Balls grown by moving away from the surface: centres (n, 3) and radii (n,), each where it was
    largest."""
    search = search_of(surface)
    best, largest = centers, np.zeros(len(centers))
    for _ in range(_STEPS):
        closest = search.closest(centers)
        is_larger = closest.distance > largest
        best = np.where(is_larger[:, None], centers, best)
        largest = np.maximum(closest.distance, largest)
        away = centers - closest.point
        centers = centers + away * (step / np.maximum(closest.distance, 1.0e-9))[:, None]
        step *= _SHORTER
    return best, largest


def _winding(centers: Floats, surface: Surface) -> Floats:
    """How often a closed mesh winds around points far from it, (n,): each triangle as a dipole.

    The first-order term of Barill et al. 2018, for triangles small beside their distance.
    """
    corners = surface.corners.astype(np.float64)
    away = corners.mean(axis=1) - centers[:, None]
    flux = np.einsum("nij,ij->ni", away, area_vectors(corners))
    return (flux / np.linalg.norm(away, axis=2) ** 3).sum(axis=1) / (4.0 * np.pi)


def _capped(surface: Surface) -> Surface:
    """The mesh with each hole closed by triangles from its edges to its middle."""
    # merge coincident vertices, so that a seam is no hole
    positions, vertex = np.unique(surface.positions, axis=0, return_inverse=True)
    triangles = vertex.ravel()[surface.triangles]
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    code = edges.min(axis=1) * len(positions) + edges.max(axis=1)
    _, first, count = np.unique(code, return_index=True, return_counts=True)
    rim = edges[first[count == 1]]
    hole = _connected(rim, len(positions))[rim[:, 0]]
    holes, hole = np.unique(hole, return_inverse=True)
    middles = [positions[rim[hole == index]].mean(axis=(0, 1)) for index in range(len(holes))]
    caps = np.column_stack([rim[:, ::-1], len(positions) + hole])
    return Surface(np.vstack([positions, *middles]), np.vstack([triangles, caps]))


def _connected(edges: Ints, vertex_count: int) -> Ints:
    """The lowest vertex that each vertex is connected to by edges (n, 2), (vertex_count,)."""
    label = np.arange(vertex_count)
    while True:
        lowest = label.copy()
        for one, two in (edges.T, edges.T[::-1]):
            np.minimum.at(lowest, one, label[two])
        lowest = lowest[lowest]
        if (lowest == label).all():
            return label
        label = lowest


def _select_distinct(balls: Floats, count: int) -> Floats:
    """The largest ball, then repeatedly the one that protrudes most from those, (n <= count, 4)."""
    chosen: list[int] = []
    protrusion = balls[:, 3].copy()
    while len(chosen) < min(count, len(balls)):
        best = int(protrusion.argmax())
        if not protrusion[best] > _MIN_PROTRUSION * balls[:, 3].max():
            break
        chosen.append(best)
        apart = np.linalg.norm(balls[:, :3] - balls[best, :3], axis=1)
        protrusion = np.minimum(protrusion, apart + balls[:, 3] - balls[best, 3])
    return balls[chosen]


def _parts(regions: HiddenRegions) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    return regions.origin, regions.axis, regions.nearest, regions.width, regions.slope
