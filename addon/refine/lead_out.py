"""Strands that ride on guides are led out of colliders; every segment keeps its length.

Guides stay out of colliders, but a strand between two guides that part around a head would go
through it. From root to tip, a point that is too near to a collider moves straight out, then along
its segment until this has its length again, and so on until both hold. If that fails, as behind an
ear, the segment turns, as far as it must, towards the nearest direction that leads out. The rest of
the strand moves along without changing its shape. A point that was in a collider when the motion
began may stay as deep as it was while it is where its root carries it; as it moves away from there,
it must come out by the same distance.

Hair behind an ear may be inside a mesh according to the mesh's distance field, whose cells are
thicker than the ear, although it is outside of the mesh itself. There the field does not show the
way out, so such a strand moves with its root up to its last such point and rides only beyond it. A
strand that nothing leads out is placed as its root carries it.

If a strand rides straight into a collider, all directions out are equally near, and the choice
would change from frame to frame. So it starts from how it was bent in the frame before, see
`Deflections`, and turns back to where it rides within a fraction of a second.

Twin of gpu_shaders/lead_out.comp.glsl.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from ..arrays import (
    Bools,
    Floats,
    Ints,
    number_in_piece,
    piece_starts,
    pieces_of_rows,
    rows_of_pieces,
)
from ..dynamics.colliders import Pose, PosedCollider, signed_distance
from ..dynamics.colliders.signed_distance import (
    are_outside_meshes,
    distance_of_few,
    nearer_than,
    poses_at_end,
)
from ..strands.vectors import even_directions, unit

#: Maximum number of times that a point moves straight out and back to its segment's length.
SWEEPS = 2
#: Lower limit of the squared sine of the angle between a segment and the way out in that move.
MIN_SQUARED_SINE = 0.5
#: How much nearer than it should be a point may come before its strand is led out, as a fraction
#: of `Clearance.max_distance`.
TOLERANCE = 0.05
#: A point that has to move by more than this fraction of its segment is not moved straight out:
#: deep inside of a collider the way out may switch to another side.
MAX_STRAIGHT_MOVE = 0.5
#: Number of directions tried for a segment that moving straight out does not lead out, and how
#: often the turn towards the chosen one is bisected.
DIRECTION_COUNT, BISECTIONS = 64, 5
#: A point deeper than this in a distance field, as a fraction of `Clearance.max_distance`, is
#: tested with the mesh itself.
DEEP = 0.5
#: A strand that is still stuck, as in a fold, is led again from its root, farther out by this
#: fraction of its mean segment; maximum number of attempts.
EXTRA_DISTANCE, ATTEMPTS = 0.5, 3
#: How quickly segments turn back to where they ride once nothing leads them out [rad/s].
RETURN_RATE = 20.0
#: A strand whose segments all lean by no more than this counts as where it rides.
MIN_DEFLECTION = 1.0e-3
#: How many points of a strand are tested at once for the first one that is too near.
_AHEAD = np.arange(5)
_TINY = 1.0e-30

#: Where roots carry points: indices (n,) of points and of their strands (n,) to (n, 3) world [m].
type CarryPoints = Callable[[Ints, Ints], Floats]


@dataclass(frozen=True, eq=False)
class HeldParts:
    """Strands of which a first part moves rigidly with the root.

    strands: (n,) their indices.
    index, owners: (k,) the points of these parts, and the strand that each belongs to.
    every, along: (m,) all points of these strands, and which of the k points each moves with.
    """

    strands: Ints
    index: Ints
    owners: Ints
    every: Ints
    along: Ints

    @classmethod
    def of(cls, held: Ints, offsets: Ints) -> HeldParts:
        """Args:
        held: (strand_count,), see `Clearance`.
        """
        strands = held.nonzero()[0]
        counts, last = np.diff(offsets)[strands], held[strands]
        every = rows_of_pieces(strands, offsets)
        is_held = number_in_piece(counts) <= np.repeat(last, counts)
        along = np.maximum.accumulate(np.where(is_held, np.cumsum(is_held) - 1, 0))
        return cls(strands, every[is_held], np.repeat(strands, last + 1), every, along)


@dataclass(frozen=True, eq=False)
class Clearance:
    """The distance that strands keep from colliders while they are where their roots carry them.

    max_distance: [m], the distance of points that were at least this far away when the motion
        began.
    points: (point_count,) float32 [m], the distance of each point: `max_distance`, or less if it
        was nearer when the motion began; -inf where it moves with its root.
    held: (strand_count,) int32, the last point of each strand that moves with its root, because it
        is inside a distance field but outside the mesh; 0: only the root.
    """

    max_distance: float
    points: Floats
    held: Ints
    _held_parts: HeldParts | None = None

    def holding(self, points: Ints, offsets: Ints) -> Clearance:
        """The same, with strands moving with their roots at least up to these points (n,)."""
        held, owner = self.held.copy(), pieces_of_rows(points, offsets)
        np.maximum.at(held, owner, (points - offsets[owner]).astype(np.int32))
        return Clearance(self.max_distance, _free_up_to(held, self.points, offsets), held)

    def held_parts(self, offsets: Ints) -> HeldParts:
        """The held parts of all strands; computed once, for the first `offsets`."""
        if self._held_parts is None:
            object.__setattr__(self, "_held_parts", HeldParts.of(self.held, offsets))
        assert self._held_parts is not None
        return self._held_parts

    @cached_property
    def reach(self) -> Floats:
        """The distance below which each point may be too near, (point_count,) float32 [m]; -inf
        where it moves with its root."""
        most = np.float32((1.0 - TOLERANCE) * self.max_distance)
        return np.where(self.points == -np.inf, np.float32(-np.inf), most)


@dataclass(frozen=True, eq=False)
class Deflections:
    """How leading out has bent strands in one frame, for the next one.

    strands: (n,) ascending, those that are not where they ride.
    values: (m, 3) float32, for all of their points, strand by strand: the change of the unit
        direction of the segment that ends there, world axes.
    """

    strands: Ints
    values: Floats

    @classmethod
    def from_points(cls, strands: Ints, ridden: Floats, led: Floats, offsets: Ints) -> Deflections:
        """Args:
        strands: (n,). ridden, led: (m, 3) their points where they ride, and where they were led to.
        """
        counts = np.diff(offsets)[strands]
        begins = piece_starts(counts)
        values = _steps(led - ridden, begins)  # over lengths, which are the same in both
        values /= np.maximum(_size(_steps(ridden, begins)), np.float32(_TINY))[:, None]
        return cls(strands, values)._where(_size(values) > MIN_DEFLECTION, counts)

    def decayed(self, duration: float, offsets: Ints) -> Deflections:
        """The deflections that are left after some time [s]."""
        size, turned = _size(self.values), np.float32(RETURN_RATE * duration)
        left = self._where(size > turned, np.diff(offsets)[self.strands])
        size = np.maximum(_size(left.values), np.float32(_TINY))
        scale = np.maximum(np.float32(1.0) - turned / size, np.float32(0.0))
        return Deflections(left.strands, left.values * scale[:, None])

    def _where(self, is_bent: Bools, counts: Ints) -> Deflections:
        """The deflections of strands that have a bent segment.

        Args:
            is_bent: (m,). counts: (n,) point counts of the strands.
        """
        if not len(self.strands):
            return self
        chosen = np.logical_or.reduceat(is_bent, piece_starts(counts))
        return Deflections(self.strands[chosen], self.values[np.repeat(chosen, counts)])

    def apply_to(self, points: Floats, offsets: Ints) -> None:
        """Bend strands, in place; segments keep their lengths. points: (point_count, 3), of all."""
        if not len(self.strands):
            return
        counts, index = np.diff(offsets)[self.strands], rows_of_pieces(self.strands, offsets)
        begins = piece_starts(counts)
        ridden = points[index].astype(np.float64)
        steps = _steps(ridden, begins)
        length = _size(steps)
        change = _at_length(0.0, unit(steps) + self.values, length) - steps
        shift = np.cumsum(change, axis=0)
        shift -= np.repeat(shift[begins], counts, axis=0)
        points[index] = ridden + shift


NO_DEFLECTIONS = Deflections(np.zeros(0, np.int64), np.zeros((0, 3), np.float32))


@dataclass(frozen=True, eq=False)
class LedOut:
    """Strands that were led out of colliders in one frame.

    strands: (n,) int32, ascending.
    points: (m, 3) float32 world [m], all of their points, strand by strand.
    deflections: how they were bent, where that is known.
    """

    strands: Ints
    points: Floats
    deflections: Deflections = NO_DEFLECTIONS

    @classmethod
    def of(
        cls, strands: Ints, points: Floats, offsets: Ints, deflections: Deflections = NO_DEFLECTIONS
    ) -> LedOut:
        """Take these strands from the points of all, (point_count, 3)."""
        return cls(strands.astype(np.int32), points[rows_of_pieces(strands, offsets)], deflections)

    def fits(self, offsets: Ints) -> bool:
        """Whether strands and point counts match these offsets, (strand_count + 1,)."""
        count = len(offsets) - 1
        if len(self.strands) and not 0 <= self.strands.min() <= self.strands.max() < count:
            return False
        return self.points.shape == (int(np.diff(offsets)[self.strands].sum()), 3)

    def put(self, points: Floats, offsets: Ints) -> None:
        """Write into the points of all strands, (point_count, 3), in place."""
        points[rows_of_pieces(self.strands, offsets)] = self.points


NO_LED_OUT = LedOut(np.zeros(0, np.int32), np.zeros((0, 3), np.float32))


def clearance_at(
    points: Floats, offsets: Ints, colliders: Sequence[PosedCollider], max_distance: float
) -> Clearance:
    """The clearance of a motion that begins now.

    Args:
        points: (point_count, 3) world [m], strand by strand, where their roots carry them.
        offsets: (strand_count + 1,), strand s is points[offsets[s]:offsets[s + 1]].
        colliders: used in their poses at the frame's end.
        max_distance: [m].
    """
    distance, _ = signed_distance(points, colliders, max_distance)
    distance[offsets[:-1]] = np.inf
    none = Clearance(max_distance, distance, np.zeros(len(offsets) - 1, np.int32))
    return none.holding(points_outside_meshes(points, distance, colliders, max_distance), offsets)


def _free_up_to(held: Ints, distance: Floats, offsets: Ints) -> Floats:
    """The distances (point_count,), but -inf for each strand's points up to `held`."""
    counts = np.diff(offsets)
    is_held = number_in_piece(counts) <= np.repeat(held, counts)
    return np.where(is_held, np.float32(-np.inf), distance)


def points_outside_meshes(
    points: Floats, distance: Floats, colliders: Sequence[PosedCollider], max_distance: float
) -> Ints:
    """Which points (n, 3), at these distances (n,), lie deep inside a distance field but outside
    its mesh, (m,)."""
    deep = (distance < -DEEP * max_distance).nonzero()[0]
    chosen: Ints = deep[are_outside_meshes(points[deep], colliders)]
    return chosen


def lead_out(
    points: Floats,
    carry: CarryPoints,
    offsets: Ints,
    colliders: Sequence[PosedCollider],
    clearance: Clearance,
    deflections: Deflections = NO_DEFLECTIONS,
) -> tuple[Ints, Deflections]:
    """Lead strands out of colliders, in place.

    Args:
        points: (point_count, 3) world [m], where strands ride.
        carry: where roots carry points.
        offsets, colliders: see `clearance_at`.
        deflections: those of the frame before, after `Deflections.decayed`.

    Returns:
        The strands (n,) that are not where they ride, ascending; and how strands are bent.
    """
    poses, max_distance = poses_at_end(colliders), clearance.max_distance
    held = _hold(points, carry, offsets, clearance)
    leaning = rows_of_pieces(deflections.strands, offsets)
    upright = points[leaning]
    deflections.apply_to(points, offsets)
    index, distance, outward = nearer_than(points, poses, clearance.reach)
    owner = pieces_of_rows(index, offsets)
    away = _size(points.take(index, axis=0) - carry(index, owner))
    wanted = np.minimum(clearance.points.take(index) + away, np.float32(max_distance))
    is_near = distance < wanted - np.float32(TOLERANCE * max_distance)
    strands, first = np.unique(owner[is_near], return_index=True)
    bent = np.union1d(deflections.strands, strands)
    every = rows_of_pieces(bent, offsets)
    ridden = points.take(every, axis=0)
    ridden[np.searchsorted(every, leaning)] = upright
    if len(strands):
        first = is_near.nonzero()[0][first]
        found = index[first], distance[first], outward.T[first]
        near = _Near.of(strands, found, points, carry, offsets, clearance)
        points[near.index], is_lost = _led(near, max_distance, poses)
        lost = np.searchsorted(every, near.index[is_lost])
        ridden[lost] = points[every[lost]]  # so that they have no lean
    return np.union1d(held, bent), Deflections.from_points(
        bent, ridden, points.take(every, axis=0), offsets
    )


def _hold(points: Floats, carry: CarryPoints, offsets: Ints, clearance: Clearance) -> Ints:
    """Move the held parts of strands with their roots, in place, and translate the rest of these
    strands along; returns the strands (n,)."""
    held = clearance.held_parts(offsets)
    shift = carry(held.index, held.owners) - points.take(held.index, axis=0)
    points[held.every] += shift.take(held.along, axis=0)
    return held.strands


def _steps(points: Floats, begins: Ints) -> Floats:
    """The vector from the previous point to each, (n, 3); 0 where strands begin."""
    steps = np.diff(points, axis=0, prepend=points[:1])
    steps[begins] = 0.0
    return steps


@cache
def tried_directions() -> Floats:
    """The directions that are tried, unit vectors (DIRECTION_COUNT, 3)."""
    return even_directions(DIRECTION_COUNT)


@dataclass(frozen=True, eq=False)
class _Near:
    """Strands that are too near, and all of their points, strand by strand.

    begins, ends: (n,) where each strand begins and ends among the m points.
    firsts: (n,) the first point of each, among the m, that is too near.
    found: its distance (n,) [m] and way out (n, 3); None if these still have to be queried.
    index: (m,) the points' indices among all.
    points, carried: (m, 3) where they ride, and where their roots carry them.
    wanted: (m,) [m], the distance from colliders that each should have.
    """

    begins: Ints
    ends: Ints
    firsts: Ints
    found: tuple[Floats, Floats] | None
    index: Ints
    points: Floats
    carried: Floats
    wanted: Floats

    @classmethod
    def of(
        cls,
        strands: Ints,
        found: tuple[Ints, Floats, Floats],
        points: Floats,
        carry: CarryPoints,
        offsets: Ints,
        clearance: Clearance,
    ) -> _Near:
        """Take these strands from the points of all, (point_count, 3).

        Args:
            found: the first point of each that is too near, its distance and its way out.
        """
        counts = np.diff(offsets)[strands]
        ends, index = np.cumsum(counts), rows_of_pieces(strands, offsets)
        some, carried = points.take(index, axis=0), carry(index, np.repeat(strands, counts))
        wanted = clearance.points.take(index) + _size(some - carried)
        return cls(
            ends - counts,
            ends,
            found[0] - offsets[strands] + ends - counts,
            found[1:],
            index,
            some.astype(np.float64),
            carried.astype(np.float64),
            np.minimum(wanted, np.float32(clearance.max_distance)),
        )

    def part(self, chosen: Ints) -> _Near:
        """Some of the strands, to be led from their roots on."""
        offsets = np.append(self.begins, self.ends[-1:])
        index, counts = rows_of_pieces(chosen, offsets), np.diff(offsets)[chosen]
        ends = np.cumsum(counts)
        begins = ends - counts
        return _Near(
            begins,
            ends,
            begins + 1,
            None,
            self.index[index],
            self.points[index],
            self.carried[index],
            self.wanted[index],
        )

    @property
    def mean_segments(self) -> Floats:
        """The mean segment length of each strand, (n,) [m]."""
        length = _size(_steps(self.points, self.begins))
        return np.add.reduceat(length, self.begins) / (self.ends - self.begins - 1)


def _led(near: _Near, max_distance: float, poses: Sequence[Pose]) -> tuple[Floats, Bools]:
    """Where the points are led to, (m, 3), and which belong to strands that nothing leads out,
    (m,)."""
    count = len(near.begins)
    led, shortfall = _led_by(
        near, np.zeros(count), np.full(count, TOLERANCE * max_distance), max_distance, poses
    )
    stuck = np.flatnonzero(shortfall > TOLERANCE * max_distance)
    if len(stuck):
        # all further attempts at once: use the first that succeeds, or the last
        tries = np.tile(stuck, ATTEMPTS - 1)
        number = np.repeat(np.arange(1, ATTEMPTS), len(stuck))
        again = near.part(tries)
        farther = EXTRA_DISTANCE * number * again.mean_segments
        max_shortfall = np.where(number == ATTEMPTS - 1, max_distance, TOLERANCE * max_distance)
        found, left_over = _led_by(again, farther, max_shortfall, max_distance, poses)
        is_out = (left_over <= TOLERANCE * max_distance).reshape(ATTEMPTS - 1, -1)
        is_out[-1] = True
        chosen = is_out.argmax(axis=0) * len(stuck) + np.arange(len(stuck))
        shortfall[stuck] = left_over[chosen]
        from_ = rows_of_pieces(chosen, np.append(again.begins, again.ends[-1:]))
        led[rows_of_pieces(stuck, np.append(near.begins, near.ends[-1:]))] = found[from_]
    is_lost = np.repeat(shortfall > max_distance, near.ends - near.begins)
    return np.where(is_lost[:, None], near.carried, led), is_lost


def _led_by(
    near: _Near, farther: Floats, max_shortfall: Floats, max_distance: float, poses: Sequence[Pose]
) -> tuple[Floats, Floats]:
    """One attempt: where the points are led to, (m, 3), and the largest remaining shortfall
    of each strand, (n,) [m].

    Args:
        farther: (n,) [m] beyond the wanted distance that strands are led out.
        max_shortfall: (n,) [m], a strand with a larger one is led no further.
    """
    walk = _Walk.of(near, farther, TOLERANCE * max_distance, poses)
    every = np.arange(len(farther))
    waiting: Ints = every[:0]
    if near.found is not None:
        waiting = walk.push(every, walk.goal[near.firsts] - near.found[0], near.found[1])
    going = walk.underway(every, max_shortfall)
    while len(going) + len(waiting):
        if len(waiting) > len(going):  # turns are expensive: many strands at once
            walk.turn(waiting)
            going, waiting = np.append(going, walk.underway(waiting, max_shortfall)), waiting[:0]
        else:
            stuck = walk.step(going)
            going, waiting = walk.underway(going, max_shortfall), np.append(waiting, stuck)
    return walk.led(), walk.worst


@dataclass(frozen=True, eq=False)
class _Walk:
    """Strands being led out from root to tip, each at its own point and sweep; changed in place.

    goal: (m,) [m], the distance that each point of `near` should have; `tolerance` [m] less will
        do.
    lengths: (m,) [m], of the segments that end at the points.
    at: (n,) each strand's current point, among the m.
    sweep: (n,) how often it has moved straight out; 0: perhaps it need not.
    is_waiting: (n,) whether the strand waits for its segment to be turned.
    shift: (n, 3) displacement of the last point that was led, and of the points after it until the
        next one that is. own_shift: (n, 3) displacement of the current point.
    shifts, is_led: (m, 3) and (m,), displacement of the points that were led, and which these are.
    farther: see `_led_by`. worst: (n,) [m], the largest shortfall so far.
    """

    near: _Near
    goal: Floats
    lengths: Floats
    tolerance: float
    poses: Sequence[Pose]
    at: Ints
    sweep: Ints
    is_waiting: Bools
    shift: Floats
    own_shift: Floats
    shifts: Floats
    is_led: Bools
    farther: Floats
    worst: Floats

    @classmethod
    def of(cls, near: _Near, farther: Floats, tolerance: float, poses: Sequence[Pose]) -> _Walk:
        count, points = len(farther), near.points
        is_led = np.zeros(len(points), bool)
        is_led[near.begins] = True
        return cls(
            near,
            near.wanted + np.repeat(farther, near.ends - near.begins),
            _size(_steps(points, near.begins)),
            tolerance,
            poses,
            near.firsts.copy(),
            np.zeros(count, np.int64),
            np.zeros(count, bool),
            np.zeros((count, 3)),
            np.zeros((count, 3)),
            np.zeros_like(points),
            is_led,
            farther,
            np.zeros(count),
        )

    def underway(self, some: Ints, max_shortfall: Floats) -> Ints:
        """Those of some strands that are neither finished, nor given up, nor waiting."""
        is_going = self.at[some] < self.near.ends[some]
        is_going &= (self.worst[some] <= max_shortfall[some]) & ~self.is_waiting[some]
        return some[is_going]

    def step(self, going: Ints) -> Ints:
        """Advance some strands with one distance query for all of them.

        It covers each strand's current point and the next ones, as if the current one were out.
        Returns the strands (k,) whose segments have to turn.
        """
        index = self.at.take(going)[:, None] + _AHEAD
        np.minimum(index, self.near.ends.take(going)[:, None] - 1, out=index)
        places = self.near.points.take(index, axis=0)
        places += self.own_shift.take(going, axis=0)[:, None]
        distance, outward = distance_of_few(places.reshape(-1, 3), self.poses)
        shortfall = self.goal.take(index).ravel()
        shortfall -= distance
        is_in = (shortfall > self.tolerance).reshape(index.shape)
        first = is_in.argmax(axis=1)  # 0 where none is
        found = np.arange(0, index.size, len(_AHEAD)) + first
        is_found = is_in.take(found)
        first[~is_found] = len(_AHEAD)
        self._go_on(going, first)
        found = found.compress(is_found)
        return self.push(
            going.compress(is_found), shortfall.take(found), outward.take(found, axis=0)
        )

    def push(self, some: Ints, shortfall: Floats, outward: Floats) -> Ints:
        """Move the current points of some strands straight out, by their shortfalls (k,) [m] along
        their ways out (k, 3).

        Returns the strands that this would not lead out; these wait for a turn.
        """
        is_tried = self.sweep.take(some) == SWEEPS
        is_tried |= shortfall > MAX_STRAIGHT_MOVE * self.lengths.take(self.at.take(some))
        is_going = ~is_tried
        self._go_out(
            some.compress(is_going),
            shortfall.compress(is_going),
            outward.compress(is_going, axis=0),
        )
        stuck: Ints = some.compress(is_tried)
        self.is_waiting[stuck] = True
        return stuck

    def turn(self, some: Ints) -> None:
        """Turn the current segments of some strands until their ends are out, and go on."""
        point = self.at[some]
        start, arm, length = self._arms(some, point)
        end, shortfall = _turned_out(
            start,
            arm,
            length,
            unit(self.near.carried[point] - self.near.carried[point - 1]),
            self.goal[point],
            self.poses,
        )
        self.own_shift[some] = end - self.near.points[point]
        self.sweep[some] = SWEEPS
        self.worst[some] = np.maximum(self.worst[some], shortfall - self.farther[some])
        self.is_waiting[some] = False
        self._go_on(some, np.ones_like(some))

    def led(self) -> Floats:
        """Where all points are led to, (m, 3)."""
        last = np.maximum.accumulate(np.where(self.is_led, np.arange(len(self.is_led)), 0))
        return self.near.points + self.shifts[last]

    def _arms(self, some: Ints, point: Ints) -> tuple[Floats, Floats, Floats]:
        """The segments that end at some strands' points: their starts, the vectors from there to
        where the points are now, (k, 3) each, and the lengths to keep, (k,) [m]."""
        start = self.near.points.take(point - 1, axis=0)
        start += self.shift.take(some, axis=0)
        arm = self.near.points.take(point, axis=0)
        arm += self.own_shift.take(some, axis=0)
        arm -= start
        return start, arm, self.lengths.take(point)

    def _go_out(self, some: Ints, shortfall: Floats, outward: Floats) -> None:
        """Move some strands straight out by their shortfalls (k,) [m], and back to the segment
        length."""
        point = self.at.take(some)
        start, arm, length = self._arms(some, point)
        arm += outward * _going_out(arm, outward, length, shortfall)[:, None]
        here = _at_length(start, arm, length)
        here -= self.near.points.take(point, axis=0)
        self.own_shift[some] = here
        self.sweep[some] += 1

    def _go_on(self, some: Ints, count: Ints) -> None:
        """Advance some strands by `count` points each (k,), and record where their current points
        were led to."""
        is_out = count > 0
        is_led = is_out & (self.sweep.take(some) > 0)
        led = some.compress(is_led)
        point, shift = self.at.take(led), self.own_shift.take(led, axis=0)
        self.shift[led] = self.shifts[point] = shift
        self.is_led[point] = True
        self.at[some] += count
        self.sweep[some.compress(is_out)] = 0


def _going_out(arm: Floats, outward: Floats, length: Floats, shortfall: Floats) -> Floats:
    """How far [m] the ends of segments (n, 3) move straight out, so that `shortfall` [m] remains of
    it once the segments are back at their lengths, which removes the component along them."""
    along = np.einsum("ij,ij->i", arm, outward) / np.maximum(length, _TINY)
    return shortfall / np.maximum(1.0 - along * along, MIN_SQUARED_SINE)


def _turned_out(
    start: Floats,
    arm: Floats,
    length: Floats,
    toward: Floats,
    wanted: Floats,
    poses: Sequence[Pose],
) -> tuple[Floats, Floats]:
    """The ends (n, 3) of segments turned until they are out, and the remaining shortfall of each
    from `wanted`, (n,) [m].

    Args:
        toward: (n, 3) unit directions in which roots carry the segments, tried as well since they
            do not jump from frame to frame.
    """
    rows = np.arange(len(arm))
    tried = np.concatenate([toward[None], np.repeat(tried_directions()[:, None], len(arm), axis=1)])
    distance, _ = distance_of_few((start + length[:, None] * tried).reshape(-1, 3), poses)
    shortfall = np.maximum(wanted - distance.reshape(len(tried), -1), 0.0)
    arm = arm / np.maximum(length, _TINY)[:, None]
    # the nearest direction that leads out; if none does, the one with the smallest shortfall
    found = np.where(shortfall > 0.0, -2.0 - shortfall, np.einsum("tni,ni->tn", tried, arm)).argmax(
        axis=0
    )
    # query all turns that the bisection might reach at once, then find the smallest that leads out
    parts = np.arange(1, (1 << BISECTIONS) + 1)[:, None, None] / (1 << BISECTIONS)
    arms = arm + parts * (tried[found, rows] - arm)
    ends = start + arms * (length / np.maximum(_size(arms), _TINY))[..., None]
    is_near = distance_of_few(ends[:-1].reshape(-1, 3), poses)[0].reshape(-1, len(arm)) < wanted
    low, high = np.zeros(len(arm), np.int64), np.full(len(arm), 1 << BISECTIONS)
    for _ in range(BISECTIONS):
        middle = (low + high) // 2
        is_in = is_near[middle - 1, rows]
        low, high = np.where(is_in, middle, low), np.where(is_in, high, middle)
    shortfall = np.where(high < 1 << BISECTIONS, 0.0, shortfall[found, rows])
    return ends[high - 1, rows], shortfall


def _at_length(start: Floats | float, arm: Floats, length: Floats) -> Floats:
    """The points (n, 3) at this distance [m] from `start`, in the direction of `arm`."""
    return start + arm * (length / np.maximum(_size(arm), _TINY))[:, None]


def _size(vectors: Floats) -> Floats:
    """The lengths of vectors (..., 3)."""
    result: Floats = np.sqrt(np.einsum("...j,...j->...", vectors, vectors))
    return result
