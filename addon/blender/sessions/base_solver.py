"""What both solvers share: the motion that is shown, and showing baked guides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ... import motion_flow
from ...arrays import Floats
from ...dynamics.settings import DynamicsSettings
from ...dynamics.state import rows_of
from ...errors import HairloomError
from ...motion_flow import FrameInput, Motion
from ...refine.lead_out import NO_LED_OUT, LedOut
from ...rig_flow import Pose, Rig


class BaseSolver:
    """Holds the motion of a solver, whose guides may come from a bake; see `solvers.Solver`."""

    def __init__(self, rig: Rig, motion: Motion | None) -> None:
        self._rig = rig
        self._motion = motion or motion_flow.begin(rig, rig.rest_pose)
        self._led_out = NO_LED_OUT
        self._is_baked = False

    @property
    def pose(self) -> Pose:
        return self._motion.pose

    @property
    def motion(self) -> Motion:
        return restarted_motion(self._rig, self._motion) if self._is_baked else self._motion

    @property
    def size(self) -> float:
        return self._motion.dynamics.rest.size

    def has_jumped(self, pose: Pose, settings: DynamicsSettings, duration: float) -> bool:
        return motion_flow.has_jumped(self._rig, self._motion, pose, settings, duration)

    def advance_rigidly(self, frame: FrameInput) -> None:
        self._take(motion_flow.advance_rigidly(self._rig, self.motion, frame))

    def show_baked(self, pose: Pose, guides: Floats, led: LedOut = NO_LED_OUT) -> None:
        self._take(carried_motion(self._rig, self._motion, pose, guides))
        self._led_out, self._is_baked = led, True

    def _take(self, motion: Motion) -> None:
        """Show this motion; drops earlier strands, led-out strands and baked guides."""
        raise NotImplementedError


def carried_motion(rig: Rig, motion: Motion, pose: Pose, guides: Floats) -> Motion:
    """A motion that shows baked guides, (guide_count, cv_count, 3) world [m], without colliders.

    Raises:
        HairloomError: the shape of the guides is not this rig's.
    """
    wanted = rig.guide_grid.shape
    if guides.shape != wanted:
        raise HairloomError(
            f"it holds guides of shape {guides.shape}, but this groom has {wanted}",
            place="bake",
            remedy="Bake again",
        )
    guides = np.ascontiguousarray(guides, np.float32)
    return replace(
        motion, pose=pose, guides=guides, colliders=(), clearance=None, guide_clearance=None
    )


def restarted_motion(rig: Rig, shown: Motion) -> Motion:
    """The motion that starts from the shown guides at rest."""
    begun = motion_flow.begin(rig, shown.pose)
    rows = rows_of(shown.guides, "bake")
    dynamics = replace(begun.dynamics, position=rows, previous=rows)
    return replace(begun, dynamics=dynamics, guides=shown.guides)
