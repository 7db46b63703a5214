"""Mirror: the hair of one side of a surface grows on its other side, too."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands import StrandSet, Surface
from ..strands.affine import transform_points
from ..strands.closest_point import search_of
from .mirror_settings import MirrorSettings

#: Fraction of the surface's size: roots nearer to the plane are in the middle, and roots that need
#: to move by no more stay where the plane puts them.
_NEAR = 1.0e-6


def reflection(matrix: Floats, axis: str) -> Floats:
    """(4, 4) float64, across the plane through an object's origin, in world space.

    Args:
        matrix: (4, 4), from object to world space. axis: of the object, across the plane.
    """
    number = "xyz".index(axis)
    normal = np.linalg.inv(matrix)[number, :3]  # correct in a sheared object, too
    normal = normal / np.linalg.norm(normal)
    result = np.eye(4)
    result[:3, :3] -= 2.0 * np.outer(normal, normal)
    result[:3, 3] = 2.0 * normal * (normal @ matrix[:3, 3])
    return result


def mirror_sides(roots: Floats, surface: Surface, matrix: Floats, settings: MirrorSettings) -> Ints:
    """1 for roots (n, 3) on the side that is mirrored, -1 on the other, 0 in the middle, (n,).

    Args:
        matrix: (4, 4), from the surface's object to the space of roots and surface.
    """
    normal = np.linalg.inv(matrix)["xyz".index(settings.axis), :3]
    normal = normal / np.linalg.norm(normal)
    height = (roots.astype(np.float64) - matrix[:3, 3]) @ normal
    side = np.where(np.abs(height) > _NEAR * _size(surface), np.sign(height), 0.0)
    return np.asarray(side if settings.side == "positive" else -side).astype(np.int32)


@dataclass(frozen=True, eq=False)
class Mirrored:
    """strands: bound to the surface, with root UVs if it has any.
    shift: (strand_count, 3) float32 [m], how far each was moved from where the plane puts it.
    """

    strands: StrandSet
    shift: Floats

    @property
    def is_shifted(self) -> Bools:
        """Which strands were moved, (strand_count,)."""
        return np.asarray((self.shift != 0.0).any(axis=1))


def mirror_strands(strands: StrandSet, surface: Surface, across: Floats) -> Mirrored:
    """Strands on the other side of a plane, as far from the surface as they are on their own.

    The point that a root grows on is mirrored and moved to the closest point of the surface; the
    strand moves with it. On a symmetric surface nothing but signs change.

    Args:
        strands: in the space of the surface. across: (4, 4), see `reflection`.
    """
    search = search_of(surface)
    foot = search.closest(strands.roots).point.astype(np.float64)
    foot = foot @ across[:3, :3].T + across[:3, 3]
    held = search.closest(foot)
    shift = (held.point - foot).astype(np.float32)
    shift[np.linalg.norm(shift, axis=1) <= _NEAR * _size(surface)] = 0.0
    root_uv = None
    if surface.corner_uv is not None:
        root_uv = np.einsum("sk,skj->sj", held.barycentric, surface.corner_uv[held.triangle])
    points = transform_points(strands.points, across) + np.repeat(
        shift, strands.point_counts, axis=0
    )
    found = replace(
        strands,
        points=points,
        root_uv=root_uv,
        root_triangle=held.triangle,
        root_barycentric=held.barycentric,
    )
    return Mirrored(found, shift)


def _size(surface: Surface) -> float:
    low, high = surface.bounds()
    return float(np.linalg.norm(high - low))
