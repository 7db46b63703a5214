"""Grooms that feel each other are simulated together in each frame, see `dynamics.neighbours`.

    with CoupledFrame(sessions) as frame:
        ...                         each session is moved as if it were run_alone; those that feel
                                    others wait
        frame.simulate_coupled()    those that waited are simulated, all together

Others see the guides of hair that is not simulated, plays a bake or feels nothing move in straight
lines within the frame.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from types import TracebackType
from typing import Protocol, Self

import numpy as np

from ... import motion_flow
from ...arrays import Floats
from ...dynamics.neighbours import AdvancingGroom, LinearMotion, NeighbourStyle, advance_together
from ...rig_flow import Pose, Rig
from .session import Session


class FeltGroom(Protocol):
    """A groom that others may feel.

    uid: of its object.
    """

    uid: int

    @property
    def is_felt(self) -> bool:
        """Whether others feel it; hair that renders leave out is not felt."""

    @property
    def rig(self) -> Rig: ...

    @property
    def pose(self) -> Pose:
        """The pose of its body when it was last moved."""

    def guides(self) -> Floats:
        """Its guides, (guide_count, cv_count, 3) [m, world]."""

    def neighbour_style(self) -> NeighbourStyle:
        """See `motion_flow.neighbour_style`."""


@dataclass(frozen=True, eq=False)
class _GroomStart:
    """A groom at the beginning of the frame.

    reach: radius [m] of the ball that its hair cannot leave. near: the grooms that it feels, by
    session number.
    """

    groom: FeltGroom
    style: NeighbourStyle
    guides: Floats
    reach: float
    near: frozenset[int]

    @property
    def mover(self) -> AdvancingGroom:
        """The groom's motion in the frame, once all grooms that do not wait have been moved."""
        groom = self.groom
        straight = LinearMotion(self.guides, groom.guides, self.reach)
        if not isinstance(groom, Session):
            return AdvancingGroom(groom.uid, self.style, straight)
        waiting, known = groom.pending_steps, groom.known_hair
        return AdvancingGroom(groom.uid, self.style, straight, waiting, self.near, known)


class CoupledFrame:
    """A frame of these grooms, from where they are now."""

    def __init__(self, grooms: Iterable[FeltGroom]) -> None:
        self._starts = _frame_starts([groom for groom in grooms if groom.is_felt])

    @property
    def _sessions(self) -> list[Session]:
        return [each.groom for each in self._starts if isinstance(each.groom, Session)]

    def __enter__(self) -> Self:
        for start in self._starts:
            if start.near and isinstance(start.groom, Session):
                start.groom.is_coupled = True
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for session in self._sessions:
            session.is_coupled, session.pending_steps = False, None

    def simulate_coupled(self) -> list[Session]:
        """Simulate the sessions that wait; returns them, to call `Session.finish_frame` on each."""
        waiting = [session for session in self._sessions if session.pending_steps is not None]
        if waiting:
            movers = {start.groom.uid: start.mover for start in self._starts}
            advance_together(tuple(movers.values()))
            for session in waiting:
                mover = movers[session.uid]
                session.known_hair, session.failure = mover.known, mover.error
        return waiting


def _frame_starts(grooms: list[FeltGroom]) -> list[_GroomStart]:
    """The grooms that feel others, and those that they feel."""
    feeling = {each.uid for each in grooms if isinstance(each, Session) and each.feels_hair}
    if not feeling or len(grooms) < 2:
        return []
    balls = {each.uid: motion_flow.bounding_sphere(each.rig, each.pose) for each in grooms}
    near = {uid: _touching_balls(uid, balls) for uid in feeling}
    taking_part = frozenset().union(*near.values(), (uid for uid in near if near[uid]))
    return [
        _GroomStart(
            each,
            each.neighbour_style(),
            each.guides(),
            balls[each.uid][1],
            near.get(each.uid, frozenset()),
        )
        for each in grooms
        if each.uid in taking_part
    ]


def _touching_balls(uid: int, balls: dict[int, tuple[Floats, float]]) -> frozenset[int]:
    """The numbers of other balls (middle, radius) that touch this one."""
    middle, radius = balls[uid]
    return frozenset(
        other
        for other, (place, reach) in balls.items()
        if other != uid and float(np.linalg.norm(place - middle)) <= radius + reach
    )
