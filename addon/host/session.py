"""The live session of one groom: read once, then carried, simulated and drawn from arrays.

A session holds numbers and arrays, never a reference into Blender's data.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy
import numpy as np

from .. import pipeline
from ..arrays import Floats
from ..dynamics.settings import DynamicsSettings
from ..errors import HairloomError
from ..groom.settings import GuideSettings
from ..pipeline import Motion, Pose, Rig
from ..render.snapshot import Snapshot
from ..shading.ambient import AmbientSettings
from ..shading.settings import ShadingSettings, StrandSettings
from ..strands import StrandSet
from .lights import read_ambient, read_lights
from .objects import Body, head_of, matrix_of
from .obstacles import Obstacle, obstacle_of
from .properties import settings_of
from .source import read_source, usable_curves
from .surfaces import read_positions


@dataclass(frozen=True)
class Choices:
    """All that the artist has set for one groom."""

    guides: GuideSettings
    ambient: AmbientSettings
    shading: ShadingSettings
    strands: StrandSettings
    dynamics: DynamicsSettings

    @classmethod
    def of(cls, hair: bpy.types.Object) -> Choices:
        groom, character = hair.data.hairloom, hair.hairloom
        return cls(
            settings_of(groom.guides, GuideSettings),
            settings_of(groom.ambient, AmbientSettings),
            settings_of(groom.shading, ShadingSettings),
            settings_of(groom.strands, StrandSettings),
            settings_of(character.dynamics, DynamicsSettings),
        )


class Session:
    """One groom while it is previewed.

    Args:
        hair: a hair curves object.

    Raises:
        HairloomError: no hair curves, none that can be used, or of another scale than the head.
    """

    def __init__(self, hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
        head = head_of(hair)
        self.hair = Body.at_rest(hair, depsgraph)
        self.source = read_source(hair, depsgraph)
        uses_head = self.source.head is not None and head is not None
        self.head = Body.at_rest(head, depsgraph) if uses_head else None
        self.head_uid = head and head.session_uid
        self.obstacle: Obstacle | None = None
        self.is_playing = False
        self.is_stale = False
        self._prepare(hair, depsgraph)

    @property
    def uid(self) -> int:
        return self.hair.handle.uid

    @property
    def name(self) -> str:
        return self.hair.handle.name

    def _prepare(self, hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
        """Everything that hangs on the strands and on the choice of guides."""
        self.choices = Choices.of(hair)
        self.rig: Rig = pipeline.prepare(
            self.source.strands, self.source.head, self.choices.guides, place=self.name
        )
        rig = self.rig
        self.motion: Motion = pipeline.begin(rig, rig.rest_pose)
        self.snapshot = Snapshot(
            strands=rig.strands.grid,
            radius=rig.strands.radius.reshape(rig.strands.strand_count, -1),
            occlusion=pipeline.rest_occlusion(rig, self.choices.ambient),
            shading=self.choices.shading,
            strand_settings=self.choices.strands,
        )
        self.light(depsgraph)
        self.rest(depsgraph)
        self.is_stale = False

    def has_another_head(self) -> bool:
        """Whether the artist has set another surface since the session began."""
        head = head_of(self.hair.found())
        return (head and head.session_uid) != self.head_uid

    def read_again(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Take over edited curves and guide settings; what did not change stays as it is.

        The curves are taken to be in the pose in which the session began, as edits are.
        """
        hair = self.hair.found()
        self.is_stale = False
        read = usable_curves(hair, depsgraph)
        back = self.hair.rest @ np.linalg.pinv(matrix_of(hair, depsgraph))
        strands = read.strands if np.allclose(back, np.eye(4)) else read.strands.transformed(back)
        choices = Choices.of(hair)
        same_guides = (choices.guides, choices.ambient) == (
            self.choices.guides,
            self.choices.ambient,
        )
        if same_guides and _same(strands, self.source.strands):
            self.take_settings()
            return
        self.source = replace(self.source, strands=strands, dropped=read.dropped)
        self._prepare(hair, depsgraph)

    def take_settings(self) -> None:
        """Take over what acts at once; guide and ambient settings make the session stale."""
        choices = Choices.of(self.hair.found())
        before = self.choices
        self.is_stale |= (choices.guides, choices.ambient) != (before.guides, before.ambient)
        self.choices = replace(choices, guides=before.guides, ambient=before.ambient)
        self.snapshot = replace(
            self.snapshot, shading=choices.shading, strand_settings=choices.strands
        )

    def light(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Take over the scene's lights and world."""
        self.snapshot = replace(
            self.snapshot,
            lights=read_lights(depsgraph, self.snapshot.center),
            ambient=read_ambient(depsgraph.scene),
        )

    def rest(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Hair in its style, carried by the head as it is posed now.

        Raises:
            HairloomError: the hair or its head is gone, or the head's mesh is another one.
        """
        pose = self._pose(depsgraph)
        self.motion = pipeline.begin(self.rig, pose)
        if self.is_playing and self.obstacle is not None:
            self.obstacle.move(depsgraph)
        self._show(pipeline.carried(self.rig, pose))

    def play(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Get ready to simulate from the style on; makes the collider, which can take a second.

        Raises:
            HairloomError: as `rest`, or the collider is no closed mesh.
        """
        self.take_settings()
        self.rest(depsgraph)
        self.is_playing = True
        known, self.obstacle = self.obstacle, None
        self.obstacle = obstacle_of(
            self.hair.found(), self.head, self.rig.head, self.choices.dynamics, depsgraph, known
        )

    def stop(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Back to the style."""
        self.is_playing = False
        self.rest(depsgraph)

    def advance(self, depsgraph: bpy.types.Depsgraph, duration: float) -> None:
        """Simulate the time [s] since the last call, in which everything moved to where it is now.

        Raises:
            HairloomError: as `rest`.
        """
        pose = self._pose(depsgraph)
        self.motion = pipeline.advance(
            self.rig,
            self.motion,
            pose,
            () if self.obstacle is None else (self.obstacle.move(depsgraph),),
            self.choices.dynamics,
            gravity_of(depsgraph.scene),
            duration,
        )
        self._show(pipeline.strands_now(self.rig, self.motion))

    def _pose(self, depsgraph: bpy.types.Depsgraph) -> Pose:
        self.hair.found()
        if self.head is None:
            return Pose(None, self.hair.moved(depsgraph))
        head = self.head.found()
        positions = read_positions(head, depsgraph, place=head.name)
        assert self.rig.head is not None
        if len(positions) != len(self.rig.head.positions):
            raise HairloomError(
                f"its mesh now has {len(positions):,} vertices instead of "
                f"{len(self.rig.head.positions):,}, so the hair has lost its hold",
                place=head.name,
                remedy="Press Preview again",
            )
        return Pose(positions, self.head.moved(depsgraph))

    def _show(self, points: Floats) -> None:
        self.snapshot = replace(self.snapshot, strands=points)


def gravity_of(scene: bpy.types.Scene) -> Floats:
    """(3,) [m/s^2], world space."""
    return np.array(scene.gravity) if scene.use_gravity else np.zeros(3)


def _same(one: StrandSet, other: StrandSet) -> bool:
    """Whether two readings give the same hair, but for rounding in the object's matrix."""
    return (
        np.array_equal(one.offsets, other.offsets)
        and np.allclose(one.points, other.points, rtol=1e-6, atol=1e-7)
        and np.allclose(one.radius, other.radius, rtol=1e-5)
        and np.array_equal(one.group, other.group)
    )
