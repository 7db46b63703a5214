"""The solver on the GPU: guides stay there from the simulation to the drawing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ... import motion_flow
from ...arrays import Floats
from ...dynamics.colliders import PosedCollider
from ...dynamics.neighbours import FrameSteps
from ...dynamics.painted import PaintedGuides
from ...dynamics.settings import DynamicsSettings
from ...motion_flow import FrameInput, Motion
from ...refine.lead_out import NO_LED_OUT, LedOut
from ...render.collider_textures import UploadedColliders
from ...render.dynamics_pass import DynamicsPass
from ...render.ride_pass import RidePass, RideTexels
from ...render.snapshot import Snapshot
from ...render.strand_layout import from_strand_rows
from ...render.textures import texture_to_array
from ...rig_flow import Pose, Rig
from .base_solver import BaseSolver


class ComputeSolver(BaseSolver):
    """Solver on the GPU. Textures are made with the first frame that is simulated or shown.

    The dynamics of the motion that it holds are those from which the GPU started; newer states are
    on the GPU alone.

    Args:
        texels: see `texels_of`.
    """

    device = "compute"

    def __init__(
        self, rig: Rig, motion: Motion | None = None, texels: RideTexels | None = None
    ) -> None:
        super().__init__(rig, motion)
        self._is_resting = motion is None
        self._are_strands_current = False
        self._time_since_led = np.inf  # time since the frame that leading out continues from [s]
        self._dynamics: DynamicsPass | None = None
        self._colliders = UploadedColliders()
        self._ride = RidePass(
            rig.strands,
            rig.root_holds,
            rig.guides,
            rig.guide_grid,
            rig.riders,
            rig.holds,
            self._colliders,
            texels,
        )
        self._ride.lead_out.set_clearance(self._motion.clearance)

    @property
    def motion(self) -> Motion:
        if self._is_baked or self._dynamics is None:
            return super().motion
        return replace(
            self._motion,
            dynamics=self._dynamics.read(),
            guides=self.guides(),
        )

    def rest(self, pose: Pose, known: Motion | None = None) -> None:
        self._take(known or motion_flow.begin(self._rig, pose))
        self._is_resting = True

    def find_clearance(
        self,
        colliders: tuple[PosedCollider, ...],
        settings: DynamicsSettings,
        painted: PaintedGuides | None = None,
    ) -> None:
        self._motion = motion_flow.with_clearance(
            self._rig, self._motion, colliders, settings, painted
        )
        self._ride.lead_out.set_clearance(self._motion.clearance)

    def steps(self, frame: FrameInput) -> FrameSteps[None]:
        if self._is_baked:
            self._take(self.motion)
        if self._motion.clearance is not None and not self._is_resting:
            self._update_strands()  # so that motion does not depend on which frames are shown
            self._time_since_led = frame.hair_time
        self.find_clearance(frame.colliders, frame.settings, frame.painted)
        motion = self._motion
        if self._dynamics is None:
            self._dynamics = DynamicsPass(motion.dynamics, self._colliders)
        target = motion_flow.style_of_guides(self._rig, frame.pose)
        drive = motion.drive(frame, target, motion_flow.held_cvs(self._rig, frame.pose))
        yield from self._dynamics.steps(drive, frame.settings, frame.hair_time)
        self._motion = replace(
            motion,
            carried_guides=target,
            pose=frame.pose,
            previous_carried_guides=motion.carried_guides,
            duration=frame.duration,
            hair_time=frame.hair_time,
            colliders=frame.colliders,
        )
        self._is_resting = self._are_strands_current = False

    def take_style(self, rig: Rig) -> None:
        if self._motion.clearance is not None and not self._is_resting:
            self._update_strands()  # the last frame, with its own style
        self._rig, self._motion = rig, motion_flow.with_style(rig, self._motion)
        self._ride.take_style(rig.strands, rig.guide_grid, rig.riders)
        if self._dynamics is not None:
            self._dynamics.take_rest(self._motion.dynamics.rest)

    def guides(self) -> Floats:
        texture = self._guides_texture
        if texture is None:
            return self._motion.guides
        guide_count, cv_count, _ = self._motion.guides.shape
        pixels = from_strand_rows(texture_to_array(texture), guide_count, cv_count)
        return np.ascontiguousarray(pixels[..., :3])

    def strands(self) -> Floats:
        self._update_strands()
        return self._ride.read()

    def led_out_strands(self) -> LedOut:
        self._update_strands()
        return self._led_out if self._is_baked else self._ride.read_led()

    def with_strands(self, snapshot: Snapshot) -> Snapshot:
        self._update_strands()
        return replace(snapshot, device_points=self._ride.points)

    def release(self) -> None:
        """Free everything on the GPU; the next frame goes on from the motion that was read back."""
        is_resting, is_baked, led = self._is_resting, self._is_baked, self._led_out
        motion = self._motion if is_baked else self.motion
        self._ride.release()
        self._take(motion)
        self._is_resting, self._is_baked, self._led_out = is_resting, is_baked, led

    @property
    def _guides_texture(self) -> Any:
        """The guides on the GPU; None if those of the motion are current."""
        return None if self._dynamics is None else self._dynamics.guides

    def _take(self, motion: Motion) -> None:
        """Show the guides of this motion; the simulation on the GPU ends."""
        if self._dynamics is not None:
            self._dynamics.release()
            self._dynamics = None
        self._motion, self._led_out, self._time_since_led = motion, NO_LED_OUT, np.inf
        self._ride.lead_out.set_clearance(motion.clearance)
        self._is_baked = self._is_resting = self._are_strands_current = False

    def _update_strands(self) -> None:
        """Update the strands on the GPU to this moment, once."""
        if self._are_strands_current and self._ride.points.texture is not None:
            return
        pose, texture = self.pose, self._guides_texture
        head, matrix, anchors = pose.head_positions, pose.matrix, pose.anchors
        if self._is_resting and motion_flow.held_guides(self._rig, pose) is None:
            self._ride.carry(head, matrix, anchors)
        else:
            guides = self._motion.guides if texture is None else texture
            colliders = self._motion.colliders
            self._ride.ride(
                head, matrix, guides, anchors, colliders, self._led_out, self._time_since_led
            )
        self._are_strands_current = True


def texels_of(rig: Rig) -> RideTexels:
    """The data of this rig's strands that a solver uploads; a thread may make it earlier."""
    return RideTexels.of(rig.strands, rig.root_holds, rig.riders)
