"""Finds how far hair stays from its colliders, when it begins to play.

That takes some hundredths of a second, with many children a tenth: longer than a frame. So Play has
it found in the background, and the result is cached, as each loop of playback begins alike.
"""

from __future__ import annotations

from dataclasses import dataclass

from ... import motion_flow
from ...dynamics.colliders import PosedCollider
from ...dynamics.settings import DynamicsSettings
from ...motion_flow import Motion
from ...rig_flow import Pose, Rig
from ..base.thread_work import ThreadWork
from ..colliders.fields import NotReadyError


@dataclass(frozen=True, eq=False)
class PlayStart:
    """The state in which hair begins to play.

    colliders: at rest where they are at that moment.
    """

    rig: Rig
    pose: Pose
    colliders: tuple[PosedCollider, ...]
    settings: DynamicsSettings

    def is_same_as(self, other: PlayStart) -> bool:
        """Whether rig, pose and colliders are the same; `with_clearance` compares the settings."""
        return (
            self.rig is other.rig
            and self.pose.is_same_as(other.pose)
            and len(self.colliders) == len(other.colliders)
            and all(map(PosedCollider.is_same_at_end, self.colliders, other.colliders))
        )

    def motion(self) -> Motion:
        """The motion of hair at rest, with its clearance from the colliders."""
        motion = motion_flow.begin(self.rig, self.pose)
        return motion_flow.with_clearance(self.rig, motion, self.colliders, self.settings)


class FirstContacts:
    """The motion of the start that was requested last."""

    def __init__(self) -> None:
        self._start: PlayStart | None = None
        self._motion: Motion | ThreadWork[Motion] | None = None

    def store(self, start: PlayStart, motion: Motion) -> None:
        """Store a motion that was found elsewhere."""
        self._start, self._motion = start, motion

    def known_motion(self, start: PlayStart) -> Motion | None:
        """The motion of this start, if it is known or being found; waits for it."""
        if self._start is None or not self._start.is_same_as(start):
            return None
        if not isinstance(self._motion, ThreadWork):
            return self._motion
        self._motion.wait()
        return self._motion.result()

    def find(self, start: PlayStart) -> None:
        """Have the motion of this start found in a thread, unless it is known. If work on an
        earlier start is done, that will do, so that a moving body is waited for only once.

        Raises:
            NotReadyError: it is being found.
        """
        if isinstance(self._motion, ThreadWork):
            if not self._motion.is_done:
                raise NotReadyError
        elif self._start is None or not self._start.is_same_as(start):
            self._start = start
            self._motion = ThreadWork(lambda _: start.motion(), "first contacts")
            raise NotReadyError
