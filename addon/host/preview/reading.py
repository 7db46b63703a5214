"""What is read of one groom: curves, head and settings, and where both bodies are.

It holds numbers and arrays, never a reference into Blender's data.
"""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ... import pipeline
from ...pipeline import Pose, Rig
from ...strands import StrandSet
from ..bakes.baked_rig import BakedRig, RestMatrices
from ..scene.objects import Body, head_of, matrix_of
from ..scene.poses import check_finite, read_pose
from ..scene.source import read_density, read_source, usable_curves
from ..scene.wind import gravity_of, scene_wind
from ..settings.choices import Choices
from .fingerprints import collider_places, groom_fingerprint
from .simulated import hashes


class Reading:
    """One groom as it was read.

    Args:
        hair: a hair curves object.

    Raises:
        HairloomError: no hair curves, or none that can be used.
    """

    def __init__(self, hair: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
        head = head_of(hair)
        self.hair = Body.at_rest(hair, depsgraph)
        self.source = read_source(hair, depsgraph)
        uses_head = self.source.head is not None and head is not None
        self.head = Body.at_rest(head, depsgraph) if uses_head else None
        self._head_uid = head and head.session_uid
        self.choices = Choices.of(hair)
        check_finite(hair.name, self.hair.rest)

    @property
    def name(self) -> str:
        return self.hair.handle.name

    @property
    def rests(self) -> RestMatrices:
        return RestMatrices(self.hair.rest, None if self.head is None else self.head.rest)

    def rig(self, baked: BakedRig | None = None) -> Rig:
        """The groom made ready to move.

        Args:
            baked: the rig of a bake of this very groom, to be the same to the bit.

        Raises:
            HairloomError: the groom is of another scale than the head.
        """
        if baked is not None and (baked.rests.head is None) == (self.head is None):
            return self._rig_of(baked)
        return pipeline.prepare(
            self.source.strands,
            self.source.head,
            self.choices.guides,
            place=self.name,
            children=self.choices.children,
            density=self.source.density,
        )

    def _rig_of(self, baked: BakedRig) -> Rig:
        """The rig of a bake; rest is where hair and head were then."""
        back = baked.rests.hair @ np.linalg.pinv(self.hair.rest)
        strands = self.source.strands.transformed(back)
        self.source = replace(self.source, strands=strands, head=baked.rig.head)
        self.hair.rest = baked.rests.hair
        if self.head is not None and baked.rests.head is not None:
            self.head.rest = baked.rests.head
        return baked.rig

    def has_another_head(self) -> bool:
        """Whether the artist has set another surface since."""
        head = head_of(self.hair.found())
        return (head and head.session_uid) != self._head_uid

    def read_again(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Take over edited curves, weights and settings; whether the rig is another one now.

        The curves are taken to be in the pose in which the reading began, as edits are.

        Raises:
            HairloomError: the hair is gone, or none that can be used is left.
        """
        hair, before = self.hair.found(), self.source
        read = usable_curves(hair, depsgraph)
        back = self.hair.rest @ np.linalg.pinv(matrix_of(hair, depsgraph))
        strands = read.strands if np.allclose(back, np.eye(4)) else read.strands.transformed(back)
        if _same(strands, before.strands):
            strands = before.strands
        choices = Choices.of(hair)
        density, warning = read_density(hair, before.head, depsgraph)
        is_same = (
            choices.acts_at_once(self.choices)
            and strands is before.strands
            and np.array_equal(density, before.density)  # type: ignore[arg-type]
        )
        self.source = replace(
            before,
            strands=strands,
            dropped=read.dropped,
            density=density,
            density_warning=warning,
        )
        if not is_same:
            self.choices = choices
        return not is_same

    def take_choices(self) -> Choices:
        """Take over what acts at once; returns all that the artist has set by now."""
        choices = Choices.of(self.hair.found())
        self.choices = choices.at_once(self.choices)
        return choices

    def pose(self, rig: Rig, depsgraph: bpy.types.Depsgraph) -> Pose:
        """Where the body is now; see `poses.read_pose`."""
        vertex_count = None if rig.head is None else len(rig.head.positions)
        return read_pose(self.hair, self.head, vertex_count, depsgraph)

    def fingerprint(self, depsgraph: bpy.types.Depsgraph) -> str:
        """See `simulated.Simulated`."""
        hair = self.hair.found()
        head = None if self.head is None else self.head.found()
        return groom_fingerprint(hair, head, self.choices, depsgraph.scene)

    def moment(self, pose: Pose, depsgraph: bpy.types.Depsgraph) -> str:
        """See `simulated.Simulated`."""
        hair = self.hair.found()
        head = None if self.head is None else self.head.found()
        return hashes(
            pose=pose.matrix if pose.head_positions is None else pose.head_positions,
            settings=replace(Choices.of(hair).dynamics, form="automatic"),
            colliders=collider_places(hair, head, depsgraph),
            forces=(gravity_of(depsgraph.scene), scene_wind(depsgraph)),
        )


def _same(one: StrandSet, other: StrandSet) -> bool:
    """Whether two readings give the same hair, but for rounding in the object's matrix."""
    return (
        np.array_equal(one.offsets, other.offsets)
        and np.allclose(one.points, other.points, rtol=1e-6, atol=1e-7)
        and np.allclose(one.radius, other.radius, rtol=1e-5)
        and np.array_equal(one.group, other.group)
    )
