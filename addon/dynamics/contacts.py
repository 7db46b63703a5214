"""Contacts: found once in a substep, solved as planes each time lengths and contacts alternate.

A CV near a collider gets the plane of its nearest surface, moved out by the CV's own radius, which
grows from root to tip (the "pearl" configuration of Nguyen and Donnelly 2005), so that no collider
slips between two CVs. What a plane asks for is limited: a CV goes no deeper than it was, as seen
from the moving collider, and is led out by no more than `push_speed`. So hair that starts inside
comes out at a walk instead of exploding.

Friction is Coulomb's, on positions (Macklin et al. 2014, "Unified Particle Physics", section 6.1):
the slip against the collider's own motion is reduced by up to mu times the push.

Limitations: one plane a CV and collider and substep; between colliders that touch each other the
last one wins.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from .colliders import PosedCollider, transform_points
from .constraints import PINNED, TINY, dot
from .settings import DynamicsSettings

#: How far a CV may be brought by the length solve after contacts were found [m].
REACH = 0.002
#: Closer than this to its plane a CV counts as touching, so that lengths do not push it in [m].
SKIN = np.float32(1.0e-4)


@dataclass(frozen=True)
class Contacts:
    """Planes of one collider, n of them.

    index: (n,) into the free CVs, flattened (cv_count - 2, guide_count).
    normal: (3, n) outwards, world. offset: (n,) [m], the CV shall keep normal . x >= offset.
    origin: (3, n) world [m], where the CV would be had it stayed with the collider.
    is_out: (n,) whether the offset leads all the way out.
    push: (n,) [m], how far it was pushed so far in this substep.
    """

    index: Ints
    normal: Floats
    offset: Floats
    origin: Floats
    is_out: Bools
    push: Floats

    def push_out(self, position: Floats, friction: float) -> Bools:
        """Bring CVs back to their planes, in place; returns which ones touch, (n,)."""
        free = _free_rows(position)
        here = np.stack([row.take(self.index) for row in free])
        gap = dot(self.normal, here)
        np.subtract(self.offset, gap, out=gap)
        push = np.maximum(gap, np.float32(0.0))
        self.push[:] += push
        here += self.normal * push
        if friction:
            here -= self._friction(here, push, friction)
        for row, value in zip(free, here, strict=True):
            row[self.index] = value
        return (gap > -SKIN) & self.is_out

    def _friction(self, here: Floats, push: Floats, friction: float) -> Floats:
        slip = here - self.origin
        slip -= self.normal * dot(self.normal, slip)
        length = np.maximum(np.sqrt(dot(slip, slip)), TINY)
        slip *= np.minimum(push * np.float32(friction) / length, np.float32(1.0))
        return slip

    def absorb(self, position: Floats, previous: Floats) -> None:
        """Take away the speed that pushing out has made: contacts do not bounce.

        Changes `previous`, so that no pushed CV moves away from the collider.
        """
        pushed = np.flatnonzero(self.push > 0.0)
        index, normal = self.index[pushed], self.normal[:, pushed]
        here = np.stack([row.take(index) for row in _free_rows(position)])
        away = np.maximum(dot(normal, here - self.origin[:, pushed]), np.float32(0.0))
        for row, value in zip(_free_rows(previous), normal * away, strict=True):
            row[index] += value


def find_contacts(
    position: Floats,
    previous: Floats,
    colliders: tuple[PosedCollider, ...],
    span: tuple[float, float],
    settings: DynamicsSettings,
    dt: float,
) -> list[Contacts]:
    """Planes for all free CVs near a collider.

    Args:
        position, previous: (3, cv_count, guide_count) world [m], a substep apart.
        span: begin and end of the substep as shares of the frame.
    """
    if position.shape[1] <= PINNED or not position.shape[2]:
        return []
    radius = cv_radius(settings, position.shape[1])
    found = (
        _contacts_with(posed, position, previous, span, radius, settings.push_speed * dt)
        for posed in colliders
    )
    return [contacts for contacts in found if len(contacts.index)]


def cv_radius(settings: DynamicsSettings, cv_count: int) -> Floats:
    """Collision radius [m] of the free CVs, (cv_count - 2,), growing evenly along the guide."""
    along = np.linspace(0.0, 1.0, cv_count)[PINNED:]
    radius = settings.radius_root + (settings.radius_tip - settings.radius_root) * along
    return radius.astype(np.float32)


def touched_normals(contacts: list[Contacts], touching: list[Bools], like: Floats) -> Floats:
    """Normal (3, cv_count - 2, guide_count) at each free CV that touches, zero elsewhere."""
    normals = np.zeros((3, like.shape[1] - PINNED, like.shape[2]), np.float32)
    rows = normals.reshape(3, -1)
    for one, is_touching in zip(contacts, touching, strict=True):
        rows[:, one.index[is_touching]] = one.normal[:, is_touching]
    return normals


def _contacts_with(
    posed: PosedCollider,
    position: Floats,
    previous: Floats,
    span: tuple[float, float],
    radius: Floats,
    led_out: float,
) -> Contacts:
    before, now = (posed.matrix_at(moment) for moment in span)
    inverse = np.linalg.inv(now)
    reach = float(radius.max()) + REACH
    index, local = _near(posed, position, now, inverse, reach)

    distance, gradient = posed.collider.distance(local)
    # distance and normal in the world: the gradient transforms by the inverse transposed, and its
    # length says how much the distance is scaled along it
    steepness = inverse[:3, :3].T.astype(np.float32)
    normal = sum(steepness[:, axis, None] * gradient[axis] for axis in range(3))
    scale = np.maximum(np.sqrt(dot(normal, normal)), TINY)
    normal /= scale
    distance = distance / scale
    own_radius = radius[index // position.shape[2]]

    close = np.flatnonzero(distance < own_radius + np.float32(REACH))
    index, local = index[close], local[:, close]
    normal, distance, own_radius = normal[:, close], distance[close], own_radius[close]
    here = np.stack([row.take(index) for row in _free_rows(position)])
    origin = np.stack([row.take(index) for row in _free_rows(previous)])
    origin += transform_points(now - before, local)
    reached = distance - dot(normal, here - origin) + np.float32(led_out)
    offset = dot(normal, here) - distance + np.minimum(own_radius, reached)
    is_out = reached >= own_radius
    return Contacts(index, normal, offset, origin, is_out, np.zeros_like(offset))


def _near(
    posed: PosedCollider, position: Floats, now: Floats, inverse: Floats, reach: float
) -> tuple[Ints, Floats]:
    """Free CVs that may be within `reach` [m], and where they are in object space (3, n).

    A bounding sphere first, then the collider's own quick answer.
    """
    center, radius = posed.collider.bounds
    stretch = np.linalg.svd(now[:3, :3], compute_uv=False)
    center = (now[:3, :3] @ center + now[:3, 3]).astype(np.float32)
    free = _free_rows(position)
    squared, scratch = np.zeros_like(free[0]), np.empty_like(free[0])
    for axis, row in enumerate(free):
        np.subtract(row, center[axis], out=scratch)
        scratch *= scratch
        squared += scratch
    index = np.flatnonzero(squared < np.float32((radius * stretch[0] + reach) ** 2))
    local = transform_points(inverse, np.stack([row.take(index) for row in free]))
    kept = posed.collider.near(local, reach / float(stretch[-1]))
    return index[kept], local[:, kept]


def _free_rows(position: Floats) -> list[Floats]:
    """x, y and z of all free CVs, each flat: views into `position`."""
    return [position[axis, PINNED:].reshape(-1) for axis in range(3)]
