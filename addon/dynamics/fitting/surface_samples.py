"""Points spread evenly over a mesh, and the faces that form its outside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Bools, Floats
from ...errors import HairloomError
from ...strands import Surface
from ...strands.triangles import area_vectors, uniform_barycentrics
from ..colliders.winding import winding_number
from .holes import close_holes

#: Distance from a face at which inside and outside are tested, in the mesh's longest sides.
_BESIDE = 1.0e-4
#: Steps of the R2 sequence (Roberts 2018), which fills a square evenly: 1 / g and 1 / g^2, where
#: g^3 = g + 1.
_R2 = (0.7548776662466927, 0.5698402909980532)


@dataclass(frozen=True)
class SurfaceSamples:
    """point: (n, 3) float64 [m]. normal: (n, 3) float64, unit, outwards."""

    point: Floats
    normal: Floats


@dataclass(frozen=True)
class Boundary:
    """The outside of a mesh.

    surface: closed, with all triangles facing outwards.
    is_mesh: (triangle_count,) False for triangles that only close a hole.
    """

    surface: Surface
    is_mesh: Bools

    @property
    def mesh(self) -> Surface:
        """The surface without the triangles that close holes."""
        return Surface(self.surface.positions, self.surface.triangles[self.is_mesh])


def boundary_of(surface: Surface, place: str) -> Boundary:
    """The faces between inside and outside, without parts that lie inside others; holes are closed.

    Args:
        place: names the mesh in messages.

    Raises:
        HairloomError: no faces, no size, or no face with an inside.
    """
    closed, fans = close_holes(surface)
    corners = closed.corners.astype(np.float64)
    cross = 2.0 * area_vectors(corners)
    area = np.linalg.norm(cross, axis=1)
    if not area.sum() > 0.0:
        raise _broken(place, "it has no faces, or they have no area")
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    solid = np.flatnonzero(area > 1.0e-12 * size * size)
    beside = cross[solid] / area[solid, None] * (_BESIDE * size)
    middle = corners[solid].mean(axis=1)
    ahead = np.abs(winding_number(middle + beside, closed)) > 0.5
    behind = np.abs(winding_number(middle - beside, closed)) > 0.5
    outward, inward = solid[behind & ~ahead], solid[ahead & ~behind]
    is_mesh = ~np.isin(np.concatenate([outward, inward]), fans)
    if not is_mesh.any():
        raise _broken(place, "it encloses no volume")
    triangles = np.concatenate([closed.triangles[outward], closed.triangles[inward][:, ::-1]])
    return Boundary(Surface(closed.positions, triangles), is_mesh)


def samples_of(surface: Surface, count: int) -> SurfaceSamples:
    """`count` points spread evenly by area, deterministic."""
    corners = surface.corners.astype(np.float64)
    cross = 2.0 * area_vectors(corners)
    area = np.linalg.norm(cross, axis=1)
    along = np.cumsum(area)
    place = (np.arange(count) + 0.5) / count * along[-1]
    triangle = np.minimum(np.searchsorted(along, place, side="right"), len(area) - 1)
    one, other = (np.mod(0.5 + step * np.arange(1, count + 1), 1.0) for step in _R2)
    point = np.einsum("nk,nkj->nj", uniform_barycentrics(one, other), corners[triangle])
    normal = cross[triangle] / np.maximum(area[triangle, None], 1.0e-300)
    return SurfaceSamples(point, normal)


def _broken(place: str, problem: str) -> HairloomError:
    return HairloomError(problem, place=place, remedy="Choose a closed mesh, or close its holes")
