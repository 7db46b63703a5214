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
from .groom_rotation import fit_rotation
from .trajectory import curvature, value_at

#: Rotation in a frame from which on arcs matter [rad]: below, a chord is off by at most a hundred
#: thousandth of the distance from the axis, and a parabola by less than float32 resolves.
MIN_ARC_ANGLE = math.radians(0.5)
#: Below this squared angle [rad^2] the first terms of series are used.
_SMALL = 1.0e-8


@dataclass(frozen=True)
class RigidMotion:
    """The motion from x to rotation x + shift. rotation: (3, 3) float64. shift: (3,) [m]."""

    rotation: Floats
    shift: Floats

    @property
    def inverse(self) -> RigidMotion:
        return RigidMotion(self.rotation.T, -(self.rotation.T @ self.shift))

    def relative_to(self, other: RigidMotion) -> RigidMotion:
        """The rotation, and the shift of the pivot, from the other place to this one."""
        return RigidMotion(self.rotation @ other.rotation.T, self.shift - other.shift)

    def scaled(self, shift_fraction: float, rotation_fraction: float) -> RigidMotion:
        """The motion with these fractions of its shift and rotation."""
        return RigidMotion(
            rotation_matrix(rotation_vector(self.rotation) * rotation_fraction),
            self.shift * shift_fraction,
        )

    def rotated(self, rotation: Floats) -> RigidMotion:
        """The same motion in a space that is turned by a rotation (3, 3)."""
        return RigidMotion(rotation @ self.rotation @ rotation.T, rotation @ self.shift)


NO_MOTION = RigidMotion(np.eye(3), np.zeros(3))


@dataclass(frozen=True)
class RigidPath:
    """A rigid path within a frame, about a pivot that the owner stores.

    now, earlier: the motion from the frame's begin to its end, and to one frame earlier.
    ratio: duration of the frame before, over that of this one.
    """

    now: RigidMotion
    earlier: RigidMotion | None = None
    ratio: float = 1.0

    @cached_property
    def is_arc(self) -> bool:
        """Whether it turns by more than MIN_ARC_ANGLE."""
        known = self.now if self.earlier is None else self.earlier
        turns = (rotation_vector(each.rotation) for each in (self.now, known))
        return any(math.hypot(*turn) > MIN_ARC_ANGLE for turn in turns)

    def at(self, moment: float) -> RigidMotion:
        """The motion from the frame's begin to a moment, 0 its begin and 1 its end."""
        twist, bent = self._twist
        return motion_of(value_at(np.zeros(6), twist, bent, moment))

    @cached_property
    def _twist(self) -> tuple[Floats, Floats | None]:
        """The twist from begin to end, (6,) float64: w [rad] and v [m]; and its curvature."""
        twist = twist_of(self.now)
        if self.earlier is None:
            return twist, None
        return twist, curvature(twist_of(self.earlier), np.zeros(6), twist, self.ratio)


def rotation_matrix(vector: Floats) -> Floats:
    """The rotation matrix (3, 3) of a rotation vector (3,), about it by its length [rad]."""
    first, second, _ = _series(vector)
    square = float(vector @ vector)
    return _rotation_polynomial(vector, 1.0 - second * square, first, second)


def rotation_vector(rotation: Floats) -> Floats:
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
    vector: Floats = quaternion[1:] * (2.0 * math.atan2(size, float(quaternion[0])) / size)
    return vector


def motion_of(twist: Floats) -> RigidMotion:
    """The rigid motion of a twist (6,)."""
    vector = twist[:3]
    return RigidMotion(rotation_matrix(vector), _mean_rotation(vector) @ twist[3:])


def twist_of(motion: RigidMotion) -> Floats:
    """The twist (6,) of a rigid motion."""
    vector = rotation_vector(motion.rotation)
    return np.concatenate([vector, np.linalg.solve(_mean_rotation(vector), motion.shift)])


def _mean_rotation(vector: Floats) -> Floats:
    """V(w), the mean of the rotations along the path."""
    _, second, third = _series(vector)
    return _rotation_polynomial(vector, 1.0 - third * float(vector @ vector), second, third)


def _series(vector: Floats) -> tuple[float, float, float]:
    """sin a / a, (1 - cos a) / a^2 and (a - sin a) / a^3."""
    square = float(vector @ vector)
    if square < _SMALL:
        return 1.0 - square / 6.0, 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    angle = math.sqrt(square)
    sine = math.sin(angle)
    return (
        sine / angle,
        2.0 * (math.sin(angle / 2.0) / angle) ** 2,
        (angle - sine) / angle**3,
    )


def _rotation_polynomial(vector: Floats, even: float, cross: float, outer: float) -> Floats:
    """even 1 + cross [w] + outer w w^T, where [w]^2 = w w^T - a^2."""
    x, y, z = vector.tolist()
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
            return cls(np.zeros(3), RigidPath(NO_MOTION))
        pivot = before.mean(axis=1)
        since = None if earlier is None else _rigid_motion(before, earlier)
        return cls(pivot, RigidPath(_rigid_motion(before, now), since, ratio))

    def transform(self, motion: RigidMotion, start: RigidMotion = NO_MOTION) -> RigidTransform:
        """The motion of places by `motion`, after the pivot has been moved by `start`."""
        origin = self.pivot + start.shift
        return RigidTransform(motion.rotation, origin, origin + motion.shift)

    def transform_back(self, motion: RigidMotion) -> RigidTransform:
        """The motion of places back to the frame's begin."""
        there = self.pivot + motion.shift
        return RigidTransform(motion.inverse.rotation, there, self.pivot)


def _rigid_motion(before: Floats, now: Floats) -> RigidMotion:
    middle = before.mean(axis=1)
    rotation = fit_rotation(before - middle[:, None], now)
    return RigidMotion(rotation, now.mean(axis=1) - middle)


@dataclass(frozen=True, eq=False)
class LastSubstep:
    """Where something was as a whole at a substep's begin and end, computed on demand.

    path: of its frame. span: begin and end of the substep as fractions of the frame.
    """

    path: RigidPath
    span: tuple[float, float]

    @cached_property
    def places(self) -> tuple[RigidMotion, RigidMotion]:
        """The places at the substep's begin and end, relative to the frame's end."""
        begin, end = (self.path.at(moment).relative_to(self.path.now) for moment in self.span)
        return begin, end


@dataclass(frozen=True, eq=False)
class KnownSubstep:
    """`LastSubstep` with known places."""

    places: tuple[RigidMotion, RigidMotion]


AT_REST = KnownSubstep((NO_MOTION, NO_MOTION))


@dataclass(frozen=True)
class RigidTransform:
    """The motion from x to rotation (x - origin) + there.

    rotation: (3, 3). origin, moved_origin: (3,) world [m].
    """

    rotation: Floats
    origin: Floats
    moved_origin: Floats

    @property
    def texels(self) -> Floats:
        """(4, 4) for the GPU: rows of the rotation and `moved_origin`; last the origin."""
        rows = np.concatenate([self.rotation, self.moved_origin[:, None]], axis=1)
        return np.concatenate([rows, [[*self.origin, 0.0]]])

    def apply(self, rows: Floats) -> Floats:
        """Places (3, ...) [m] moved, in the same dtype; without BLAS, which would wake threads."""
        places = rows.reshape(3, -1)
        beside = places - self.origin.astype(rows.dtype)[:, None]
        result = np.einsum("ij,jn->in", self.rotation.astype(rows.dtype), beside)
        result += self.moved_origin.astype(rows.dtype)[:, None]
        return result.reshape(rows.shape)


@dataclass(frozen=True)
class CarriedPath:
    """The path of places (3, ...) [m] within a frame.

    before, displacement, curvature: see `trajectory.value_at`, relative to the carrier.
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
        """The path through places (3, ...) world [m]; the others as in `trajectory.curvature`."""
        if carrier is not None:
            path = carrier.path
            now = carrier.transform_back(path.now).apply(now)
            if earlier is not None and path.earlier is not None:
                earlier = carrier.transform_back(path.earlier).apply(earlier)
        bent = None if earlier is None else curvature(earlier, before, now, ratio)
        return cls(before, now - before, bent, carrier)

    def at(self, moment: float, place: RigidMotion | None = None) -> Floats:
        """The places at a moment, 0 the frame's begin and 1 its end.

        Args:
            place: of the carrier; None: according to its path.
        """
        seen = value_at(self.before, self.displacement, self.curvature, moment)
        if self.carrier is None:
            return seen
        return self.carrier.transform(place or self.carrier.path.at(moment)).apply(seen)

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
