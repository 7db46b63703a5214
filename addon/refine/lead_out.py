"""Strands that ride on guides are led out of colliders; every segment keeps its length.

Guides stay out of colliders, but a strand between two guides that part around a head would go
through it. From root to tip, a point that is too near to a collider goes straight out, then back
along its segment to the length that this had, and so on until both hold. Where they do not, as
behind an ear, the segment turns towards the nearest direction that leads out, as far as it must.
What comes after it goes along, in its shape. What was in a collider when the motion began may stay
as deep as it was where its root carries it, and comes out by as much as it moves away from there.

Hair behind an ear may lie in the grid of a mesh, whose cells are thicker than the ear, though
outside of the mesh itself. There the grid does not tell which way is out, so such a point goes no
farther from where its root carries it than it was from the mesh: it stays outside, wherever it
turns. So does a strand that nothing leads out: it is as its root carries it.

The twin on the GPU is gpu_shaders/lead_out.comp.glsl.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Floats, Ints
from ..dynamics.colliders import Pose, PosedCollider, signed_distance
from ..dynamics.colliders.signed_distance import distance_to, outside_by, poses_now
from ..strands.vectors import GOLDEN_ANGLE

#: How often a point goes straight out and back to its length, at most.
SWEEPS = 4
#: How much nearer than it should be a point may come before its strand is led out, as a fraction
#: of the distance that is kept.
SLACK = 0.05
#: How many directions are tried for a segment that this does not lead out, and how often the turn
#: to the one that does is halved.
TRIES, HALVINGS = 64, 5
#: A point that is deeper than this in a grid, as a fraction of the distance that is kept, is looked
#: for in the mesh itself; and how much of the way that it may go is used, since it also bends.
DEEP, LEASHED = 0.5, 0.9
#: A strand that is stuck all the same, as in a fold, is led from its root again, farther out by
#: this much of its mean segment; how often it is led at most.
MARGIN, ATTEMPTS = 0.5, 3
_TINY = 1.0e-30


@dataclass(frozen=True, eq=False)
class Clearance:
    """How far strands stay from colliders where their roots carry them.

    kept: [m], the distance of a point that was at least so far away when the motion began.
    points: (point_count,) float32 [m], that of each: `kept`, or less if it was nearer when the
        motion began; -inf for roots, and for those that have a leash.
    leashes: (point_count,) float32 [m], how far each goes at most from where its root carries it,
        since it lies in a grid but not in its mesh; inf: as far as it likes.
    """

    kept: float
    points: Floats
    leashes: Floats

    @cached_property
    def leashed(self) -> Ints:
        """The points that have a leash, ascending."""
        return np.isfinite(self.leashes).nonzero()[0]


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
    distance[offsets[:-1]] = np.inf
    leashes = np.full(len(points), np.inf, np.float32)
    deep = (distance < -DEEP * kept).nonzero()[0]
    outside = outside_by(points[deep], colliders)
    deep, outside = deep[outside > 0.0], outside[outside > 0.0]
    leashes[deep] = outside
    distance[deep] = distance[offsets[:-1]] = -np.inf
    return Clearance(kept, distance, leashes)


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
    poses, kept, counts = poses_now(colliders), clearance.kept, np.diff(offsets)
    pulled = _pull_back(points, carried, offsets, clearance)
    distance, _ = distance_to(points, poses, kept)
    near = (distance < np.float32((1.0 - SLACK) * kept)).nonzero()[0]
    goal = _wanted(points, carried, clearance, near)
    near = near[distance[near] < goal - np.float32(SLACK * kept)]
    strands = np.unique(np.searchsorted(offsets, near, side="right") - 1)
    for count in np.unique(counts[strands]).tolist():
        index = offsets[strands[counts[strands] == count], None] + np.arange(count)
        wanted = _wanted(points, carried, clearance, index)
        near_ones = _Near(points[index], carried[index], wanted, clearance.leashes[index])
        points[index] = _led(near_ones, kept, poses)
    return np.union1d(pulled, strands)


def _wanted(points: Floats, carried: Floats, clearance: Clearance, index: Ints) -> Floats:
    """How far from colliders some points shall be [m], in the shape of `index`."""
    away = np.linalg.norm(points[index] - carried[index], axis=-1)
    return np.minimum(clearance.points[index] + away, np.float32(clearance.kept))


def _pull_back(points: Floats, carried: Floats, offsets: Ints, clearance: Clearance) -> Ints:
    """Bring points that have a leash within it, in place; and the strands (n,) that had to move.

    All segments up to the last such point turn towards where their root carries them, all by the
    same part of the way. What comes after goes along, in its shape.
    """
    index = clearance.leashed
    away = np.linalg.norm(points[index] - carried[index], axis=1)
    part = np.float32(LEASHED) * clearance.leashes[index] / np.maximum(away, np.float32(_TINY))
    owner = np.searchsorted(offsets, index, side="right") - 1
    strands, begins = np.unique(owner, return_index=True)
    if not len(strands):
        return strands
    part = np.minimum.reduceat(part, begins)
    last = index[np.append(begins[1:], len(index)) - 1]
    is_far = part < 1.0
    strands, part, last = strands[is_far], part[is_far], last[is_far]
    for strand, fraction, end in zip(strands.tolist(), part.tolist(), last.tolist(), strict=True):
        first, after = int(offsets[strand]), int(offsets[strand + 1])
        segments = np.diff(points[first : end + 1].astype(np.float64), axis=0)
        there = np.diff(carried[first : end + 1].astype(np.float64), axis=0)
        arms = _at_length(0.0, there + fraction * (segments - there), _size(segments))
        before = points[end].copy()
        points[first + 1 : end + 1] = points[first] + np.cumsum(arms, axis=0)
        points[end + 1 : after] += points[end] - before
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


@dataclass(frozen=True, eq=False)
class _Near:
    """Strands of one point count that are too near.

    points, carried: (n, count, 3) where they ride, and where their roots carry them. wanted,
    leashes: (n, count) [m].
    """

    points: Floats
    carried: Floats
    wanted: Floats
    leashes: Floats

    def part(self, chosen: Ints) -> _Near:
        return _Near(*(values[chosen] for values in vars(self).values()))


def _led(near: _Near, kept: float, poses: Sequence[Pose]) -> Floats:
    """Where they are led to, (n, count, 3)."""
    led, stuck = near.points.astype(np.float64), np.arange(len(near.points))
    mean = np.linalg.norm(np.diff(led, axis=1), axis=2).mean(axis=1)
    lack = np.zeros(len(led))
    for attempt in range(ATTEMPTS):
        farther = MARGIN * attempt * mean[stuck]
        led[stuck], lack[stuck] = _led_by(near.part(stuck), farther, kept, poses)
        stuck = stuck[lack[stuck] > SLACK * kept]
        if not len(stuck):
            break
    return np.where((lack > kept)[:, None, None], near.carried, led)


def _led_by(
    near: _Near, farther: Floats, kept: float, poses: Sequence[Pose]
) -> tuple[Floats, Floats]:
    """Strands led out farther than they must be, by (n,) [m]; and by how much any point of each is
    nearer than it must be, (n,) [m], which is twice `kept` where one is beyond its leash."""
    some = near.points.astype(np.float64)
    segments, led, worst = np.diff(some, axis=1), some.copy(), np.zeros(len(some))
    lengths = np.linalg.norm(segments, axis=2)
    for point in range(1, led.shape[1]):
        start, length = led[:, point - 1], lengths[:, point - 1]
        here = start + segments[:, point - 1]
        goal = near.wanted[:, point] + farther
        left = np.arange(len(led))
        for sweep in range(SWEEPS + 1):
            distance, outward = distance_to(here[left], poses, kept + float(farther.max()))
            lack = goal[left] - distance
            chosen = np.flatnonzero(lack > 0.0)
            left, lack = left[chosen], lack[chosen]
            if sweep == SWEEPS or not len(left):
                break
            arm = here[left] + outward[chosen] * lack[:, None] - start[left]
            here[left] = _at_length(start[left], arm, length[left])
        left = left[lack > SLACK * kept]
        if len(left):
            arms = here[left] - start[left], length[left]
            here[left] = _turned_out(start[left], *arms, goal[left], poses)
            distance, _ = distance_to(here[left], poses, kept)
            worst[left] = np.maximum(worst[left], near.wanted[left, point] - distance)
        is_far = _pull_within(here, start, length, near.carried[:, point], near.leashes[:, point])
        worst[is_far] = 2.0 * kept
        led[:, point] = here
    return led, worst


def _pull_within(
    here: Floats, start: Floats, length: Floats, carried: Floats, leashes: Floats
) -> Ints:
    """Bring points (n, 3) within their leash of where their roots carry them, in place, at their
    length [m] from `start`; and those that do not get there, (m,)."""
    held = np.flatnonzero(np.isfinite(leashes))
    for _ in range(SWEEPS):
        away = here[held] - carried[held]
        size = _size(away)
        is_far = size > leashes[held]
        if not is_far.any():
            return held[:0]
        held, away, size = held[is_far], away[is_far], size[is_far]
        arm = carried[held] + away * (LEASHED * leashes[held] / size)[:, None] - start[held]
        here[held] = _at_length(start[held], arm, length[held])
    return held[_size(here[held] - carried[held]) > leashes[held]]


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


def _at_length(start: Floats | float, arm: Floats, length: Floats) -> Floats:
    """The points (n, 3) this far [m] from others, in the direction of `arm`."""
    return start + arm * (length / np.maximum(_size(arm), _TINY))[:, None]


def _size(rows: Floats) -> Floats:
    result: Floats = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    return result
