"""Strands that ride on guides are led out of colliders; every segment keeps its length.

Guides stay out of colliders, but a strand between two guides that part around a head would go
through it. From root to tip, a point that is too near to a collider goes straight out, then back
along its segment to the length that this had, and so on until both hold. Where they do not, as
behind an ear, the segment turns towards the nearest direction that leads out, as far as it must.
What comes after it goes along, in its shape. What was in a collider when the motion began may stay
as deep as it was where its root carries it, and comes out by as much as it moves away from there.

The twin on the GPU is gpu_shaders/lead_out.comp.glsl.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..dynamics.colliders import Pose, PosedCollider, signed_distance
from ..dynamics.colliders.signed_distance import distance_to, poses_now
from ..strands.vectors import GOLDEN_ANGLE

#: How often a point goes straight out and back to its length, at most.
SWEEPS = 4
#: How much nearer than it should be a point may come before its strand is led out, as a fraction
#: of the distance that is kept.
SLACK = 0.05
#: How many directions are tried for a segment that this does not lead out, and how often the turn
#: to the one that does is halved.
TRIES, HALVINGS = 64, 5
#: A strand that is stuck all the same, as in a fold, is led from its root again, farther out by
#: this much of its mean segment; how often it is led at most.
MARGIN, ATTEMPTS = 0.5, 3
_TINY = 1.0e-30


@dataclass(frozen=True, eq=False)
class Clearance:
    """How far strands stay from colliders where their roots carry them.

    kept: [m], the distance of a point that was at least so far away when the motion began.
    points: (point_count,) float32 [m], that of each: `kept`, or less if it was nearer when the
        motion began; -inf for roots.
    """

    kept: float
    points: Floats


@dataclass(frozen=True, eq=False)
class LedOut:
    """Strands that were led out of colliders in one frame.

    strands: (n,) int32, ascending.
    points: (m, 3) float32 world [m], all points of these, one strand after the other.
    """

    strands: Ints
    points: Floats

    @classmethod
    def of(cls, strands: Ints, points: Floats, offsets: Ints) -> LedOut:
        """These of all strands, (point_count, 3)."""
        return cls(strands.astype(np.int32), points[points_of(strands, offsets)])

    def fits(self, offsets: Ints) -> bool:
        """Whether it is of strands with these points."""
        count = len(offsets) - 1
        if len(self.strands) and not 0 <= self.strands.min() <= self.strands.max() < count:
            return False
        return self.points.shape == (int(np.diff(offsets)[self.strands].sum()), 3)

    def put(self, points: Floats, offsets: Ints) -> None:
        """Into the points of all strands, (point_count, 3), in place."""
        points[points_of(self.strands, offsets)] = self.points


NOT_LED = LedOut(np.zeros(0, np.int32), np.zeros((0, 3), np.float32))


def clearance_at(
    points: Floats, offsets: Ints, colliders: Sequence[PosedCollider], kept: float
) -> Clearance:
    """That of a motion which begins now.

    Args:
        points: (point_count, 3) world [m], strand after strand, where their roots carry them.
        offsets: (strand_count + 1,), strand s is points[offsets[s]:offsets[s + 1]].
        colliders: taken where they stand at their frame's end.
        kept: [m].
    """
    distance, _ = signed_distance(points, colliders, kept)
    distance[offsets[:-1]] = -np.inf
    return Clearance(kept, distance)


def lead_out(
    points: Floats,
    carried: Floats,
    offsets: Ints,
    colliders: Sequence[PosedCollider],
    clearance: Clearance,
) -> Ints:
    """Lead strands out of colliders, in place.

    Args:
        carried: (point_count, 3) world [m], where their roots carry them.
        points, offsets, colliders: as of `clearance_at`.

    Returns:
        (n,) the strands that were too near, ascending.
    """
    poses = poses_now(colliders)
    distance, _ = distance_to(points, poses, clearance.kept)
    away = np.linalg.norm(points - carried, axis=1)
    wanted = np.minimum(clearance.points + away, np.float32(clearance.kept))
    is_near = distance < wanted - np.float32(SLACK * clearance.kept)
    counts = np.diff(offsets)
    strands = np.unique(np.repeat(np.arange(len(counts)), counts)[is_near])
    for count in np.unique(counts[strands]).tolist():
        index = offsets[strands[counts[strands] == count], None] + np.arange(count)
        points[index] = _led(points[index], wanted[index], clearance.kept, poses)
    return strands


def points_of(strands: Ints, offsets: Ints) -> Ints:
    """The indices of all points of some strands, one strand after the other."""
    counts = np.diff(offsets)[strands]
    begins = np.cumsum(counts) - counts
    index: Ints = np.arange(counts.sum()) + np.repeat(offsets[:-1][strands] - begins, counts)
    return index


def directions() -> Floats:
    """What is tried, (TRIES, 3): evenly over the sphere, on a spiral by the golden angle."""
    number = np.arange(TRIES)
    height = 1.0 - (2.0 * number + 1.0) / TRIES
    angle, radius = GOLDEN_ANGLE * number, np.sqrt(1.0 - height * height)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)


def _led(some: Floats, wanted: Floats, kept: float, poses: Sequence[Pose]) -> Floats:
    """Strands (n, count, 3) led out; wanted (n, count) [m]."""
    some = some.astype(np.float64)
    lengths = np.linalg.norm(np.diff(some, axis=1), axis=2)
    led, stuck = some.copy(), np.arange(len(some))
    for attempt in range(ATTEMPTS):
        farther = MARGIN * attempt * lengths[stuck].mean(axis=1)
        led[stuck], lack = _led_by(some[stuck], lengths[stuck], wanted[stuck], farther, kept, poses)
        stuck = stuck[lack > SLACK * kept]
        if not len(stuck):
            break
    return led


def _led_by(
    some: Floats,
    lengths: Floats,
    wanted: Floats,
    farther: Floats,
    kept: float,
    poses: Sequence[Pose],
) -> tuple[Floats, Floats]:
    """Strands (n, count, 3) led out farther than they must be, by (n,) [m]; and by how much any
    point of each is nearer than it must be, (n,) [m]."""
    segments, led, worst = np.diff(some, axis=1), some.copy(), np.zeros(len(some))
    for point in range(1, led.shape[1]):
        start, length = led[:, point - 1], lengths[:, point - 1]
        here = start + segments[:, point - 1]
        goal = wanted[:, point] + farther
        near = np.arange(len(led))
        for sweep in range(SWEEPS + 1):
            distance, outward = distance_to(here[near], poses, kept + float(farther.max()))
            lack = goal[near] - distance
            left = np.flatnonzero(lack > 0.0)
            near, lack = near[left], lack[left]
            if sweep == SWEEPS or not len(near):
                break
            arm = here[near] + outward[left] * lack[:, None] - start[near]
            here[near] = _at_length(start[near], arm, length[near])
        near = near[lack > SLACK * kept]
        if len(near):
            arms = here[near] - start[near], length[near]
            here[near] = _turned_out(start[near], *arms, goal[near], poses)
            distance, _ = distance_to(here[near], poses, kept)
            worst[near] = np.maximum(worst[near], wanted[near, point] - distance)
        led[:, point] = here
    return led, worst


def _turned_out(
    start: Floats,
    arm: Floats,
    length: Floats,
    wanted: Floats,
    poses: Sequence[Pose],
) -> Floats:
    """The ends (n, 3) of segments that are turned until they are out."""
    tried = directions()
    ends = start + length[:, None] * tried[:, None]
    reach = float(wanted.max())
    distance, _ = distance_to(ends.reshape(-1, 3), poses, reach)
    lack = np.maximum(wanted - distance.reshape(TRIES, -1), 0.0)
    arm = arm / np.maximum(length, _TINY)[:, None]
    # the nearest that leads out; if none does, the one that lacks least
    out = tried[np.where(lack > 0.0, -1.0 - lack, tried @ arm.T).argmax(axis=0)]
    low, high = np.zeros(len(arm)), np.ones(len(arm))
    for _ in range(HALVINGS):
        middle = (low + high) / 2.0
        end = _at_length(start, arm + middle[:, None] * (out - arm), length)
        is_near = distance_to(end, poses, reach)[0] < wanted
        low, high = np.where(is_near, middle, low), np.where(is_near, high, middle)
    return _at_length(start, arm + high[:, None] * (out - arm), length)


def _at_length(start: Floats, arm: Floats, length: Floats) -> Floats:
    """The points (n, 3) this far [m] from others, in the direction of `arm`."""
    return start + arm * (length / np.maximum(np.linalg.norm(arm, axis=1), _TINY))[:, None]
