"""How something goes as a whole within a frame: on the arc of its turn, not on the chord.

A rigid motion has a twist (w, v): it turns about an axis and goes along it, and with a = |w|

    R = exp([w]),   t = V(w) v,   V(w) = 1 + (1 - cos a) / a^2 [w] + (a - sin a) / a^3 [w]^2

(Murray, Li and Sastry 1994, "A Mathematical Introduction to Robotic Manipulation", section 2.3).
Twists follow the parabola of `trajectory` through those of the frame's end and of one frame
earlier, both as seen from the frame's begin. So what turns evenly about any axis goes on its
circle, and what does not turn goes as it does without. What is not rigid is a parabola in places as
the moving thing sees them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Floats, Ints
from .trajectory import at, curvature
from .turn import rotation_from

#: [rad] in a frame from which on arcs matter: below, a chord is off by a hundred thousandth of the
#: distance from the axis at most, and a parabola by less than floats tell.
ARC = math.radians(0.5)
#: Squared angles [rad^2] below this take the first terms of the series.
_SMALL = 1.0e-8


@dataclass(frozen=True)
class Rigid:
    """x goes to rotation x + shift. rotation: (3, 3) float64. shift: (3,) [m]."""

    rotation: Floats
    shift: Floats

    @property
    def inverse(self) -> Rigid:
        return Rigid(self.rotation.T, -(self.rotation.T @ self.shift))

    def since(self, other: Rigid) -> Rigid:
        """From the other place to this one: how it has turned, and how far its pivot has gone."""
        return Rigid(self.rotation @ other.rotation.T, self.shift - other.shift)

    def part(self, shifted: float, turned: float) -> Rigid:
        """That fraction of its shift, and that of its turn."""
        return Rigid(rotation_of(turn_of(self.rotation) * turned), self.shift * shifted)

    def turned(self, turn: Floats) -> Rigid:
        """The same motion as it is where everything has been turned by a rotation (3, 3)."""
        return Rigid(turn @ self.rotation @ turn.T, turn @ self.shift)


STILL = Rigid(np.eye(3), np.zeros(3))


@dataclass(frozen=True)
class RigidPath:
    """Of something that is moved as a whole, about a pivot that its owner knows.

    now, earlier: where it is at the frame's end, and was one frame earlier, as seen from its begin.
    ratio: duration of the frame before, over that of this one.
    """

    now: Rigid
    earlier: Rigid | None = None
    ratio: float = 1.0

    @cached_property
    def is_arc(self) -> bool:
        """Whether it turns by so much that its arc matters."""
        known = self.now if self.earlier is None else self.earlier
        turns = (turn_of(each.rotation) for each in (self.now, known))
        return any(math.hypot(*turn) > ARC for turn in turns)

    def at(self, moment: float) -> Rigid:
        """Where it is at a moment, 0 the frame's begin and 1 its end, as seen from the begin."""
        twist, bent = self._twist
        return motion_of(at(np.zeros(6), twist, bent, moment))

    @cached_property
    def _twist(self) -> tuple[Floats, Floats | None]:
        """(6,) float64 from the begin to the end, w [rad] and v [m], and how it is bent."""
        twist = twist_of(self.now)
        if self.earlier is None:
            return twist, None
        return twist, curvature(twist_of(self.earlier), np.zeros(6), twist, self.ratio)


def rotation_of(turn: Floats) -> Floats:
    """The rotation (3, 3) about an axis by its length [rad], (3,)."""
    first, second, _ = _series(turn)
    square = float(turn @ turn)
    return _spin(turn, 1.0 - second * square, first, second)


def turn_of(rotation: Floats) -> Floats:
    """What `rotation_of` gives a rotation (3, 3) of, (3,) [rad], no longer than pi.

    By the largest of a quaternion's parts, which is exact at any angle (Shepperd 1978).
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
    """V(w), the mean of the rotations on the way."""
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
    """What carries places: its path, about a pivot (3,) float64 world [m], which goes with it.

    Of the motions of its path the shift is that of the pivot.
    """

    pivot: Floats
    path: RigidPath

    @classmethod
    def through(
        cls, before: Floats, now: Floats, earlier: Floats | None = None, ratio: float = 1.0
    ) -> Carrier:
        """By the same places (3, n) float64 [m] at the frame's begin, at its end and earlier."""
        if not before.size:
            return cls(np.zeros(3), RigidPath(STILL))
        pivot = before.mean(axis=1)
        since = None if earlier is None else _between(before, earlier)
        return cls(pivot, RigidPath(_between(before, now), since, ratio))

    def carry(self, motion: Rigid, begun: Rigid = STILL) -> Carry:
        """By a motion, from where it had gone before."""
        origin = self.pivot + begun.shift
        return Carry(motion.rotation, origin, origin + motion.shift)

    def seen(self, motion: Rigid) -> Carry:
        """Back to the frame's begin."""
        there = self.pivot + motion.shift
        return Carry(motion.inverse.rotation, there, self.pivot)


def _between(before: Floats, now: Floats) -> Rigid:
    middle = before.mean(axis=1)
    rotation = rotation_from(before - middle[:, None], now)
    return Rigid(rotation, now.mean(axis=1) - middle)


@dataclass(frozen=True, eq=False)
class LastStep:
    """Where something was as a whole at a substep's begin and end, found once anybody asks.

    path: of its frame. span: begin and end of the substep as fractions of that.
    """

    path: RigidPath
    span: tuple[float, float]

    @cached_property
    def places(self) -> tuple[Rigid, Rigid]:
        """At the begin and at the end, as seen from the frame's end."""
        begin, end = (self.path.at(moment).since(self.path.now) for moment in self.span)
        return begin, end


@dataclass(frozen=True, eq=False)
class KnownStep:
    """The same where it is known."""

    places: tuple[Rigid, Rigid]


#: Of what has not moved.
NOT_MOVED = KnownStep((STILL, STILL))


@dataclass(frozen=True)
class Carry:
    """x goes to rotation (x - origin) + there. rotation: (3, 3). origin, there: (3,) world [m]."""

    rotation: Floats
    origin: Floats
    there: Floats

    @property
    def texels(self) -> Floats:
        """(4, 4): rows of the rotation, each with a coordinate of `there`; the origin."""
        rows = np.concatenate([self.rotation, self.there[:, None]], axis=1)
        return np.concatenate([rows, [[*self.origin, 0.0]]])

    def moved(self, rows: Floats) -> Floats:
        """Places (3, ...) [m]; float32 stays float32. Not by BLAS, which would wake its threads."""
        places = rows.reshape(3, -1)
        beside = places - self.origin.astype(rows.dtype)[:, None]
        result = np.einsum("ij,jn->in", self.rotation.astype(rows.dtype), beside)
        result += self.there.astype(rows.dtype)[:, None]
        return result.reshape(rows.shape)


@dataclass(frozen=True)
class CarriedPath:
    """The way of places (3, ...) [m] within a frame.

    before, displacement, curvature: as `trajectory.at` takes them, as seen from what carries them.
    carrier: None: nothing turns them.
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
        """Where they are at a moment, 0 the frame's begin and 1 its end.

        Args:
            place: of what carries them; None: as its path says.
        """
        seen = at(self.before, self.displacement, self.curvature, moment)
        if self.carrier is None:
            return seen
        return self.carrier.carry(place or self.carrier.path.at(moment)).moved(seen)

    def part(self, chosen: Ints | slice) -> CarriedPath:
        """Of some of the places (3, n)."""
        bent = None if self.curvature is None else self.curvature[:, chosen]
        return CarriedPath(self.before[:, chosen], self.displacement[:, chosen], bent, self.carrier)

    def as_floats(self) -> CarriedPath:
        """In float32."""
        bent = None if self.curvature is None else self.curvature.astype(np.float32)
        before, displacement = (
            rows.astype(np.float32) for rows in (self.before, self.displacement)
        )
        return CarriedPath(before, displacement, bent, self.carrier)
