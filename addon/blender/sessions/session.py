"""The live session of one groom: read once, then carried, simulated and drawn from arrays."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import bpy
import numpy as np

from ... import motion_flow
from ...arrays import Floats
from ...comb_flow import combed
from ...dynamics.colliders import PosedCollider
from ...dynamics.figures import CardFigures, Figures, Measure
from ...dynamics.neighbours import KnownHair, Steps, Style, alone
from ...dynamics.settings import DynamicsSettings
from ...dynamics.state import start
from ...errors import HairloomError
from ...motion_flow import FrameInput, Motion
from ...paint_flow import painted
from ...refine.lead_out import Clearance
from ...render.ride_pass import RideTexels
from ...render.snapshot import Snapshot
from ...rig_flow import Begun, Pose, Rig, SimulatedSolids, Solids
from ...strands import Surface
from ...strands.arc_length import lengths
from ..bakes.baked_rig import BakedRig, RestMatrices, frame_arrays, led_in, rig_arrays
from ..bakes.baked_solids import solid_arrays, solid_constants
from ..bakes.groom_hashes import frame_rate
from ..bakes.simulated import Arrays
from ..base.latest_job import LatestJob
from ..base.objects import Body
from ..base.thread_work import ThreadWork
from ..colliders.fields import NotMadeYetError
from ..colliders.obstacles import Obstacles
from ..colliders.rigs import MadeRig
from ..properties.groom_settings import GroomSettings
from ..scene.forces import force_fields_of, gravity_of
from ..scene.source import Source, dynamics_warnings, refuse_own_dynamics
from .compute_solver import texels_of
from .first_contacts import FirstContacts, Start
from .groom_source import GroomSource
from .measures import FrameTimes
from .numpy_solver import NumpySolver
from .prepared_groom import BuildRequest, PreparedGroom, build, lit, placeholder
from .snapshots import GroomPicture
from .solvers import Solver, computed_on, form_of, solver_of


class Session:
    """One groom while it is previewed or baked; fulfils `simulated.Simulated`.

    uid, hair, head: of its objects.
    groom: what it was made into; a placeholder until the first hair is made in a thread.
    known_hair: what it knows of other grooms.
    has_company: whether it goes through a frame with others, see `together`: what it will do is in
        `waiting` then. failure: what went wrong in it.
    figures, card_figures: as measured last since the hair was at rest; of cards only where they are
        shown. are_figures_current: whether it has not moved since.

    Args:
        hair: a hair curves object.
        baked: the rig of a bake of this very groom, to be the same to the bit.
        is_drawn: False leaves out what only drawing needs.
        blocking: False: the hair is made in a thread, with a few strands as its placeholder.
        arrived: is called with this session when hair or cards can be taken over that were made
            in a thread.

    Raises:
        HairloomError: no hair curves, none that can be used, or of another scale than the head.
    """

    groom: PreparedGroom
    solver: Solver

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
        self._source = GroomSource(hair, depsgraph)
        self._source.use_bake(baked)
        self.hair, self.head = self._source.hair, self._source.head
        self.uid = self.hair.handle.uid
        self._is_drawn = is_drawn
        self._job = LatestJob[BuildRequest, _Built]("hair", partial(arrived, self))
        # light of the hair that was made last; never while other hair is made
        self._light_job = LatestJob[PreparedGroom, PreparedGroom]("light", partial(arrived, self))
        self.times = FrameTimes()
        self.obstacles: Obstacles | None = None
        self.is_playing = False
        self.is_stale = False
        self._begun: Begun | None = None
        self._is_recorded = False
        self._contacts = FirstContacts()
        self._posed: tuple[PosedCollider, ...] = ()
        self._field_notes: tuple[str, ...] = ()
        self._styled: Rig | None = None
        self.known_hair = KnownHair()
        self.has_company = False
        self.waiting: Steps[None] | None = None
        self.failure: Exception | None = None
        self.figures: Figures | None = None
        self.card_figures: CardFigures | None = None
        self.are_figures_current = False
        self.picture = GroomPicture(
            self.hair.found, is_drawn=is_drawn, arrived=partial(arrived, self)
        )
        self.cards = self.picture.cards
        request = self._source.request
        made = build(request, is_drawn=is_drawn) if blocking else placeholder(request)
        self._take(_Built(request, made), None, depsgraph)
        if not blocking:
            self._begin()

    @property
    def name(self) -> str:
        """Of its object, which may be renamed."""
        return self._source.name

    @property
    def source(self) -> Source:
        """What was read of the hair that is shown."""
        return self._source.source

    @property
    def settings(self) -> GroomSettings:
        """What the artist has set, as far as it is taken over."""
        return self._source.settings

    @property
    def rig(self) -> Rig:
        """The groom in the style of the frame that is shown."""
        return self._styled or self.groom.rig

    @property
    def made_rig(self) -> MadeRig | None:
        """The groom made ready, and from what; None without children of its own, as before it is
        made and where it comes from a bake."""
        request, groom = self._made
        if groom.rig.grown is None:
            return None
        return MadeRig(request.source, request.settings, groom.rig)

    @property
    def posed(self) -> tuple[PosedCollider, ...]:
        """What the hair collides with, where it is in the frame that is shown."""
        return self._posed

    @property
    def is_made(self) -> bool:
        """Whether there is hair to be shown; False until the first one is made."""
        return not self.groom.is_placeholder

    @property
    def is_pending(self) -> bool:
        """Whether hair is being made, the first or other hair, or its light is found."""
        return self._job.is_pending or self._light_job.is_pending

    @property
    def is_lighting(self) -> bool:
        """Whether hair is there, and its light is found."""
        return self._light_job.is_pending

    @property
    def stage(self) -> str:
        """What is done now of what is being made."""
        return self._job.stage or self._light_job.stage

    @property
    def has_arrived(self) -> bool:
        """Whether the hair that was being made, or its light, can be taken over."""
        return self._job.has_arrived or self._light_job.has_arrived

    def has_another_head(self) -> bool:
        """Whether the artist has set another surface since the session began."""
        return self._source.has_another_head()

    @property
    def rests(self) -> RestMatrices:
        """Where hair, head and ties were when the hair was made."""
        return self._source.rests

    def is_resized(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether hair or head has been scaled or mirrored since the hair was made, which no motion
        of the roots follows.

        Raises:
            HairloomError: the hair or its head is gone.
        """
        return self._source.is_resized(depsgraph)

    @property
    def holder_uids(self) -> frozenset[int]:
        """Session numbers of what holds the hair beside its roots."""
        return self._source.holder_uids

    def has_other_holders(self, edited: set[int]) -> bool:
        """Whether ties have come or changed shape since the hair was read.

        Args:
            edited: session numbers of data-blocks whose geometry has changed.
        """
        return self._source.has_other_holders(edited)

    def has_other_partings(self) -> bool:
        """Whether partings have come, gone, been moved or edited."""
        return self._source.has_other_partings()

    def constants(self) -> Arrays:
        """See `baked_rig.rig_arrays` and `baked_solids.solid_constants`."""
        arrays = rig_arrays(self.groom.rig, self._source.rests)
        if self._begun is None:
            return arrays
        settings = self.settings[DynamicsSettings]
        return arrays | solid_constants(self._begun, self._collider_meshes, settings)

    def rig_hash(self, depsgraph: bpy.types.Depsgraph) -> str:
        """See `simulated.Simulated`."""
        return self._source.rig_hash(depsgraph)

    def frame_hash(self, depsgraph: bpy.types.Depsgraph) -> str:
        """See `simulated.Simulated`."""
        return self._source.frame_hash(self._pose(depsgraph), depsgraph)

    def _pose(self, depsgraph: bpy.types.Depsgraph) -> Pose:
        return self._source.pose(self.rig, depsgraph)

    def _begin(self) -> None:
        """Have made what was requested last, once nothing else is being made."""
        request = self._source.request
        self._light_job.cancel()

        def begin() -> Callable[[ThreadWork[_Built]], _Built]:
            is_on_gpu = self.solver.form == "compute"
            return partial(_build_in_thread, request, self._made, self._moment(), is_on_gpu)

        self._job.want(request, begin)

    def _moment(self) -> _Moment | None:
        """That hair which is being made will go on from; None: it will begin at rest."""
        if not self.is_playing or not self._posed:
            return None
        standing = tuple(each.at_end() for each in self._posed)
        settings = self.settings[DynamicsSettings]
        return _Moment(self.solver.pose, standing, settings, self.solver.size)

    @property
    def bodies(self) -> tuple[Body, ...]:
        """See `simulated.Simulated`."""
        return (self.hair,) if self.head is None else (self.hair, self.head)

    @property
    def snapshot(self) -> Snapshot:
        """What is drawn."""
        return self.picture.snapshot

    @property
    def posed_head(self) -> Surface | None:
        """What hair grows on, where it is shown, world space."""
        return self.picture.head

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the artist should know about hair, head, children, colliders and lights."""
        hair = self.hair.handle.find()
        doubled = () if hair is None else dynamics_warnings(hair)
        found = () if self.obstacles is None else self.obstacles.warnings
        notes = (f"{self.name}: {note}" for note in self.rig.notes)
        cards = (f"{self.name}: {note}" for note in self.cards.warnings)
        found += self._field_notes
        return (*self._source.warnings, *notes, *cards, *doubled, *found, *self.picture.warnings)

    @property
    def computed_on(self) -> str:
        """Such as "GPU (OpenGL, llvmpipe)"."""
        return computed_on(self.solver.form)

    @property
    def strands(self) -> Floats:
        """All strands as they are shown, (point_count, 3) [m]; reads back from a GPU."""
        return self.solver.strands()

    def _take(
        self, made: _Built, before: PreparedGroom | None, depsgraph: bpy.types.Depsgraph
    ) -> None:
        """Everything that depends on the strands and on the choice of guides.

        Hair that plays goes on, unless its guides are others now.
        """
        request, groom = made.request, made.groom
        self._made = request, groom
        self.groom = groom
        self._source.accept(request)
        is_same = before is not None and before.rig is groom.rig
        goes_on = before is not None and self.is_playing and _same_guides(groom.rig, before.rig)
        if not is_same:
            # strands are others now, and guides go on
            motion = replace(self.solver.motion, clearance=made.clearance) if goes_on else None
            form = self.settings[DynamicsSettings].device
            self.solver = solver_of(groom.rig, form, motion, made.texels)
            self._contacts = FirstContacts()
            if made.start is not None:
                self._contacts.keep(*made.start)
            self._styled = None
            self._take_style(depsgraph)
        self.picture.take_groom(groom, self.settings, self.source.colors)
        self.light(depsgraph)
        if is_same or goes_on:
            self._show()
        else:
            self.rest(depsgraph)
        if groom.light is not None and groom.light.is_quick and not self._job.is_pending:
            self._light_job.want(groom, lambda: partial(_light_in_thread, groom=groom))

    def take_made(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Show the hair or the light that was made meanwhile; waits for it.

        Raises:
            HairloomError: it cannot be made.
        """
        if self.is_lighting:
            self._take_light()
            return
        made = self._job.take()
        if made is not None:
            self._take(made, self.groom, depsgraph)
            self.comb(depsgraph)  # a brush has gone on meanwhile
            self.color(depsgraph)
            self.paint(depsgraph)

    def _take_light(self) -> None:
        """Show the hair that was made last in its own light, combed or painted since or not."""
        found = self._light_job.take()
        assert found is not None, "no other hair is made meanwhile"
        request, made = self._made
        shown = found if self.groom is made else replace(self.groom, light=found.light)
        self._made, self.groom = (request, found), shown
        self.picture.take_light(shown)
        self._show()

    def finish(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Wait for the hair that is being made and for its light, and show it.

        Raises:
            HairloomError: it cannot be made.
        """
        while self.is_pending:
            self.take_made(depsgraph)

    def forget(self) -> None:
        """Nobody waits any more for hair and cards that are on their way."""
        self._job.cancel()
        self._light_job.cancel()
        self.cards.forget()

    def read_again(self, depsgraph: bpy.types.Depsgraph, *, blocking: bool = True) -> None:
        """Take over edited curves and settings of the rig; what did not change stays as it is.

        Args:
            blocking: False: other hair is made in a thread, and what was shown is shown until then.
        """
        request = self._source.read_again(depsgraph)
        self.is_stale = False
        if request is not None and blocking and not self.is_pending:
            groom = build(request, self._made, is_drawn=self._is_drawn)
            self._take(_Built(request, groom), self.groom, depsgraph)
            return
        self._color()
        self.take_settings()
        if request is not None:
            self._begin()
        elif self.groom is not self._made[1] and not self._job.is_pending:
            made = _Built(*self._made)
            self._take(made, self.groom, depsgraph)  # combed, and back by an undo
        if blocking:
            self.finish(depsgraph)

    def comb(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Have hair at rest follow curves that a brush has moved, as far as that is done at once;
        `read_again` is to come.

        Raises:
            HairloomError: as `rest`.
        """
        if self.is_playing or not self.is_made:
            return
        if self.settings[DynamicsSettings].animated_style:
            self.rest(depsgraph)  # which reads the curves as they are
            return
        moved = self._source.moved_curves(depsgraph)
        if moved is None:
            return
        self.groom = replace(self.groom, rig=combed(self.groom.rig, *moved))
        self.solver = NumpySolver.at_rest(self.rig, self._pose(depsgraph))
        self._show()

    def color(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Have hair follow the colours that a brush has painted; its cards wait for `read_again`.

        Raises:
            HairloomError: the hair is gone.
        """
        if self.is_made and self._source.read_colors(depsgraph):
            self._color()
            self._show()

    def _color(self) -> None:
        """Draw what is painted under the strands, as it was read last."""
        self.picture.take_colors(self.rig, self.source.colors, self.settings)

    def paint(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Have children at rest follow what a brush has painted, as far as that is done at once;
        `read_again` is to come. Hair that is held, and that of bakes, waits for it.

        Raises:
            HairloomError: as `rest`.
        """
        if self.is_playing or self.rig.grown is None or self.rig.holds is not None:
            return
        if self.settings[DynamicsSettings].animated_style:
            return
        if not self._source.has_other_paint(depsgraph):
            return
        self.groom = replace(self.groom, rig=painted(self.rig, *self._source.painted))
        self.solver = NumpySolver.at_rest(self.rig, self._pose(depsgraph))
        self._color()  # children stand elsewhere
        self._show()

    def shown_map(self, depsgraph: bpy.types.Depsgraph) -> Floats | None:
        """See `GroomSource.shown_map`."""
        return self._source.shown_map(self.rig, depsgraph)

    def forget_shown_map(self) -> None:
        """What is shown of it has been painted since."""
        self._source.forget_shown_map()

    def take_settings(self) -> None:
        """Take over what acts at once; settings of guides, children and ambient light make the
        session stale.

        Raises:
            HairloomError: the form of computing that was chosen is not to be had here.
        """
        before = self.settings
        self.is_stale |= self._source.take_settings()
        if self.picture.take_settings(self.rig, before, self.settings):
            self._show()
        if self.settings[DynamicsSettings].device != before[DynamicsSettings].device:
            self._change_form(self.settings[DynamicsSettings].device)

    def take_cards(self) -> None:
        """Show the cards that were built meanwhile."""
        self.cards.collect()
        self._show()

    def look_at_cards_again(self) -> None:
        """Other hair that shades its cards may be elsewhere now, or other hair; or the artist may
        have edited its cards in the scene."""
        self.cards.look_again()
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
        self._take_style(depsgraph)
        pose, self.figures, self.card_figures = self._pose(depsgraph), None, None
        self._begun, self._is_recorded, self.known_hair = None, False, KnownHair()
        _, self._field_notes = force_fields_of(self.hair.found(), depsgraph)
        if not self.is_playing or self.obstacles is None:
            self.solver.rest(pose)
        else:
            self._posed = self.obstacles.rest(depsgraph)
            start = self._start(pose, self._posed)
            self.solver.rest(pose, self._contacts.known(start))
            kept = start.settings.radius_root * self.solver.size
            self._begun = Begun(pose, self._posed, kept)
            painted = self._source.painted_guides(self.rig)
            self.solver.meet(self._posed, start.settings, painted)
            self._contacts.keep(start, self.solver.motion)
            rate = frame_rate(depsgraph.scene)
            for _ in range(self.settings[DynamicsSettings].pre_roll):
                alone(self._simulate(depsgraph, 1.0 / rate))
        self._show()

    def _take_style(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Go by the curves as they are in this frame, where the style is animated."""
        rig = self.groom.rig
        if self.settings[DynamicsSettings].animated_style and self.is_made:
            rig = self._source.styled(rig, depsgraph)
        self._go_by(rig)

    def _go_by(self, rig: Rig) -> None:
        """Let the solver go by this style of the groom."""
        if rig is not self.rig:
            self.solver.take_style(rig)
        self._styled = None if rig is self.groom.rig else rig

    def has_moved(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether the body is elsewhere than in what is shown.

        Raises:
            HairloomError: as `rest`.
        """
        return not self._pose(depsgraph).is_as(self.solver.pose)

    def play(
        self, depsgraph: bpy.types.Depsgraph, *, blocking: bool = True, is_frame: bool = False
    ) -> None:
        """Get ready to simulate from the style on; makes the colliders, which can take a second.

        Args:
            blocking, is_frame: see `simulated.Simulated`.

        Raises:
            HairloomError: as `rest`, or Blender's own hair dynamics is on.
            NotMadeYetError: a field, all of the hair, or how far that stays from colliders is
                being made, and nobody waits.
        """
        self.is_playing = False
        refuse_own_dynamics(self.hair.found())
        self.take_settings()
        if blocking:
            self.finish(depsgraph)
        self._read_obstacles(depsgraph, blocking=blocking)
        if not self.is_made:
            raise NotMadeYetError
        if not blocking and not is_frame:
            start = self._start(self._pose(depsgraph), self.solids(depsgraph))
            self._contacts.find(start)
        self.is_playing = True
        self.rest(depsgraph)

    def _start(self, pose: Pose, standing: tuple[PosedCollider, ...]) -> Start:
        return Start(self.rig, pose, standing, self.settings[DynamicsSettings])

    def make_fields(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Have the fields of its colliders made beside the window's work, so that Play finds them.

        Play reports what is wrong with a collider.
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
            self.groom.rig.root_vertices,
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
        steps = self._steps(depsgraph, duration)
        if self.has_company:
            self.waiting = steps
        else:
            alone(steps)

    def finish_frame(self) -> None:
        """After a frame with others.

        Raises:
            HairloomError: what went wrong in it.
        """
        failure, self.failure = self.failure, None
        if failure is not None:
            raise failure

    def _steps(self, depsgraph: bpy.types.Depsgraph, duration: float) -> Steps[None]:
        """See `advance`. With others it takes as long as all of them."""
        with self.times.measured("simulation"):
            self._is_recorded = False
            self._take_style(depsgraph)
            scale = self.settings[DynamicsSettings].time_scale
            yield from self._simulate(depsgraph, duration, scale)
            self._show()

    @property
    def feels_hair(self) -> bool:
        """Whether its hair feels other hair."""
        return self.settings[DynamicsSettings].volume > 0.0

    @property
    def is_felt(self) -> bool:
        """See `together.Felt`."""
        hair = self.hair.handle.find()
        return self.is_made and hair is not None and not hair.hide_render

    @property
    def pose(self) -> Pose:
        """Where the body is in what is shown."""
        return self.solver.pose

    def guides(self) -> Floats:
        """As they are shown, (guide_count, cv_count, 3) [m, world]; reads back from a GPU."""
        return self.solver.guides()

    def style_seen(self) -> Style:
        """See `motion_flow.style_seen`."""
        return motion_flow.style_seen(self.rig, self.solver.pose, self.groom.rig)

    def _simulate(
        self, depsgraph: bpy.types.Depsgraph, duration: float, time_scale: float = 1.0
    ) -> Steps[None]:
        """A frame of this duration [s], in which the hair's time goes at this speed."""
        pose, settings = self._pose(depsgraph), self.settings[DynamicsSettings]
        goes_along = not time_scale or self.solver.has_jumped(pose, settings, duration)
        if self.obstacles is not None and goes_along:
            self._posed = self.obstacles.rest(depsgraph)
        elif self.obstacles is not None:
            self._posed = self.obstacles.move(depsgraph, duration)
        else:
            self._posed = ()
        fields, self._field_notes = force_fields_of(self.hair.found(), depsgraph)
        gravity, painted = gravity_of(depsgraph.scene), self._source.painted_guides(self.rig)
        frame = FrameInput(
            pose, self._posed, settings, gravity, duration, fields, painted, time_scale
        )
        if goes_along:
            self.solver.go_along(frame)
        else:
            yield from self.solver.steps(frame)

    def measure(self) -> None:
        """Find the figures of this moment, while it is simulated."""
        measure = self.new_measure()
        self.measure_into(measure)
        self.figures, self.are_figures_current = measure.figures, True
        self.card_figures = self.cards.figures(self._solids)

    def new_measure(self) -> Measure:
        """For the frames from rest on; while it is simulated."""
        assert self._begun is not None, "it is simulated"
        pose, posed, rig = self._begun.pose, self._begun.colliders, self.rig
        guides = start(motion_flow.carried_guides(rig, pose), rig.curl_room)
        return Measure(guides, motion_flow.carried(rig, pose), rig.strands.offsets, posed)

    def measure_into(self, measure: Measure) -> None:
        """Take the present frame into account; reads strands back from a GPU."""
        guides, rig = self.solver.guides(), self.rig
        if self._styled is not None:
            style = motion_flow.carried_guides(rig, self.solver.pose)
            measure.take_style(start(style, rig.curl_room))
        measure.add(self.solver.strands(), self._rest_lengths(), guides, self._posed)

    def _rest_lengths(self) -> Floats:
        """Of all strands."""
        rig = self.rig
        if rig.head is not None:
            return rig.rest_lengths
        return lengths(self.rest_points(), rig.strands.offsets)

    def rest_points(self) -> Floats:
        """All strands as long as in their style, (point_count, 3) [m]; those of hair without a head
        grow with its object."""
        rig = self.rig
        if rig.head is not None:
            return rig.strands.points
        return motion_flow.carried(rig, self.solver.pose)

    def solids(self, depsgraph: bpy.types.Depsgraph) -> tuple[PosedCollider, ...]:
        """What the hair would collide with now; none before they are made."""
        if self.obstacles is None:
            self.make_fields(depsgraph)
        return () if self.obstacles is None else self.obstacles.standing(depsgraph)

    def recorded(self) -> Arrays:
        """See `baked_rig.frame_arrays` and `baked_solids.solid_arrays`."""
        guides, led = self.solver.guides(), self.solver.led()
        styled = self.rig if self.settings[DynamicsSettings].animated_style else None
        arrays = frame_arrays(self.solver.pose, guides, led, styled)
        return arrays | solid_arrays(self._posed, self._collider_meshes)

    @property
    def _collider_meshes(self) -> tuple[Surface, ...]:
        return () if self.obstacles is None else self.obstacles.meshes

    def show_recorded(self, frame: Arrays, solids: Solids | None = None) -> None:
        """Hair as it was recorded, on the head as that was.

        Raises:
            HairloomError: the frame is of another groom.
        """
        baked = BakedRig(self.groom.rig, self._source.rests)
        if not baked.fits(frame):
            raise HairloomError(
                "its bake is of another groom, or of other guides",
                place=self.name,
                remedy="Bake again, or delete the bake",
            )
        self._go_by(baked.styled(frame))
        pose = replace(baked.pose(frame), solids=solids)
        self.solver.carry(pose, frame["guides"], led_in(frame))
        self._is_recorded, self.known_hair = True, KnownHair()
        self._show()

    def _show(self) -> None:
        self.are_figures_current = False
        self.picture.show(self.rig, self.solver, self.settings, self._solids)

    @property
    def _solids(self) -> Solids | None:
        """What cards are led out of."""
        if self._is_recorded:
            return self.solver.pose.solids
        return None if self._begun is None else SimulatedSolids(self._begun, self._posed)


@dataclass(frozen=True, eq=False)
class _Moment:
    """A moment of hair that plays.

    colliders: as they stand. size: see `Solver.size`.
    """

    pose: Pose
    colliders: tuple[PosedCollider, ...]
    settings: DynamicsSettings
    size: float


@dataclass(frozen=True, eq=False)
class _Built:
    """Hair, and what else was made of it beside the window's work.

    texels: what the GPU gets of its strands.
    clearance: of hair that was playing when it was asked for, if it goes on. start: else where it
        begins again, and its motion.
    """

    request: BuildRequest
    groom: PreparedGroom
    texels: RideTexels | None = None
    clearance: Clearance | None = None
    start: tuple[Start, Motion] | None = None


def _build_in_thread(
    request: BuildRequest,
    before: tuple[BuildRequest, PreparedGroom],
    moment: _Moment | None,
    is_on_gpu: bool,
    work: ThreadWork[_Built],
) -> _Built:
    groom = build(request, before, is_drawn=True, is_quick=True, report=work.report)
    if groom.rig is before[1].rig:
        return _Built(request, groom)
    made = _Built(request, groom, texels_of(groom.rig) if is_on_gpu else None)
    if moment is None:
        return made
    if not _same_guides(groom.rig, before[1].rig):
        start = Start(groom.rig, moment.pose, moment.colliders, moment.settings)
        return replace(made, start=(start, start.motion()))
    kept = moment.settings.radius_root * moment.size
    clearance = motion_flow.strand_clearance(groom.rig, moment.pose, moment.colliders, kept)
    return replace(made, clearance=clearance)


def _light_in_thread(work: ThreadWork[PreparedGroom], groom: PreparedGroom) -> PreparedGroom:
    return lit(groom, work.report)


def _same_guides(one: Rig, other: Rig) -> bool:
    """Whether what moves the guides of one moves those of the other."""
    return one.head is other.head and np.array_equal(one.guide_grid, other.guide_grid)
