"""The live session of one groom: read once, then carried, simulated and drawn from arrays."""

from __future__ import annotations

from contextlib import suppress

import bpy
import numpy as np

from ...arrays import Floats
from ...errors import HairloomError
from ...pipeline import Motion, Pose, Rig
from ...render.snapshot import Snapshot
from ..bakes.baked_rig import BakedRig, RestMatrices, frame_arrays, rig_arrays, used_vertices
from ..cards.shown_cards import ShownCards
from ..colliders.fields import NotMadeYetError
from ..colliders.obstacles import Obstacles
from ..scene.objects import Body
from ..scene.source import Source, dynamics_warnings, refuse_own_dynamics
from ..scene.wind import gravity_of, scene_wind
from ..settings.choices import Choices
from .groom_picture import GroomPicture
from .measures import measured
from .reading import Reading
from .simulated import Arrays
from .solvers import Solver, computed_on, form_of, solver_of


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
        self._reading = Reading(hair, depsgraph)
        self.obstacles: Obstacles | None = None
        self.is_playing = False
        self.is_stale = False
        self.picture = GroomPicture(is_drawn=is_drawn)
        self._take_rig(self._reading.rig(baked), depsgraph)

    @property
    def uid(self) -> int:
        return self.hair.handle.uid

    @property
    def name(self) -> str:
        return self._reading.name

    @property
    def hair(self) -> Body:
        return self._reading.hair

    @property
    def head(self) -> Body | None:
        return self._reading.head

    @property
    def source(self) -> Source:
        return self._reading.source

    @property
    def snapshot(self) -> Snapshot:
        """What is drawn."""
        return self.picture.snapshot

    @property
    def cards(self) -> ShownCards:
        return self.picture.cards

    @property
    def choices(self) -> Choices:
        """What the artist has set, as far as it is taken over."""
        return self._reading.choices

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the artist should know about hair, head, children, colliders and lights."""
        hair = self.hair.handle.find()
        doubled = () if hair is None else dynamics_warnings(hair)
        found = () if self.obstacles is None else self.obstacles.warnings
        notes = (f"{self.name}: {note}" for note in self.rig.notes)
        cards = (f"{self.name}: {note}" for note in self.cards.warnings)
        return (*self.source.warnings, *notes, *cards, *doubled, *found, *self.picture.warnings)

    @property
    def computed_on(self) -> str:
        """Such as "GPU (OpenGL, llvmpipe)"."""
        return computed_on(self.solver.form)

    @property
    def strands(self) -> Floats:
        """All strands as they are shown, (strand_count, cv_count, 3) [m]; reads back from a GPU."""
        return self.solver.strands()

    def _take_rig(
        self, rig: Rig, depsgraph: bpy.types.Depsgraph, motion: Motion | None = None
    ) -> None:
        """Everything that hangs on the strands and on the choice of guides.

        Args:
            motion: to go on from; None: from rest.
        """
        self.rig = rig
        self._used = used_vertices(rig)
        self.solver: Solver = solver_of(rig, self.choices.dynamics.form, motion)
        self.picture.take_rig(self.hair.found(), rig, self.choices)
        self.light(depsgraph)
        if motion is None:
            self.rest(depsgraph)
        else:
            self._show()
        self.is_stale = False

    def has_another_head(self) -> bool:
        """Whether the artist has set another surface since the session began."""
        return self._reading.has_another_head()

    def read_again(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Take over edited curves and settings of the rig; what did not change stays as it is.

        Hair that plays goes on, unless its guides are others now.
        """
        self.is_stale = False
        if not self._reading.read_again(depsgraph):
            self.take_settings()
            return
        rig = self._reading.rig()
        goes_on = self.is_playing and _same_guides(rig, self.rig)
        self._take_rig(rig, depsgraph, self.solver.motion if goes_on else None)

    def take_settings(self) -> None:
        """Take over what acts at once; settings of guides, children and ambient light make the
        session stale.

        Raises:
            HairloomError: the form of computing that was chosen is not to be had here.
        """
        before = self.choices
        self.is_stale |= not self._reading.take_choices().acts_at_once(before)
        if self.picture.take_choices(self.hair.found(), self.rig, before, self.choices):
            self._show()
        if self.choices.dynamics.form != before.dynamics.form:
            self._change_form(self.choices.dynamics.form)

    def take_cards(self) -> None:
        """Show the cards that were built meanwhile."""
        self.cards.collect(self.hair.found())
        self._show()

    @property
    def is_coarse(self) -> bool:
        """Whether a slider is being moved, so that it is shaded by tables that are quickly made."""
        return self.picture.is_coarse

    def refine(self) -> None:
        """Shade by tables of full size again."""
        self.picture.refine()

    def _change_form(self, form: str) -> None:
        """Go on where the hair is now, with another solver."""
        if form_of(form) != self.solver.form:
            self.solver = solver_of(self.rig, form, self.solver.motion)
            self._show()

    def light(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Take over the scene's lights and world."""
        self.picture.light(depsgraph)

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

    def play(self, depsgraph: bpy.types.Depsgraph, *, waits: bool = True) -> None:
        """Get ready to simulate from the style on; makes the colliders, which can take a second.

        Args:
            waits: False: do not wait for the fields of colliders that are to be made.

        Raises:
            HairloomError: as `rest`, or Blender's own hair dynamics is on.
            NotMadeYetError: a field is being made, and nobody waits.
        """
        self.is_playing = False
        refuse_own_dynamics(self.hair.found())
        self.take_settings()
        self._read_obstacles(depsgraph, waits=waits)
        self.is_playing = True
        self.rest(depsgraph)

    def make_fields(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Have the fields of its colliders made beside the window's work, so that Play finds them.

        What is wrong with a collider is told by Play.
        """
        with suppress(HairloomError, NotMadeYetError):
            self._read_obstacles(depsgraph, waits=False)

    def _read_obstacles(self, depsgraph: bpy.types.Depsgraph, *, waits: bool) -> None:
        self.obstacles = Obstacles.of(
            self.hair.found(),
            self.head,
            self.rig.head,
            self.choices.dynamics,
            depsgraph,
            self.obstacles,
            self._used,
            waits=waits,
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
        with measured(self.uid, "simulation"):
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
        return rig_arrays(self.rig, self._reading.rests)

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
        return self._reading.fingerprint(depsgraph)

    def moment(self, depsgraph: bpy.types.Depsgraph) -> str:
        """See `simulated.Simulated`."""
        return self._reading.moment(self._pose(depsgraph), depsgraph)

    def _pose(self, depsgraph: bpy.types.Depsgraph) -> Pose:
        return self._reading.pose(self.rig, depsgraph)

    def _show(self) -> None:
        self.picture.show(self.rig, self.solver, self.choices)


def _same_guides(one: Rig, other: Rig) -> bool:
    """Whether what moves the guides of one moves those of the other."""
    return one.head is other.head and np.array_equal(
        one.strands.grid[one.guides], other.strands.grid[other.guides]
    )
