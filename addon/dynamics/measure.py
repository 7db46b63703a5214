"""What a simulation must hold: lengths, and hair outside of colliders."""

from __future__ import annotations

import numpy as np

from ..strands.vectors import dot_rows
from .colliders import PosedCollider, transform_points
from .constraints import PINNED, TINY, directions
from .state import DynamicsState


def max_stretch(state: DynamicsState) -> float:
    """Largest change of a simulated segment's length, as a fraction of its rest length.

    Segments between pinned CVs belong to the style, and those without length cannot stretch.
    """
    rest = state.rest.length[PINNED - 1 :]
    if not rest.size:
        return 0.0
    _, length = directions(state.position[:, PINNED - 1 :])
    change = np.divide(np.abs(length - rest), rest, out=np.zeros_like(rest), where=rest > TINY)
    return float(change.max())


def deepest_penetration(state: DynamicsState, colliders: tuple[PosedCollider, ...]) -> float:
    """How deep [m] the center of any free CV lies in a collider at the frame's end; 0 if none."""
    points = state.position[:, PINNED:].reshape(3, -1)
    deepest = 0.0
    for posed in colliders if points.size else ():
        inverse = np.linalg.inv(posed.matrix_now)
        distance, gradient = posed.collider.distance(transform_points(inverse, points))
        # in the collider's space a step outwards is as long as the inverse makes it; the gradient
        # gives the direction only, because a sampled one is short where two sides are as near
        gradient /= np.maximum(np.sqrt(dot_rows(gradient, gradient)), TINY)
        steepness = inverse[:3, :3].T.astype(np.float32)
        outward = sum(steepness[:, axis, None] * gradient[axis] for axis in range(3))
        scale = np.maximum(np.sqrt(dot_rows(outward, outward)), TINY)
        deepest = max(deepest, float(-(distance / scale).min()))
    return deepest
