"""Hair of the built-in head, moved to another head that this one was fitted to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import StrandSet, Surface
from ..strands.arc_length import segment_lengths
from ..strands.closest_point import ClosestPoints, ClosestPointSearch
from ..strands.vectors import unit

#: distance from its root [m on the built-in head] beyond which a strand follows the warp alone
_FADE = 0.03
#: a triangle farther than this from the skin [m on the built-in head] does not belong to the head
_NEAR = 0.08


@dataclass(frozen=True, eq=False)
class FittedHair:
    """strands: bound to the other head, in its space.
    away: (strand_count,) how far each root was from that head before it was moved onto it.
    """

    strands: StrandSet
    away: Floats


def fit_hair(
    strands: StrandSet,
    roots: Floats,
    warp: Callable[[Floats], Floats],
    outside: OuterSkinSearch,
    scale: float,
) -> FittedHair:
    """Hair with its roots on the other head, which follows the smooth warp beyond them.

    The smooth warp keeps together what belongs together: a braid, a tail, a lock.

    Args:
        strands: on the built-in head, in its space.
        roots: (strand_count, 3) approximate places on the other head, in its space.
        scale: how much larger the other head is.
    """
    found = outside.closest(roots)
    offsets, counts = strands.offsets, strands.point_counts
    points = warp(strands.points)
    reached = np.cumsum(segment_lengths(strands.points, offsets), dtype=np.float64)
    reached -= np.repeat(reached[offsets[:-1]], counts)
    moved = np.repeat(found.point - points[offsets[:-1]], counts, axis=0)
    points += moved * np.exp(-((reached / _FADE) ** 2))[:, None]
    target = outside.target
    uv = target.corner_uv
    fitted = replace(
        strands,
        points=points,
        radius=strands.radius * np.float32(scale),
        root_triangle=found.triangle,
        root_barycentric=found.barycentric,
        root_uv=None
        if uv is None
        else np.einsum("sk,skj->sj", found.barycentric, uv[found.triangle]),
    )
    return FittedHair(fitted, found.distance)


class OuterSkinSearch:
    """Finds closest points on the outer skin of a head, without inner parts: sockets, the mouth,
    the inner side of a shell."""

    def __init__(self, target: Surface, skin: Surface, scale: float) -> None:
        """
        Args:
            skin: of the built-in head, fitted to the target.
            scale: how much larger than the built-in head both are.
        """
        self.target = target
        self._triangles = np.flatnonzero(_is_outer(target, skin, _NEAR * scale))
        if not len(self._triangles):
            self._triangles = np.arange(len(target.triangles))
        outer = Surface(target.positions, target.triangles[self._triangles])
        self._search = ClosestPointSearch(outer)

    def closest(self, points: Floats) -> ClosestPoints:
        """The points closest to these, (n, 3) [m], on triangles of the whole target."""
        found = self._search.closest(points)
        triangle: Ints = self._triangles[found.triangle].astype(np.int32)
        return replace(found, triangle=triangle)


def _is_outer(target: Surface, skin: Surface, near: float) -> Bools:
    """Which triangles (triangle_count,) face the same way as the skin beside them."""
    middle, facing = target.corners.mean(axis=1), target.triangle_normals()
    low, high = skin.bounds()
    is_outer = ((middle > low - near) & (middle < high + near)).all(axis=1)
    index = np.flatnonzero(is_outer)
    found = ClosestPointSearch(skin).closest(middle[index], near)
    normal = skin.triangle_normals()[found.triangle]
    agrees = np.einsum("nj,nj->n", unit(normal), facing[index]) > 0.0
    is_outer[index] = agrees & (found.distance < near)
    return np.asarray(is_outer)


def warped_weights(weights: Floats, skin: Surface, positions: Floats, reach: float) -> Floats:
    """Weights of the skin's vertices at the closest point of each of the positions (n, 3); 0 where
    that is farther than `reach`."""
    found = ClosestPointSearch(skin).closest(positions, reach)
    at = np.einsum("nk,nk->n", found.barycentric, weights[skin.triangles[found.triangle]])
    return np.where(found.distance < reach, at, 0.0)
