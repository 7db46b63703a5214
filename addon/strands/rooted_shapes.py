"""Strands stored as roots on a UV map, each with its shape in the frame of its root.

So they can grow on any mesh with the same UV map, in any place, orientation and pose.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..errors import HairloomError
from .closest_point import ClosestPointSearch
from .strand_set import DEFAULT_RADIUS, StrandSet
from .surface import Surface
from .vectors import unit, unit_or

#: A root farther than this from every triangle of the UV map, in UV, lies on none of them.
_MAX_UV_DISTANCE = 0.01


@dataclass(frozen=True, eq=False)
class RootedShapes:
    """Strands that are independent of the mesh they grow on.

    root_uv: (strand_count, 2) float32.
    offsets: (strand_count + 1,) int32, as in `StrandSet`.
    shape: (point_count, 3) float32 [m], positions relative to the root, in its frame: x in the
        direction in which U grows on the surface, y across it on the surface, z along the normal.
    group: (strand_count,) int32.
    """

    root_uv: Floats
    offsets: Ints
    shape: Floats
    group: Ints

    @classmethod
    def of(cls, strands: StrandSet, surface: Surface) -> RootedShapes:
        """The shapes of strands that are bound to this surface, in its space."""
        triangle, barycentric = strands.root_triangle, strands.root_barycentric
        assert triangle is not None and barycentric is not None and surface.corner_uv is not None
        origin, frame = _frames(surface, triangle, barycentric.astype(np.float64))
        counts = strands.point_counts
        local = strands.points - np.repeat(origin, counts, axis=0)
        shape = np.einsum("pi,pij->pj", local, np.repeat(frame, counts, axis=0))
        shape[strands.offsets[:-1]] = 0.0
        uv = np.einsum("sk,skj->sj", barycentric, surface.corner_uv[triangle])
        return cls(uv.astype(np.float32), strands.offsets, shape.astype(np.float32), strands.group)

    def on(self, surface: Surface, scale: float = 1.0) -> StrandSet:
        """Strands on this surface, bound to it and in its space, without widths of their own.

        Args:
            scale: factor of their size.

        Raises:
            HairloomError: the surface has no UVs, or its UV map has no face at a root.
        """
        triangle, barycentric = _find_uv(self.root_uv, surface)
        origin, frame = _frames(surface, triangle, barycentric)
        counts = np.diff(self.offsets)
        turned = np.einsum("pj,pij->pi", scale * self.shape, np.repeat(frame, counts, axis=0))
        return StrandSet(
            points=np.repeat(origin, counts, axis=0) + turned,
            offsets=self.offsets,
            radius=np.full(len(self.shape), DEFAULT_RADIUS),
            group=self.group,
            root_uv=self.root_uv,
            root_triangle=triangle,
            root_barycentric=barycentric,
            has_widths=False,
        )


def _find_uv(uv: Floats, surface: Surface) -> tuple[Ints, Floats]:
    """The triangle (n,) and barycentric coordinates (n, 3) at each UV coordinate (n, 2)."""
    if surface.corner_uv is None:
        raise HairloomError(
            "this mesh has no UVs", place="head", remedy="Use the built-in head with its UV map"
        )
    places = np.zeros((len(uv), 3), np.float32)
    places[:, :2] = uv
    found = surface.compute_once(_uv_search).closest(places)
    if len(uv) and found.distance.max() > _MAX_UV_DISTANCE:
        raise HairloomError(
            "its UV map has no face where hair is to grow",
            place="head",
            remedy="Use the built-in head with its own UV map",
        )
    return found.triangle, found.barycentric


def _uv_search(surface: Surface) -> ClosestPointSearch:
    """A search through the surface's UV map, as a mesh in the plane z = 0."""
    assert surface.corner_uv is not None
    flat = np.zeros((3 * len(surface.triangles), 3), np.float32)
    flat[:, :2] = surface.corner_uv.reshape(-1, 2)
    return ClosestPointSearch(Surface(flat, np.arange(len(flat)).reshape(-1, 3)))


def _frames(surface: Surface, triangle: Ints, barycentric: Floats) -> tuple[Floats, Floats]:
    """The positions of roots (n, 3), and their frames (n, 3, 3): along U, across and normal as
    columns."""
    assert surface.corner_uv is not None
    corners = surface.corners[triangle].astype(np.float64)
    origin = np.einsum("nk,nkj->nj", barycentric, corners)
    normals = surface.vertex_normals()[surface.triangles[triangle]].astype(np.float64)
    edges = corners[:, 1:] - corners[:, :1]
    flat_normal = np.cross(edges[:, 0], edges[:, 1])
    normal = unit_or(np.einsum("nk,nkj->nj", barycentric, normals), unit(flat_normal))
    uv = surface.corner_uv[triangle].astype(np.float64)
    span = uv[:, 1:] - uv[:, :1]
    # dP/du up to its length: the mix of edges that leaves V constant, towards growing U even where
    # the map is mirrored
    area = span[:, 0, 0] * span[:, 1, 1] - span[:, 1, 0] * span[:, 0, 1]
    along_u = edges[:, 0] * span[:, 1, 1:] - edges[:, 1] * span[:, 0, 1:]
    along_u *= np.where(area < 0.0, -1.0, 1.0)[:, None]
    along_u -= normal * np.einsum("nj,nj->n", along_u, normal)[:, None]
    along = unit_or(unit(along_u), unit(np.cross(normal, (0.3, 0.5, 0.8))))
    return origin, np.stack([along, np.cross(normal, along), normal], axis=2)
