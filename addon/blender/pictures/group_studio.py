"""The studio with several grooms, which are drawn together: they hide and shadow each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np

from ...arrays import Floats
from ...params import Settings
from ...render.accumulation import Accumulation, Target
from ...render.camera import Camera
from ...render.camera_window import jittered, sample_place
from ...render.good_side import GoodSide, good_side
from ...render.light_samples import lights_at
from ...render.scene_pass import ScenePass
from ...render.scene_snapshot import DrawnGroom, SceneSnapshot
from ...render.snapshot import MeshSnapshot, Snapshot
from ...render.strand_layers import LayerStatistics
from ...render.strand_pass import Statistics
from ...rig_flow import Pose
from ...strands import Surface
from ...strands.join import join_strands
from .studio import Studio

_NOTHING = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class PosedCompanion:
    """A groom beside that of a GroupStudio, at one moment; see `Studio.picture`."""

    studio: Studio
    pose: Pose
    points: Floats
    guides: Floats


class GroupStudio(Studio):
    """Draws several grooms in one picture, each with its own settings. The stage is that of its own
    groom, which counts as the first.

    Args:
        companions: the other grooms; `companions` may be set again for another moment.
        arguments: of Studio, for its own groom.
    """

    def __init__(self, companions: Sequence[PosedCompanion], *arguments: Any, **more: Any) -> None:
        super().__init__(*arguments, **more)
        self.companions = tuple(companions)
        self._scene_pass, self._target = ScenePass(), Target()
        self._sum = Accumulation()

    def _draw(
        self,
        snapshot: Snapshot,
        camera: Camera,
        width: int,
        height: int,
        samples: int,
        is_soft: bool = True,
        on_sample: Callable[[int], object] = lambda done: None,
    ) -> Floats:
        """As `Studio._draw`, with all companions beside this snapshot."""
        meshes, lights = snapshot.meshes, snapshot.lights
        own = replace(snapshot, meshes=(), lights=())
        others = (
            each.studio.snapshot(each.pose, each.points, each.guides) for each in self.companions
        )
        scene = SceneSnapshot(
            meshes=meshes,
            casters=meshes,
            grooms=tuple(DrawnGroom(number, hair) for number, hair in enumerate((own, *others))),
            ambient=snapshot.ambient,
        )
        self._sum.begin(width, height)
        count = self.sample_count(samples)
        for sample in range(count):
            on_sample(sample)
            place = sample_place(sample, samples)
            lit = lights_at(lights, sample, self._ball.center) if is_soft else lights
            moved = jittered(camera, place, width, height, sample)
            now = replace(scene, lights=lit)
            self._scene_pass.draw(now, moved, self._target, (width, height), _NOTHING)
            self._sum.add(self._target.color)
        on_sample(count)
        self._notes |= dict.fromkeys(self._scene_pass.notes)
        return self._sum.mean()

    def show_look(self, *look: Settings) -> None:
        """Draw all grooms with these settings; with none, each with its own."""
        super().show_look(*look)
        for each in self.companions:
            each.studio.show_look(*look)

    def sample_count(self, samples: int) -> int:
        """The largest number of samples that one of the grooms needs."""
        counts = [each.studio.sample_count(samples) for each in self.companions]
        return max(super().sample_count(samples), *counts)

    @cached_property
    def side(self) -> GoodSide:
        """The directions from which all hair together is best seen."""
        studios = [each.studio for each in self.companions]
        strands = reduce(join_strands, [self.parents, *(each.parents for each in studios)])
        heads = [self.head, *(each.head for each in studios)]
        return good_side(strands, next((each for each in heads if each is not None), None))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about each groom and its head."""
        others = [note for each in self.companions for note in each.studio.warnings]
        return tuple(dict.fromkeys((*super().warnings, *others)))

    @property
    def statistics(self) -> Statistics:
        """The counts of all hair that was drawn in the last picture."""
        found = self._scene_pass.statistics
        return Statistics(
            sum(each.strands for each in found),
            sum(each.pieces for each in found),
            sum(each.vertices for each in found),
            LayerStatistics(parts=max((each.layers.parts for each in found), default=0)),
        )

    def framed_points(self, pose: Pose, points: Floats) -> Floats:
        """Points of all hair that pictures show, and of the heads near it, (n, 3) [m]."""
        others = [each.studio.framed_points(each.pose, each.points) for each in self.companions]
        return np.concatenate([super().framed_points(pose, points), *others])

    def strand_middles(self, points: Floats) -> Floats:
        """The middle points of the strands of all grooms, (strand_count, 3) [m]."""
        others = [each.studio.strand_middles(each.points) for each in self.companions]
        return np.concatenate([super().strand_middles(points), *others])

    def _meshes_of_picture(self, pose: Pose) -> tuple[MeshSnapshot, ...]:
        """Each head once, with the ambient light that all hair on it lets through."""
        heads: list[tuple[Studio, Pose, Floats | None]] = []
        own = [(self, pose), *((each.studio, each.pose) for each in self.companions)]
        for studio, posed in own:
            for number, (other, its_pose, occlusion) in enumerate(heads):
                if _is_same_head(studio.head, posed, other.head, its_pose):
                    heads[number] = other, its_pose, _product(occlusion, studio.head_occlusion)
                    break
            else:
                heads.append((studio, posed, studio.head_occlusion))
        found = [each for each in heads if each[0].head is not None]
        return tuple(
            replace(mesh, key=(number, part))
            for number, (studio, posed, occlusion) in enumerate(found)
            for part, mesh in enumerate(studio.meshes(posed, occlusion))
        )


def _is_same_head(one: Surface | None, pose: Pose, other: Surface | None, its_pose: Pose) -> bool:
    """Whether both are the same mesh in the same place."""
    if one is None or other is None:
        return one is other
    if pose.head_positions is None or its_pose.head_positions is None:
        return False
    return np.array_equal(one.triangles, other.triangles) and np.allclose(
        pose.head_positions, its_pose.head_positions, atol=1.0e-5
    )


def _product(one: Floats | None, other: Floats | None) -> Floats | None:
    if one is None or other is None:
        return other if one is None else one
    return one * other
