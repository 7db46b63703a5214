"""Roots on the surface: where each strand is held, and how it is carried when the surface moves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..errors import HairloomError
from ..strands import StrandSet, Surface
from ..strands.closest_point import ClosestPointSearch, search_of
from .root_fit import IMPLAUSIBLE_DISTANCE, fitting_factor

#: Sine of a triangle's first angle below which rounding in float64 decides about its normal.
_FLAT = 1.0e-9
#: Strands carried at once, so that they stay in the processor's cache.
_CHUNK = 512


@dataclass(frozen=True)
class BoundRoots:
    """strands: bound to the surface, root UVs filled from it where they were unknown.
    distance: (strand_count,) float32 [m], from each root to its point of the surface.
    """

    strands: StrandSet
    distance: Floats


@dataclass(frozen=True)
class RootFrames:
    """A right-handed orthonormal frame where each strand is held, in the space of the surface.

    origin: (strand_count, 3) float64 [m], on the surface.
    rotation: (strand_count, 3, 3) float64, columns: along the triangle's first edge, bitangent,
        normal.
    """

    origin: Floats
    rotation: Floats


def bind_roots(strands: StrandSet, surface: Surface, *, place: str) -> BoundRoots:
    """Hold each root at the closest point of the surface; the points stay where they are.

    Args:
        strands: in the space of the surface.
        place: names the groom in error messages.

    Raises:
        HairloomError: the surface has no triangles, or the groom is of another scale than it.
    """
    search = search_of(surface)
    roots = strands.roots
    closest = search.closest(roots)
    _check_scale(roots, closest.distance, surface, search, place)
    root_uv = strands.root_uv
    if root_uv is None and surface.corner_uv is not None:
        corner_uv = surface.corner_uv[closest.triangle]
        root_uv = np.einsum("sk,skj->sj", closest.barycentric, corner_uv)
    bound = replace(
        strands,
        root_uv=root_uv,
        root_triangle=closest.triangle,
        root_barycentric=closest.barycentric,
    )
    return BoundRoots(bound, closest.distance.astype(np.float32))


def root_frames(
    positions: Floats, triangles: Ints, root_triangle: Ints, root_barycentric: Floats
) -> RootFrames:
    """The frames of roots on a surface as it is deformed now.

    A triangle without area or first edge gets axes of the world in their place, so that every
    frame is a finite rotation.

    Args:
        positions: (vertex_count, 3) [m].
        triangles: (triangle_count, 3).
        root_triangle: (strand_count,).
        root_barycentric: (strand_count, 3).
    """
    a, b, c = (positions[triangles[root_triangle, k]].astype(np.float64) for k in range(3))
    weight = np.asarray(root_barycentric, np.float64)
    # offsets from a: barycentric coordinates in float32 need not sum to 1 exactly
    origin = a + weight[:, 1:2] * (b - a) + weight[:, 2:3] * (c - a)
    tangent, _ = _unit(b - a, 0.0, fallback=(1.0, 0.0, 0.0))
    flat = _FLAT * np.linalg.norm(c - a, axis=1)
    normal, is_flat = _unit(np.cross(tangent, c - a), flat, fallback=(0.0, 0.0, 1.0))
    normal[is_flat] = _across(tangent[is_flat])
    rotation = np.stack([tangent, np.cross(normal, tangent), normal], axis=2)
    return RootFrames(origin, rotation)


def follow(points: Floats, counts: Ints, rest: RootFrames, now: RootFrames) -> Floats:
    """Each strand carried rigidly with its root, (point_count, 3) float32 [m].

    Adds only the change, so that a root that did not move returns its strand bit for bit.

    Args:
        points: (point_count, 3) [m], the strands at rest, one after the other.
        counts: (strand_count,) how many points each has.
        rest, now: frames of the same roots at rest and now.
    """
    turn = (now.rotation - rest.rotation) @ rest.rotation.transpose(0, 2, 1)
    # the rounding of the origin to float32 must not show: it is turned here instead
    rounding = rest.origin - rest.origin.astype(np.float32)
    shift = now.origin - rest.origin - np.einsum("sij,sj->si", turn, rounding)
    # of a strand the turn, in three columns of three, the shift, and the origin
    motions = np.column_stack([turn.transpose(0, 2, 1).reshape(-1, 9), shift, rest.origin]).astype(
        np.float32
    )
    moved = np.array(points, np.float32)
    ends = np.cumsum(counts)
    for first in range(0, len(counts), _CHUNK):
        last = min(first + _CHUNK, len(counts))
        part = moved[ends[first] - counts[first] : ends[last - 1]]
        motion = np.ascontiguousarray(np.repeat(motions[first:last], counts[first:last], axis=0).T)
        local = part.T - motion[12:]
        change = motion[9:12]
        for column in range(3):
            change += motion[3 * column : 3 * column + 3] * local[column]
        part += change.T
    return moved


def _check_scale(
    roots: Floats, distance: Floats, surface: Surface, search: ClosestPointSearch, place: str
) -> None:
    """Raise when the roots lie too far from the surface to have grown on it."""
    if not len(roots):
        return
    low, high = surface.bounds()
    surface_size = float(np.linalg.norm(high - low))
    if np.median(distance) <= IMPLAUSIBLE_DISTANCE * surface_size:
        return
    roots_size = float(np.linalg.norm(np.ptp(roots, axis=0)))
    factor = fitting_factor(roots, search)
    if factor is None:
        raise HairloomError(
            f"its roots lie {np.median(distance):.3g} m from the head (median); they span"
            f" {roots_size:.3g} m, the head spans {surface_size:.3g} m, and no usual unit makes"
            " them meet",
            place=place,
            remedy="Move the groom onto the head, choose its up axis, or choose another head",
        )
    raise HairloomError(
        f"this groom is of another scale than the head: its roots span {roots_size:.3g} m,"
        f" the head spans {surface_size:.3g} m",
        place=place,
        remedy=f"Scale the groom by {factor:.4g} (pass --groom-scale {factor:.4g})",
    )


def _unit(
    vectors: Floats, shortest: Floats | float, fallback: tuple[float, float, float]
) -> tuple[Floats, Bools]:
    """Unit vectors, and which are the fallback because they were no longer than the shortest."""
    length = np.linalg.norm(vectors, axis=1)
    is_short = length <= shortest
    unit = vectors / np.where(is_short, 1.0, length)[:, None]
    unit[is_short] = fallback
    return unit, is_short


def _across(tangent: Floats) -> Floats:
    """Unit vectors across these unit tangents, as near to the world's axes as can be."""
    axis = np.zeros_like(tangent)
    axis[np.arange(len(tangent)), np.abs(tangent).argmin(axis=1)] = 1.0
    across = axis - tangent * np.einsum("ij,ij->i", axis, tangent)[:, None]
    return across / np.linalg.norm(across, axis=1, keepdims=True)
