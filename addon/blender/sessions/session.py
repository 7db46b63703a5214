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
from ...comb_flow import combed_rig
from ...dynamics.colliders import PosedCollider
from ...dynamics.figures import CardFigures, Figures, FiguresCollector
from ...dynamics.neighbours import FrameSteps, KnownNeighbours, NeighbourStyle, run_alone
from ...dynamics.settings import DynamicsSettings
from ...dynamics.state import start
from ...errors import HairloomError
from ...motion_flow import FrameInput, Motion
from ...paint_flow import painted_rig
from ...refine.lead_out import Clearance
from ...render.ride_pass import RideTexels
from ...render.snapshot import Snapshot
from ...rig_flow import MotionStart, Pose, Rig, SimulatedSolids, Solids
from ...strands import Surface
from ..bakes.baked_rig import BakedRig, RestMatrices, frame_arrays, led_out_in, rig_arrays
from ..bakes.baked_solids import solid_arrays, solid_constants
from ..bakes.groom_hashes import frame_rate
from ..bakes.simulation import Arrays
from ..base.latest_job import LatestJob
from ..base.objects import Body
from ..base.thread_work import ThreadWork
from ..colliders.fields import NotReadyError
from ..colliders.rigs import CachedRig
from ..colliders.scene_colliders import SceneColliders
from ..properties.groom_settings import GroomSettings
from ..scene.forces import force_fields_of, gravity_of
from ..scene.source import Source, check_no_hair_dynamics, dynamics_warnings
from .compute_solver import texels_of
from .first_contacts import FirstContacts, PlayStart
from .groom_source import GroomSource
from .measures import FrameTimes
from .numpy_solver import NumpySolver
from .prepared_groom import (
    BuildRequest,
    PreparedGroom,
    build_groom,
    placeholder_groom,
    with_full_light,
)
from .snapshots import GroomPicture
from .solvers import Solver, device_name, make_solver, resolved_device


class Session:
    """One groom while it is previewed or baked; implements `simulation.Simulation`.

    uid, hair, head: of its objects.
    groom: the prepared groom; a placeholder until the first hair is made in a thread.
    known_hair: data about other grooms that its dynamics keeps from frame to frame.
    is_coupled: whether it is simulated together with others in this frame, see `coupled_frame`;
        `pending_steps` then holds them. failure: the error of these steps.
    figures, card_figures: last measurement since the hair was at rest; those of cards only while
        cards are shown. are_figures_current: whether the hair has not moved since.

    Args:
        hair: a hair curves object.
        baked: the rig of a bake of this groom, to be the same to the bit.
        is_drawn: False leaves out what only drawing needs.
        blocking: False: the hair is made in a thread, with a few strands as its placeholder.
        on_result: called with this session when hair or cards that were made in a thread can be
            taken over.

    Raises:
        HairloomError: no hair curves, none are usable, or they are of another scale than the head.
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
        on_result: Callable[[Session], None] = lambda session: None,
    ) -> None:
        self._source = GroomSource(hair, depsgraph)
        self._source.use_bake(baked)
        self.hair, self.head = self._source.hair, self._source.head
        self.uid = self.hair.handle.uid
        self._is_drawn = is_drawn
        self._job = LatestJob[BuildRequest, _Built]("hair", partial(on_result, self))
        # full light of the hair that was made last; does not run while other hair is made
        self._light_job = LatestJob[PreparedGroom, PreparedGroom]("light", partial(on_result, self))
        self.times = FrameTimes()
        self.scene_colliders: SceneColliders | None = None
        self.is_playing = False
        self.is_stale = False
        self._motion_start: MotionStart | None = None
        self._is_recorded = False
        self._contacts = FirstContacts()
        self._posed_colliders: tuple[PosedCollider, ...] = ()
        self._field_notes: tuple[str, ...] = ()
        self._styled_rig: Rig | None = None
        self.known_hair = KnownNeighbours()
        self.is_coupled = False
        self.pending_steps: FrameSteps[None] | None = None
        self.failure: Exception | None = None
        self.figures: Figures | None = None
        self.card_figures: CardFigures | None = None
        self.are_figures_current = False
        self.picture = GroomPicture(
            self.hair.resolve, is_drawn=is_drawn, on_result=partial(on_result, self)
        )
        self.cards = self.picture.cards
        request = self._source.request
        made = build_groom(request, is_drawn=is_drawn) if blocking else placeholder_groom(request)
        self._take(_Built(request, made), None, depsgraph)
        if not blocking:
            self._begin()

    @property
    def name(self) -> str:
        """The name of its object when that was last found."""
        return self._source.name

    @property
    def source(self) -> Source:
        """The data that the shown hair was made from."""
        return self._source.source

    @property
    def settings(self) -> GroomSettings:
        """The artist's settings, as far as they have been taken over."""
        return self._source.settings

    @property
    def rig(self) -> Rig:
        """The rig in the style of the shown frame."""
        return self._styled_rig or self.groom.rig

    @property
    def cached_rig(self) -> CachedRig | None:
        """The rig, and what it was made from; None if it has not grown children itself, as before
        it is made and when it comes from a bake."""
        request, groom = self._made
        if groom.rig.grown_children is None:
            return None
        return CachedRig(request.source, request.settings, groom.rig)

    @property
    def posed_colliders(self) -> tuple[PosedCollider, ...]:
        """The colliders in the shown frame."""
        return self._posed_colliders

    @property
    def is_made(self) -> bool:
        """Whether there is hair to show; False until the first hair is made."""
        return not self.groom.is_placeholder

    @property
    def is_pending(self) -> bool:
        """Whether hair or its light is being made."""
        return self._job.is_pending or self._light_job.is_pending

    @property
    def is_lighting(self) -> bool:
        """Whether the hair is made, and its full light is being found."""
        return self._light_job.is_pending

    @property
    def stage(self) -> str:
        """The present stage of the work on hair or light."""
        return self._job.stage or self._light_job.stage

    @property
    def has_result(self) -> bool:
        """Whether finished hair or light can be taken over."""
        return self._job.has_result or self._light_job.has_result

    def has_changed_head(self) -> bool:
        """Whether the artist has set another surface since the session began."""
        return self._source.has_changed_head()

    @property
    def rest_matrices(self) -> RestMatrices:
        """The transforms of hair, head and ties when the hair was made."""
        return self._source.rest_matrices

    def is_resized(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether hair or head has been scaled or mirrored since the hair was made; motion of the
        roots cannot follow that.

        Raises:
            HairloomError: the hair or its head is gone.
        """
        return self._source.is_resized(depsgraph)

    @property
    def holder_uids(self) -> frozenset[int]:
        """Session numbers of what holds the hair beside its roots."""
        return self._source.holder_uids

    def has_changed_holders(self, edited: set[int]) -> bool:
        """Whether ties were added or have changed shape since the hair was read.

        Args:
            edited: session numbers of data-blocks whose geometry has changed.
        """
        return self._source.has_changed_holders(edited)

    def has_changed_partings(self) -> bool:
        """Whether partings have been added, removed, moved or edited."""
        return self._source.has_changed_partings()

    def constants(self) -> Arrays:
        """See `baked_rig.rig_arrays` and `baked_solids.solid_constants`."""
        arrays = rig_arrays(self.groom.rig, self._source.rest_matrices)
        if self._motion_start is None:
            return arrays
        settings = self.settings[DynamicsSettings]
        return arrays | solid_constants(self._motion_start, self._collider_meshes, settings)

    def rig_hash(self, depsgraph: bpy.types.Depsgraph) -> str:
        """See `simulation.Simulation`."""
        return self._source.rig_hash(depsgraph)

    def frame_hash(self, depsgraph: bpy.types.Depsgraph) -> str:
        """See `simulation.Simulation`."""
        return self._source.frame_hash(self._pose(depsgraph), depsgraph)

    def _pose(self, depsgraph: bpy.types.Depsgraph) -> Pose:
        return self._source.pose(self.rig, depsgraph)

    def _begin(self) -> None:
        """Have the last request built in a thread, once nothing else is being built."""
        request = self._source.request
        self._light_job.cancel()

        def begin() -> Callable[[ThreadWork[_Built]], _Built]:
            is_on_gpu = self.solver.device == "compute"
            return partial(_build_in_thread, request, self._made, self._play_state(), is_on_gpu)

        self._job.request(request, begin)

    def _play_state(self) -> _PlayState | None:
        """The state from which hair that is being made will go on; None: it will start at rest."""
        if not self.is_playing or not self._posed_colliders:
            return None
        standing = tuple(each.at_end() for each in self._posed_colliders)
        settings = self.settings[DynamicsSettings]
        return _PlayState(self.solver.pose, standing, settings, self.solver.size)

    @property
    def bodies(self) -> tuple[Body, ...]:
        """See `simulation.Simulation`."""
        return (self.hair,) if self.head is None else (self.hair, self.head)

    @property
    def snapshot(self) -> Snapshot:
        """The snapshot that is drawn."""
        return self.picture.snapshot

    @property
    def posed_head(self) -> Surface | None:
        """The head in the shown pose, world space."""
        return self.picture.head

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about hair, head, children, colliders, cards and lights."""
        hair = self.hair.handle.find()
        doubled = () if hair is None else dynamics_warnings(hair)
        found = () if self.scene_colliders is None else self.scene_colliders.warnings
        notes = (f"{self.name}: {note}" for note in self.rig.notes)
        cards = (f"{self.name}: {note}" for note in self.cards.warnings)
        found += self._field_notes
        return (*self._source.warnings, *notes, *cards, *doubled, *found, *self.picture.warnings)

    @property
    def device_name(self) -> str:
        """The device that simulates it, such as "GPU (OpenGL, llvmpipe)"."""
        return device_name(self.solver.device)

    @property
    def strands(self) -> Floats:
        """All strands as they are shown, (point_count, 3) [m]; reads back from a GPU."""
        return self.solver.strands()

    def _take(
        self, made: _Built, before: PreparedGroom | None, depsgraph: bpy.types.Depsgraph
    ) -> None:
        """Take over new hair, and update everything that depends on its strands and guides.

        Hair that plays goes on, unless its guides have changed.
        """
        request, groom = made.request, made.groom
        self._made = request, groom
        self.groom = groom
        self._source.accept(request)
        is_same = before is not None and before.rig is groom.rig
        goes_on = before is not None and self.is_playing and _same_guides(groom.rig, before.rig)
        if not is_same:
            # the strands are new, but the guides go on
            motion = replace(self.solver.motion, clearance=made.clearance) if goes_on else None
            self.solver = self._new_solver(groom.rig, motion, made.texels)
            self._contacts = FirstContacts()
            if made.start is not None:
                self._contacts.store(*made.start)
            self._styled_rig = None
            self._take_style(depsgraph)
        self.picture.take_groom(groom, self.settings, self.source.colors)
        self.take_lights(depsgraph)
        if is_same or goes_on:
            self._show()
        else:
            self.rest(depsgraph)
        if groom.light is not None and groom.light.is_quick and not self._job.is_pending:
            self._light_job.request(groom, lambda: partial(_light_in_thread, groom=groom))

    def take_made(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Show the hair or the light that is being made; waits for it.

        Raises:
            HairloomError: it cannot be made.
        """
        if self.is_lighting:
            self._take_light()
            return
        made = self._job.take()
        if made is not None:
            self._take(made, self.groom, depsgraph)
            self.follow_combing(depsgraph)  # brushes may have gone on meanwhile
            self.follow_painted_colors(depsgraph)
            self.follow_painted_masks(depsgraph)

    def _take_light(self) -> None:
        """Show the last hair, which may have been combed or painted since, in its full light."""
        found = self._light_job.take()
        assert found is not None, "no other hair is made meanwhile"
        request, made = self._made
        shown = found if self.groom is made else replace(self.groom, light=found.light)
        self._made, self.groom = (request, found), shown
        self.picture.take_hair_light(shown)
        self._show()

    def finish(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Wait for the hair that is being made and for its light, and show it.

        Raises:
            HairloomError: it cannot be made.
        """
        while self.is_pending:
            self.take_made(depsgraph)

    def forget(self) -> None:
        """Give up hair, light and cards that are being made."""
        self._job.cancel()
        self._light_job.cancel()
        self.cards.forget()

    def read_again(self, depsgraph: bpy.types.Depsgraph, *, blocking: bool = True) -> None:
        """Take over edited curves and settings of the rig; unchanged parts are reused.

        Args:
            blocking: False: new hair is made in a thread, and the old hair is shown until then.
        """
        request = self._source.read_again(depsgraph)
        self.is_stale = False
        if request is not None and blocking and not self.is_pending:
            groom = build_groom(request, self._made, is_drawn=self._is_drawn)
            self._take(_Built(request, groom), self.groom, depsgraph)
            return
        self._draw_painted_colors()
        self.take_settings()
        if request is not None:
            self._begin()
        elif self.groom is not self._made[1] and not self._job.is_pending:
            made = _Built(*self._made)
            self._take(made, self.groom, depsgraph)  # it was combed, and the combing undone
        if blocking:
            self.finish(depsgraph)

    def follow_combing(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Let hair at rest follow curves that a brush has moved, as far as can be done at once;
        `read_again` does the rest later.

        Raises:
            HairloomError: as `rest`.
        """
        if self.is_playing or not self.is_made:
            return
        if self.settings[DynamicsSettings].animated_style:
            self.rest(depsgraph)  # reads the present curves
            return
        moved = self._source.moved_curves(depsgraph)
        if moved is None:
            return
        self.groom = replace(self.groom, rig=combed_rig(self.groom.rig, *moved))
        self.solver = NumpySolver.at_rest(self.rig, self._pose(depsgraph))
        self._show()

    def follow_painted_colors(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Let hair follow colours that a brush has painted; its cards wait for `read_again`.

        Raises:
            HairloomError: the hair is gone.
        """
        if self.is_made and self._source.read_colors(depsgraph):
            self._draw_painted_colors()
            self._show()

    def _draw_painted_colors(self) -> None:
        """Draw strands in the painted colours that were read last."""
        self.picture.take_colors(self.rig, self.source.colors, self.settings)

    def follow_painted_masks(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Let children at rest follow masks that a brush has painted, as far as can be done at
        once; `read_again` does the rest later. Held hair and hair of bakes wait for that.

        Raises:
            HairloomError: as `rest`.
        """
        if self.is_playing or self.rig.grown_children is None or self.rig.holds is not None:
            return
        if self.settings[DynamicsSettings].animated_style:
            return
        if not self._source.has_changed_paint(depsgraph):
            return
        self.groom = replace(self.groom, rig=painted_rig(self.rig, *self._source.painted))
        self.solver = NumpySolver.at_rest(self.rig, self._pose(depsgraph))
        self._draw_painted_colors()  # children stand elsewhere
        self._show()

    def shown_map(self, depsgraph: bpy.types.Depsgraph) -> Floats | None:
        """See `GroomSource.shown_map`."""
        return self._source.shown_map(self.rig, depsgraph)

    def forget_shown_map(self) -> None:
        """Read the shown map again, as it may have been painted."""
        self._source.forget_shown_map()

    def take_settings(self) -> None:
        """Take over settings that act at once; those of guides, children and ambient light make the
        session stale.

        Raises:
            HairloomError: the chosen device is not available here.
        """
        before = self.settings
        self.is_stale |= self._source.take_settings()
        if self.picture.take_settings(self.rig, before, self.settings):
            self._show()
        if self.settings[DynamicsSettings].device != before[DynamicsSettings].device:
            self._change_device(self.settings[DynamicsSettings].device)

    def take_cards(self) -> None:
        """Show the cards that were built in a thread."""
        self.cards.collect()
        self._show()

    def refresh_cards(self) -> None:
        """Update its cards after other hair that shades them may have changed, or the artist may
        have edited them in the scene."""
        self.cards.look_again()
        self._show()

    @property
    def is_coarse(self) -> bool:
        """Whether it is shaded with coarse, quickly made tables, as while a slider moves."""
        return self.picture.is_coarse

    def refine(self) -> None:
        """Shade with tables of full size again."""
        self.picture.refine()

    def _change_device(self, device: str) -> None:
        """Go on from the present motion with another solver."""
        if resolved_device(device) != self.solver.device:
            self.solver = self._new_solver(self.rig, self.solver.motion)
            self._show()

    def _new_solver(
        self, rig: Rig, motion: Motion | None, texels: RideTexels | None = None
    ) -> Solver:
        """As `make_solver`, on the chosen device; errors name the hair."""
        try:
            return make_solver(rig, self.settings[DynamicsSettings].device, motion, texels)
        except HairloomError as error:
            raise error.at(f"{self.name}, {error.place}") from error

    def take_lights(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Take over the scene's lights and world."""
        self.picture.take_lights(depsgraph)

    def rest(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Put hair into its style, carried by the head in its present pose.

        Raises:
            HairloomError: the hair or its head is gone, or the head's mesh has changed.
        """
        self._take_style(depsgraph)
        pose, self.figures, self.card_figures = self._pose(depsgraph), None, None
        self._motion_start, self._is_recorded, self.known_hair = None, False, KnownNeighbours()
        _, self._field_notes = force_fields_of(self.hair.resolve(), depsgraph)
        if not self.is_playing or self.scene_colliders is None:
            self.solver.rest(pose)
        else:
            self._posed_colliders = self.scene_colliders.rest(depsgraph)
            start = self._play_start(pose, self._posed_colliders)
            self.solver.rest(pose, self._contacts.known_motion(start))
            kept = start.settings.radius_root * self.solver.size
            self._motion_start = MotionStart(pose, self._posed_colliders, kept)
            painted = self._source.painted_guides(self.rig)
            self.solver.find_clearance(self._posed_colliders, start.settings, painted)
            self._contacts.store(start, self.solver.motion)
            rate = frame_rate(depsgraph.scene)
            for _ in range(self.settings[DynamicsSettings].pre_roll):
                run_alone(self._simulate(depsgraph, 1.0 / rate))
        self._show()

    def _take_style(self, depsgraph: bpy.types.Depsgraph) -> None:
        """If the style is animated, use the curves of this frame as the style."""
        rig = self.groom.rig
        if self.settings[DynamicsSettings].animated_style and self.is_made:
            rig = self._source.styled_rig(rig, depsgraph)
        self._use_rig(rig)

    def _use_rig(self, rig: Rig) -> None:
        """Use this rig, the groom in another style, in the solver."""
        if rig is not self.rig:
            self.solver.take_style(rig)
        self._styled_rig = None if rig is self.groom.rig else rig

    def has_moved(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether the body's pose differs from the shown one.

        Raises:
            HairloomError: as `rest`.
        """
        return not self._pose(depsgraph).is_same_as(self.solver.pose)

    def play(
        self, depsgraph: bpy.types.Depsgraph, *, blocking: bool = True, is_frame: bool = False
    ) -> None:
        """Get ready to simulate, starting at rest; makes the colliders, which can take a second.

        Args:
            blocking, is_frame: see `simulation.Simulation`.

        Raises:
            HairloomError: as `rest`, or Blender's own hair dynamics is on.
            NotReadyError: a distance field, the hair, or its first contacts are being made, and
                the call does not block.
        """
        self.is_playing = False
        check_no_hair_dynamics(self.hair.resolve())
        self.take_settings()
        if blocking:
            self.finish(depsgraph)
        self._read_scene_colliders(depsgraph, blocking=blocking)
        if not self.is_made:
            raise NotReadyError
        if not blocking and not is_frame:
            start = self._play_start(self._pose(depsgraph), self.solids(depsgraph))
            self._contacts.find(start)
        self.is_playing = True
        self.rest(depsgraph)

    def _play_start(self, pose: Pose, standing: tuple[PosedCollider, ...]) -> PlayStart:
        return PlayStart(self.rig, pose, standing, self.settings[DynamicsSettings])

    def make_fields(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Have the distance fields of its colliders made in the background, before Play.

        Errors of colliders are reported by Play, not here.
        """
        with suppress(HairloomError, NotReadyError):
            self._read_scene_colliders(depsgraph, blocking=False)

    def _read_scene_colliders(self, depsgraph: bpy.types.Depsgraph, *, blocking: bool) -> None:
        self.scene_colliders = SceneColliders.of(
            self.hair.resolve(),
            self.head,
            self.rig.head,
            self.settings[DynamicsSettings],
            depsgraph,
            self.scene_colliders,
            self.groom.rig.root_vertices,
            blocking=blocking,
        )

    def moment(self) -> Moment:
        """The present moment of its motion; the hair must be simulated. Reads back from a GPU."""
        return Moment(self.rig, self.solver.motion, self._motion_start, self._posed_colliders)

    def return_to(self, moment: Moment, depsgraph: bpy.types.Depsgraph) -> bool:
        """Show hair at rest in an earlier moment, and go on from there. Returns False, and changes
        nothing, if its hair or its body is not as it was.

        Raises:
            HairloomError: as `rest`.
        """
        is_same = self.rig is moment.rig and self._pose(depsgraph).is_same_as(moment.motion.pose)
        if not is_same or self.scene_colliders is None:
            return False
        self.scene_colliders.rest(depsgraph)
        self._motion_start, self._posed_colliders = moment.start, moment.colliders
        self.solver = self._new_solver(self.rig, moment.motion)
        self.is_playing, self._is_recorded = True, False
        self._show()
        return True

    def stop(self, depsgraph: bpy.types.Depsgraph) -> None:
        """End the simulation; hair is in its style again."""
        self.is_playing = False
        self.rest(depsgraph)

    def advance(self, depsgraph: bpy.types.Depsgraph, duration: float) -> None:
        """Simulate the time [s] since the last call, in which everything moved to where it is now.

        Raises:
            HairloomError: as `rest`.
        """
        steps = self._steps(depsgraph, duration)
        if self.is_coupled:
            self.pending_steps = steps
        else:
            run_alone(steps)

    def finish_frame(self) -> None:
        """Finish a frame that was simulated together with others.

        Raises:
            HairloomError: the error of this groom in that frame.
        """
        failure, self.failure = self.failure, None
        if failure is not None:
            raise failure

    def _steps(self, depsgraph: bpy.types.Depsgraph, duration: float) -> FrameSteps[None]:
        """The steps of `advance`. With other grooms, the measured time is that of all of them."""
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
        """See `coupled_frame.FeltGroom`."""
        hair = self.hair.handle.find()
        return self.is_made and hair is not None and not hair.hide_render

    @property
    def is_recorded(self) -> bool:
        """Whether the shown hair comes from a bake."""
        return self._is_recorded

    @property
    def pose(self) -> Pose:
        """The pose of the body as it is shown."""
        return self.solver.pose

    def guides(self) -> Floats:
        """The shown guides, (guide_count, cv_count, 3) [m, world]; reads back from a GPU."""
        return self.solver.guides()

    def neighbour_style(self) -> NeighbourStyle:
        """See `motion_flow.neighbour_style`."""
        return motion_flow.neighbour_style(self.rig, self.solver.pose, self.groom.rig)

    def _simulate(
        self, depsgraph: bpy.types.Depsgraph, duration: float, time_scale: float = 1.0
    ) -> FrameSteps[None]:
        """Simulate a frame of this duration [s]; the hair's time runs faster by this factor."""
        pose, settings = self._pose(depsgraph), self.settings[DynamicsSettings]
        goes_along = not time_scale or self.solver.has_jumped(pose, settings, duration)
        if self.scene_colliders is not None and goes_along:
            self._posed_colliders = self.scene_colliders.rest(depsgraph)
        elif self.scene_colliders is not None:
            self._posed_colliders = self.scene_colliders.move(depsgraph, duration)
        else:
            self._posed_colliders = ()
        fields, self._field_notes = force_fields_of(self.hair.resolve(), depsgraph)
        gravity, painted = gravity_of(depsgraph.scene), self._source.painted_guides(self.rig)
        frame = FrameInput(
            pose, self._posed_colliders, settings, gravity, duration, fields, painted, time_scale
        )
        if goes_along:
            self.solver.advance_rigidly(frame)
        else:
            yield from self.solver.steps(frame)

    def measure(self) -> None:
        """Measure the figures of this moment; the hair must be simulated."""
        measure = self.new_measure()
        self.measure_into(measure)
        self.figures, self.are_figures_current = measure.figures, True
        self.card_figures = self.cards.figures(self._solids)

    def new_measure(self) -> FiguresCollector:
        """A measure for the frames since rest; the hair must be simulated."""
        assert self._motion_start is not None, "it is simulated"
        pose, posed, rig = self._motion_start.pose, self._motion_start.colliders, self.rig
        guides = start(motion_flow.carried_guides(rig, pose), rig.curl_slack)
        return FiguresCollector(
            guides, motion_flow.carried_strands(rig, pose), rig.strands.offsets, posed
        )

    def measure_into(self, measure: FiguresCollector) -> None:
        """Add the present frame to a measure; reads strands back from a GPU."""
        guides, rig = self.solver.guides(), self.rig
        if self._styled_rig is not None:
            style = motion_flow.carried_guides(rig, self.solver.pose)
            measure.set_style(start(style, rig.curl_slack))
        measure.add_frame(
            self.solver.strands(), self.rig.rest_lengths, guides, self._posed_colliders
        )

    def solids(self, depsgraph: bpy.types.Depsgraph) -> tuple[PosedCollider, ...]:
        """The colliders of the hair at this moment; none until they are made."""
        if self.scene_colliders is None:
            self.make_fields(depsgraph)
        return (
            () if self.scene_colliders is None else self.scene_colliders.static_colliders(depsgraph)
        )

    def bake_arrays(self) -> Arrays:
        """See `baked_rig.frame_arrays` and `baked_solids.solid_arrays`."""
        guides, led = self.solver.guides(), self.solver.led_out_strands()
        styled = self.rig if self.settings[DynamicsSettings].animated_style else None
        arrays = frame_arrays(self.solver.pose, guides, led, styled)
        return arrays | solid_arrays(self._posed_colliders, self._collider_meshes)

    @property
    def _collider_meshes(self) -> tuple[Surface, ...]:
        return () if self.scene_colliders is None else self.scene_colliders.meshes

    def show_recorded(self, frame: Arrays, solids: Solids | None = None) -> None:
        """Show recorded hair on the recorded head.

        Raises:
            HairloomError: the frame is of another groom.
        """
        baked = BakedRig(self.groom.rig, self._source.rest_matrices)
        if not baked.fits(frame):
            raise HairloomError(
                "its bake belongs to another groom, or to other guides",
                place=self.name,
                remedy="Bake again, or delete the bake",
            )
        self._use_rig(baked.styled_rig(frame))
        pose = replace(baked.pose(frame), solids=solids)
        self.solver.show_baked(pose, frame["guides"], led_out_in(frame))
        self._is_recorded, self.known_hair = True, KnownNeighbours()
        self._show()

    def _show(self) -> None:
        self.are_figures_current = False
        self.picture.show(self.rig, self.solver, self.settings, self._solids)

    @property
    def _solids(self) -> Solids | None:
        """The solids that cards are led out of."""
        if self._is_recorded:
            return self.solver.pose.solids
        return (
            None
            if self._motion_start is None
            else SimulatedSolids(self._motion_start, self._posed_colliders)
        )


@dataclass(frozen=True, eq=False)
class Moment:
    """A moment of simulated hair, to return to.

    start: where the motion began. colliders: their motion in the last frame.
    """

    rig: Rig
    motion: Motion
    start: MotionStart | None
    colliders: tuple[PosedCollider, ...]


@dataclass(frozen=True, eq=False)
class _PlayState:
    """The state of playing hair at one moment.

    colliders: at their places at that moment. size: see `Solver.size`.
    """

    pose: Pose
    colliders: tuple[PosedCollider, ...]
    settings: DynamicsSettings
    size: float


@dataclass(frozen=True, eq=False)
class _Built:
    """New hair, with the data that a thread has made for it.

    texels: data of its strands for the GPU.
    clearance: if hair was playing when this was requested, and will go on.
    start: if it was playing, but will start again: where, and the motion.
    """

    request: BuildRequest
    groom: PreparedGroom
    texels: RideTexels | None = None
    clearance: Clearance | None = None
    start: tuple[PlayStart, Motion] | None = None


def _build_in_thread(
    request: BuildRequest,
    before: tuple[BuildRequest, PreparedGroom],
    moment: _PlayState | None,
    is_on_gpu: bool,
    work: ThreadWork[_Built],
) -> _Built:
    groom = build_groom(request, before, is_drawn=True, is_quick=True, report=work.report)
    if groom.rig is before[1].rig:
        return _Built(request, groom)
    made = _Built(request, groom, texels_of(groom.rig) if is_on_gpu else None)
    if moment is None:
        return made
    if not _same_guides(groom.rig, before[1].rig):
        start = PlayStart(groom.rig, moment.pose, moment.colliders, moment.settings)
        return replace(made, start=(start, start.motion()))
    kept = moment.settings.radius_root * moment.size
    clearance = motion_flow.strand_clearance(groom.rig, moment.pose, moment.colliders, kept)
    return replace(made, clearance=clearance)


def _light_in_thread(work: ThreadWork[PreparedGroom], groom: PreparedGroom) -> PreparedGroom:
    return with_full_light(groom, work.report)


def _same_guides(one: Rig, other: Rig) -> bool:
    """Whether two rigs have the same guides on the same head, so that a motion fits both."""
    return one.head is other.head and np.array_equal(one.guide_grid, other.guide_grid)
