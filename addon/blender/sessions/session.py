"""The live session of one groom: read once, then carried, simulated and drawn from arrays."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial

import bpy
import numpy as np

from ...arrays import Floats
from ...dynamics.settings import DynamicsSettings
from ...errors import HairloomError
from ...pipeline import Rig
from ...render.snapshot import Snapshot
from ..bakes.baked_rig import BakedRig, RestMatrices, frame_arrays
from ..bakes.simulated import Arrays
from ..cards.show import ShownCards
from ..colliders.fields import NotMadeYetError
from ..colliders.obstacles import Obstacles
from ..scene.source import dynamics_warnings, refuse_own_dynamics
from ..scene.wind import gravity_of, scene_wind
from .groom import Groom
from .groom_picture import GroomPicture
from .making import Made, make
from .measures import FrameTimes
from .solvers import Solver, computed_on, form_of, solver_of


class Session(Groom):
    """One groom while it is previewed or baked; fulfils `simulated.Simulated`.

    Args and errors are those of `Groom`.
    """

    def __init__(
        self,
        hair: bpy.types.Object,
        depsgraph: bpy.types.Depsgraph,
        *,
        baked: BakedRig | None = None,
        is_drawn: bool = True,
        blocking: bool = True,
        arrived: Callable[[Session], None] = lambda session: None,
    ) -> None:
        tell = partial(arrived, self)
        super().__init__(hair, depsgraph, baked, is_drawn=is_drawn, blocking=blocking, arrived=tell)
        self.times = FrameTimes()
        self.obstacles: Obstacles | None = None
        self.is_playing = False
        self.is_stale = False
        self.picture = GroomPicture(self.hair.found, is_drawn=is_drawn, arrived=tell)
        self._take(self.made, None, depsgraph)

    @property
    def snapshot(self) -> Snapshot:
        """What is drawn."""
        return self.picture.snapshot

    @property
    def cards(self) -> ShownCards:
        return self.picture.cards

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

    def _take(self, made: Made, before: Made | None, depsgraph: bpy.types.Depsgraph) -> None:
        """Everything that hangs on the strands and on the choice of guides.

        Hair that plays goes on, unless its guides are others now.
        """
        self.made = made
        self._reading.accept(made.order)
        is_same = before is not None and before.rig is made.rig
        goes_on = before is not None and self.is_playing and _same_guides(made.rig, before.rig)
        if not is_same:
            motion = self.solver.motion if goes_on else None
            self.solver: Solver = solver_of(
                made.rig, self.settings[DynamicsSettings].device, motion
            )
        self.picture.take_made(made, self.settings)
        self.light(depsgraph)
        if is_same or goes_on:
            self._show()
        else:
            self.rest(depsgraph)

    def take_made(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Show the hair that was made meanwhile; waits for it.

        Raises:
            HairloomError: it cannot be made.
        """
        made = self._job.take()
        if made is not None:
            self._take(made, self.made, depsgraph)

    def finish(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Wait for the hair that is being made, and show it.

        Raises:
            HairloomError: it cannot be made.
        """
        while self.is_pending:
            self.take_made(depsgraph)

    def forget(self) -> None:
        """Nobody waits any more for hair and cards that are on their way."""
        self._job.cancel()
        self.cards.forget()

    def read_again(self, depsgraph: bpy.types.Depsgraph, *, blocking: bool = True) -> None:
        """Take over edited curves and settings of the rig; what did not change stays as it is.

        Args:
            blocking: False: other hair is made in a thread, and what was shown is shown until then.
        """
        order = self._reading.read_again(depsgraph)
        self.is_stale = False
        if order is not None and blocking and not self.is_pending:
            made = make(order, self.made, is_drawn=self._is_drawn)
            self._take(made, self.made, depsgraph)
            return
        self.take_settings()
        if order is not None:
            self._begin()
        if blocking:
            self.finish(depsgraph)

    def take_settings(self) -> None:
        """Take over what acts at once; settings of guides, children and ambient light make the
        session stale.

        Raises:
            HairloomError: the form of computing that was chosen is not to be had here.
        """
        before = self.settings
        self.is_stale |= self._reading.take_settings()
        if self.picture.take_settings(self.rig, before, self.settings):
            self._show()
        if self.settings[DynamicsSettings].device != before[DynamicsSettings].device:
            self._change_form(self.settings[DynamicsSettings].device)

    def take_cards(self) -> None:
        """Show the cards that were built meanwhile."""
        self.cards.collect()
        self._show()

    def shade_cards_again(self) -> None:
        """Other hair that shades its cards may be elsewhere now, or other hair."""
        self.cards.shade_again()
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

    def play(self, depsgraph: bpy.types.Depsgraph, *, blocking: bool = True) -> None:
        """Get ready to simulate from the style on; makes the colliders, which can take a second.

        Args:
            blocking: False: do not wait for the fields of colliders that are to be made.

        Raises:
            HairloomError: as `rest`, or Blender's own hair dynamics is on.
            NotMadeYetError: a field, or all of the hair, is being made, and nobody waits.
        """
        self.is_playing = False
        refuse_own_dynamics(self.hair.found())
        self.take_settings()
        if blocking:
            self.finish(depsgraph)
        self._read_obstacles(depsgraph, blocking=blocking)
        if not self.is_made:
            raise NotMadeYetError
        self.is_playing = True
        self.rest(depsgraph)

    def make_fields(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Have the fields of its colliders made beside the window's work, so that Play finds them.

        What is wrong with a collider is told by Play.
        """
        with suppress(HairloomError, NotMadeYetError):
            self._read_obstacles(depsgraph, blocking=False)

    def _read_obstacles(self, depsgraph: bpy.types.Depsgraph, *, blocking: bool) -> None:
        self.obstacles = Obstacles.of(
            self.hair.found(),
            self.head,
            self.rig.head,
            self.settings[DynamicsSettings],
            depsgraph,
            self.obstacles,
            self.made.used,
            blocking=blocking,
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
        with self.times.measured("simulation"):
            pose = self._pose(depsgraph)
            self.solver.advance(
                pose,
                () if self.obstacles is None else self.obstacles.move(depsgraph, duration),
                self.settings[DynamicsSettings],
                gravity_of(depsgraph.scene),
                duration,
                scene_wind(depsgraph),
            )
            self._show()

    def recorded(self) -> Arrays:
        """See `baked_rig.frame_arrays`."""
        return frame_arrays(self.solver.pose, self.solver.guides(), self.made.used)

    def show_recorded(self, frame: Arrays) -> None:
        """Hair as it was recorded, on the head as that was.

        Raises:
            HairloomError: the frame is of another groom.
        """
        rig = self.rig
        baked = BakedRig(rig, RestMatrices(self.hair.rest, None), self.made.used)
        shapes = [len(rig.guides), rig.strands.grid.shape[1], 3], len(self.made.used)
        found = list(frame["guides"].shape), len(frame.get("head", ()))
        if found != shapes:
            raise HairloomError(
                "its bake is of another groom, or of other guides",
                place=self.name,
                remedy="Bake again, or delete the bake",
            )
        self.solver.carry(baked.pose(frame), frame["guides"])
        self._show()

    def _show(self) -> None:
        self.picture.show(self.rig, self.solver, self.settings)


def _same_guides(one: Rig, other: Rig) -> bool:
    """Whether what moves the guides of one moves those of the other."""
    return one.head is other.head and np.array_equal(
        one.strands.grid[one.guides], other.strands.grid[other.guides]
    )
