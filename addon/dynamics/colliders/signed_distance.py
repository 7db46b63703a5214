"""Distances of points from posed colliders, and the direction out, for users other than the solver.

Twin of gpu_shaders/lib_signed_distance.glsl.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Bools, Floats, Ints
from ...strands.closest_point import search_of
from .distance_field import DistanceField
from .posed import (
    Pose,
    PosedCollider,
    poses_through,
    transform_points,
    world_distance,
)

#: Minimum length of the gradient of a sampled distance, see `world_distance`.
MIN_GRADIENT = 0.5
#: Points tested at once, so that they stay in the processor's cache.
_CHUNK = 32768


def signed_distance(
    points: Floats, colliders: Sequence[PosedCollider], reach: float = np.inf
) -> tuple[Floats, Floats]:
    """Signed distance from the nearest collider at the frame's end.

    Args:
        points: (n, 3) world [m].
        reach: [m], distances beyond it are not computed; the smaller, the faster.

    Returns:
        The distance (n,) float32 [m], negative inside, `reach` where nothing is nearer; and the
        unit direction outwards (n, 3) float32, in which it grows, zero where nothing is nearer.
    """
    return distance_to(points, poses_at_end(colliders), reach)


def poses_at_end(colliders: Sequence[PosedCollider]) -> list[Pose]:
    """The poses of all colliders at the frame's end, without those that are flat then."""
    (poses,) = poses_through(tuple(colliders), [(0.0, 1.0)])
    return poses


def distance_to(points: Floats, poses: Sequence[Pose], reach: float) -> tuple[Floats, Floats]:
    """`signed_distance` of points (n, 3) world [m], with `poses_at_end` computed once for several
    queries."""
    distance = np.full(len(points), reach, np.float32)
    outward = np.zeros((len(points), 3), np.float32)
    index, found, normal = nearer_than(points, poses, reach)
    distance[index] = found
    outward[index] = normal.T
    return distance, outward


def nearer_than(
    points: Floats, poses: Sequence[Pose], reach: Floats | float
) -> tuple[Ints, Floats, Floats]:
    """Which points (n, 3) are nearer than `reach` [m], one or (n,), ascending: their indices,
    distances and normals (3, m)."""
    reaches = np.broadcast_to(np.float32(reach), len(points))
    found = [_near(pose, points, reaches) for pose in poses]
    if len(found) == 1:
        return found[0]
    none = (np.zeros(0, np.int64), np.zeros(0, np.float32), np.zeros((3, 0), np.float32))
    index, distance, outward = (
        np.concatenate(each, axis=-1) for each in zip(none, *found, strict=True)
    )
    order = np.lexsort((distance, index))  # the nearest collider of each point first
    index, chosen = np.unique(index.take(order), return_index=True)
    chosen = order.take(chosen)
    return index, distance.take(chosen), outward.take(chosen, axis=1)


def distance_of_few(points: Floats, poses: Sequence[Pose]) -> tuple[Floats, Floats]:
    """`distance_to` with infinite reach; faster if points are few or mostly near."""
    rows = np.ascontiguousarray(points.T, np.float32)
    if len(poses) == 1:
        found, normal = world_distance(
            poses[0], transform_points(poses[0].inverse, rows), MIN_GRADIENT
        )
        return found, normal.T
    distance = np.full(rows.shape[1], np.inf, np.float32)
    outward = np.zeros_like(rows)
    for pose in poses:
        found, normal = world_distance(pose, transform_points(pose.inverse, rows), MIN_GRADIENT)
        is_nearer = found < distance
        np.copyto(distance, found, where=is_nearer)
        np.copyto(outward, normal, where=is_nearer)
    return distance, outward.T


def _near(pose: Pose, points: Floats, reach: Floats) -> tuple[Ints, Floats, Floats]:
    """Points (n, 3) world that are nearer to a collider than their reach, (n,) [m], ascending:
    their indices, distances and normals (3, m)."""
    maybe: list[Ints] = [np.zeros(0, np.int64)]
    for first in range(0, len(points), _CHUNK):
        some = slice(first, first + _CHUNK)
        near = pose.collider.near(_local(pose, points[some]), reach[some] / np.float32(pose.scale))
        maybe.append(near + first)
    index = np.concatenate(maybe)
    local = _local(pose, points.take(index, axis=0))
    distance, normal = world_distance(pose, local, MIN_GRADIENT)
    nearer = (distance < reach.take(index)).nonzero()[0]
    return index.take(nearer), distance.take(nearer), normal.take(nearer, axis=1)


def _local(pose: Pose, points: Floats) -> Floats:
    """Points (n, 3) world in the space of a collider, (3, n)."""
    return transform_points(pose.inverse, np.ascontiguousarray(points.T, np.float32))


def are_outside_meshes(points: Floats, colliders: Sequence[PosedCollider]) -> Bools:
    """Whether points (n, 3) world are outside of all colliders, (n,). Slow.

    Tests meshes themselves, while `signed_distance` uses their fields, whose cells thicken thin
    parts.
    """
    rows = np.ascontiguousarray(np.asarray(points, np.float32).T)
    result = np.ones(rows.shape[1], bool)
    for pose in poses_at_end(colliders) if rows.size else ():
        local = transform_points(pose.inverse, rows)
        if isinstance(pose.collider, DistanceField):
            result &= pose.collider.are_outside(local)
        else:
            result &= world_distance(pose, local)[0] > 0.0
    return result


def mesh_distance(points: Floats, colliders: Sequence[PosedCollider]) -> Floats:
    """Signed distances (n,) of points (n, 3) world from meshes themselves. Slow, for few points."""
    rows = np.ascontiguousarray(np.asarray(points, np.float32).T)
    nearest = np.full(rows.shape[1], np.inf, np.float32)
    for pose in poses_at_end(colliders) if rows.size else ():
        local = transform_points(pose.inverse, rows)
        distance, _ = world_distance(pose, local, MIN_GRADIENT)
        if isinstance(pose.collider, DistanceField) and pose.collider.surface is not None:
            found = search_of(pose.collider.surface).closest(local.T).distance
            found = found.astype(np.float32) * np.float32(pose.scale)
            distance = np.where(pose.collider.are_outside(local), found, -found)
        np.minimum(nearest, distance, out=nearest)
    return nearest
