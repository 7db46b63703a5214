"""Chains of joints that springs turn, as engines with VRMC_springBone move them.

The algorithm is that of the specification (VRM Consortium, VRMC_springBone 1.0, "SpringBone
Algorithm"): a bone's tail moves on by inertia (Verlet 1967), is pulled towards its direction at
rest and by gravity, and is corrected to the bone's length and out of colliders; the bone then takes
the smallest rotation that points it at its tail. Bones do not stretch, and a chain's first joint
moves with the head.

Limitation, of the specification itself: stiffness, gravity and the fraction that inertia keeps are
those of one step, so the motion depends on the rate of steps. Values are fitted for `STEP_RATE`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from .joint_chains import cross_matrices
from .joint_keys import quaternions, rotation_matrices, slerp

#: Steps [1/s] that the values are for: engines step once a frame.
STEP_RATE = 60.0
DOWN = np.array([0.0, 0.0, -1.0])
#: Minimum of 1 + cos between two directions, which is 0 for opposite ones.
_MIN_COSINE_SUM = 1.0e-9
#: Lengths [m] below this count as 0.
_MIN_LENGTH = 1.0e-9


@dataclass(frozen=True, eq=False)
class SpringColliders:
    """Balls and capsules that move with the head, in the space of the chains at rest.

    center, tail: (n, 3) [m] the ends of a capsule's axis; equal for a ball. radius: (n,) [m].
    """

    center: Floats
    tail: Floats
    radius: Floats

    @classmethod
    def spheres(cls, center: Floats, radius: Floats) -> SpringColliders:
        """Balls without axes: centres (n, 3) [m] and radii (n,) [m]."""
        center = np.asarray(center, np.float64).reshape(-1, 3)
        return cls(center, center, np.asarray(radius, np.float64).reshape(-1))

    def nearest(self, points: Floats) -> tuple[Floats, Floats]:
        """The place on each axis nearest to points (..., 3), (..., n, 3), and the points' distance
        from the ball around it (..., n) [m].
        """
        axis = self.tail - self.center
        square = np.maximum((axis * axis).sum(axis=1), _MIN_LENGTH**2)
        away = points[..., None, :] - self.center
        fraction = np.clip((away * axis).sum(axis=-1) / square, 0.0, 1.0)
        place = self.center + fraction[..., None] * axis
        distance = np.linalg.norm(points[..., None, :] - place, axis=-1) - self.radius
        return place, distance


@dataclass(frozen=True, eq=False)
class SpringValues:
    """Spring parameters of each bone, (chains, bones) each, with the names and units of
    VRMC_springBone.

    stiffness, gravity: speed at which a tail is pulled [m/s]. drag: 0 to 1, the fraction of a
        tail's motion in a step that the next step loses. hit_radius: [m].
    """

    stiffness: Floats
    drag: Floats
    gravity: Floats
    hit_radius: Floats


@dataclass(frozen=True, eq=False)
class SpringChains:
    """Chains at rest, and the balls that they keep out of.

    rest: (chains, joints, 4, 4) rigid [m]; y points to the next joint, the last one ends the chain.
    colliders: for all chains. collides: (chains, n) which balls a chain keeps out of.
    """

    rest: Floats
    colliders: SpringColliders
    collides: Bools

    @property
    def lengths(self) -> Floats:
        """Lengths of the bones, (chains, joints - 1) [m]."""
        lengths: Floats = np.linalg.norm(np.diff(self.rest[..., :3, 3], axis=1), axis=-1)
        return lengths

    def select(self, chains: Ints) -> SpringChains:
        """The chains with these indices, (n,), possibly several times."""
        return SpringChains(self.rest[chains], self.colliders, self.collides[chains])


def resampled_to_steps(carrier: Floats, frame_rate: float, step_rate: float = STEP_RATE) -> Floats:
    """A rigid motion by frames, (frame_count, 4, 4), resampled to steps, (step_count, 4, 4).

    Between frames rotations are interpolated by slerp and translations linearly.
    """
    last = len(carrier) - 1
    frame = np.arange(round(last * step_rate / frame_rate) + 1) * frame_rate / step_rate
    before = np.minimum(frame.astype(np.int64), max(last - 1, 0))
    after, fraction = np.minimum(before + 1, last), np.minimum(frame - before, 1.0)[:, None]
    turns = quaternions(carrier[:, :3, :3])
    steps: Floats = np.tile(np.eye(4), (len(frame), 1, 1))
    steps[:, :3, :3] = rotation_matrices(slerp(turns[before], turns[after], fraction))
    places = carrier[:, :3, 3]
    steps[:, :3, 3] = places[before] * (1.0 - fraction) + places[after] * fraction
    return steps


def resampled_to_frames(values: Floats, frame_count: int, frame_rate: float) -> Floats:
    """Values of steps (step_count, ...) at the frames, interpolated linearly."""
    step = np.minimum(np.arange(frame_count) * STEP_RATE / frame_rate, len(values) - 1)
    before = np.minimum(step.astype(np.int64), max(len(values) - 2, 0))
    fraction = (step - before).reshape(-1, *[1] * (values.ndim - 1))
    mixed: Floats = values[before] * (1.0 - fraction)
    mixed += values[np.minimum(before + 1, len(values) - 1)] * fraction
    return mixed


def simulate_springs(chains: SpringChains, values: SpringValues, carrier: Floats) -> Floats:
    """Places of the joints in each step as springs move them, in the space of the head.

    Args:
        carrier: (step_count, 4, 4) rigid motion of the head; one step is 1 / `STEP_RATE`.

    Returns:
        Places (step_count, chains, joints, 3) [m]; the chains begin at rest.
    """
    count, joints = chains.rest.shape[:2]
    lengths, relative = chains.lengths, _relative_rotations(chains.rest)
    step = 1.0 / STEP_RATE
    places = np.empty((len(carrier), count, joints, 3))
    first = chains.rest[..., :3, 3] @ carrier[0, :3, :3].T + carrier[0, :3, 3]
    tail, before = first[:, 1:].copy(), first[:, 1:].copy()
    for number, head in enumerate(carrier):
        turn = np.broadcast_to(head[:3, :3], (count, 3, 3))
        place = chains.rest[:, 0, :3, 3] @ head[:3, :3].T + head[:3, 3]
        moved = [place]
        for bone in range(joints - 1):
            at_rest = turn @ relative[:, bone]
            goal = at_rest[..., 1]
            now = tail[:, bone]
            onward = (now - before[:, bone]) * (1.0 - values.drag[:, bone, None])
            pull = goal * values.stiffness[:, bone, None] + DOWN * values.gravity[:, bone, None]
            length = lengths[:, bone, None]
            after = _at_length(now + onward + pull * step, place, length)
            _push_out(after, place, length, chains, values.hit_radius[:, bone], head)
            before[:, bone], tail[:, bone] = now, after
            turn = rotations_between(goal, (after - place) / length) @ at_rest
            place = after
            moved.append(place)
        places[number] = (np.stack(moved, axis=1) - head[:3, 3]) @ head[:3, :3]
    return places


def rotations_towards(rest: Floats, places: Floats) -> Floats:
    """Rotations of joints that point at these places, each by the smallest rotation after its
    parent's.

    Args:
        rest: (chains, joints, 4, 4). places: (frame_count, chains, joints, 3).

    Returns:
        (frame_count, chains, joints, 3, 3); the last joint turns with the one before.
    """
    relative = _relative_rotations(rest)
    directions = _unit(np.diff(places, axis=2))
    turn = np.broadcast_to(np.eye(3), (*places.shape[:2], 3, 3))
    turns = []
    for bone in range(rest.shape[1] - 1):
        at_rest = turn @ relative[:, bone]
        turn = rotations_between(at_rest[..., 1], directions[:, :, bone]) @ at_rest
        turns.append(turn)
    return np.stack([*turns, turn], axis=2)


def with_bone_lengths(rest: Floats, targets: Floats) -> Floats:
    """The places nearest to targets (..., chains, joints, 3), joint by joint, that bones of the
    rest lengths reach.
    """
    lengths = np.linalg.norm(np.diff(rest[..., :3, 3], axis=1), axis=-1)
    places = [np.broadcast_to(rest[:, 0, :3, 3], targets.shape[:-2] + (3,))]
    for bone in range(rest.shape[1] - 1):
        places.append(_at_length(targets[..., bone + 1, :], places[-1], lengths[:, bone, None]))
    return np.stack(places, axis=-2)


def rotations_between(one: Floats, other: Floats) -> Floats:
    """The smallest rotations (..., 3, 3) that take unit vectors to others; Rodrigues' formula."""
    axis, cosine = np.cross(one, other), (one * other).sum(axis=-1)
    cross = cross_matrices(axis)
    fraction = 1.0 / np.maximum(1.0 + cosine, _MIN_COSINE_SUM)
    turn: Floats = np.eye(3) + cross + cross @ cross * fraction[..., None, None]
    return turn


def _push_out(
    tail: Floats, place: Floats, length: Floats, chains: SpringChains, reach: Floats, head: Floats
) -> None:
    """Push tails (chains, 3) out of the balls that they hit, one after the other, in place."""
    colliders = chains.colliders
    if not len(colliders.radius):
        return
    local = (tail - head[:3, 3]) @ head[:3, :3]
    near = (colliders.nearest(local)[1] < reach[:, None]) & chains.collides
    rows = np.flatnonzero(near.any(axis=1))
    if not len(rows):
        return
    local_tails, root = local[rows], (place[rows] - head[:3, 3]) @ head[:3, :3]
    for number in range(len(colliders.radius)):
        one = SpringColliders(
            *(each[number][None] for each in (colliders.center, colliders.tail, colliders.radius))
        )
        axis, distance = one.nearest(local_tails)
        miss = distance[:, 0] - reach[rows]
        hit = np.flatnonzero((miss < 0.0) & chains.collides[rows, number])
        pushed = local_tails[hit] - _unit(local_tails[hit] - axis[hit, 0]) * miss[hit, None]
        local_tails[hit] = _at_length(pushed, root[hit], length[rows][hit])
    tail[rows] = local_tails @ head[:3, :3].T + head[:3, 3]


def _relative_rotations(rest: Floats) -> Floats:
    """Rotations of joints at rest relative to the joint before, (chains, joints, 3, 3)."""
    turn = rest[..., :3, :3]
    relative: Floats = turn.copy()
    relative[:, 1:] = turn[:, :-1].swapaxes(-1, -2) @ turn[:, 1:]
    return relative


def _at_length(tail: Floats, place: Floats, length: Floats) -> Floats:
    """Tails moved along their direction from the place to this length (..., 1) from it."""
    return place + _unit(tail - place) * length


def _unit(vectors: Floats) -> Floats:
    length = np.sqrt((vectors * vectors).sum(axis=-1, keepdims=True))
    unit: Floats = vectors / np.maximum(length, _MIN_LENGTH)
    return unit
