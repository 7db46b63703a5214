"""How far points are from posed colliders, and which way leads out: for whoever is not the solver.

The twin on the GPU is gpu_shaders/lib_signed_distance.glsl.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...arrays import Bools, Floats, Ints
from .distance_field import DistanceField
from .posed import (
    Pose,
    PosedCollider,
    poses_through,
    to_world,
    transform_points,
    world_distance,
)

#: How long the gradient of a sampled distance counts at least, see `world_distance`.
FLATTEST = 0.5
#: Points that are looked for at once.
_CHUNK = 16384


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
    distance = np.full(len(points), reach, np.float32)
    outward = np.zeros((len(points), 3), np.float32)
    for index, found, normal in _nearer(points, poses, reach):
        distance[index] = found
        outward[index] = normal.T
    return distance, outward


def nearer_than(points: Floats, poses: Sequence[Pose], reach: Floats) -> tuple[Ints, Floats]:
    """Which points (n, 3) are nearer than their reach, (n,) float32 [m], ascending, and their
    distance [m]."""
    indices: list[Ints] = [np.zeros(0, np.int64)]
    distances: list[Floats] = [np.zeros(0, np.float32)]
    for index, distance, _ in _nearer(points, poses, reach):
        indices.append(index)
        distances.append(distance)
    return np.concatenate(indices), np.concatenate(distances)


def distance_of_few(points: Floats, poses: Sequence[Pose]) -> tuple[Floats, Floats]:
    """`distance_to` at any distance; sooner than that where points are few, or near anyway."""
    rows = np.ascontiguousarray(points.T, np.float32)
    distance = np.full(rows.shape[1], np.inf, np.float32)
    outward = np.zeros_like(rows)
    for pose in poses:
        found, normal = world_distance(pose, transform_points(pose.inverse, rows), FLATTEST)
        if len(poses) == 1:
            return found, normal.T
        is_nearer = found < distance
        np.copyto(distance, found, where=is_nearer)
        np.copyto(outward, normal, where=is_nearer)
    return distance, outward.T


def _nearer(
    points: Floats, poses: Sequence[Pose], reach: Floats | float
) -> Iterator[tuple[Ints, Floats, Floats]]:
    """Which points (n, 3) are nearer than `reach` [m], one or (n,), ascending: their indices,
    distances and normals (3, m). As many at once as stay in the processor's cache."""
    reaches = np.broadcast_to(np.float32(reach), len(points))
    for first in range(0, len(points) if poses else 0, _CHUNK):
        rows = np.ascontiguousarray(points[first : first + _CHUNK].T, np.float32)
        found = [_near(pose, rows, reaches[first : first + _CHUNK]) for pose in poses]
        index, distance, outward = found[0]
        if len(found) > 1:
            index = np.concatenate([each[0] for each in found])
            distance = np.concatenate([each[1] for each in found])
            order = np.lexsort((distance, index))  # of each point the nearest collider first
            index, chosen = np.unique(index.take(order), return_index=True)
            chosen = order.take(chosen)
            distance = distance.take(chosen)
            outward = np.concatenate([each[2] for each in found], axis=1).take(chosen, axis=1)
        yield index + first, distance, outward


def _near(pose: Pose, rows: Floats, reach: Floats) -> tuple[Ints, Floats, Floats]:
    """Points (3, n) world that are nearer to a collider than their reach, (n,) [m], ascending:
    their indices, distances and normals (3, m)."""
    local, collider = transform_points(pose.inverse, rows), pose.collider
    own_reach = reach / np.float32(pose.scale)
    if isinstance(collider, DistanceField):
        index, distance, normal = collider.nearer(local, own_reach)
    else:
        index = collider.near(local, own_reach)
        distance, normal = collider.distance(local.take(index, axis=1))
    distance, normal = to_world(pose, distance, normal, FLATTEST)
    nearer = (distance < reach.take(index)).nonzero()[0]
    return index.take(nearer), distance.take(nearer), normal.take(nearer, axis=1)


def are_outside_meshes(points: Floats, colliders: Sequence[PosedCollider]) -> Bools:
    """Whether points (n, 3) world are outside of all colliders, (n,). Slow.

    Of meshes themselves, where `signed_distance` knows only their grids, whose cells make thicker
    what is thin.
    """
    rows = np.ascontiguousarray(np.asarray(points, np.float32).T)
    result = np.ones(rows.shape[1], bool)
    for pose in poses_now(colliders) if rows.size else ():
        local = transform_points(pose.inverse, rows)
        if isinstance(pose.collider, DistanceField):
            result &= pose.collider.are_outside(local)
        else:
            result &= world_distance(pose, local)[0] > 0.0
    return result
