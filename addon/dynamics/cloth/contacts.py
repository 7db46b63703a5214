"""Contacts of cloth: planes that are found once per substep and move through its small steps.

They are found where the substep would lead, and move with the collider from the substep's begin to
its end, so that edges and contacts are solved alternately in every small step: cloth that is drawn
tight around a collider lies on it without being stretched. Vertices that edges draw into a collider
nevertheless are pushed out at the end of the substep.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Floats
from ...strands.vectors import dot_rows
from ..colliders import Pose, PosedCollider
from ..contacts import Contacts, find_contacts


@dataclass(frozen=True)
class MovingPlanes:
    """Planes of one collider that move through a substep, m of them.

    contacts: the planes at the substep's end.
    begin_offset: (m,) [m], their offsets at its begin_offset: where the collider was or, for a
        vertex inside it, where the vertex was.
    displacement: (3, m) [m], of the collider at each vertex.
    """

    contacts: Contacts
    begin_offset: Floats
    displacement: Floats

    @classmethod
    def of(cls, contacts: Contacts, before: Floats) -> MovingPlanes:
        """Args:
        before: (3, n) world [m], vertices at the substep's begin.
        """
        here = before.take(contacts.index, axis=1)
        displacement = contacts.origin - here
        begin = contacts.offset - dot_rows(contacts.normal, displacement)
        return cls(contacts, np.minimum(begin, dot_rows(contacts.normal, here)), displacement)

    def push_out(
        self, position: Floats, previous: Floats, number: int, steps: int, friction: float
    ) -> None:
        """Push vertices (3, n) world [m] out in small step `number` of `steps`, in place, without
        bouncing."""
        known = self.contacts
        fraction = np.float32((number + 1) / steps)
        origin = previous.take(known.index, axis=1)
        origin += self.displacement * np.float32(1.0 / steps)
        now = replace(
            known,
            offset=self.begin_offset + (known.offset - self.begin_offset) * fraction,
            origin=origin,
            push=np.zeros_like(self.begin_offset),
        )
        now.push_out(position, friction)
        now.absorb(position, previous)


def find_moving_planes(
    position: Floats,
    previous: Floats,
    gravity_step: Floats,
    steps: int,
    radius: Floats,
    poses: list[Pose],
    max_exit: float,
    size: float,
) -> list[MovingPlanes]:
    """Planes near where the substep of `steps` small ones would lead.

    Args:
        position, previous: (3, n) world [m], one small step apart.
        gravity_step: (3, 1) [m], displacement by gravity in a small step.
        radius, poses, max_exit, size: see `find_contacts`.
    """
    ahead = (position - previous) * np.float32(steps)
    ahead += position
    ahead += gravity_step * np.float32(steps * (steps + 1) / 2)
    found = find_contacts(ahead, position, radius, poses, max_exit, size)
    return [MovingPlanes.of(one, position) for one in found]


def push_out_at_end(
    position: Floats,
    previous: Floats,
    before: Floats,
    contacts: list[Contacts],
    friction: float,
    fraction: float,
) -> None:
    """Push vertices out of colliders as the substep ends, in place.

    Args:
        before: (3, n) world [m], vertices at the substep's begin.
        fraction: duration of a small step over that of the substep. Contacts span a substep, the
            speed in `previous` a small step, so it gets this fraction of the push.
    """
    pushed, unbounced = position.copy(), before.copy()
    for one in contacts:
        one.push_out(position, friction)
    for one in contacts:
        one.absorb(position, unbounced)
    np.subtract(position, pushed, out=pushed)
    unbounced -= before
    unbounced -= pushed
    previous += pushed
    previous += unbounced * np.float32(fraction)


def relative_to_origin(origin: Floats, posed: PosedCollider) -> PosedCollider:
    """A collider moved so that `origin` (3, 1) world [m] becomes the origin."""
    back = np.eye(4)
    back[:3, 3:] = -origin
    earlier = None if posed.matrix_earlier is None else back @ posed.matrix_earlier
    return replace(
        posed,
        matrix_before=back @ posed.matrix_before,
        matrix_now=back @ posed.matrix_now,
        matrix_earlier=earlier,
    )
