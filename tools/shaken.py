"""Hair on a head that shakes as `hairloom simulate` shakes it, without a scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hairloom.addon.blender.command_line.simulate_job import shake_matrix
from hairloom.addon.rig_flow import Pose, Rig

GRAVITY = np.array([0.0, 0.0, -9.81])  # [m/s^2]


def shaken_poses(rig: Rig, frame_count: int, rate: float) -> list[Pose]:
    """The head in each frame, from rest on."""
    assert rig.head is not None
    low, high = rig.head.bounds()
    poses = []
    for frame in range(frame_count):
        matrix = shake_matrix((low + high) / 2.0, frame / rate)
        positions = rig.head.positions @ matrix[:3, :3].T + matrix[:3, 3]
        poses.append(Pose(positions.astype(np.float32), matrix))
    return poses


@dataclass(frozen=True, eq=False)
class ComputedMotion:
    """A `GuideMotion` that is computed: frame_state gives the pose and the guides at a frame."""

    rig: Rig
    frames: range
    frame_rate: float
    frame_state: Callable[[int], tuple[Pose, np.ndarray]]
    notes: tuple[str, ...] = ()

    def at(self, frame: int) -> tuple[Pose, np.ndarray]:
        return self.frame_state(frame)
