"""Rigid motion within a frame: along the arc of its rotation, not along the chord.

A rigid motion is a screw with twist (w, v), a rotation about an axis and a shift along it. With
a = |w|

    R = exp([w]),   t = V(w) v,   V(w) = 1 + (1 - cos a) / a^2 [w] + (a - sin a) / a^3 [w]^2

(Murray, Li and Sastry 1994, "A Mathematical Introduction to Robotic Manipulation", section 2.3).
Twists follow the parabola of `trajectory` through the twists at the frame's end and one frame
earlier, both relative to the frame's begin. So a uniform rotation about any axis follows its
circle, and motion without rotation is the same as without twists. Motion that is not rigid follows
a parabola in the moving frame of reference.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Floats, Ints
from .trajectory import at, curvature
from .turn import rotation_from

#: Rotation in a frame from which on arcs matter [rad]: below, a chord is off by at most a hundred
#: thousandth of the distance from the axis, and a parabola by less than float32 resolves.
ARC = math.radians(0.5)
#: Below this squared angle [rad^2] the first terms of series are used.
_SMALL = 1.0e-8


@dataclass(frozen=True)
class Rigid:
    """The motion from x to rotation x + shift. rotation: (3, 3) float64. shift: (3,) [m]."""

    rotation: Floats
    shift: Floats

    @property
    def inverse(self) -> Rigid:
        return Rigid(self.rotation.T, -(self.rotation.T @ self.shift))

    def since(self, other: Rigid) -> Rigid:
        """The rotation, and the shift of the pivot, from the other place to this one."""
        return Rigid(self.rotation @ other.rotation.T, self.shift - other.shift)

    def part(self, shifted: float, turned: float) -> Rigid:
        """The motion with these fractions of its shift and rotation."""
        return Rigid(rotation_of(turn_of(self.rotation) * turned), self.shift * shifted)

    def turned(self, turn: Floats) -> Rigid:
        """The same motion in a space that is turned by a rotation (3, 3)."""
        return Rigid(turn @ self.rotation @ turn.T, turn @ self.shift)


STILL = Rigid(np.eye(3), np.zeros(3))


@dataclass(frozen=True)
class RigidPath:
    """A rigid path within a frame, about a pivot that the owner stores.

    now, earlier: the motion from the frame's begin to its end, and to one frame earlier.
    ratio: duration of the frame before, over that of this one.
    """

    now: Rigid
    earlier: Rigid | None = None
    ratio: float = 1.0

    @cached_property
    def is_arc(self) -> bool:
        """Whether it turns by more than ARC."""
        known = self.now if self.earlier is None else self.earlier
        turns = (turn_of(each.rotation) for each in (self.now, known))
        return any(math.hypot(*turn) > ARC for turn in turns)

    def at(self, moment: float) -> Rigid:
        """The motion from the frame's begin to a moment, 0 its begin and 1 its end."""
        twist, bent = self._twist
        return motion_of(at(np.zeros(6), twist, bent, moment))

    @cached_property
    def _twist(self) -> tuple[Floats, Floats | None]:
        """The twist from begin to end, (6,) float64: w [rad] and v [m]; and its curvature."""
        twist = twist_of(self.now)
        if self.earlier is None:
            return twist, None
        return twist, curvature(twist_of(self.earlier), np.zeros(6), twist, self.ratio)


def rotation_of(turn: Floats) -> Floats:
    """The rotation matrix (3, 3) of a rotation vector (3,), about it by its length [rad]."""
    first, second, _ = _series(turn)
    square = float(turn @ turn)
    return _spin(turn, 1.0 - second * square, first, second)


def turn_of(rotation: Floats) -> Floats:
    """The rotation vector (3,) [rad] of a rotation matrix (3, 3), no longer than pi.

    Computed from the largest component of the quaternion, which is accurate at any angle (Shepperd
    1978).
    """
    m = np.asarray(rotation, np.float64)
    squares = np.array([1.0 + np.trace(m), *(1.0 + 2.0 * m[i, i] - np.trace(m) for i in range(3))])
    largest = int(squares.argmax())
    twice = m - m.T
    around = np.array([twice[2, 1], twice[0, 2], twice[1, 0]])
    if largest == 0:
        quaternion = np.array([squares[0], *around])
    else:
        i = largest - 1
        quaternion = np.array([around[i], *(m[i] + m[:, i])])
        quaternion[largest] = squares[largest]
    if quaternion[0] < 0.0:
        quaternion = -quaternion
    size = float(np.linalg.norm(quaternion[1:]))
    if not size:
        return np.zeros(3)
    turn: Floats = quaternion[1:] * (2.0 * math.atan2(size, float(quaternion[0])) / size)
    return turn


def motion_of(twist: Floats) -> Rigid:
    """The rigid motion of a twist (6,)."""
    turn = twist[:3]
    return Rigid(rotation_of(turn), _mean_turn(turn) @ twist[3:])


def twist_of(motion: Rigid) -> Floats:
    """The twist (6,) of a rigid motion."""
    turn = turn_of(motion.rotation)
    return np.concatenate([turn, np.linalg.solve(_mean_turn(turn), motion.shift)])


def _mean_turn(turn: Floats) -> Floats:
    """V(w), the mean of the rotations along the path."""
    _, second, third = _series(turn)
    return _spin(turn, 1.0 - third * float(turn @ turn), second, third)


def _series(turn: Floats) -> tuple[float, float, float]:
    """sin a / a, (1 - cos a) / a^2 and (a - sin a) / a^3."""
    square = float(turn @ turn)
    if square < _SMALL:
        return 1.0 - square / 6.0, 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    angle = math.sqrt(square)
    sine = math.sin(angle)
    return (
        sine / angle,
        2.0 * (math.sin(angle / 2.0) / angle) ** 2,
        (angle - sine) / angle**3,
    )


def _spin(turn: Floats, even: float, cross: float, outer: float) -> Floats:
    """even 1 + cross [w] + outer w w^T, where [w]^2 = w w^T - a^2."""
    x, y, z = turn.tolist()
    a, b, c = cross * x, cross * y, cross * z
    p, q, r = outer * x, outer * y, outer * z
    return np.array(
        [
            [even + p * x, p * y - c, p * z + b],
            [q * x + c, even + q * y, q * z - a],
            [r * x - b, r * y + a, even + r * z],
        ]
    )


@dataclass(frozen=True)
class Carrier:
    """A moving frame that carries places.

    pivot: (3,) float64 world [m], at the frame's begin. path: shifts are those of the pivot.
    """

    pivot: Floats
    path: RigidPath

    @classmethod
    def through(
        cls, before: Floats, now: Floats, earlier: Floats | None = None, ratio: float = 1.0
    ) -> Carrier:
        """The best fit to places (3, n) float64 [m] at the frame's begin, its end and earlier."""
        if not before.size:
            return cls(np.zeros(3), RigidPath(STILL))
        pivot = before.mean(axis=1)
        since = None if earlier is None else _between(before, earlier)
        return cls(pivot, RigidPath(_between(before, now), since, ratio))

    def carry(self, motion: Rigid, begun: Rigid = STILL) -> Carry:
        """The motion of places by `motion`, after the pivot has been moved by `begun`."""
        origin = self.pivot + begun.shift
        return Carry(motion.rotation, origin, origin + motion.shift)

    def seen(self, motion: Rigid) -> Carry:
        """The motion of places back to the frame's begin."""
        there = self.pivot + motion.shift
        return Carry(motion.inverse.rotation, there, self.pivot)


def _between(before: Floats, now: Floats) -> Rigid:
    middle = before.mean(axis=1)
    rotation = rotation_from(before - middle[:, None], now)
    return Rigid(rotation, now.mean(axis=1) - middle)


@dataclass(frozen=True, eq=False)
class LastStep:
    """Where something was as a whole at a substep's begin and end, computed on demand.

    path: of its frame. span: begin and end of the substep as fractions of the frame.
    """

    path: RigidPath
    span: tuple[float, float]

    @cached_property
    def places(self) -> tuple[Rigid, Rigid]:
        """The places at the substep's begin and end, relative to the frame's end."""
        begin, end = (self.path.at(moment).since(self.path.now) for moment in self.span)
        return begin, end


@dataclass(frozen=True, eq=False)
class KnownStep:
    """`LastStep` with known places."""

    places: tuple[Rigid, Rigid]


NOT_MOVED = KnownStep((STILL, STILL))


@dataclass(frozen=True)
class Carry:
    """The motion from x to rotation (x - origin) + there.

    rotation: (3, 3). origin, there: (3,) world [m].
    """

    rotation: Floats
    origin: Floats
    there: Floats

    @property
    def texels(self) -> Floats:
        """(4, 4) for the GPU: rows of the rotation and `there`; last the origin."""
        rows = np.concatenate([self.rotation, self.there[:, None]], axis=1)
        return np.concatenate([rows, [[*self.origin, 0.0]]])

    def moved(self, rows: Floats) -> Floats:
        """Places (3, ...) [m] moved, in the same dtype; without BLAS, which would wake threads."""
        places = rows.reshape(3, -1)
        beside = places - self.origin.astype(rows.dtype)[:, None]
        result = np.einsum("ij,jn->in", self.rotation.astype(rows.dtype), beside)
        result += self.there.astype(rows.dtype)[:, None]
        return result.reshape(rows.shape)


@dataclass(frozen=True)
class CarriedPath:
    """The path of places (3, ...) [m] within a frame.

    before, displacement, curvature: see `trajectory.at`, relative to the carrier.
    carrier: the moving frame; None: the world.
    """

    before: Floats
    displacement: Floats
    curvature: Floats | None
    carrier: Carrier | None

    @classmethod
    def through(
        cls,
        before: Floats,
        now: Floats,
        earlier: Floats | None,
        ratio: float,
        carrier: Carrier | None,
    ) -> CarriedPath:
        if carrier is not None:
            path = carrier.path
            now = carrier.seen(path.now).moved(now)
            if earlier is not None and path.earlier is not None:
                earlier = carrier.seen(path.earlier).moved(earlier)
        bent = None if earlier is None else curvature(earlier, before, now, ratio)
        return cls(before, now - before, bent, carrier)

    def at(self, moment: float, place: Rigid | None = None) -> Floats:
        """The places at a moment, 0 the frame's begin and 1 its end.

        Args:
            place: of the carrier; None: according to its path.
        """
        seen = at(self.before, self.displacement, self.curvature, moment)
        if self.carrier is None:
            return seen
        return self.carrier.carry(place or self.carrier.path.at(moment)).moved(seen)

    def part(self, chosen: Ints | slice) -> CarriedPath:
        """The path of some of the places (3, n)."""
        bent = None if self.curvature is None else self.curvature[:, chosen]
        return CarriedPath(self.before[:, chosen], self.displacement[:, chosen], bent, self.carrier)

    def as_floats(self) -> CarriedPath:
        """The same in float32."""
        bent = None if self.curvature is None else self.curvature.astype(np.float32)
        before, displacement = (
            rows.astype(np.float32) for rows in (self.before, self.displacement)
        )
        return CarriedPath(before, displacement, bent, self.carrier)
