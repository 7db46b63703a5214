"""Ambient occlusion of card vertices by rays against cards, with their alpha, and bodies.

For cards without known strands, and for occlusion by other grooms; cards that are made from strands
have the strands' occlusion, see `build.CardGroom`.

The result is the light that a vertex receives from a uniform sky, as a fraction of what a surface
with its normal receives in the open:  A = sum_i |n . d_i| T_i / sum_i |n . d_i|,  over directions
d_i spread evenly over the half sphere about the normal n, which faces away from the head. So a card
that lies open on the head has 1. T is the transmittance of the ray: 0 through a body,
(1 - alpha)^extinction through each card at the place that is met (Scheuermann 2004, section 5;
Zhukov, Iones and Kronin 1998, ambient light under a uniform sky). With an extinction of 1 a card
blocks as much light as it appears to; strands block more, see shading/ambient.py.

All vertices share one set of axes. Along each axis every vertex has one ray, to the side to which
its normal leans, and all rays are traced together (see parallel_rays.py).

Limitations: alpha is that of the nearest pixel. A body only blocks rays that enter it, so that
roots a little below the skin are not dark; its triangles must face outwards.
"""

from __future__ import annotations

import os
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Self

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import Surface
from .card_mesh import CardMesh
from .occlusion_settings import CardOcclusionSettings
from .parallel_rays import crossings, point_grid
from .sort import card_of_vertex
from .steps import result_of

#: Minimum distance of what a ray meets, for cards that cross at a vertex. In extents of the cards.
_MIN_DISTANCE = 2.0e-4
#: Optical depth of opaque texels: exp of its negative is 0 in float32.
_OPAQUE_DEPTH = 100.0
#: Directions at work at the same time; numpy lets other threads run most of the time.
_THREADS = min(4, os.cpu_count() or 1)
_DIRECTIONS_PER_STEP = 8


@dataclass(frozen=True)
class CardOccluder:
    """Cards that occlude. alpha: (height, width) in [0, 1], row 0 the lowest; None: opaque."""

    mesh: CardMesh
    alpha: Floats | None = None

    @classmethod
    def of_surface(cls, surface: Surface, alpha: Floats | None) -> CardOccluder:
        """A mesh that occludes but is not shaded, so its cards' attributes are left empty. It is
        opaque without UVs."""
        corners = surface.triangles.ravel()
        count = len(corners)
        uv = surface.corner_uv
        nothing, unknown = np.zeros((count, 3), np.float32), np.zeros(count, np.float32)
        mesh = CardMesh(
            positions=surface.positions[corners],
            triangles=np.arange(count).reshape(-1, 3),
            uv=nothing[:, :2] if uv is None else uv.reshape(-1, 2),
            normal=nothing,
            tangent=nothing,
            occlusion=unknown,
            card=np.zeros(count // 3, np.int32),
            along=unknown,
        )
        return cls(mesh, None if uv is None else alpha)


def vertex_occlusion(
    mesh: CardMesh,
    occluders: Sequence[CardOccluder],
    bodies: Sequence[Surface],
    settings: CardOcclusionSettings,
) -> Floats:
    """How open each vertex of `mesh` is, (vertex_count,) float32: 1 open, 0 enclosed.

    Args:
        mesh: the cards that are shaded; they occlude themselves if `mesh` is among the occluders.
        occluders: cards of this groom, and optionally of others, all in one space.
        bodies: heads and whatever else lets no light through, in the same space.
    """
    return result_of(occlusion_steps(mesh, occluders, bodies, settings))


def occlusion_steps(
    mesh: CardMesh,
    occluders: Sequence[CardOccluder],
    bodies: Sequence[Surface],
    settings: CardOcclusionSettings,
) -> Generator[float, None, Floats]:
    """As vertex_occlusion, some directions per step; yields the fraction that is done."""
    count = len(mesh.positions)
    if not count:
        return np.ones(0, np.float32)
    scene = _Scene(mesh, occluders, bodies, settings)
    axes = evenly_spread_axes(settings.rays)
    light, whole = np.zeros(count), np.zeros(count)
    with ThreadPoolExecutor(_THREADS) as threads:
        for first in range(0, len(axes), _DIRECTIONS_PER_STEP):
            part = axes[first : first + _DIRECTIONS_PER_STEP]
            # in order, so that the sums are the same every time
            for fraction, transmittance in threads.map(scene.transmittance_along, part):
                light += fraction * transmittance
                whole += fraction
            yield (first + len(part)) / len(axes)
    openness = np.divide(light, whole, out=np.ones(count), where=whole > 0.0)
    shown: Floats = (1.0 - settings.strength * (1.0 - openness)).astype(np.float32)
    return shown


def diagonal_of(*meshes: CardMesh) -> float:
    """The diagonal of cards' bounds [m], the unit of distances in the settings."""
    positions = np.concatenate([mesh.positions for mesh in meshes])
    return float(np.linalg.norm(np.ptp(positions, axis=0)))


def evenly_spread_axes(count: int) -> Floats:
    """Unit vectors, one of each axis, (count, 3): with their opposites evenly over the sphere.

    A Fibonacci lattice of the upper half (Swinbank and Purser 2006).
    """
    step = np.arange(count) + 0.5
    height = 1.0 - step / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * step
    breadth = np.sqrt(1.0 - height**2)
    return np.stack([breadth * np.cos(turn), breadth * np.sin(turn), height], axis=1)


class _Triangles:
    """Triangles that parallel rays may meet.

    corners: (3, 3, triangle_count) float32 [m], corner by corner, coordinates first.
    height: of a typical triangle [m].
    """

    def __init__(self, positions: Floats, triangles: Ints, middle: Floats) -> None:
        corners = (positions - middle)[triangles]
        self.corners = np.ascontiguousarray(corners.transpose(1, 2, 0))
        self.height = (
            float(np.median(np.ptp(corners, axis=1).mean(axis=1))) if len(corners) else 0.0
        )


class _OccluderCards:
    """The cards of one occluder.

    texel: (triangle_count, 6) float32 place in the texture of each triangle's first corner, and
        offsets of the others from it, x and y in pixels.
    depth: (height, width) float32, optical depth.
    card: (triangle_count,); -1 if the shaded vertices belong to another mesh.
    """

    def __init__(self, occluder: CardOccluder, middle: Floats, is_own: bool) -> None:
        mesh = occluder.mesh
        alpha = np.ones((1, 1), np.float32) if occluder.alpha is None else occluder.alpha
        self.triangles = _Triangles(mesh.positions, mesh.triangles, middle)
        self.card = mesh.card if is_own else np.full_like(mesh.card, -1)
        self.depth = -np.log(np.maximum(1.0 - alpha, np.exp(-_OPAQUE_DEPTH))).astype(np.float32)
        texel = mesh.uv[mesh.triangles] * np.array(alpha.shape[::-1], np.float32)
        texel[:, 1:] -= texel[:, :1]
        self._texel = texel.reshape(-1, 6)

    def depth_at(self, triangle: Ints, second: Floats, third: Floats) -> Floats:
        """Optical depth where triangles are met, (n,)."""
        texel = self._texel.take(triangle, axis=0)
        across = texel[:, 0] + second * texel[:, 2] + third * texel[:, 4]
        upwards = texel[:, 1] + second * texel[:, 3] + third * texel[:, 5]
        height, width = self.depth.shape
        column = np.clip(across, 0, width - 1).astype(np.int64)
        row = np.clip(upwards, 0, height - 1).astype(np.int64)
        depth: Floats = self.depth.ravel().take(row * width + column)
        return depth


@dataclass(frozen=True)
class _Distances:
    """Range along a ray in which cards and bodies occlude, and from where on a vertex's own card
    does [m]."""

    nearest: float
    reach: float
    own_card: float

    @classmethod
    def of(cls, settings: CardOcclusionSettings, extent: float, whole: float) -> Self:
        """Args:
        extent: of the cards that are shaded [m].
            whole: of these and all occluders.
        """
        own = settings.self_occlusion_distance * extent
        return cls(_MIN_DISTANCE * extent, settings.reach * whole, own)


class _Scene:
    """The shaded vertices and the occluders, prepared for one axis after the other."""

    def __init__(
        self,
        mesh: CardMesh,
        occluders: Sequence[CardOccluder],
        bodies: Sequence[Surface],
        settings: CardOcclusionSettings,
    ) -> None:
        middle = mesh.positions.mean(axis=0)
        self._points = np.ascontiguousarray((mesh.positions - middle).T)
        self._normals = mesh.normal
        self._card = card_of_vertex(mesh)
        self._extinction = settings.extinction
        self._distances = _Distances.of(
            settings, diagonal_of(mesh), diagonal_of(mesh, *(each.mesh for each in occluders))
        )
        self._bodies = [_Triangles(body.positions, body.triangles, middle) for body in bodies]
        self._layers = [_OccluderCards(each, middle, each.mesh is mesh) for each in occluders]

    def transmittance_along(self, axis: Floats) -> tuple[Floats, Floats]:
        """(cosine, transmittance) of each vertex' ray along the axis, each (vertex_count,)."""
        frame = _frame(axis)
        leaning = self._normals @ frame[2]
        side = np.where(leaning < 0.0, -1.0, 1.0).astype(np.float32)
        rays = _Rays(np.arange(len(leaning)), frame @ self._points, side, self._card)
        for body in self._bodies:
            rays = rays.select(~rays.enters(frame @ body.corners, body.height, self._distances))
        depth = np.zeros(len(rays.vertex))
        for layer in self._layers:
            depth += rays.depth(frame @ layer.triangles.corners, layer, self._distances)
        transmittance = np.zeros(len(leaning))
        transmittance[rays.vertex] = np.exp(-self._extinction * depth)
        return np.abs(leaning), transmittance


@dataclass(frozen=True)
class _RayHits:
    """Rays and the triangles that they meet, each (m,); distance [m] along the ray."""

    ray: Ints
    triangle: Ints
    second: Floats
    third: Floats
    distance: Floats


@dataclass(frozen=True)
class _Rays:
    """Parallel rays, (n,) each.

    vertex, card: where they start; places: (3, n) float32 in the frame of the axis [m];
    side: 1 for rays along the axis, -1 for those against it.
    """

    vertex: Ints
    places: Floats
    side: Floats
    card: Ints

    def select(self, chosen: Bools) -> _Rays:
        index = np.flatnonzero(chosen)
        return _Rays(
            self.vertex[index], self.places.take(index, axis=1), self.side[index], self.card[index]
        )

    def enters(self, corners: Floats, height: float, distances: _Distances) -> Bools:
        """Which of the rays enter a body within the reach, (n,)."""
        one, two = corners[1] - corners[0], corners[2] - corners[0]
        facing = one[0] * two[1] - one[1] * two[0]
        found = np.zeros(len(self.vertex), bool)
        for met in self._hits(corners, height, distances):
            enters = facing.take(met.triangle) * self.side.take(met.ray) < 0.0
            found[met.ray[enters]] = True
        return found

    def depth(self, corners: Floats, layer: _OccluderCards, distances: _Distances) -> Floats:
        """Optical depth of all cards of a layer that each ray meets, (n,)."""
        total = np.zeros(len(self.vertex))
        for met in self._hits(corners, layer.triangles.height, distances):
            is_own = layer.card.take(met.triangle) == self.card.take(met.ray)
            kept = np.flatnonzero(~is_own | (met.distance > distances.own_card))
            places = met.triangle.take(kept), met.second.take(kept), met.third.take(kept)
            depth = layer.depth_at(*places)
            total += np.bincount(met.ray.take(kept), depth, minlength=len(total))
        return total

    def _hits(self, corners: Floats, height: float, distances: _Distances) -> Iterator[_RayHits]:
        """All triangles that rays meet ahead within the reach, in portions."""
        if not len(self.vertex):
            return
        first, second, third = corners[:, 2]
        planes = np.stack([first, second - first, third - first], axis=1)
        for pair in crossings(point_grid(self.places[:2], height), corners[:, :2]):
            plane = planes.take(pair.triangle, axis=0)
            met = plane[:, 0] + plane[:, 1] * pair.second + plane[:, 2] * pair.third
            distance = (met - self.places[2].take(pair.point)) * self.side.take(pair.point)
            kept = np.flatnonzero((distance > distances.nearest) & (distance < distances.reach))
            yield _RayHits(
                pair.point.take(kept),
                pair.triangle.take(kept),
                pair.second.take(kept),
                pair.third.take(kept),
                distance.take(kept),
            )


def _frame(axis: Floats) -> Floats:
    """Rows: two directions perpendicular to the axis, and the axis, right-handed, (3, 3)
    float32."""
    aside = np.eye(3)[int(np.argmin(np.abs(axis)))]
    across = np.cross(aside, axis)
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(axis, across), axis]).astype(np.float32)
