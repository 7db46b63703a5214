"""Hair that is stored on its undeformed surface, and that surface posed.

Blender keeps curves on the surface as it is before shape keys and modifiers. *Deform Curves on
Surface* and *Hair Dynamics* put them onto the posed one. Hair without these modifiers is put there
here, so that it does not depend on the frame in which it is read.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..strands import StrandSet, Surface
from ..strands.closest_point import ClosestPoints, search_of
from .roots import follow, root_frames, root_motions

#: A surface is deformed where a vertex has moved by more than this part of its diagonal.
DEFORMED = 1.0e-4
#: UVs that differ by less are the same.
_SAME_UV = 1.0e-4
_SAMPLED_ROOTS = 500
#: One surface must fit this many times better than the other.
_CLEARLY = 2.0


@dataclass(frozen=True, eq=False)
class RestHair:
    """Hair as it is combed, and the undeformed surface that it stands on, both in one space."""

    strands: StrandSet
    surface: Surface

    @classmethod
    def found(
        cls, strands: StrandSet, rest: Surface, posed: Surface, least: float = DEFORMED
    ) -> RestHair | None:
        """None where the strands are to stay: they stand on the posed surface, or it is not posed.

        The root UVs say which of the two surfaces roots stand on; where these do not tell, the
        nearer surface is the one.

        Args:
            rest, posed: one mesh, before and after all that deforms it.
            least: by how much it has to be deformed at the roots, as a part of its diagonal.
        """
        if not strands.strand_count or not np.array_equal(rest.triangles, posed.triangles):
            return None
        low, high = rest.bounds()
        far = least * float(np.linalg.norm(high - low))
        if np.abs(posed.positions - rest.positions).max(initial=0.0) <= far:
            return None
        step = -(-strands.strand_count // _SAMPLED_ROOTS)
        roots = strands.roots[::step]
        on_rest, on_posed = (search_of(each).closest(roots) for each in (rest, posed))
        there = np.einsum("nk,nkj->nj", on_rest.barycentric, posed.corners[on_rest.triangle])
        if np.median(np.linalg.norm(there - on_rest.point, axis=1)) <= far:
            return None
        uv = None if strands.root_uv is None else strands.root_uv[::step]
        off_rest = _uv_error(on_rest, rest, uv)
        off_posed = _uv_error(on_posed, posed, uv)
        if max(off_rest, off_posed) <= _SAME_UV:
            off_rest, off_posed = (float(np.median(each.distance)) for each in (on_rest, on_posed))
            if off_posed <= far:
                return None
        return cls(strands, rest) if _CLEARLY * off_rest < off_posed else None

    def on(self, posed: Surface) -> StrandSet:
        """The strands on the posed surface."""
        return carried(self.strands, self.surface, posed)


def carried(strands: StrandSet, start: Surface, end: Surface) -> StrandSet:
    """Strands on a surface, on the same one in another pose: each moves and turns with its root.

    Args:
        strands: where they are bound, by that, else by the closest points of the start.
    """
    triangle, barycentric = strands.root_triangle, strands.root_barycentric
    if triangle is None or barycentric is None:
        held = search_of(start).closest(strands.roots)
        triangle, barycentric = held.triangle, held.barycentric
    was, now = (
        root_frames(each.positions, each.triangles, triangle, barycentric) for each in (start, end)
    )
    return strands.with_points(follow(strands.points, strands.offsets, root_motions(was, now)))


def _uv_error(closest: ClosestPoints, surface: Surface, root_uv: Floats | None) -> float:
    """How far the UVs of these points lie from those of the roots, the median; 0 where either has
    none."""
    if root_uv is None or surface.corner_uv is None:
        return 0.0
    uv = np.einsum("nk,nkj->nj", closest.barycentric, surface.corner_uv[closest.triangle])
    return float(np.median(np.linalg.norm(uv - root_uv, axis=1)))
