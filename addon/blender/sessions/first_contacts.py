"""How far hair stays from its colliders, found where it begins to play.

That takes some hundredths of a second, with many children a tenth: longer than a frame. So Play has
it found beside the window's work, and it is kept, as each round of playback begins alike.
"""

from __future__ import annotations

from dataclasses import dataclass

from ... import motion_flow
from ...dynamics.colliders import PosedCollider
from ...dynamics.settings import DynamicsSettings
from ...motion_flow import Motion
from ...rig_flow import Pose, Rig
from ..base.thread_work import ThreadWork
from ..colliders.fields import NotMadeYetError


@dataclass(frozen=True, eq=False)
class Start:
    """Where hair begins to play.

    colliders: as they stand.
    """

    rig: Rig
    pose: Pose
    colliders: tuple[PosedCollider, ...]
    settings: DynamicsSettings

    def is_as(self, other: Start) -> bool:
        """Whether hair is as far from as many colliders; `with_clearance` looks at the settings."""
        return (
            self.rig is other.rig
            and self.pose.is_as(other.pose)
            and len(self.colliders) == len(other.colliders)
            and all(map(PosedCollider.stands_as, self.colliders, other.colliders))
        )

    def motion(self) -> Motion:
        """Hair at rest that knows how far it stays from them."""
        motion = motion_flow.begin(self.rig, self.pose)
        return motion_flow.with_clearance(self.rig, motion, self.colliders, self.settings)


class FirstContacts:
    """The motion of the start that was asked for last."""

    def __init__(self) -> None:
        self._start: Start | None = None
        self._motion: Motion | ThreadWork[Motion] | None = None

    def keep(self, start: Start, motion: Motion) -> None:
        """It was found elsewhere."""
        self._start, self._motion = start, motion

    def known(self, start: Start) -> Motion | None:
        """The motion of this start if it is known, or about to be, which is waited for."""
        if self._start is None or not self._start.is_as(start):
            return None
        if not isinstance(self._motion, ThreadWork):
            return self._motion
        self._motion.wait()
        return self._motion.result()

    def find(self, start: Start) -> None:
        """Have it found in a thread, unless it is known. A body that moves is waited for once: that
        of the start which was asked for before will do.

        Raises:
            NotMadeYetError: that is not done yet.
        """
        if isinstance(self._motion, ThreadWork):
            if not self._motion.is_done:
                raise NotMadeYetError
        elif self._start is None or not self._start.is_as(start):
            self._start = start
            self._motion = ThreadWork(lambda _: start.motion(), "first contacts")
            raise NotMadeYetError
