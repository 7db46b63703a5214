"""Scalar reference of cloth, one vertex and one edge at a time in float64: for reading and tests.

It shares with the fast form only settings, state, drive and how that carries the mesh, colliders
and the order of edges.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...arrays import Floats, Ints
from ..contacts import CONTACT_MARGIN
from ..force_fields import ForceFields
from ..frame import Drive
from ..reference.force_fields import previous_after_fields
from ..wind import air_from_settings
from .carried import pinned_path
from .coloring import greedy_colors, opposite_pairs
from .settings import FinSettings
from .state import PINNED_WEIGHT, ClothState


def advance_cloth_reference(
    state: ClothState, drive: Drive, settings: FinSettings, duration: float
) -> ClothState:
    """Reference of `cloth.step.advance_cloth`; see there."""
    dt = 1.0 / settings.substep_rate
    duration = min(duration, settings.max_frame_time)
    time = state.time_left + duration
    count = math.floor(time / dt + 1.0e-6) if duration else 0
    cloth = _Cloth(state, drive, settings)
    for number in range(count):
        begin = (number * dt - state.time_left) / duration
        cloth.substep(begin, begin + dt / duration, state.time + number * dt)
    position, previous = (np.array(rows).T.copy() for rows in (cloth.x, cloth.previous))
    left = max(time - count * dt, 0.0)
    small = cloth.small if count else state.small_step
    return ClothState(position, previous, state.fabric, small, left, state.time + count * dt)


@dataclass
class _Plane:
    """One contact: a vertex must keep normal . x >= offset, which moves from first to last."""

    vertex: int
    normal: Floats
    displacement: Floats
    first: float
    last: float


class _Cloth:
    """x and previous: a list of (3,) float64 world [m]."""

    def __init__(self, state: ClothState, drive: Drive, settings: FinSettings) -> None:
        fabric = state.fabric
        self.fabric, self.drive, self.settings = fabric, drive, settings
        self.dt = 1.0 / settings.substep_rate
        self.small = self.dt / settings.small_steps
        self.x = list(state.position.T.astype(np.float64))
        self.previous = list(state.previous.T.astype(np.float64))
        if state.small_step:
            ratio = self.small / state.small_step
            self.previous = [
                x - (x - p) * ratio for x, p in zip(self.x, self.previous, strict=True)
            ]
        self.pinned = [bool(weight >= PINNED_WEIGHT) for weight in fabric.pin]
        folds = opposite_pairs(fabric.triangles)
        folds = folds[[not (self.pinned[a] and self.pinned[b]) for a, b in folds]]
        self.edges, self.folds = _in_order(fabric.pairs), _in_order(folds)
        weight = settings.gravity * (1.0 - settings.buoyancy)
        self.gravity = np.asarray(drive.gravity, np.float64) * weight
        self.air = air_from_settings(settings)

    def substep(self, begin: float, end: float, time: float) -> None:
        settings = self.settings
        if settings.damping or settings.drag:
            self._apply_air_resistance(time)
        fields = self.drive.force_fields.scaled(settings.force_fields)
        if fields is not None:
            self._apply_force_fields(fields)
        if settings.bend:
            self._hold_folds()
        before = [x.copy() for x in self.x]
        steps = settings.small_steps
        fall = self.gravity * self.small**2 * steps * (steps + 1) / 2.0
        ahead = [x + (x - p) * steps + fall for x, p in zip(self.x, self.previous, strict=True)]
        planes = self._planes(ahead, before, begin, end)
        for number in range(steps):
            fraction = (number + 1) / steps
            self._small_step(begin + (end - begin) * fraction)
            for plane in planes:
                self._push_out(plane, fraction)
        self._push_out_at_end(before, begin, end)

    def _apply_air_resistance(self, time: float) -> None:
        settings, ratio = self.settings, self.dt / self.small
        for v, normal in enumerate(self._normals()):
            wind: Floats = np.zeros(3)
            if self.air is not None:
                wind = self.air.at(self.x[v][:, None].astype(np.float32), time)[:, 0] * self.small
            displacement = self.x[v] - self.previous[v] - wind
            across = normal @ displacement
            along = displacement - normal * across
            broadside = math.exp(-settings.damping * self.dt)
            broadside /= 1.0 + settings.drag * abs(across) * ratio
            edgewise = math.exp(-settings.damping * settings.edgewise * self.dt)
            edgewise /= 1.0 + settings.drag * settings.edgewise * np.linalg.norm(along) * ratio
            displacement = normal * (across * broadside) + along * edgewise
            self.previous[v] = self.x[v] - displacement - wind

    def _normals(self) -> list[Floats]:
        total = [np.zeros(3) for _ in self.x]
        for corners in self.fabric.triangles:
            a, b, c = (self.x[v] for v in corners)
            for v in corners:
                total[v] = total[v] + np.cross(b - a, c - a)
        return [n / np.linalg.norm(n) if n.any() else n for n in total]

    def _apply_force_fields(self, fields: ForceFields) -> None:
        ratio, x = self.dt / self.small, np.array(self.x)
        before = x - (x - np.array(self.previous)) * ratio
        blown = previous_after_fields(x, before, fields, self.dt, self.fabric.size, is_strand=False)
        change = (blown - before) / ratio
        self.previous = [p + one for p, one in zip(self.previous, change, strict=True)]

    def _hold_folds(self) -> None:
        rest = self.fabric.position.T.astype(np.float64)
        stiffness = (2.0 * math.pi * self.settings.bend) ** 2 / 2.0
        ratio = self.dt / self.small
        ahead = [x + (x - p) * ratio for x, p in zip(self.x, self.previous, strict=True)]
        held = [x.copy() for x in ahead]
        mass = [0.0 if pinned else 1.0 for pinned in self.pinned]
        for a, b in self.folds:
            length = float(np.linalg.norm(rest[b] - rest[a]))
            _keep_distance(held, a, b, length, mass, 1.0 / (stiffness * self.dt**2))
        for v, (one, other) in enumerate(zip(held, ahead, strict=True)):
            self.previous[v] = self.previous[v] - (one - other) / ratio

    def _small_step(self, moment: float) -> None:
        settings, drive = self.settings, self.drive
        mobility = []
        paths = pinned_path(self.fabric, drive, np.zeros((3, 1))).at(moment)
        for v in range(len(self.x)):
            x = 2.0 * self.x[v] - self.previous[v] + self.gravity * self.small**2
            self.previous[v] = self.x[v]
            carried = paths[:, v]
            weight = float(self.fabric.pin[v])
            if self.pinned[v]:
                self.x[v] = carried
                mobility.append(0.0)
                continue
            swings = math.hypot(settings.pin_pull * weight / (1.0 - weight), settings.shape)
            pull = (2.0 * math.pi * swings * self.small) ** 2
            self.x[v] = (x + carried * pull) / (1.0 + pull)
            mobility.append(1.0 / (1.0 + pull))
        self._keep_edges(mobility)

    def _keep_edges(self, mobility: list[float]) -> None:
        rest = self.fabric.position.T.astype(np.float64)
        for a, b in self.edges:
            length = float(np.linalg.norm(rest[b] - rest[a]))
            compliance = length**2 * self.settings.stretch / 9.81
            _keep_distance(self.x, a, b, length, mobility, compliance / self.small**2)
        if self.settings.long_range:
            for v, (anchor, reach) in enumerate(
                zip(self.fabric.anchor, self.fabric.reach, strict=True)
            ):
                displacement = self.x[v] - self.x[anchor]
                far = float(np.linalg.norm(displacement))
                if far > reach:
                    self.x[v] = self.x[anchor] + displacement * float(reach) / far

    def _planes(
        self, x: list[Floats], before: list[Floats], begin: float, end: float
    ) -> list[_Plane]:
        """The planes of `contacts`, with the offset at the substep's begin as in `MovingPlanes`."""
        settings, planes, size = self.settings, [], self.fabric.size
        radius = settings.radius * size
        for posed in self.drive.colliders:
            old, new = posed.matrix_at(begin), posed.matrix_at(end)
            inverse = np.linalg.inv(new)
            for v in range(len(x)):
                local = inverse @ np.append(x[v], 1.0)
                found, gradient = posed.collider.distance(local[:3, None])
                outward = inverse[:3, :3].T @ gradient[:, 0]
                steepness = float(np.linalg.norm(outward))
                normal, distance = outward / steepness, float(found[0]) / steepness
                if self.pinned[v] or distance >= radius + CONTACT_MARGIN * size:
                    continue
                displacement = ((new - old) @ local)[:3]
                reached = distance - normal @ (x[v] - before[v] - displacement)
                reached += settings.depenetration_speed * size * self.dt
                offset = normal @ x[v] - distance + min(radius, reached)
                first = min(offset - normal @ displacement, normal @ before[v])
                planes.append(_Plane(v, normal, displacement, first, offset))
        return planes

    def _push_out(self, plane: _Plane, fraction: float) -> None:
        """Push out in one small step, with friction and without bouncing."""
        v, normal = plane.vertex, plane.normal
        offset = plane.first + (plane.last - plane.first) * fraction
        origin = self.previous[v] + plane.displacement * self.small / self.dt
        bounce = self._push(plane, offset, origin)
        self.previous[v] = self.previous[v] + normal * bounce

    def _push_out_at_end(self, before: list[Floats], begin: float, end: float) -> None:
        free, bounce = [x.copy() for x in self.x], [np.zeros(3) for _ in self.x]
        for plane in self._planes(self.x, before, begin, end):
            v = plane.vertex
            one = self._push(plane, plane.last, before[v] + plane.displacement)
            bounce[v] = bounce[v] + plane.normal * one
        fraction = self.small / self.dt
        for v in range(len(self.x)):
            pushed = self.x[v] - free[v]
            self.previous[v] = self.previous[v] + pushed - (pushed - bounce[v]) * fraction

    def _push(self, plane: _Plane, offset: float, origin: Floats) -> float:
        """Push a vertex to its plane, with friction; returns how far [m] it would bounce."""
        v, normal = plane.vertex, plane.normal
        push = max(offset - normal @ self.x[v], 0.0)
        if not push:
            return 0.0
        self.x[v] = self.x[v] + normal * push
        slip = self.x[v] - origin - normal * (normal @ (self.x[v] - origin))
        length = max(float(np.linalg.norm(slip)), 1.0e-9)
        self.x[v] = self.x[v] - slip * min(self.settings.friction * push / length, 1.0)
        return max(float(normal @ (self.x[v] - origin)), 0.0)


def _in_order(pairs: Ints) -> list[tuple[int, int]]:
    """Pairs in the order of colours, in which the fast form solves them."""
    colors = greedy_colors(pairs)
    return [
        tuple(pair)
        for color in range(int(colors.max(initial=-1)) + 1)
        for pair in pairs[colors == color].tolist()
    ]


def _keep_distance(
    x: list[Floats], a: int, b: int, length: float, mobility: list[float], compliance: float
) -> None:
    total = mobility[a] + mobility[b] + compliance
    far = float(np.linalg.norm(x[b] - x[a]))
    if far and total:
        step = (x[b] - x[a]) * ((far - length) / (far * total))
        x[a], x[b] = x[a] + step * mobility[a], x[b] - step * mobility[b]
