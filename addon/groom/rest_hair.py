"""Hair that is stored on its undeformed surface, moved onto the posed one.

Blender keeps curves on the surface as it is before shape keys and modifiers. *Deform Curves on
Surface* and *Hair Dynamics* move them onto the posed one. This module does so for hair without
these modifiers, so that it does not depend on the frame in which it is read.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from ..arrays import Floats
from ..strands import StrandSet, Surface
from ..strands.closest_point import search_of
from .roots import carry_with_roots, root_frames, root_motions

#: A surface is deformed where a vertex has moved by more than this fraction of its diagonal.
DEFORMED = 1.0e-4
#: UVs that differ by less are the same.
_SAME_UV = 1.0e-4
_SAMPLED_ROOTS = 500
#: One surface must fit this many times better than the other.
_MIN_ADVANTAGE = 2.0


@dataclass(frozen=True, eq=False)
class RestHair:
    """Hair as it is combed, and the undeformed surface that it stands on, both in one space."""

    strands: StrandSet
    surface: Surface

    @classmethod
    def find(
        cls,
        strands: StrandSet,
        rests: Sequence[Surface],
        posed: Surface,
        min_deformation: float = DEFORMED,
    ) -> RestHair | None:
        """The hair on the one of the undeformed surfaces that its strands stand on; None where the
        strands are to stay, since they stand on the posed surface, or it is not deformed.

        Root UVs tell on which surface strands stand; where they fit all surfaces, the nearest one
        counts.

        Args:
            rests: the same mesh without some or all of its deformations, or in any other pose.
            min_deformation: minimum deformation at the roots, as a fraction of the diagonal.
        """
        if not strands.strand_count:
            return None
        low, high = posed.bounds()
        far = min_deformation * float(np.linalg.norm(high - low))
        rests = [
            each
            for each in rests
            if np.array_equal(each.triangles, posed.triangles)
            and np.abs(each.positions - posed.positions).max(initial=0.0) > far
        ]
        if not rests:
            return None
        step = -(-strands.strand_count // _SAMPLED_ROOTS)
        roots = strands.roots[::step]
        uv = None if strands.root_uv is None else strands.root_uv[::step]
        there = _Standing.of(roots, uv, posed, posed)
        before = [_Standing.of(roots, uv, each, posed) for each in rests]
        if max(each.uv_error for each in (*before, there)) > _SAME_UV:
            number = int(np.argmin([each.uv_error for each in before]))
            is_before = _MIN_ADVANTAGE * before[number].uv_error < there.uv_error
        else:
            number = int(np.argmin([each.distance for each in before]))
            is_before = _MIN_ADVANTAGE * before[number].distance < there.distance > far
        is_posed = before[number].moved > far
        return cls(strands, rests[number]) if is_before and is_posed else None

    def on(self, posed: Surface) -> StrandSet:
        """The strands on the posed surface."""
        return carry_with_surface(self.strands, self.surface, posed)


def carry_with_surface(strands: StrandSet, start: Surface, end: Surface) -> StrandSet:
    """Strands moved from one pose of a surface to another: each moves and turns with its root.

    Args:
        strands: held where they are bound, or else at the closest points of `start`.
    """
    triangle, barycentric = strands.root_triangle, strands.root_barycentric
    if triangle is None or barycentric is None:
        held = search_of(start).closest(strands.roots)
        triangle, barycentric = held.triangle, held.barycentric
    was, now = (
        root_frames(each.positions, each.triangles, triangle, barycentric) for each in (start, end)
    )
    return strands.with_points(
        carry_with_roots(strands.points, strands.offsets, root_motions(was, now))
    )


@dataclass(frozen=True)
class _Standing:
    """How well roots stand on a surface, medians.

    distance: [m]. uv_error: between their UVs and those of the nearest points; 0 where either has
        none. moved: how far these points are from where the pose carries them [m].
    """

    distance: float
    uv_error: float
    moved: float

    @classmethod
    def of(cls, roots: Floats, root_uv: Floats | None, surface: Surface, posed: Surface) -> Self:
        held = search_of(surface).closest(roots)

        def at(values: Floats) -> Floats:
            result: Floats = np.einsum("nk,nkj->nj", held.barycentric, values[held.triangle])
            return result

        uv_error, moved = 0.0, at(posed.corners - surface.corners)
        if root_uv is not None and surface.corner_uv is not None:
            uv_error = _median_length(at(surface.corner_uv) - root_uv)
        return cls(float(np.median(held.distance)), uv_error, _median_length(moved))


def _median_length(vectors: Floats) -> float:
    return float(np.median(np.linalg.norm(vectors, axis=1)))
