"""The live session of one groom: read once, then carried, simulated and drawn from arrays."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from .. import pipeline
from ..arrays import Floats
from ..errors import HairloomError
from ..pipeline import Motion, Pose, Rig
from ..render.hair_ball import HairBall
from ..shading.marschner.tables import DEFAULT_SIZE, PREVIEW_SIZE
from ..shading.volume.shadow_lights import shadow_warnings
from ..strands import Surface
from .baked_rig import BakedRig, RestMatrices, frame_arrays, rig_arrays, used_vertices
from .choices import Choices
from .hiders import Hiders
from .lights import (
    light_warnings,
    no_light_warnings,
    read_ambient,
    read_lights,
    scene_lights_are_shown,
)
from .objects import Body
from .obstacles import Obstacles
from .reading import Reading
from .shown import shapes_alike, snapshot_of, with_choices, with_tables
from .shown_cards import ShownCards
from .simulated import Arrays
from .solvers import Solver, computed_on, form_of, solver_of
from .source import Source, dynamics_warnings, refuse_own_dynamics
from .wind import gravity_of, scene_wind


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
        self._is_drawn = is_drawn
        self._light_warnings: tuple[str, ...] = ()
        self._ball = HairBall()
        self.cards = ShownCards()
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
        dark = no_light_warnings(self.snapshot.lights, self.snapshot.ambient)
        lights = (*self._light_warnings, *dark, *self._shadow_warnings())
        cards = (f"{self.name}: {note}" for note in self.cards.warnings)
        return (*self.source.warnings, *notes, *cards, *doubled, *found, *lights)

    def _shadow_warnings(self) -> tuple[str, ...]:
        snapshot = self.snapshot
        if snapshot.volume.shadows == "none" or not snapshot.strand_count:
            return ()
        lights = snapshot.lights if scene_lights_are_shown() else ()
        return shadow_warnings(lights, self._ball.of(snapshot), snapshot.volume)

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
        occlusion, rank, self._hiders = None, None, None
        if self._is_drawn:
            occlusion = pipeline.rest_occlusion(rig, self.choices.ambient)
            rank = pipeline.strand_ranks(rig)
            self._hiders = None if rig.head is None else Hiders(rig.head, rig.strands.roots)
        self.snapshot = with_choices(snapshot_of(rig, occlusion, rank), self.choices)
        self._want_cards()
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
        self.snapshot = with_choices(self.snapshot, self.choices)
        if not shapes_alike(before.shading, self.choices.shading) and not bpy.app.background:
            self.snapshot = with_tables(self.snapshot, PREVIEW_SIZE)
        was, now = before, self.choices
        is_other = (was.detail.culling, was.volume.shadows) != (
            now.detail.culling,
            now.volume.shadows,
        )
        if self._want_cards() or is_other:
            self._show()
        if self.choices.dynamics.form != before.dynamics.form:
            self._change_form(self.choices.dynamics.form)

    def _want_cards(self) -> bool:
        """Have cards built if they are to be shown; whether what is shown of them changes now."""
        choices, before = self.choices, self.snapshot.cards
        if not (self._is_drawn and choices.shows_cards):
            self.cards.forget()
            return before is not None
        self.cards.want(self.hair.found(), self.rig, choices.card_form)
        return True

    def take_cards(self) -> None:
        """Show the cards that were built meanwhile, if there are any."""
        if self.cards.collect(self.hair.found()):
            self._show()

    @property
    def is_coarse(self) -> bool:
        """Whether a slider is being moved, so that it is shaded by tables that are quickly made."""
        return self.snapshot.table_size < DEFAULT_SIZE

    def refine(self) -> None:
        """Shade by tables of full size again."""
        self.snapshot = with_tables(self.snapshot, DEFAULT_SIZE)

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
        self._light_warnings = light_warnings(depsgraph)

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
        hiders = None
        if self._hiders is not None and self.choices.detail.culling == "hidden":
            hiders = self._hiders.at(self.solver.pose)
        solver, drawn = self.solver, self.choices.cards_drawn
        self.snapshot = replace(
            solver.shown(self.snapshot),
            hiders=hiders,
            casters=self._casters(),
            cards=self.cards.now(self.rig, solver.pose, solver.guides, drawn),
        )

    def _casters(self) -> tuple[Surface, ...]:
        """The head as it is posed, where its shadow is wanted."""
        head, pose = self.rig.head, self.solver.pose
        if head is None or pose.head_positions is None or self.choices.volume.shadows == "none":
            return ()
        return (Surface(pose.head_positions, head.triangles),)


def _same_guides(one: Rig, other: Rig) -> bool:
    """Whether what moves the guides of one moves those of the other."""
    return one.head is other.head and np.array_equal(
        one.strands.grid[one.guides], other.strands.grid[other.guides]
    )
