"""Spheres inside a head that move with it: strands wholly behind one of them are not drawn.

In a head that deforms, a sphere follows the similarity transform that best fits the mesh around it,
and its radius shrinks by the largest residual of that fit. So it stays inside a head whose jaw
opens, and vanishes where the mesh around it folds up.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Floats, Ints
from ...dynamics.fitting.similarity import fit_similarity
from ...refine.culling import occluder_spheres_of, transform_spheres
from ...rig_flow import Pose
from ...strands import Surface
from ...strands.affine import transform_points

#: The mesh around a sphere: triangles within this many radii of its middle.
_SEARCH_RADII = 2.0
#: A head deforms if a vertex is off by more than this fraction of the smallest sphere's radius.
_RIGID_TOLERANCE = 1.0e-3
#: Vertices that a sphere's transform is fitted to; more would not change it.
_MAX_FITTED_VERTICES = 300


class OccluderSpheres:
    """The occluder spheres of one head.

    Args:
        head: world space at rest.
        roots: (n, 3) [m], of the hair, or the corners of their box; parts of a body away from them
            get no spheres.
    """

    def __init__(self, head: Surface, roots: Floats) -> None:
        self._rest = head.positions
        self._balls = occluder_spheres_of(head, roots=roots)
        self._around = [_vertices_around(head, ball) for ball in self._balls]

    def at(self, pose: Pose) -> Floats | None:
        """Centers and radii in this pose, (k, 4) [m] world space; None: there are none."""
        if pose.head_positions is None or not len(self._balls):
            return None
        bent = np.abs(transform_points(self._rest, pose.matrix) - pose.head_positions).max()
        if bent <= _RIGID_TOLERANCE * self._balls[:, 3].min():
            return transform_spheres(self._balls, pose.matrix)
        now = [
            _moved_sphere(ball, self._rest[around], pose.head_positions[around])
            for ball, around in zip(self._balls, self._around, strict=True)
        ]
        balls = [ball for ball in now if ball is not None and ball[3] > 0.0]
        return np.array(balls, np.float32) if balls else None


def _vertices_around(head: Surface, ball: Floats) -> Ints:
    """The vertices of triangles whose box is near the ball; of all triangles, if none is."""
    corners = head.positions[head.triangles] - ball[:3]
    outside = np.maximum(corners.min(axis=1), -corners.max(axis=1)).clip(min=0.0)
    near = (outside**2).sum(axis=1) <= (_SEARCH_RADII * ball[3]) ** 2
    return np.unique(head.triangles[near] if near.any() else head.triangles)


def _moved_sphere(ball: Floats, rest: Floats, now: Floats) -> Floats | None:
    """The sphere (4,), moved with the vertices around it; None if no similarity fits them."""
    some = slice(None, None, max(len(rest) // _MAX_FITTED_VERTICES, 1))
    fit = fit_similarity(rest[some], now[some])
    if fit is None:
        return None
    (gone,) = transform_spheres(ball[None], fit.matrix)
    gone[3] -= np.linalg.norm(now - transform_points(rest, fit.matrix), axis=1).max()
    return gone
