"""How far points are from posed colliders, and which way leads out: for whoever is not the solver.

The twin on the GPU is gpu_shaders/lib_signed_distance.glsl.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Floats
from .distance_field import DistanceField
from .posed import (
    Pose,
    PosedCollider,
    near_points,
    poses_through,
    transform_points,
    world_distance,
)

#: How long the gradient of a sampled distance counts at least, see `world_distance`.
FLATTEST = 0.5
#: [m] colliders are asked for points that are at least this near, also inside of another.
_LEAST = np.float32(1.0e-9)


def signed_distance(
    points: Floats, colliders: Sequence[PosedCollider], reach: float = np.inf
) -> tuple[Floats, Floats]:
    """Signed distance to the nearest collider, where all stand at the frame's end.

    Args:
        points: (n, 3) world [m].
        reach: [m] distances beyond it are not looked for; the smaller, the quicker.

    Returns:
        (n,) float32 [m], negative inside, `reach` where nothing is nearer; and the unit direction
        (n, 3) float32 outwards, in which that distance grows; zero where nothing is nearer.
    """
    return distance_to(points, poses_now(colliders), reach)


def poses_now(colliders: Sequence[PosedCollider]) -> list[Pose]:
    """Where all stand at the frame's end, but for those that are flat then."""
    (poses,) = poses_through(tuple(colliders), [(0.0, 1.0)])
    return poses


def distance_to(points: Floats, poses: Sequence[Pose], reach: float) -> tuple[Floats, Floats]:
    """`signed_distance` for whoever asks often."""
    rows = np.ascontiguousarray(np.asarray(points, np.float32).T)
    distance = np.full(rows.shape[1], reach, np.float32)
    outward = np.zeros_like(rows)
    for pose in poses if rows.size else ():
        index, local, _ = near_points(pose, rows, np.maximum(distance, _LEAST))
        found, normal = world_distance(pose, local, FLATTEST)
        nearer = (found < distance.take(index)).nonzero()[0]
        index = index.take(nearer)
        distance[index] = found.take(nearer)
        outward[:, index] = normal.take(nearer, axis=1)
    return distance, np.ascontiguousarray(outward.T)


def outside_by(points: Floats, colliders: Sequence[PosedCollider]) -> Floats:
    """How far points (n, 3) world are outside of all colliders, (n,) [m]; 0 inside of any. Slow.

    Of meshes themselves, where `signed_distance` knows only their grids, whose cells make thicker
    what is thin. Where a collider is scaled unevenly, no more than it is.
    """
    rows = np.ascontiguousarray(np.asarray(points, np.float32).T)
    least = np.full(rows.shape[1], np.inf, np.float32)
    for pose in poses_now(colliders) if rows.size else ():
        local = transform_points(pose.inverse, rows)
        if isinstance(pose.collider, DistanceField):
            found = pose.collider.outside(local) * pose.scale
        else:
            found = world_distance(pose, local)[0]
        np.minimum(least, np.maximum(found, 0.0), out=least)
    return least
