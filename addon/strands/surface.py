"""`Surface`: a triangle mesh that hair grows from, rests on or collides with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Concatenate

import numpy as np

from ..arrays import Floats, Ints, all_equal
from ..errors import HairloomError
from .affine import transform_points
from .triangles import area_vectors
from .vectors import unit
from .weld import unique_position_indices

#: Coincident vertices share a normal if their own is within 41 degrees of it (cosine). Normals of a
#: box that is split at its edges are at least 45 degrees away, so its edges stay hard.
_MIN_SMOOTH_COSINE = 0.75


@dataclass(frozen=True)
class Surface:
    """Triangles in one space (documented by its maker), validated on creation.

    positions: (vertex_count, 3) float32 [m].
    triangles: (triangle_count, 3) int32, counter-clockwise seen from outside.
    corner_uv: (triangle_count, 3, 2) float32, or None for a mesh without UVs.

    Raises:
        HairloomError: shapes that do not fit, an index out of range, values not finite.
    """

    positions: Floats
    triangles: Ints
    corner_uv: Floats | None = None

    def __post_init__(self) -> None:
        for name, dtype in (("positions", np.float32), ("triangles", np.int32)):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype))
        if self.corner_uv is not None:
            object.__setattr__(self, "corner_uv", np.ascontiguousarray(self.corner_uv, np.float32))
        for array in (self.positions, self.triangles):
            if array.ndim != 2 or array.shape[1] != 3:
                raise _broken(f"an array has shape {array.shape} instead of (n, 3)")
        count = len(self.triangles)
        if self.corner_uv is not None and self.corner_uv.shape != (count, 3, 2):
            raise _broken(f"corner_uv has shape {self.corner_uv.shape}, not {(count, 3, 2)}")
        if count and not 0 <= self.triangles.min() <= self.triangles.max() < len(self.positions):
            raise _broken("a triangle refers to a vertex that does not exist")
        if not np.isfinite(self.positions).all():
            raise _broken("a vertex is not finite")

    @property
    def corners(self) -> Floats:
        """The three corners of each triangle, (triangle_count, 3, 3) [m]."""
        return self.positions[self.triangles]

    def triangle_normals(self) -> Floats:
        """Unit normals, (triangle_count, 3); zero for a triangle without area."""
        return unit(area_vectors(self.corners))

    def welded_triangles(self) -> Ints:
        """Triangles with coincident vertices merged, as numbers of places, (triangle_count, 3)."""
        triangles: Ints = self.compute_once(_places)[self.triangles]
        return triangles

    def vertex_normals(self) -> Floats:
        """Unit normals, (vertex_count, 3), weighted by angle (Thuermer and Wuethrich 1998).

        Coincident vertices share theirs, so that UV seams do not show, except where they face
        different ways, as at hard edges and on two-sided sheets.
        """
        return self.compute_once(_vertex_normals)

    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest corner, each (3,) [m]."""
        rows = np.ascontiguousarray(self.positions.T)  # numpy is slow on rows of three
        return rows.min(axis=1), rows.max(axis=1)

    def compute_once[T](self, make: Callable[[Surface], T]) -> T:
        """The result of `make` for this surface, computed once and cached as long as it lives.

        Many callers search the same head.
        """
        cache: dict[Callable[[Surface], Any], Any] = vars(self).setdefault("_made_once", {})
        if make not in cache:
            cache[make] = make(self)
        result: T = cache[make]
        return result

    def compute_if_changed[**Rest, T](
        self,
        make: Callable[Concatenate[Surface, Rest], T],
        *arguments: Rest.args,
        **named: Rest.kwargs,
    ) -> T:
        """The result of `make` for this surface and arguments, cached until these change.

        Arguments are numbers and arrays, compared by value: hair that is combed keeps its roots.
        """
        cache: dict[Any, tuple[tuple[Any, ...], Any]] = vars(self).setdefault("_made_last", {})
        inputs = (*arguments, *named.values())
        last = cache.get(make)
        if last is None or not all_equal(last[0], inputs):
            cache[make] = last = inputs, make(self, *arguments, **named)
        result: T = last[1]
        return result

    def transformed(self, matrix: Floats) -> Surface:
        """Moved by an affine (4, 4) matrix; a mirroring one reverses the triangles' winding."""
        positions = transform_points(self.positions, matrix)
        if np.linalg.det(np.asarray(matrix, np.float64)[:3, :3]) >= 0.0:
            return replace(self, positions=positions)
        uv = None if self.corner_uv is None else self.corner_uv[:, ::-1]
        return replace(self, positions=positions, triangles=self.triangles[:, ::-1], corner_uv=uv)


def _vertex_normals(surface: Surface) -> Floats:
    """See `Surface.vertex_normals`."""
    corners, normals = surface.corners, surface.triangle_normals()
    total = np.zeros_like(surface.positions)
    for corner in range(3):
        one = unit(corners[:, (corner + 1) % 3] - corners[:, corner])
        two = unit(corners[:, (corner + 2) % 3] - corners[:, corner])
        angle = np.arccos(np.clip(np.einsum("ij,ij->i", one, two), -1.0, 1.0))
        np.add.at(total, surface.triangles[:, corner], normals * angle[:, None])
    shared = _shared_normals(surface, total)
    shared.flags.writeable = False
    return shared


def _shared_normals(surface: Surface, total: Floats) -> Floats:
    """Unit normals, (vertex_count, 3), from the sums of normals around each vertex, shared between
    coincident vertices where smooth."""
    own, place = unit(total), surface.compute_once(_places)
    count = int(place.max(initial=-1)) + 1
    if count == len(own):
        return own
    of_place = np.zeros((count, 3), np.float32)
    np.add.at(of_place, place, total)
    shared = unit(of_place)[place]
    is_smooth = np.einsum("ij,ij->i", own, shared) > _MIN_SMOOTH_COSINE
    return np.where(is_smooth[:, None], shared, own)


def _places(surface: Surface) -> Ints:
    """A number for each vertex, the same for coincident ones, (vertex_count,)."""
    return unique_position_indices(surface.positions)


def _broken(problem: str) -> HairloomError:
    return HairloomError(problem, place="mesh data", remedy="Check the mesh (Mesh > Clean Up)")
