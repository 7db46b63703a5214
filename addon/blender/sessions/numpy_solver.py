"""The solver on the CPU."""

from __future__ import annotations

from dataclasses import replace
from typing import Self

from ... import motion_flow
from ...arrays import Floats
from ...dynamics.colliders import PosedCollider
from ...dynamics.neighbours import FrameSteps
from ...dynamics.painted import PaintedGuides
from ...dynamics.settings import DynamicsSettings
from ...motion_flow import FrameInput, Motion
from ...refine.lead_out import NO_LED_OUT, LedOut
from ...render.snapshot import Snapshot
from ...rig_flow import Pose, Rig
from .base_solver import BaseSolver


class NumpySolver(BaseSolver):
    """Solver on the CPU; the same to the last bit on every machine."""

    device = "numpy"

    def __init__(self, rig: Rig, motion: Motion | None = None) -> None:
        super().__init__(rig, motion)
        self._strands: Floats | None = None

    @classmethod
    def at_rest(cls, rig: Rig, pose: Pose) -> Self:
        """A solver with hair at rest in this pose, as after `rest`."""
        solver = cls(rig, motion_flow.begin(rig, pose))
        solver._strands = motion_flow.strands_at_rest(rig, pose)
        return solver

    def rest(self, pose: Pose, known: Motion | None = None) -> None:
        self._take(known or motion_flow.begin(self._rig, pose))
        self._strands = motion_flow.strands_at_rest(self._rig, pose)

    def find_clearance(
        self,
        colliders: tuple[PosedCollider, ...],
        settings: DynamicsSettings,
        painted: PaintedGuides | None = None,
    ) -> None:
        self._motion = motion_flow.with_clearance(
            self._rig, self._motion, colliders, settings, painted
        )

    def steps(self, frame: FrameInput) -> FrameSteps[None]:
        # so that motion does not depend on which frames are shown
        led = NO_LED_OUT if self._motion.clearance is None else self.led_out_strands()
        motion = yield from motion_flow.steps(self._rig, self.motion, frame, led)
        self._take(motion)

    def take_style(self, rig: Rig) -> None:
        if self._motion.clearance is not None:
            self.led_out_strands()  # of the last frame, with its own style
        self._rig, self._motion = rig, motion_flow.with_style(rig, self._motion)

    def guides(self) -> Floats:
        return self._motion.guides

    def strands(self) -> Floats:
        if self._strands is None and self._is_baked:
            shown = self._motion
            self._strands = motion_flow.strands_at(
                self._rig, shown.pose, shown.guides, self._led_out
            )
        elif self._strands is None:
            self._strands, self._led_out = motion_flow.strands_and_led(self._rig, self._motion)
        return self._strands

    def led_out_strands(self) -> LedOut:
        self.strands()
        return self._led_out

    def with_strands(self, snapshot: Snapshot) -> Snapshot:
        return replace(snapshot, points=self.strands(), device_points=None)

    def _take(self, motion: Motion) -> None:
        self._motion, self._is_baked, self._strands = motion, False, None
        self._led_out = NO_LED_OUT
