"""Roots on the surface: where each strand is held, and how it is carried when the surface moves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..errors import HairloomError
from ..strands import StrandSet, Surface
from ..strands.blocks import blocks_of
from ..strands.closest_point import ClosestPointSearch, search_of
from ..strands.root_motions import RootMotions
from ..strands.vectors import cross_rows, dot_rows
from .root_fit import IMPLAUSIBLE_DISTANCE, LOOSE_DISTANCE, better_fit, fitting_factor

#: Sine of a triangle's first angle below which rounding in float64 decides about its normal.
_FLAT = 1.0e-9
#: Fewer roots than this, or roots that span less than this fraction of the surface, reveal no wrong
#: scale where they are near to it.
_FEW, _PATCH = 16, 0.01


@dataclass(frozen=True)
class BoundRoots:
    """strands: bound to the surface, root UVs filled from it where they were unknown.
    distance: (strand_count,) float32 [m], from each root to its point of the surface.
    """

    strands: StrandSet
    distance: Floats

    def looseness(self, surface: Surface) -> float:
        """How far the roots lie from the surface, the median [m]; 0 where that is near enough for
        hair that grows on it."""
        distance = float(np.median(self.distance)) if len(self.distance) else 0.0
        low, high = surface.bounds()
        return distance if distance > LOOSE_DISTANCE * float(np.linalg.norm(high - low)) else 0.0


@dataclass(frozen=True)
class RootFrames:
    """A right-handed orthonormal frame where each strand is held, in the space of the surface.

    origin: (strand_count, 3) float64 [m], on the surface.
    rotation: (strand_count, 3, 3) float64, columns: along the triangle's first edge, bitangent,
        normal.
    """

    origin: Floats
    rotation: Floats


@dataclass(frozen=True, eq=False)
class RootHolds:
    """Which vertices of a surface hold roots, and how.

    vertices: (n,) ascending. corners: (strand_count, 3), of each root's triangle, as indices into
        `vertices`. barycentric: (strand_count, 3).
    fraction: (n,), the fraction of all roots that each vertex holds. lift: (3,) [m], from the
        middle of the points that hold roots to that of the roots.
    rest_positions: (vertex_count, 3) [m], of the whole surface.
    """

    vertices: Ints
    corners: Ints
    barycentric: Floats
    fraction: Floats
    lift: Floats
    rest_positions: Floats

    @classmethod
    def of(cls, strands: StrandSet, head: Surface) -> RootHolds:
        """Args:
        strands: bound to the head.
        """
        assert strands.root_triangle is not None and strands.root_barycentric is not None
        triangles = head.triangles[strands.root_triangle]
        holds_any = np.zeros(len(head.positions), bool)
        holds_any[triangles] = True
        vertices = np.flatnonzero(holds_any)
        place = np.cumsum(holds_any) - 1
        weight = strands.root_barycentric[:, 1:].astype(np.float64)
        weights = np.column_stack([1.0 - weight.sum(axis=1), weight])
        held = np.bincount(triangles.ravel(), weights.ravel(), len(holds_any))[vertices]
        fraction = held / max(len(triangles), 1)
        middle = fraction @ head.positions[vertices]
        lift = strands.roots.mean(axis=0, dtype=np.float64) - middle
        corners = place[triangles].astype(np.int32)
        return cls(vertices, corners, strands.root_barycentric, fraction, lift, head.positions)

    def center(self, positions: Floats) -> Floats:
        """The middle of all roots (3,) [m] on vertices (vertex_count, 3).

        `lift` does not turn with the surface.
        """
        return np.asarray(self.fraction @ positions[self.vertices] + self.lift, np.float32)


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
    corners = triangles[root_triangle]
    a, b, c = (_rows(positions[corners[:, k]]) for k in range(3))
    weight = _rows(root_barycentric)
    along, across = b - a, c - a
    # offsets from a: barycentric coordinates in float32 need not sum to 1 exactly
    origin = a + weight[1] * along + weight[2] * across
    tangent, _ = _unit(along, 0.0, fallback=(1.0, 0.0, 0.0))
    flat = _FLAT * np.sqrt(dot_rows(across, across))
    normal, is_flat = _unit(cross_rows(tangent, across), flat, fallback=(0.0, 0.0, 1.0))
    if is_flat.any():
        normal[:, is_flat] = _across(tangent[:, is_flat])
    axes = np.stack([tangent, cross_rows(normal, tangent), normal])
    return RootFrames(origin.T, axes.transpose(2, 1, 0))


def root_motions(rest: RootFrames, now: RootFrames) -> RootMotions:
    """How the same roots have moved; exactly 0 where they have not."""
    was = rest.rotation.transpose(1, 2, 0)
    change, origin = now.rotation.transpose(1, 2, 0) - was, rest.origin.T
    turn = np.empty_like(change)
    for row in range(3):
        for column in range(3):
            turn[row, column] = dot_rows(change[row], was[column])
    # the origin is rounded to float32 below; the shift compensates for that
    rounding = origin - origin.astype(np.float32)
    shift = now.origin.T - origin
    for column in range(3):
        shift -= turn[:, column] * rounding[column]
    return RootMotions(*(np.ascontiguousarray(rows, np.float32) for rows in (turn, shift, origin)))


def carry_with_roots(points: Floats, offsets: Ints, motions: RootMotions) -> Floats:
    """Each strand carried with its root, (point_count, 3) [m], as precise as `points`.

    Adds only the change, so that a root that did not move returns its strand bit for bit.

    Args:
        points: (point_count, 3) [m], the strands at rest, one after the other.
        offsets: (strand_count + 1,), strand s is points[offsets[s]:offsets[s + 1]].
        motions: of their roots.
    """
    moved = np.array(points)
    for block in blocks_of(offsets):
        rest = block.planes(moved)
        block.write(moved, rest + motions.displacement(rest, block.strands))
    return moved


def _check_scale(
    roots: Floats, distance: Floats, surface: Surface, search: ClosestPointSearch, place: str
) -> None:
    """Raise when the roots lie too far from the surface to have grown on it."""
    if not len(roots):
        return
    low, high = surface.bounds()
    surface_size = float(np.linalg.norm(high - low))
    roots_size = float(np.linalg.norm(np.ptp(roots, axis=0)))
    away = float(np.median(distance))
    is_far = away > IMPLAUSIBLE_DISTANCE * surface_size
    # hair of a head in metres may lie near a body in decimetres all the same: between its legs
    is_apart = away > IMPLAUSIBLE_DISTANCE * roots_size and len(roots) >= _FEW
    is_apart &= roots_size > _PATCH * surface_size
    if is_far:
        factor = fitting_factor(roots, search)
    elif is_apart and (clear := better_fit({"": roots}, search)) is not None:
        factor = clear.factor
    else:
        return
    if factor is None:
        raise HairloomError(
            f"its roots lie {away:.3g} m from the head (median); they span {roots_size:.3g} m, "
            f"the head spans {surface_size:.3g} m, and no common unit makes them meet",
            place=place,
            remedy="Move the groom onto the head, choose its up axis, or choose another head",
        )
    raise HairloomError(
        f"this groom has a different scale from the head: its roots span {roots_size:.3g} m, the "
        f"head spans {surface_size:.3g} m",
        place=place,
        remedy=f"Scale the groom by {factor:.4g} (pass --groom-scale {factor:.4g}), or the head by "
        f"{1.0 / factor:.4g} (pass --head-scale {1.0 / factor:.4g})",
    )


def _rows(values: Floats) -> Floats:
    """Values (n, 3) as rows (3, n) float64."""
    return np.ascontiguousarray(values.T, np.float64)


def _unit(
    rows: Floats, shortest: Floats | float, fallback: tuple[float, float, float]
) -> tuple[Floats, Bools]:
    """Unit vectors (3, n), and which are the fallback because they were no longer than the
    shortest."""
    length = np.sqrt(dot_rows(rows, rows))
    is_short = length <= shortest
    unit = rows / np.where(is_short, 1.0, length)
    if is_short.any():
        unit[:, is_short] = np.array(fallback)[:, None]
    return unit, is_short


def _across(tangent: Floats) -> Floats:
    """Unit vectors across these unit tangents (3, n), as near to the world's axes as can be."""
    axis = np.zeros_like(tangent)
    axis[np.abs(tangent).argmin(axis=0), np.arange(tangent.shape[1])] = 1.0
    across = axis - tangent * dot_rows(axis, tangent)
    return across / np.sqrt(dot_rows(across, across))
