"""Contacts of one guide for the scalar reference, CV by CV; see `contacts.py` for the ideas."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Floats
from ..colliders import PosedCollider
from ..colliders.posed import FLAT
from ..constraints import PINNED
from ..contacts import REACH, SKIN
from ..settings import DynamicsSettings


@dataclass(frozen=True)
class Moment:
    """A substep: begin and end as fractions of the frame; its time and length [s]."""

    begin: float
    end: float
    time: float
    dt: float


@dataclass
class Plane:
    """One contact: CV `cv` shall keep normal . x >= offset; see `contacts.Contacts`."""

    cv: int
    normal: Floats
    offset: float
    origin: Floats
    is_out: bool
    skin: float  # [m]
    push: float = 0.0

    def push_out(self, x: Floats, friction: float) -> bool:
        """Bring the CV back to its plane, in place; returns whether it touches."""
        missing = self.offset - float(self.normal @ x[self.cv])
        push = max(missing, 0.0)
        self.push += push
        x[self.cv] += self.normal * push
        slip = x[self.cv] - self.origin
        slip = slip - self.normal * (self.normal @ slip)
        length = max(float(np.linalg.norm(slip)), 1.0e-9)
        x[self.cv] -= slip * min(friction * push / length, 1.0)
        return bool(missing > -self.skin) and self.is_out

    def absorb(self, x: Floats, previous: Floats) -> None:
        """Take away the speed that pushing out has made."""
        if self.push > 0.0:
            away = float(self.normal @ (x[self.cv] - self.origin))
            previous[self.cv] += self.normal * max(away, 0.0)


def push_out(planes: list[Plane], x: Floats, friction: float) -> dict[int, Floats]:
    """Bring all CVs back, one after the other; the normals of those that touch."""
    return {plane.cv: plane.normal for plane in planes if plane.push_out(x, friction)}


def planes_of(
    posed: PosedCollider,
    x: Floats,
    previous: Floats,
    settings: DynamicsSettings,
    moment: Moment,
    size: float,
) -> list[Plane]:
    """Planes for all CVs of x (cv_count, 3) near a collider; `size` [m] is the hair's."""
    planes: list[Plane] = []
    before, now = posed.matrix_at(moment.begin), posed.matrix_at(moment.end)
    if np.linalg.cond(now[:3, :3]) >= 1.0 / FLAT:
        return planes
    inverse = np.linalg.inv(now)
    for cv in range(PINNED, len(x)):
        along = cv / (len(x) - 1)
        radius = size * (settings.radius_root * (1.0 - along) + settings.radius_tip * along)
        local = inverse @ np.append(x[cv], 1.0)
        found, gradient = posed.collider.distance(local[:3, None])
        outward = inverse[:3, :3].T @ gradient[:, 0]
        steepness = float(np.linalg.norm(outward))
        normal, distance = outward / steepness, float(found[0]) / steepness
        if distance >= radius + REACH * size:
            continue
        origin = previous[cv] + ((now - before) @ local)[:3]
        was = distance - normal @ (x[cv] - origin)
        reached = was + settings.depenetration_speed * size * moment.dt
        offset = float(normal @ x[cv]) - distance + min(radius, reached)
        planes.append(Plane(cv, normal, offset, origin, reached >= radius, SKIN * size))
    return planes
