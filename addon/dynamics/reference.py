"""The same step, one guide and one CV after the other in float64: slow, to be read and compared.

Nothing is shared with the fast form but settings, state, drive, colliders and the groom's mean
rotation. Frames are rotation matrices here, and each linear system is written out and solved
densely, so the banded solves are checked as well.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..arrays import Floats
from .colliders import PosedCollider
from .constraints import CONTACT_WEIGHT, PINNED
from .contacts import REACH, SKIN
from .forces import best_rotation
from .settings import DynamicsSettings
from .state import DynamicsState
from .step import Drive
from .style import GENTLE, SHARP


def advance_slowly(
    state: DynamicsState, drive: Drive, settings: DynamicsSettings, duration: float
) -> DynamicsState:
    """What `step.advance` does; see there."""
    dt = 1.0 / settings.substep_rate
    duration = min(duration, settings.longest_frame)
    time = state.time_left + duration
    count = math.floor(time / dt + 1.0e-6) if duration else 0
    guides = [_Guide(state, drive, g, settings) for g in range(state.guide_count)]
    for number in range(count):
        begin = (number * dt - state.time_left) / duration
        ratio = dt / state.substep if state.substep and number == 0 else 1.0
        for guide in guides:
            guide.substep(drive, settings, dt, duration, begin, ratio)
    if not guides:
        return state
    rows = [np.stack([g.x for g in guides]), np.stack([g.previous for g in guides])]
    position, previous = (grid.transpose(2, 1, 0).astype(np.float32) for grid in rows)
    left = max(time - count * dt, 0.0)
    return DynamicsState(position, previous, state.rest, dt if count else state.substep, left)


@dataclass
class _Plane:
    """One contact: CV `cv` shall keep normal . x >= offset; see `contacts.Contacts`."""

    cv: int
    normal: Floats
    offset: float
    origin: Floats
    is_out: bool
    push: float = 0.0


class _Guide:
    """One guide, x and previous (cv_count, 3) float64 world [m]."""

    def __init__(
        self, state: DynamicsState, drive: Drive, guide: int, settings: DynamicsSettings
    ) -> None:
        def points(rows: Floats) -> Floats:
            return rows[:, :, guide].T.astype(np.float64)

        self.x, self.previous = points(state.position), points(state.previous)
        self.rest = points(state.rest.position)
        self.twist_cv = int(state.rest.shape.twist_cv[guide])
        self.length = [float(np.linalg.norm(b - a)) for a, b in pairwise(self.rest)]
        self.before = drive.target_before[guide].astype(np.float64)
        self.now = drive.target_now[guide].astype(np.float64)
        middle = (drive.target_before + drive.target_now).transpose(2, 1, 0) / 2.0
        self.gravity = self._felt_gravity(
            drive, settings, best_rotation(state.rest.position, middle)
        )

    def substep(
        self,
        drive: Drive,
        settings: DynamicsSettings,
        dt: float,
        duration: float,
        begin: float,
        ratio: float,
    ) -> None:
        end = begin + dt / duration
        style = self.before + (self.now - self.before) * end
        self._predict(settings, dt, duration, ratio)
        self.x[:PINNED] = style[:PINNED]
        self._restore_style(style, settings, dt)
        self._newton_step({})
        planes = [
            plane
            for posed in drive.colliders
            for plane in self._contacts(posed, begin, end, settings, dt)
        ]
        normals: dict[int, Floats] = {}
        for _ in range(settings.contact_passes if planes else 0):
            normals = self._push_out(planes, settings.friction)
            self._newton_step(normals)
        self._finish_lengths(normals, settings)
        for plane in planes:
            self._absorb(plane)

    def _predict(
        self, settings: DynamicsSettings, dt: float, duration: float, ratio: float
    ) -> None:
        both = settings.damping + settings.style_damping
        kept = math.exp(-both * dt)
        share = settings.style_damping / both if both else 0.0
        for cv in range(len(self.x)):
            style_speed = (self.now[cv] - self.before[cv]) / duration
            moved = (self.x[cv] - self.previous[cv]) * ratio * kept
            moved = moved + style_speed * dt * share * (1.0 - kept) + self.gravity[cv] * dt**2
            self.previous[cv], self.x[cv] = self.x[cv].copy(), self.x[cv] + moved

    def _felt_gravity(self, drive: Drive, settings: DynamicsSettings, turn: Floats) -> Floats:
        pull = np.asarray(drive.gravity, np.float64) * settings.gravity
        felt = np.tile(pull, (len(self.x), 1))
        free = len(self.x) - PINNED
        if free < 1:
            return felt
        # the part of the combed weight across all length constraints, by projection
        combed = np.tile(turn @ pull, free)
        jacobian = _jacobian((self.before + self.now) / 2.0)
        tension = np.linalg.solve(jacobian @ jacobian.T, jacobian @ combed)
        felt[PINNED:] -= settings.weight_held * (combed - jacobian.T @ tension).reshape(free, 3)
        return felt

    def _restore_style(self, style: Floats, settings: DynamicsSettings, dt: float) -> None:
        count = len(self.x)
        free = count - PINNED
        if free < 1:
            return
        bend = 2.0 * math.pi * settings.bend * (count - 1) ** 2 / 3.5160
        turns = _frames(self.x, style, self.twist_cv)
        rest_turns = _frames(self.rest, self.rest, self.twist_cv)
        matrix, right = np.eye(free), self.x[PINNED:].copy()
        for cv in range(PINNED, count):
            along = cv / (count - 1)
            swings = settings.style_root * (1.0 - along) + settings.style_tip * along
            pull = (2.0 * math.pi * swings * dt) ** 2
            matrix[cv - PINNED, cv - PINNED] += pull
            right[cv - PINNED] += pull * style[cv]
        for i in range(1, count - 1):
            rest_second = self.rest[i + 1] - 2.0 * self.rest[i] + self.rest[i - 1]
            style_second = style[i + 1] - 2.0 * style[i] + style[i - 1]
            hold = _hold(rest_second, (self.length[i] + self.length[i - 1]) / 2.0)
            wanted = hold * (turns[i - 1] @ rest_turns[i - 1].T @ rest_second)
            wanted = wanted + (1.0 - hold) * style_second
            weights = {i - 1: 1.0, i: -2.0, i + 1: 1.0}
            for one, weight in weights.items():
                if one < PINNED:
                    wanted = wanted - weight * self.x[one]
            inner = {one - PINNED: w for one, w in weights.items() if one >= PINNED}
            for one, weight in inner.items():
                right[one] += (bend * dt) ** 2 * weight * wanted
                for other, other_weight in inner.items():
                    matrix[one, other] += (bend * dt) ** 2 * weight * other_weight
        self.x[PINNED:] = np.linalg.solve(matrix, right)

    def _newton_step(self, normals: dict[int, Floats]) -> None:
        free = len(self.x) - PINNED
        if free < 1:
            return
        jacobian = _jacobian(self.x)
        mobility = np.eye(3 * free)
        for cv, normal in normals.items():
            at = slice(3 * (cv - PINNED), 3 * (cv - PINNED) + 3)
            mobility[at, at] -= float(CONTACT_WEIGHT) * np.outer(normal, normal)
        error = self._lengths() - self.length[PINNED - 1 :]
        tension = np.linalg.solve(jacobian @ mobility @ jacobian.T, error)
        self.x[PINNED:] -= (mobility @ jacobian.T @ tension).reshape(free, 3)

    def _finish_lengths(self, normals: dict[int, Floats], settings: DynamicsSettings) -> None:
        wanted = np.array(self.length[PINNED - 1 :])
        for _ in range(settings.length_iterations):
            if (np.abs(self._lengths() - wanted) <= wanted * settings.length_tolerance).all():
                return
            self._newton_step(normals)
        if (np.abs(self._lengths() - wanted) > wanted * settings.length_tolerance).any():
            way = np.diff(self.x, axis=0)
            for cv in range(PINNED, len(self.x)):
                unit = way[cv - 1] / np.linalg.norm(way[cv - 1])
                self.x[cv] = self.x[cv - 1] + unit * self.length[cv - 1]

    def _lengths(self) -> Floats:
        return np.array([np.linalg.norm(b - a) for a, b in pairwise(self.x[PINNED - 1 :])])

    def _contacts(
        self, posed: PosedCollider, begin: float, end: float, settings: DynamicsSettings, dt: float
    ) -> list[_Plane]:
        planes = []
        before, now = posed.matrix_at(begin), posed.matrix_at(end)
        inverse = np.linalg.inv(now)
        for cv in range(PINNED, len(self.x)):
            along = cv / (len(self.x) - 1)
            radius = settings.radius_root * (1.0 - along) + settings.radius_tip * along
            local = inverse @ np.append(self.x[cv], 1.0)
            found, gradient = posed.collider.distance(local[:3, None])
            outward = inverse[:3, :3].T @ gradient[:, 0]
            steepness = float(np.linalg.norm(outward))
            normal, distance = outward / steepness, float(found[0]) / steepness
            if distance >= radius + REACH:
                continue
            origin = self.previous[cv] + ((now - before) @ local)[:3]
            was = distance - normal @ (self.x[cv] - origin)
            reached = was + settings.push_speed * dt
            offset = float(normal @ self.x[cv]) - distance + min(radius, reached)
            planes.append(_Plane(cv, normal, offset, origin, reached >= radius))
        return planes

    def _push_out(self, planes: list[_Plane], friction: float) -> dict[int, Floats]:
        touching = {}
        for plane in planes:
            missing = plane.offset - plane.normal @ self.x[plane.cv]
            push = max(missing, 0.0)
            plane.push += push
            self.x[plane.cv] += plane.normal * push
            slip = self.x[plane.cv] - plane.origin
            slip = slip - plane.normal * (plane.normal @ slip)
            length = max(float(np.linalg.norm(slip)), 1.0e-9)
            self.x[plane.cv] -= slip * min(friction * push / length, 1.0)
            if missing > -SKIN and plane.is_out:
                touching[plane.cv] = plane.normal
        return touching

    def _absorb(self, plane: _Plane) -> None:
        if plane.push > 0.0:
            away = plane.normal @ (self.x[plane.cv] - plane.origin)
            self.previous[plane.cv] += plane.normal * max(away, 0.0)


def _hold(rest_second: Floats, length: float) -> float:
    """1 for gentle bends, 0 for sharp kinks, straight in between."""
    sharpness = float(np.linalg.norm(rest_second)) / length if length else 2.0
    return min(max((SHARP - sharpness) / (SHARP - GENTLE), 0.0), 1.0)


def _jacobian(x: Floats) -> Floats:
    """Of the lengths of all segments beyond the pinned ones, by the free CVs: (n, 3 n)."""
    free = len(x) - PINNED
    jacobian = np.zeros((free, 3 * free))
    for row in range(free):
        way = x[row + PINNED] - x[row + PINNED - 1]
        unit = way / np.linalg.norm(way)
        jacobian[row, 3 * row : 3 * row + 3] = unit
        if row:
            jacobian[row, 3 * row - 3 : 3 * row] = -unit
    return jacobian


def _frames(x: Floats, style: Floats, twist_cv: int) -> list[Floats]:
    """Rotation of each segment, columns tangent, normal, binormal, carried without twist."""
    tangents = [(b - a) / np.linalg.norm(b - a) for a, b in pairwise(x)]
    beside = style[twist_cv] - style[0]
    beside = beside - tangents[0] * (tangents[0] @ beside)
    normal = beside / max(float(np.linalg.norm(beside)), 1.0e-9)
    turns = [np.stack([tangents[0], normal, np.cross(tangents[0], normal)], axis=1)]
    for one, other in pairwise(tangents):
        turns.append(_smallest_rotation(one, other) @ turns[-1])
    return turns


def _smallest_rotation(one: Floats, other: Floats) -> Floats:
    """The rotation (3, 3) that turns one unit vector into another (Rodrigues)."""
    x, y, z = np.cross(one, other)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Floats = np.eye(3) + cross + cross @ cross / (1.0 + one @ other)
    return rotation
