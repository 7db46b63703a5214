"""The solver on the CPU, and what both solvers do with baked guides."""

from __future__ import annotations

from dataclasses import replace
from typing import Self

import numpy as np

from ... import motion_flow
from ...arrays import Floats
from ...dynamics.colliders import PosedCollider
from ...dynamics.neighbours import Steps
from ...dynamics.painted import PaintedGuides
from ...dynamics.settings import DynamicsSettings
from ...dynamics.state import rows_of
from ...errors import HairloomError
from ...motion_flow import FrameInput, Motion
from ...refine.lead_out import NOT_LED, LedOut
from ...render.snapshot import Snapshot
from ...rig_flow import Pose, Rig


class NumpySolver:
    """On the CPU; the same to the last bit on every machine."""

    form = "numpy"

    def __init__(self, rig: Rig, motion: Motion | None = None) -> None:
        self._rig = rig
        self._motion = motion or motion_flow.begin(rig, rig.rest_pose)
        self._is_baked = False
        self._strands: Floats | None = None
        self._led = NOT_LED

    @classmethod
    def at_rest(cls, rig: Rig, pose: Pose) -> Self:
        """With hair in its style in this pose, as `rest` brings it there."""
        solver = cls(rig, motion_flow.begin(rig, pose))
        solver._strands = motion_flow.strands_at_rest(rig, pose)
        return solver

    @property
    def pose(self) -> Pose:
        return self._motion.pose

    @property
    def motion(self) -> Motion:
        return let_go(self._rig, self._motion) if self._is_baked else self._motion

    @property
    def size(self) -> float:
        return self._motion.dynamics.rest.size

    def rest(self, pose: Pose, known: Motion | None = None) -> None:
        self._take(known or motion_flow.begin(self._rig, pose))
        self._strands = motion_flow.strands_at_rest(self._rig, pose)

    def meet(
        self,
        colliders: tuple[PosedCollider, ...],
        settings: DynamicsSettings,
        painted: PaintedGuides | None = None,
    ) -> None:
        self._motion = motion_flow.with_clearance(
            self._rig, self._motion, colliders, settings, painted
        )

    def steps(self, frame: FrameInput) -> Steps[None]:
        # what was not shown counts too: motion does not depend on who looks
        led = NOT_LED if self._motion.clearance is None else self.led()
        motion = yield from motion_flow.steps(self._rig, self.motion, frame, led)
        self._take(motion)

    def take_style(self, rig: Rig) -> None:
        if self._motion.clearance is not None:
            self.led()  # of the frame before, by its style
        self._rig, self._motion = rig, motion_flow.with_style(rig, self._motion)

    def has_jumped(self, pose: Pose, settings: DynamicsSettings, duration: float) -> bool:
        return motion_flow.has_jumped(self._rig, self._motion, pose, settings, duration)

    def go_along(self, frame: FrameInput) -> None:
        self._take(motion_flow.go_along(self._rig, self.motion, frame))

    def carry(self, pose: Pose, guides: Floats, led: LedOut = NOT_LED) -> None:
        self._take(carried_motion(self._rig, self._motion, pose, guides))
        self._led, self._is_baked = led, True

    def guides(self) -> Floats:
        return self._motion.guides

    def strands(self) -> Floats:
        if self._strands is None and self._is_baked:
            shown = self._motion
            self._strands = motion_flow.strands_at(self._rig, shown.pose, shown.guides, self._led)
        elif self._strands is None:
            self._strands, self._led = motion_flow.strands_and_led(self._rig, self._motion)
        return self._strands

    def led(self) -> LedOut:
        self.strands()
        return self._led

    def shown(self, snapshot: Snapshot) -> Snapshot:
        return replace(snapshot, points=self.strands(), device_points=None)

    def _take(self, motion: Motion) -> None:
        self._motion, self._is_baked, self._strands = motion, False, None
        self._led = NOT_LED


def carried_motion(rig: Rig, motion: Motion, pose: Pose, guides: Floats) -> Motion:
    """A motion that shows baked guides, if they belong to this rig; colliders are no matter."""
    wanted = rig.guide_grid.shape
    if guides.shape != wanted:
        raise HairloomError(
            f"it holds guides of shape {guides.shape}, this groom has {wanted}",
            place="bake",
            remedy="Bake again",
        )
    guides = np.ascontiguousarray(guides, np.float32)
    return replace(
        motion, pose=pose, guides=guides, colliders=(), clearance=None, guide_clearance=None
    )


def let_go(rig: Rig, shown: Motion) -> Motion:
    """The motion that starts from shown guides at no speed."""
    begun = motion_flow.begin(rig, shown.pose)
    rows = rows_of(shown.guides, "bake")
    dynamics = replace(begun.dynamics, position=rows, previous=rows)
    return replace(begun, dynamics=dynamics, guides=shown.guides)
