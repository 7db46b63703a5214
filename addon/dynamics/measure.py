"""Measures of a simulation's quality: lengths and penetration, of guides and of all strands."""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands.arc_length import strand_lengths
from ..strands.vectors import dot_rows
from .colliders import PosedCollider, transform_points
from .colliders.signed_distance import signed_distance
from .constraints import PINNED_COUNT, TINY, directions
from .state import DynamicsState

#: Minimum length that changes are related to, as a fraction of the median: hair of a thousandth of
#: a millimetre gets many times longer by the rounding of float32 alone.
MIN_LENGTH = 0.01


def max_stretch(state: DynamicsState) -> float:
    """Largest change of a simulated segment's length, as a fraction of its rest length.

    Segments between pinned CVs, without length, or of curls, which may stretch, do not count. See
    MIN_LENGTH.
    """
    rest = state.rest.length[PINNED_COUNT - 1 :]
    if not rest.size:
        return 0.0
    _, length = directions(state.position[:, PINNED_COUNT - 1 :])
    is_fixed = rest > TINY
    if state.rest.curl_slack is not None:
        is_fixed &= state.rest.curl_slack[PINNED_COUNT - 1 :] == 0.0
    long = np.maximum(rest, np.float32(MIN_LENGTH * state.rest.size / len(state.rest.length)))
    change = np.divide(np.abs(length - rest), long, out=np.zeros_like(rest), where=is_fixed)
    return float(change.max())


def deepest_penetration(state: DynamicsState, colliders: tuple[PosedCollider, ...]) -> float:
    """How deep [m] the center of any free CV lies in a collider at the frame's end; 0 if none."""
    points = state.position[:, PINNED_COUNT:].reshape(3, -1)
    return float(_depths(points, colliders).max(initial=0.0))


def _depths(points: Floats, colliders: tuple[PosedCollider, ...]) -> Floats:
    """How deep [m] each of the points (3, n) lies in a collider at the frame's end, (n,)."""
    deepest = np.zeros(points.shape[1], np.float32)
    for posed in colliders if points.size else ():
        inverse = np.linalg.inv(posed.matrix_now)
        distance, gradient = posed.collider.distance(transform_points(inverse, points))
        # the inverse scales a step outwards into the collider's space; the gradient is used for its
        # direction only, because a sampled one is too short where two sides are equally near
        gradient /= np.maximum(np.sqrt(dot_rows(gradient, gradient)), TINY)
        steepness = inverse[:3, :3].T.astype(np.float32)
        outward = sum(steepness[:, axis, None] * gradient[axis] for axis in range(3))
        scale = np.maximum(np.sqrt(dot_rows(outward, outward)), TINY)
        np.maximum(deepest, -(distance / scale), out=deepest)
    return deepest


def length_changes(points: Floats, offsets: Ints, rest_lengths: Floats) -> Floats:
    """The change of each strand's length, as a fraction of that at rest, (strand_count,).

    Args:
        points: (point_count, 3) [m], strand by strand.
        offsets: (strand_count + 1,), strand s is points[offsets[s]:offsets[s + 1]].
        rest_lengths: (strand_count,) [m]; see MIN_LENGTH.
    """
    change = np.abs(strand_lengths(points, offsets) - rest_lengths)
    shortest = MIN_LENGTH * float(np.median(rest_lengths)) if len(rest_lengths) else 0.0
    return np.asarray(change / np.maximum(rest_lengths, max(shortest, float(TINY))))


def are_outside(points: Floats, colliders: tuple[PosedCollider, ...]) -> Bools:
    """Which points (n, 3) world [m] are outside of all colliders at the frame's end, (n,)."""
    distance, _ = signed_distance(points, colliders, 0.0)
    return np.asarray(distance >= 0.0)


def strand_depths(
    points: Floats, offsets: Ints, colliders: tuple[PosedCollider, ...], were_outside: Bools
) -> Floats:
    """How deep [m] the points of each strand that were outside at rest lie in a collider,
    (strand_count,).

    Args:
        points, offsets: see `length_changes`.
        were_outside: (point_count,), see `are_outside`.
    """
    distance, _ = signed_distance(points, colliders, 0.0)
    inside = np.flatnonzero(were_outside & (distance < 0.0))
    depth = np.zeros(len(points), np.float32)
    depth[inside] = _depths(np.ascontiguousarray(points[inside].T, np.float32), colliders)
    return np.maximum.reduceat(depth, offsets[:-1]) if len(depth) else np.zeros(0, np.float32)
