"""Contacts: found once in a substep, solved as planes each time lengths and contacts alternate.

A CV near a collider gets the plane of its nearest surface, moved out by the CV's own radius, which
grows from root to tip (the "pearl" configuration of Nguyen and Donnelly 2005), so that no collider
slips between two CVs. What a plane asks for is limited: a CV goes no deeper than it was, as seen
from the moving collider, and is led out by no more than `depenetration_speed`. So hair that starts
inside comes out at a walk instead of exploding.

Friction is Coulomb's, on positions (Macklin et al. 2014, "Unified Particle Physics", section 6.1):
the slip against the collider's own motion is reduced by up to mu times the push.

Limitations: one plane a CV and collider and substep; between colliders that touch each other the
last one wins.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..strands.vectors import dot_rows
from .colliders import Pose, transform_points
from .colliders.posed import near_points, world_distance
from .constraints import PINNED, TINY, Touched, chosen
from .settings import DynamicsSettings

#: How far a CV may be brought by the length solve after contacts were found, in sizes: these are
#: the median length of hair, `state.Rest.size`, and `cloth.state.Fabric.size`.
REACH = 0.008
#: Closer than this to its plane a CV counts as touching, so that lengths do not push it in; in
#: sizes.
SKIN = 4.0e-4


@dataclass(frozen=True)
class Contacts:
    """Planes of one collider, n of them.

    index: (m,) into the points that contacts were looked for.
    normal: (3, m) outwards, world. offset: (m,) [m], the point shall keep normal . x >= offset.
    origin: (3, m) world [m], where the point would be had it stayed with the collider.
    is_out: (m,) whether the offset leads all the way out.
    skin: [m], closer than this it touches.
    push: (m,) [m], how far it was pushed so far in this substep.
    """

    index: Ints
    normal: Floats
    offset: Floats
    origin: Floats
    is_out: Bools
    skin: np.float32
    push: Floats

    def push_out(self, position: Floats, friction: float) -> Bools:
        """Bring points (3, n) back to their planes, in place; returns which ones touch, (m,)."""
        here = chosen(position, self.index)
        gap = dot_rows(self.normal, here)
        np.subtract(self.offset, gap, out=gap)
        push = np.maximum(gap, np.float32(0.0))
        self.push[:] += push
        here += self.normal * push
        if friction:
            here -= self._friction(here, push, friction)
        for row, value in zip(position, here, strict=True):
            row[self.index] = value
        return (gap > -self.skin) & self.is_out

    def _friction(self, here: Floats, push: Floats, friction: float) -> Floats:
        slip = here - self.origin
        slip -= self.normal * dot_rows(self.normal, slip)
        length = np.maximum(np.sqrt(dot_rows(slip, slip)), TINY)
        slip *= np.minimum(push * np.float32(friction) / length, np.float32(1.0))
        return slip

    def absorb(self, position: Floats, previous: Floats) -> None:
        """Take away the speed that pushing out has made: contacts do not bounce.

        Changes `previous` (3, n), so that no pushed point moves away from the collider.
        """
        moved = chosen(position, self.index)
        moved -= self.origin
        away = np.maximum(dot_rows(self.normal, moved), np.float32(0.0))
        away *= self.push > 0.0
        for row, value in zip(previous, self.normal * away, strict=True):
            row[self.index] += value


def find_contacts(
    position: Floats,
    previous: Floats,
    radius: Floats,
    poses: list[Pose],
    led_out: float,
    size: float,
) -> list[Contacts]:
    """Planes for all points near a collider.

    Args:
        position, previous: (3, n) float32 world [m], a substep apart.
        radius: (n,) float32 [m], the distance that each point keeps; -inf: it has no contacts.
        poses: of the colliders at the substep's end.
        led_out: how far [m] a point that is inside may be led out in this substep.
        size: of the hair or cloth [m].
    """
    found = (_contacts_with(pose, position, previous, radius, led_out, size) for pose in poses)
    return [contacts for contacts in found if len(contacts.index)]


def cv_radius(settings: DynamicsSettings, cv_count: int, size: float) -> Floats:
    """Collision radius [m] of the free CVs, (cv_count - 2,), growing evenly along the guide."""
    along = np.linspace(0.0, 1.0, cv_count)[PINNED:]
    radius = settings.radius_root + (settings.radius_tip - settings.radius_root) * along
    return (size * radius).astype(np.float32)


@lru_cache(maxsize=8)
def radius_of_all(
    settings: DynamicsSettings, cv_count: int, guide_count: int, size: float
) -> Floats:
    """The same of all CVs of some guides, (cv_count * guide_count,); -inf for the pinned."""
    pinned = np.full(PINNED, -np.inf, np.float32)
    radius = np.repeat(np.concatenate([pinned, cv_radius(settings, cv_count, size)]), guide_count)
    radius.flags.writeable = False
    return radius


def touched_by(contacts: list[Contacts], touching: list[Bools]) -> Touched | None:
    """Free CVs that touch, each with the normal of the last collider that it touches; None where
    none does."""
    found = []
    for one, is_touching in zip(contacts, touching, strict=True):
        which = is_touching.nonzero()[0]  # sooner than by np.flatnonzero
        if which.size:
            found.append(Touched(one.index.take(which), chosen(one.normal, which)))
    if len(found) < 2:
        return found[0] if found else None
    index = np.concatenate([one.index for one in found])[::-1]
    normal = np.concatenate([one.normal for one in found], axis=1)[:, ::-1]
    index, last = np.unique(index, return_index=True)
    return Touched(index, normal[:, last])


def _contacts_with(
    pose: Pose, position: Floats, previous: Floats, radius: Floats, led_out: float, size: float
) -> Contacts:
    index, local, reach = near_points(pose, position, radius, REACH * size)
    distance, normal = world_distance(pose, local)
    close = (distance < reach).nonzero()[0]
    index, distance = index.take(close), distance.take(close)
    local, normal = chosen(local, close), chosen(normal, close)
    here, origin = chosen(position, index), chosen(previous, index)
    origin += transform_points(pose.displacement, local)
    reached = distance - dot_rows(normal, here - origin)
    reached += np.float32(led_out)
    own_radius = radius.take(index)
    offset = dot_rows(normal, here)
    offset -= distance
    offset += np.minimum(own_radius, reached)
    is_out = reached >= own_radius
    skin = np.float32(SKIN * size)
    return Contacts(index, normal, offset, origin, is_out, skin, np.zeros_like(offset))
