"""A take: the guides of a groom over a range of frames, simulated once and drawn often."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import bpy
import numpy as np

from ... import pipeline
from ...arrays import Floats
from ...dynamics.colliders import Collider, PosedCollider
from ...dynamics.measure import deepest_penetration, max_stretch
from ...dynamics.settings import DynamicsSettings
from ...dynamics.way import bow
from ...errors import HairloomError
from ...exchange.files.array_file import read_arrays
from ...exchange.files.atomic import atomic_write
from ...pipeline import Pose, Rig
from ..base.objects import Body
from ..scene.surfaces import read_positions
from ..scene.wind import gravity_of, scene_wind
from .fingerprints import frame_rate

#: the shake: how far the head turns and sways, and how often
SHAKE_ANGLE = np.radians(25.0)
SHAKE_SWAY = 0.03  # [m]
SHAKE_RATE = 1.0  # [1/s]
GRAVITY = np.array([0.0, 0.0, -9.81])  # [m/s^2]


@dataclass(frozen=True)
class Take:
    """Guides in world space, and the head that they went with.

    guides: (frame_count, guide_count, cv_count, 3) float32 [m].
    heads: (frame_count, vertex_count, 3) float32 [m].
    frame_rate: [1/s].
    """

    guides: Floats
    heads: Floats
    frame_rate: float

    @property
    def frame_count(self) -> int:
        return len(self.guides)

    def pose(self, frame: int) -> Pose:
        return Pose(self.heads[frame], np.eye(4))


@dataclass(frozen=True)
class Worst:
    """The worst of all frames: stretch as a fraction, penetration in metres."""

    stretch: float
    penetration: float


@dataclass(frozen=True)
class TakeDrive:
    """What moves the hair of a take.

    poses: of the head, one a frame. frame_rate: [1/s].
    winds: (3,) [m/s] a frame, of the scene's force fields; none: still air.
    gravity: (3,) [m/s^2], world space.
    """

    poses: list[Pose]
    frame_rate: float
    winds: tuple[Floats, ...] = ()
    gravity: Floats = field(default_factory=lambda: GRAVITY)


def simulate(
    rig: Rig,
    collider: Collider,
    drive: TakeDrive,
    settings: DynamicsSettings,
    stage: Callable[[str], AbstractContextManager[None]],
    each_frame: Callable[[int], object],
) -> tuple[Take, Worst]:
    """Run the dynamics through the poses, the first being where the hair starts at rest.

    Roots and collider go smoothly through the poses, see `dynamics.way`.

    Args:
        stage: gives a context in which a named stage is timed.
        each_frame: told the number of each finished frame.
    """
    poses, rate = drive.poses, drive.frame_rate
    motion, earlier = pipeline.begin(rig, poses[0]), None
    guides, stretch, penetration = [motion.guides], 0.0, 0.0
    for frame, (before, now) in enumerate(pairwise(poses), start=1):
        bent = None if earlier is None else bow(earlier.matrix, before.matrix, now.matrix, 1.0)
        posed = (PosedCollider(collider, before.matrix, now.matrix, bent),)
        wind = drive.winds[frame] if drive.winds else pipeline.NO_WIND
        with stage("simulate frame"):
            motion = pipeline.advance(
                rig, motion, now, posed, settings, drive.gravity, 1.0 / rate, wind
            )
        earlier = before
        guides.append(motion.guides)
        stretch = max(stretch, max_stretch(motion.dynamics))
        penetration = max(penetration, deepest_penetration(motion.dynamics, posed))
        each_frame(frame)
    heads = np.stack([_head_of(pose) for pose in poses])
    return Take(np.stack(guides), heads, rate), Worst(stretch, penetration)


def shaken_poses(rig: Rig, frame_count: int, frame_rate: float) -> list[Pose]:
    """The head turning left and right and swaying: eases in, so that frame 0 is at rest."""
    assert rig.head is not None
    low, high = rig.head.bounds()
    centre = (low + high) / 2.0
    poses = []
    for frame in range(frame_count):
        seconds = frame / frame_rate
        phase = 2.0 * np.pi * SHAKE_RATE * seconds
        ease = min(seconds / 0.25, 1.0)
        matrix = _turn_about(centre, ease * SHAKE_ANGLE * np.sin(phase))
        matrix[0, 3] += ease * SHAKE_SWAY * np.sin(phase)
        moved = rig.head.positions @ matrix[:3, :3].T + matrix[:3, 3]
        poses.append(Pose(moved.astype(np.float32), matrix))
    return poses


def scene_drive(head_object: str) -> TakeDrive:
    """The head, wind and gravity as the open scene animates them, over its frame range.

    Leaves the scene where it was. Rest is where the head is now: what was read from the scene was
    read in this frame.
    """
    scene, head = bpy.context.scene, bpy.data.objects[head_object]
    shown, poses, winds = scene.frame_current, [], []
    body = Body.at_rest(head, bpy.context.evaluated_depsgraph_get())
    try:
        for frame in range(scene.frame_start, scene.frame_end + 1):
            scene.frame_set(frame)
            depsgraph = bpy.context.evaluated_depsgraph_get()
            positions = read_positions(head, depsgraph, place=head_object)
            poses.append(Pose(positions, body.moved(depsgraph)))
            winds.append(scene_wind(depsgraph))
    finally:
        scene.frame_set(shown)
    return TakeDrive(poses, frame_rate(scene), tuple(winds), gravity_of(scene))


def write_take(path: Path, take: Take) -> None:
    """Write a take as .npz, atomically."""
    with atomic_write(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, guides=take.guides, heads=take.heads, frame_rate=take.frame_rate)


def read_take(path: Path, rig: Rig) -> Take:
    """Read a take that belongs to this rig.

    Raises:
        HairloomError: not a take, or one of another groom.
    """
    try:
        data = read_arrays(path)
        guides, heads = (np.asarray(data[name], np.float32) for name in ("guides", "heads"))
        take = Take(guides, heads, float(data["frame_rate"]))
        _check(take)
    except FileNotFoundError as error:
        raise HairloomError(
            "there is no such file", place=str(path), remedy="Check the path"
        ) from error
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise HairloomError(
            "this file is no take, or it is damaged",
            place=str(path),
            remedy="Make it again with hairloom simulate",
        ) from error
    if rig.head is None:
        raise HairloomError(
            "a take needs the head that it was simulated with",
            place=str(path),
            remedy="Name the head with --head FILE_OR_OBJECT",
        )
    wanted = (len(rig.guides), rig.strands.grid.shape[1], 3), rig.head.positions.shape
    if (take.guides.shape[1:], take.heads.shape[1:]) != wanted:
        raise HairloomError(
            f"this take is of another groom (it holds guides of shape {take.guides.shape[1:]},"
            f" this groom has {wanted[0]})",
            place=str(path),
            remedy="Give the groom, head and guide settings that it was simulated with",
        )
    return take


def _check(take: Take) -> None:
    """Raise ValueError for what no take holds."""
    if not (np.isfinite(take.guides).all() and np.isfinite(take.heads).all()):
        raise ValueError("positions that are not finite")
    if take.guides.ndim != 4 or len(take.heads) != take.frame_count or not take.frame_count:
        raise ValueError("frames are missing")
    if not (np.isfinite(take.frame_rate) and take.frame_rate > 0.0):
        raise ValueError("the frame rate is no positive number")


def _head_of(pose: Pose) -> Floats:
    assert pose.head_positions is not None, "a take is of hair on a head"
    return pose.head_positions


def _turn_about(centre: Floats, angle: float) -> Floats:
    """A (4, 4) rotation about the vertical through a point."""
    cosine, sine = np.cos(angle), np.sin(angle)
    matrix = np.eye(4)
    matrix[:2, :2] = [[cosine, -sine], [sine, cosine]]
    matrix[:3, 3] = centre - matrix[:3, :3] @ centre
    return matrix
