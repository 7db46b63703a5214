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
#: A collider that turns around within a frame is flat on its way; then it holds nothing out. Share
#: of the largest scale.
FLAT = 1.0e-3


@dataclass(frozen=True)
class Contacts:
    """Planes of one collider, n of them.

    index: (m,) into the points that contacts were looked for.
    normal: (3, m) outwards, world. offset: (m,) [m], the point shall keep normal . x >= offset.
    origin: (3, m) world [m], where the point would be had it stayed with the collider.
    is_out: (m,) whether the offset leads all the way out.
    push: (m,) [m], how far it was pushed so far in this substep.
    """

    index: Ints
    normal: Floats
    offset: Floats
    origin: Floats
    is_out: Bools
    push: Floats

    def push_out(self, position: Floats, friction: float) -> Bools:
        """Bring points (3, n) back to their planes, in place; returns which ones touch, (m,)."""
        here = _chosen(position, self.index)
        gap = dot(self.normal, here)
        np.subtract(self.offset, gap, out=gap)
        push = np.maximum(gap, np.float32(0.0))
        self.push[:] += push
        here += self.normal * push
        if friction:
            here -= self._friction(here, push, friction)
        for row, value in zip(position, here, strict=True):
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

        Changes `previous` (3, n), so that no pushed point moves away from the collider.
        """
        pushed = np.flatnonzero(self.push > 0.0)
        index, normal = self.index[pushed], _chosen(self.normal, pushed)
        moved = _chosen(position, index)
        moved -= _chosen(self.origin, pushed)
        away = np.maximum(dot(normal, moved), np.float32(0.0))
        for row, value in zip(previous, normal * away, strict=True):
            row[index] += value


def find_contacts(
    position: Floats,
    previous: Floats,
    radius: Floats,
    colliders: tuple[PosedCollider, ...],
    span: tuple[float, float],
    led_out: float,
) -> list[Contacts]:
    """Planes for all points near a collider.

    Args:
        position, previous: (3, n) float32 world [m], a substep apart; views do.
        radius: (n,) float32 [m], the distance that each point keeps.
        span: begin and end of the substep as shares of the frame.
        led_out: how far [m] a point that is inside may be led out in this substep.
    """
    if not position.shape[1]:
        return []
    found = (
        _contacts_with(posed, position, previous, radius, span, led_out) for posed in colliders
    )
    return [contacts for contacts in found if contacts is not None and len(contacts.index)]


def cv_radius(settings: DynamicsSettings, cv_count: int) -> Floats:
    """Collision radius [m] of the free CVs, (cv_count - 2,), growing evenly along the guide."""
    along = np.linspace(0.0, 1.0, cv_count)[PINNED:]
    radius = settings.radius_root + (settings.radius_tip - settings.radius_root) * along
    return radius.astype(np.float32)


def touched_normals(contacts: list[Contacts], touching: list[Bools], like: Floats) -> Floats | None:
    """Normal (3, cv_count - 2, guide_count) at each free CV that touches, zero elsewhere; None
    where none does."""
    chosen = [np.flatnonzero(is_touching) for is_touching in touching]
    if not any(one.size for one in chosen):
        return None
    normals = np.zeros((3, like.shape[1] - PINNED, like.shape[2]), np.float32)
    rows = normals.reshape(3, -1)
    for one, which in zip(contacts, chosen, strict=True):
        index = one.index[which]
        for row, values in zip(rows, _chosen(one.normal, which), strict=True):
            row[index] = values
    return normals


def _contacts_with(
    posed: PosedCollider,
    position: Floats,
    previous: Floats,
    radius: Floats,
    span: tuple[float, float],
    led_out: float,
) -> Contacts | None:
    before, now = (posed.matrix_at(moment) for moment in span)
    scales = np.linalg.svd(now[:3, :3], compute_uv=False)
    if scales[-1] <= FLAT * scales[0]:
        return None
    inverse = np.linalg.inv(now)
    reach = float(radius.max()) + REACH
    index, local = _near(posed, position, now, inverse, scales, reach)

    distance, gradient = posed.collider.distance(local)
    # distance and normal in the world: the gradient transforms by the inverse transposed, and its
    # length says how much the distance is scaled along it
    steepness = np.eye(4)
    steepness[:3, :3] = inverse[:3, :3].T
    normal = transform_points(steepness, gradient)
    scale = np.maximum(np.sqrt(dot(normal, normal)), TINY)
    normal /= scale
    distance = distance / scale
    own_radius = radius.take(index)

    close = np.flatnonzero(distance < own_radius + np.float32(REACH))
    index, distance, own_radius = index[close], distance[close], own_radius[close]
    local, normal = _chosen(local, close), _chosen(normal, close)
    here, origin = _chosen(position, index), _chosen(previous, index)
    origin += transform_points(now - before, local)
    reached = distance - dot(normal, here - origin) + np.float32(led_out)
    offset = dot(normal, here) - distance + np.minimum(own_radius, reached)
    is_out = reached >= own_radius
    return Contacts(index, normal, offset, origin, is_out, np.zeros_like(offset))


def _near(
    posed: PosedCollider,
    position: Floats,
    now: Floats,
    inverse: Floats,
    scales: Floats,
    reach: float,
) -> tuple[Ints, Floats]:
    """Points that may be within `reach` [m], and where they are in object space (3, n).

    A bounding sphere first, then the collider's own quick answer.
    """
    center, radius = posed.collider.bounds
    center = (now[:3, :3] @ center + now[:3, 3]).astype(np.float32)
    offset = position - center[:, None]
    squared = dot(offset, offset)
    index = np.flatnonzero(squared < np.float32((radius * scales[0] + reach) ** 2))
    local = transform_points(inverse, _chosen(position, index))
    kept = posed.collider.near(local, reach / float(scales[-1]))
    return index[kept], _chosen(local, kept)


def _chosen(rows: Floats, index: Ints) -> Floats:
    """The chosen columns (3, m) of rows (3, n)."""
    chosen = np.empty((3, len(index)), rows.dtype)
    for row, out in zip(rows, chosen, strict=True):
        row.take(index, out=out, mode="clip")  # the other modes buffer
    return chosen
