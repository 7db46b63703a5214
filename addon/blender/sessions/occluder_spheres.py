"""Balls inside a head that go with it: what lies wholly behind one of them is not drawn.

In a head that bends a ball goes as its surroundings go, by the similarity that fits the mesh around
it best, and it shrinks by as much as that mesh has come nearer than the similarity says. So it
stays inside of a head whose jaw opens, and vanishes where the mesh around it folds up.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Floats, Ints
from ...dynamics.fitting.similarity import fit_similarity
from ...refine.culling import moved_spheres, occluder_spheres_of
from ...rig_flow import Pose
from ...strands import Surface
from ...strands.affine import moved

#: The mesh around a ball: triangles within this many radii of its middle.
_AROUND = 2.0
#: A head bends if a vertex is elsewhere by more than this part of a ball's radius.
_RIGID = 1.0e-3
#: Vertices that tell where a ball has gone: more would say the same.
_ENOUGH = 300


class OccluderSpheres:
    """The balls of one head.

    Args:
        head: world space at rest.
        roots: (n, 3) [m], of the hair, or the corners of their box; other parts of a body hide none
            of it.
    """

    def __init__(self, head: Surface, roots: Floats) -> None:
        self._rest = head.positions
        self._balls = occluder_spheres_of(head, roots=roots)
        self._around = [_vertices_around(head, ball) for ball in self._balls]

    def at(self, pose: Pose) -> Floats | None:
        """(k, 4) center and radius [m], world space, in this pose; None where there are none."""
        if pose.head_positions is None or not len(self._balls):
            return None
        bent = np.abs(moved(self._rest, pose.matrix) - pose.head_positions).max()
        if bent <= _RIGID * self._balls[:, 3].min():
            return moved_spheres(self._balls, pose.matrix)
        now = [
            _carried(ball, self._rest[around], pose.head_positions[around])
            for ball, around in zip(self._balls, self._around, strict=True)
        ]
        balls = [ball for ball in now if ball is not None and ball[3] > 0.0]
        return np.array(balls, np.float32) if balls else None


def _vertices_around(head: Surface, ball: Floats) -> Ints:
    """Of all triangles whose box comes near the ball; of all there are, if none does."""
    corners = head.positions[head.triangles] - ball[:3]
    outside = np.maximum(corners.min(axis=1), -corners.max(axis=1)).clip(min=0.0)
    near = (outside**2).sum(axis=1) <= (_AROUND * ball[3]) ** 2
    return np.unique(head.triangles[near] if near.any() else head.triangles)


def _carried(ball: Floats, rest: Floats, now: Floats) -> Floats | None:
    """The sphere (4,) where its surroundings have gone; None where that is unknown."""
    some = slice(None, None, max(len(rest) // _ENOUGH, 1))
    fit = fit_similarity(rest[some], now[some])
    if fit is None:
        return None
    (gone,) = moved_spheres(ball[None], fit.matrix)
    gone[3] -= np.linalg.norm(now - moved(rest, fit.matrix), axis=1).max()
    return gone
