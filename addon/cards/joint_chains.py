"""Chains of joints that cards share if they move alike: each card's chain, a second one, and the
joints at rest.

Similarity is that of the displacements of places along the cards, frame by frame, and a little of
their positions: k-means (Lloyd 1982) from the cards that are farthest from each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..strands.vectors import unit_or
from .joint_solve import Skin

#: Weight of cards' positions relative to their motion.
_PLACE_WEIGHT = 0.75
_ROUNDS = 20
_MIN_LENGTH = 1.0e-12


@dataclass(frozen=True, eq=False)
class Chains:
    """The chain of each card, and another one that may move it too; (n,) each."""

    first: Ints
    second: Ints
    count: int


def card_chains(places: Floats, moved_places: Floats, max_chains: int) -> Chains:
    """Put cards into `max_chains` chains or fewer.

    Args:
        places: (n, row_count, 3) along each card at rest [m].
        moved_places: (n, row_count, frame_count, 3) the same in motion.
    """
    motions = (moved_places - places[:, :, None]).reshape(len(places), -1)
    middle = places - places.mean(axis=(0, 1))
    size = np.sqrt((middle * middle).mean())
    fraction = _PLACE_WEIGHT * np.sqrt((motions * motions).mean()) / max(float(size), _MIN_LENGTH)
    vectors = np.concatenate([motions, middle.reshape(len(places), -1) * fraction], axis=1)
    own, centres = _k_means(vectors, min(max_chains, len(places)))
    used, own = np.unique(own, return_inverse=True)
    return Chains(own, _second_centres(vectors, own, centres[used]), len(used))


def _k_means(vectors: Floats, count: int) -> tuple[Ints, Floats]:
    """The nearest of `count` centres of each vector, and the centres."""
    centres = _initial_centres(vectors, count)
    nearest = np.full(len(vectors), -1)
    for _ in range(_ROUNDS):
        before, nearest = nearest, _squared_distances(vectors, centres).argmin(axis=1)
        if np.array_equal(before, nearest):
            break
        members = np.bincount(nearest, minlength=count)
        sums = np.zeros_like(centres)
        np.add.at(sums, nearest, vectors)
        has_some = members > 0
        centres[has_some] = sums[has_some] / members[has_some, None]
    return nearest, centres


def _initial_centres(vectors: Floats, count: int) -> Floats:
    """Vectors chosen one by one, each the farthest from all chosen ones, beginning near the
    mean."""
    first = int(_squared_distances(vectors, vectors.mean(axis=0)[None])[:, 0].argmin())
    chosen, distance = [first], np.full(len(vectors), np.inf)
    while len(chosen) < count:
        distance = np.minimum(distance, _squared_distances(vectors, vectors[chosen[-1:]])[:, 0])
        chosen.append(int(distance.argmax()))
    return vectors[chosen].copy()


def _second_centres(vectors: Floats, own: Ints, centres: Floats) -> Ints:
    """The other centre whose mixture with a vector's own centre comes nearest to it; its own if
    there is only one."""
    count = len(centres)
    if count < 2:
        return own
    grid = centres @ centres.T
    square = np.diag(grid)
    squared_gaps = np.maximum(square[own][:, None] - 2.0 * grid[own] + square, _MIN_LENGTH)
    to_centres = vectors @ centres.T
    from_own = to_centres[np.arange(len(own)), own]
    # (v - a) (b - a) for all b, a being its own centre
    toward = to_centres - from_own[:, None] - grid[own] + square[own][:, None]
    fraction = np.clip(toward / squared_gaps, 0.0, 0.5)
    gain = 2.0 * fraction * toward - fraction * fraction * squared_gaps
    gain[np.arange(len(own)), own] = -1.0
    return gain.argmax(axis=1)


def _squared_distances(vectors: Floats, centres: Floats) -> Floats:
    """Squared distances, (n, k)."""
    product = vectors @ centres.T
    lengths = (vectors * vectors).sum(axis=1)[:, None] + (centres * centres).sum(axis=1)
    squares: Floats = np.maximum(lengths - 2.0 * product, 0.0)
    return squares


def rest_joints(lines: Floats, chains: Chains, joints: int) -> Floats:
    """Joints at rest along the middle of a chain's cards, with y towards the tip,
    (chains, joints, 4, 4).

    Args:
        lines: (n, row_count, 3) places along each card, root to tip [m].
    """
    places = chain_lines(lines, chains, joints)
    rest = np.tile(np.eye(4), (chains.count, joints, 1, 1))
    rest[..., :3, 3] = places
    rest[..., :3, :3] = rotations_from_y(np.gradient(places, axis=1))
    return rest


def chain_lines(lines: Floats, chains: Chains, joints: int) -> Floats:
    """Places evenly along the middle of each chain's cards, (chains, joints, ...).

    Args:
        lines: (n, row_count, ...) of each card, root to tip.
    """
    is_member = (chains.first == np.arange(chains.count)[:, None]).astype(np.float64)
    middle = np.tensordot(is_member / is_member.sum(axis=1, keepdims=True), lines, 1)
    at = np.linspace(0.0, middle.shape[1] - 1.0, joints)
    before = np.minimum(at.astype(int), middle.shape[1] - 2)
    fraction = (at - before).reshape(-1, *[1] * (middle.ndim - 2))
    places: Floats = middle[:, before] * (1.0 - fraction) + middle[:, before + 1] * fraction
    return places


def rotations_from_y(direction: Floats) -> Floats:
    """The smallest rotations (..., 3, 3) that take y to these directions; Rodrigues' formula."""
    y = np.array([0.0, 1.0, 0.0])
    unit = unit_or(direction, y, 1.0e-9)
    axis, cosine = np.cross(y, unit), unit[..., 1]
    cross = cross_matrices(axis)
    fraction = 1.0 / np.maximum(1.0 + cosine, 1.0e-6)
    turns = np.eye(3) + cross + cross @ cross * fraction[..., None, None]
    turns[cosine < -1.0 + 1.0e-6] = np.diag([1.0, -1.0, -1.0])
    return turns


def cross_matrices(axis: Floats) -> Floats:
    """Matrices (..., 3, 3) of the cross product with vectors (..., 3)."""
    cross = np.zeros((*axis.shape, 3))
    cross[..., 0, 1], cross[..., 1, 0] = -axis[..., 2], axis[..., 2]
    cross[..., 0, 2], cross[..., 2, 0] = axis[..., 1], -axis[..., 1]
    cross[..., 1, 2], cross[..., 2, 1] = -axis[..., 0], axis[..., 0]
    return cross


def joint_reach(points: Floats, skin: Skin, rest: Floats) -> Floats:
    """Root mean square distance from each joint of the points that it moves, (chains, joints)
    [m]."""
    places = rest.reshape(-1, 4, 4)[:, :3, 3]
    square = np.square(points[:, None] - places[skin.joint]).sum(axis=-1)
    whole = np.bincount(skin.joint.ravel(), skin.weight.ravel(), len(places))
    sums = np.bincount(skin.joint.ravel(), (skin.weight * square).ravel(), len(places))
    reach = np.sqrt(sums / np.maximum(whole, 1.0e-9))
    return reach.reshape(rest.shape[:2])
