"""The distance between points and triangles, pair by pair.

The squared distance to a triangle is a quadratic form in its barycentric coordinates; its minimum
lies inside or on one of the three edges (Ericson, Real-Time Collision Detection 2005, section
5.1.5). Taking the minimum of these four candidates, instead of Ericson's region tests, needs no
division by the area, so that slivers, duplicate corners and single points need no special case.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints

#: Pairs measured at once, so that they stay in the processor's cache.
_CHUNK = 1 << 14
#: A triangle whose 4 area^2 is below this fraction of |ab|^2 |ac|^2 is treated as its edges alone.
_DEGENERATE_RATIO = 1.0e-12


class TriangleForms:
    """Triangles as their quadratic forms.

    Args:
        corners: (triangle_count, 3, 3) float64.
    """

    def __init__(self, corners: Floats) -> None:
        a = corners[:, 0]
        ab, ac = corners[:, 1] - a, corners[:, 2] - a
        bb, bc, cc = ((one * two).sum(axis=1) for one, two in ((ab, ab), (ab, ac), (ac, ac)))
        determinant = bb * cc - bc * bc
        determinant[determinant <= _DEGENERATE_RATIO * bb * cc] = 0.0
        #: as rows, read in one pass: a, ab, ac, ab.ab, ab.ac, ac.ac, determinant (0 where flat)
        self._rows = np.concatenate([a.T, ab.T, ac.T, [bb, bc, cc, determinant]])

    def squared_distance(self, points: Floats, triangle: Ints) -> Floats:
        """Squared distance from each of the points (n, 3) to its triangle (n,), (n,)."""
        return self._distance_and_barycentric(points, triangle)[0]

    def closest(self, points: Floats, triangle: Ints) -> Floats:
        """Barycentric coordinates of each point's closest point on its triangle (n,), (n, 3)."""
        _, v, w = self._distance_and_barycentric(points, triangle)
        return np.stack([1.0 - v - w, v, w], axis=1)

    def _distance_and_barycentric(self, points: Floats, triangle: Ints) -> Floats:
        """Squared distance, and barycentric coordinates v and w of the closest point, (3, n)."""
        found = np.empty((3, len(triangle)))
        for start in range(0, len(triangle), _CHUNK):
            part = slice(start, start + _CHUNK)
            ax, ay, az, bx, by, bz, cx, cy, cz, *form = self._rows.take(triangle[part], axis=1)
            x, y, z = points[part].T
            x, y, z = x - ax, y - ay, z - az
            along_ab, along_ac = bx * x + by * y + bz * z, cx * x + cy * y + cz * z
            v, w = _minimum(along_ab, along_ac, *form)
            x, y, z = x - v * bx - w * cx, y - v * by - w * cy, z - v * bz - w * cz
            found[:, part] = x * x + y * y + z * z, v, w
        return found


def _minimum(
    d1: Floats, d2: Floats, bb: Floats, bc: Floats, cc: Floats, determinant: Floats
) -> tuple[Floats, Floats]:
    """The v and w that minimize v^2 bb + 2 v w bc + w^2 cc - 2 v d1 - 2 w d2 over the triangle."""
    v = _divided(cc * d1 - bc * d2, determinant)
    w = _divided(bb * d2 - bc * d1, determinant)
    outside = np.flatnonzero(~((determinant > 0.0) & (v >= 0.0) & (w >= 0.0) & (v + w <= 1.0)))
    v[outside], w[outside] = _on_edges(*(part[outside] for part in (d1, d2, bb, bc, cc)))
    return v, w


def _on_edges(d1: Floats, d2: Floats, bb: Floats, bc: Floats, cc: Floats) -> tuple[Floats, Floats]:
    """The same, over the edges only."""
    on_ab = np.clip(_divided(d1, bb), 0.0, 1.0)
    on_ac = np.clip(_divided(d2, cc), 0.0, 1.0)
    on_bc = np.clip(_divided(d2 - d1 + bb - bc, bb - 2.0 * bc + cc), 0.0, 1.0)
    best = on_ab * (on_ab * bb - 2.0 * d1)
    v, w = on_ab, np.zeros_like(on_ab)
    for other_v, other_w in ((np.zeros_like(on_ac), on_ac), (1.0 - on_bc, on_bc)):
        value = other_v * (other_v * bb + 2.0 * (other_w * bc - d1))
        value += other_w * (other_w * cc - 2.0 * d2)
        is_less = value < best
        best = np.where(is_less, value, best)
        v, w = np.where(is_less, other_v, v), np.where(is_less, other_w, w)
    return v, w


def _divided(value: Floats, by: Floats) -> Floats:
    return np.divide(value, by, out=np.zeros_like(value), where=by > 0.0)
