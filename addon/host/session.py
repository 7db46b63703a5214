"""The live session of one groom: read once, then carried, simulated and drawn from arrays.

A session holds numbers and arrays, never a reference into Blender's data.
"""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from .. import pipeline
from ..arrays import Floats
from ..errors import HairloomError
from ..pipeline import Pose, Rig
from ..render.snapshot import Snapshot
from ..strands import StrandSet
from .baked_rig import BakedRig, RestMatrices, frame_arrays, rig_arrays, used_vertices
from .choices import Choices
from .fingerprints import collider_places, groom_fingerprint
from .lights import read_ambient, read_lights
from .objects import Body, head_of, matrix_of
from .obstacles import Obstacles
from .poses import check_finite, read_pose
from .simulated import Arrays, hashes
from .solvers import Solver, form_of, solver_of
from .source import dynamics_warnings, read_source, refuse_own_dynamics, usable_curves
from .studio import gpu_in_use
from .wind import scene_wind

#: Blender's names of what it draws and computes by -> those that artists know
_BACKENDS = {"OPENGL": "OpenGL", "VULKAN": "Vulkan", "METAL": "Metal"}


class Session:
    """One groom while it is previewed or baked; fulfils `simulated.Simulated`.

    Args:
        hair: a hair curves object.
        baked: the rig of a bake of this very groom, to be the same to the bit.
        is_drawn: False leaves out what only drawing needs.

    Raises:
        HairloomError: no hair curves, none that can be used, or of another scale than the head.
    """

    def __init__(
        self,
        hair: bpy.types.Object,
        depsgraph: bpy.types.Depsgraph,
        *,
        baked: BakedRig | None = None,
        is_drawn: bool = True,
    ) -> None:
        head = head_of(hair)
        self.hair = Body.at_rest(hair, depsgraph)
        self.source = read_source(hair, depsgraph)
        uses_head = self.source.head is not None and head is not None
        self.head = Body.at_rest(head, depsgraph) if uses_head else None
        self.head_uid = head and head.session_uid
        self.obstacles: Obstacles | None = None
        self.is_playing = False
        self.is_stale = False
        self._is_drawn = is_drawn
        self.choices = Choices.of(hair)
        check_finite(hair.name, self.hair.rest)
        if baked is not None and (baked.rests.head is None) == (self.head is None):
            rig = self._rig_of(baked)
        else:
            rig = pipeline.prepare(
                self.source.strands, self.source.head, self.choices.guides, place=self.name
            )
        self._take_rig(rig, depsgraph)

    @property
    def uid(self) -> int:
        return self.hair.handle.uid

    @property
    def name(self) -> str:
        return self.hair.handle.name

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the artist should know about hair, head and colliders."""
        hair = self.hair.handle.find()
        doubled = () if hair is None else dynamics_warnings(hair)
        found = () if self.obstacles is None else self.obstacles.warnings
        return (*self.source.warnings, *doubled, *found)

    @property
    def computed_on(self) -> str:
        """Such as "GPU (OpenGL, llvmpipe)"."""
        if self.solver.form == "numpy":
            return "CPU (numpy)"
        used = gpu_in_use()
        backend = _BACKENDS.get(used["backend"], used["backend"])
        return f"GPU ({backend}, {used['renderer'].partition(' (')[0]})"

    @property
    def strands(self) -> Floats:
        """All strands as they are shown, (strand_count, cv_count, 3) [m]; reads back from a GPU."""
        return self.solver.strands()

    def _take_rig(self, rig: Rig, depsgraph: bpy.types.Depsgraph) -> None:
        """Everything that hangs on the strands and on the choice of guides."""
        self.rig = rig
        self._used = used_vertices(rig)
        self.solver: Solver = solver_of(rig, self.choices.dynamics.form)
        occlusion = None
        if self._is_drawn:
            occlusion = pipeline.rest_occlusion(rig, self.choices.ambient)
        self.snapshot = Snapshot(
            strands=rig.strands.grid,
            radius=rig.strands.radius.reshape(rig.strands.strand_count, -1),
            occlusion=occlusion,
            shading=self.choices.shading,
            strand_settings=self.choices.strands,
        )
        self.light(depsgraph)
        self.rest(depsgraph)
        self.is_stale = False

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
        self.choices = choices
        rig = pipeline.prepare(strands, self.source.head, choices.guides, place=self.name)
        self._take_rig(rig, depsgraph)

    def take_settings(self) -> None:
        """Take over what acts at once; guide and ambient settings make the session stale.

        Raises:
            HairloomError: the form of computing that was chosen is not to be had here.
        """
        choices = Choices.of(self.hair.found())
        before = self.choices
        self.is_stale |= (choices.guides, choices.ambient) != (before.guides, before.ambient)
        self.choices = replace(choices, guides=before.guides, ambient=before.ambient)
        self.snapshot = replace(
            self.snapshot, shading=choices.shading, strand_settings=choices.strands
        )
        if choices.dynamics.form != before.dynamics.form:
            self._change_form(choices.dynamics.form)

    def _change_form(self, form: str) -> None:
        """Go on where the hair is now, with another solver."""
        if form_of(form) != self.solver.form:
            self.solver = solver_of(self.rig, form, self.solver.motion)
            self._show()

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
        self.solver.rest(self._pose(depsgraph))
        if self.is_playing and self.obstacles is not None:
            self.obstacles.rest(depsgraph)
        self._show()

    def has_moved(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether the body is elsewhere than in what is shown.

        Raises:
            HairloomError: as `rest`.
        """
        now, shown = self._pose(depsgraph), self.solver.pose
        if now.head_positions is None or shown.head_positions is None:
            return not np.array_equal(now.matrix, shown.matrix)
        return not np.array_equal(now.head_positions, shown.head_positions)

    def play(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Get ready to simulate from the style on; makes the colliders, which can take a second.

        Raises:
            HairloomError: as `rest`, or Blender's own hair dynamics is on.
        """
        hair = self.hair.found()
        self.is_playing = False
        refuse_own_dynamics(hair)
        self.take_settings()
        self.obstacles = Obstacles.of(
            hair,
            self.head,
            self.rig.head,
            self.choices.dynamics,
            depsgraph,
            self.obstacles,
            self._used,
        )
        self.is_playing = True
        self.rest(depsgraph)

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
        self.solver.advance(
            pose,
            () if self.obstacles is None else self.obstacles.move(depsgraph, duration),
            self.choices.dynamics,
            gravity_of(depsgraph.scene),
            duration,
            scene_wind(depsgraph),
        )
        self._show()

    def constants(self) -> Arrays:
        """See `baked_rig.rig_arrays`."""
        rests = RestMatrices(self.hair.rest, None if self.head is None else self.head.rest)
        return rig_arrays(self.rig, rests)

    def recorded(self) -> Arrays:
        """See `baked_rig.frame_arrays`."""
        return frame_arrays(self.solver.pose, self.solver.guides(), self._used)

    def show_recorded(self, frame: Arrays) -> None:
        """Hair as it was recorded, on the head as that was.

        Raises:
            HairloomError: the frame is of another groom.
        """
        rig = self.rig
        baked = BakedRig(rig, RestMatrices(self.hair.rest, None), self._used)
        shapes = [len(rig.guides), rig.strands.grid.shape[1], 3], len(self._used)
        found = list(frame["guides"].shape), len(frame.get("head", ()))
        if found != shapes:
            raise HairloomError(
                "its bake is of another groom, or of other guides",
                place=self.name,
                remedy="Bake again, or delete the bake",
            )
        self.solver.carry(baked.pose(frame), frame["guides"])
        self._show()

    def fingerprint(self, depsgraph: bpy.types.Depsgraph) -> str:
        """See `simulated.Simulated`."""
        hair = self.hair.found()
        head = None if self.head is None else self.head.found()
        return groom_fingerprint(hair, head, self.choices.guides, depsgraph.scene)

    def moment(self, depsgraph: bpy.types.Depsgraph) -> str:
        """See `simulated.Simulated`."""
        pose, hair = self._pose(depsgraph), self.hair.found()
        head = None if self.head is None else self.head.found()
        return hashes(
            pose=pose.matrix if pose.head_positions is None else pose.head_positions,
            settings=replace(Choices.of(hair).dynamics, form="automatic"),
            colliders=collider_places(hair, head, depsgraph),
            forces=(gravity_of(depsgraph.scene), scene_wind(depsgraph)),
        )

    def _pose(self, depsgraph: bpy.types.Depsgraph) -> Pose:
        vertex_count = None if self.rig.head is None else len(self.rig.head.positions)
        return read_pose(self.hair, self.head, vertex_count, depsgraph)

    def _show(self) -> None:
        self.snapshot = self.solver.shown(self.snapshot)


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
