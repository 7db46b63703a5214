"""The record of one previewed groom or fin: its session, its phase, its bake, its problems.

While Blender plays, no frame waits for what is being made:

    the hair is not made yet      Blender's own strands are shown, and playback goes on
    the hair is being rebuilt     the hair that exists plays on
    a collider is not made yet    the hair follows its body at rest

The hair begins, from rest, at the first frame for which everything is made. The next loop of
playback begins at the first frame and then equals a bake. To catch up earlier, the bodies of all
missed frames would be needed. Steps of a single frame, scripts, bakes and renders (also those of
the viewport) wait, so that what they show is exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ...errors import HairloomError
from ..bakes import playback
from ..bakes.baked_rig import BakedRig
from ..bakes.cache import Cache, Facts
from ..bakes.groom_hashes import RIG_PARTS, frame_rate, groom_rig_hash
from ..bakes.simulation import Simulation, differences
from ..base import latest_job
from ..base.objects import Handle, head_of
from ..colliders import fields
from ..colliders.fields import NotReadyError
from ..properties.groom_settings import GroomSettings
from ..sessions.session import Moment, Session
from .phases import SIMULATED, Action, Event, Phase, frame_event, next_phase

#: A step ahead of more time [s] than this is a jump, not dropped frames.
_MAX_DROPPED_TIME = 1.0


@dataclass(frozen=True)
class BakeStatus:
    """The bake of a groom or fin, compared with the scene.

    changed_inputs: what has changed since it was made, in words; empty: it is up to date.
    frame_hash: frame hash of the scene in the frame that is shown.
    """

    facts: Facts
    changed_inputs: tuple[str, ...] = ()
    frame_hash: str = ""


class Preview:
    """One previewed groom or fin.

    frame: the scene frame up to which the timeline has moved it; None: the timeline does not.
    bake: None: it has none. rig_hash: the present one, to compare with that of the bake; "": not
        computed yet.
    problem, bake_problem: why it is not simulated, or why its bake is not shown.
    cards_are_stale: whether its cards need to be shaded again once edits have settled.
    must_rest: whether it was stopped while it was disabled, and must rest once it is read again.
    is_simulated: whether it is shown after simulated time, not at rest and not from a bake.

    Methods raise HairloomError when an object that it is made of is gone or broken.
    """

    def __init__(self, session: Simulation) -> None:
        self.session = session
        self.phase = Phase.REST
        self.frame: int | None = None
        self.bake: BakeStatus | None = None
        self.rig_hash = ""
        self.problem = self.bake_problem = ""
        self.cards_are_stale = self.must_rest = False
        self.is_simulated = False
        self._taken_bake: tuple[str, bool] | None = None
        self._left: tuple[int, Moment] | None = None

    @property
    def uid(self) -> int:
        return self.session.uid

    @property
    def groom(self) -> Session | None:
        """Its session, unless it is a fin."""
        return self.session if isinstance(self.session, Session) else None

    @property
    def is_made(self) -> bool:
        """Whether there is something to simulate."""
        return self.groom is None or self.groom.is_made

    @property
    def can_begin(self) -> bool:
        """Whether everything that it needs to be simulated is made."""
        return self.session.is_made and fields.are_ready()

    @property
    def is_playing(self) -> bool:
        """Whether it plays freely, by the clock, or is about to."""
        return self.phase in (Phase.FREE, Phase.WAITING)

    @property
    def is_deferred(self) -> bool:
        """Whether it rests while Blender plays, because something is still being made."""
        return self.phase is Phase.DEFERRED and not _is_exact()

    @property
    def problems(self) -> str:
        """Why it is not simulated, or why its bake is not shown; empty while all is well."""
        return " ".join(filter(None, (self.problem, self.bake_problem)))

    def is_disabled(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether this depsgraph leaves out an object that it is made of.

        Such an object is in another scene, in an excluded collection, or disabled in viewports;
        `evaluated_get` then returns the original, without modifiers. A deleted object does not
        count.
        """
        bodies = (body.handle.find() for body in self.session.bodies)
        return not all(
            body is None or body.evaluated_get(depsgraph).is_evaluated for body in bodies
        )

    def stop(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Stop playing it: it rests, or shows the scene's frame from its bake."""
        self.handle_or_raise(Event.STOP, depsgraph)
        self.show_frame(depsgraph)

    def stop_disabled(self, depsgraph: bpy.types.Depsgraph) -> None:
        """`stop` for a preview that is disabled: cloth rests now, hair once it is read again."""
        self.phase, self.session.is_playing = Phase.REST, False
        self.session.is_stale = self.must_rest = True
        if self.groom is None:
            self.session.stop(depsgraph)

    def resolve(self) -> bpy.types.Object:
        """Its object."""
        return Handle(self.uid, self.session.name).resolve()

    def handle(
        self,
        event: Event,
        depsgraph: bpy.types.Depsgraph,
        duration: float = 0.0,
        *,
        blocking: bool = True,
    ) -> None:
        """React to an event; hair that cannot be simulated at the moment only follows its body.

        Args:
            duration: of an advance [s].
            blocking: False: do not wait for what is being made.
        """
        try:
            self.handle_or_raise(event, depsgraph, duration, blocking=blocking)
        except HairloomError as error:
            self.handle_or_raise(Event.FAILED, depsgraph)
            self.problem = str(error)

    def handle_or_raise(
        self,
        event: Event,
        depsgraph: bpy.types.Depsgraph,
        duration: float = 0.0,
        *,
        blocking: bool = True,
    ) -> None:
        """As `handle`, but raise errors of the simulation; the preview is at rest then."""
        self.phase, action = next_phase(self.phase, event)
        session = self.session
        if self.phase not in SIMULATED:
            session.is_playing = False
        if action is not Action.NONE:
            self.problem, self.must_rest = "", False
            self.is_simulated = action is Action.ADVANCE
        try:
            match action:
                case Action.BEGIN:
                    # saves reading the scene in each frame of playback just to find it unmade
                    is_frame = self.phase is Phase.TIMELINE
                    if is_frame and not blocking and not self.can_begin:
                        raise NotReadyError
                    session.play(depsgraph, blocking=blocking, is_frame=is_frame)
                case Action.ADVANCE:
                    session.advance(depsgraph, duration)
                case Action.REST:
                    session.rest(depsgraph)
                case Action.STOP:
                    session.stop(depsgraph)
        except NotReadyError:
            self.handle_or_raise(Event.NOT_READY, depsgraph)
        except HairloomError:
            self.phase, session.is_playing = Phase.REST, False
            raise

    def finish_frame(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Finish a frame that its groom was simulated in together with others."""
        assert self.groom is not None, "fins go alone"
        try:
            self.groom.finish_frame()
        except HairloomError as error:
            self.handle_or_raise(Event.FAILED, depsgraph)
            self.problem = str(error)

    def detach_from_timeline(self) -> None:
        """Detach it from the timeline, until `follow_frame`."""
        self.frame = None

    def follow_frame(self, depsgraph: bpy.types.Depsgraph) -> None:
        """React to a change of the scene's frame."""
        obj, scene = self.resolve(), depsgraph.scene
        now, before = scene.frame_current, self.frame
        if before is None and self.phase is Phase.FREE:
            before = now - 1  # it was played freely until now
        self.frame = now
        if not self.is_made and not _is_exact():
            self.handle(Event.NOT_READY, depsgraph)
            return
        rate, first = frame_rate(scene), _first_frame(scene)
        if now == first:
            self.check_bake(depsgraph)
        if self._show_baked(obj, depsgraph):
            return
        event, frames = frame_event(
            before,
            now,
            first,
            is_played=playback.is_animation_playing(),
            max_dropped=rate * _MAX_DROPPED_TIME,
        )
        self.handle(event, depsgraph, frames / rate, blocking=_is_exact())

    def keep_moment(self) -> None:
        """Keep hair that the timeline has simulated, before undo or redo takes its frame away."""
        if self.phase is Phase.TIMELINE and self.is_simulated and self.groom is not None:
            assert self.frame is not None, "the timeline has moved it"
            self._left = self.frame, self.groom.moment()

    def return_to_kept_moment(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Show hair at rest as it was in this frame before an undo, if all else is as it was."""
        if self.groom is None or self._left is None or self.is_simulated:
            return
        frame, moment = self._left
        is_here = frame == self.frame == depsgraph.scene.frame_current
        is_at_rest = self.phase in (Phase.REST, Phase.TIMELINE)
        if is_here and is_at_rest and self.groom.return_to(moment, depsgraph):
            self.phase, self.is_simulated = Phase.TIMELINE, True

    def rest_if_moved(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """React to a new evaluation of the body within a frame: hair rests if its body has moved,
        and shows its bake again if that is back where it was baked, such as after an undo.

        Returns whether the hair is at rest.
        """
        assert self.groom is not None
        if self.bake is not None and self.phase in (Phase.BAKED, Phase.REST):
            facts, now = self.bake.facts, self.session.frame_hash(depsgraph)
            if self.phase is Phase.BAKED and not _has_moved(self.bake.frame_hash, now):
                return False
            if self.phase is Phase.REST and self._is_as_baked(now, depsgraph):
                return not self.show_frame(depsgraph)
            self.bake = BakeStatus(facts, self._changes_since_bake(facts, depsgraph, now))
        if self.phase is not Phase.BAKED and not self.groom.has_moved(depsgraph):
            return self.phase is Phase.REST
        self.handle(Event.RESET, depsgraph)
        return True

    def _is_as_baked(self, frame_hash: str, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether everything is where it was in this frame of the bake."""
        assert self.bake is not None
        facts, frame = self.bake.facts, depsgraph.scene.frame_current
        if not facts.first <= frame <= facts.last:
            return False
        return not _has_moved(facts.frame_hashes[frame - facts.first], frame_hash)

    def take_bake(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Find its bake, and show the scene's frame from it."""
        self._taken_bake = self._bake_settings()
        self.check_bake(depsgraph)
        self.show_frame(depsgraph)

    def has_other_bake(self) -> bool:
        """Whether its object names another bake since `take_bake`, or shows or hides it now."""
        return self._taken_bake not in (None, self._bake_settings())

    def _bake_settings(self) -> tuple[str, bool]:
        bake = self.resolve().hairloom.bake
        return bake.folder, bake.is_shown

    def is_resized(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether its hair must be made again because its object or head has another size now.

        Playing hair keeps its size until it rests, and baked hair that of its bake.
        """
        if self.groom is None or self.bake is not None or playback.is_animation_playing():
            return False
        return self.phase not in (Phase.FREE, Phase.WAITING) and self.groom.is_resized(depsgraph)

    def check_bake(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Find out again whether there is a bake, and whether it is up to date."""
        obj = self.resolve()
        self.rig_hash = self.session.rig_hash(depsgraph)
        cache = self._cache_of(obj)
        self.bake = None if cache is None else self._bake_status(cache.facts, depsgraph)

    def take_read_hair(self, depsgraph: bpy.types.Depsgraph) -> None:
        """After its hair was read again, which puts it to rest: compare the bake, and show the
        scene's frame from it again if the bake is up to date."""
        self.check_bake(depsgraph)
        if self.phase is Phase.BAKED and self.bake is not None and not self.bake.changed_inputs:
            self.show_frame(depsgraph)

    def compare_bake(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Compare the bake with the scene again after a setting was changed."""
        if self.bake is not None:
            self.bake = self._bake_status(self.bake.facts, depsgraph)

    def show_frame(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Show the scene's frame from the bake; returns whether the bake has it."""
        return self._show_baked(self.resolve(), depsgraph)

    def forget_bake(self) -> None:
        """Forget a bake that was deleted or replaced."""
        self.bake, self.bake_problem = None, ""

    def _show_baked(self, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bool:
        """As `show_frame`; a broken bake is reported in the panel, and the hair is simulated."""
        frame = depsgraph.scene.frame_current
        self.bake_problem = ""
        cache = self._cache_of(obj) if obj.hairloom.bake.is_shown else None
        if cache is None or not cache.has_frame(frame):
            if self.phase is Phase.BAKED:
                self.handle_or_raise(Event.SAME, depsgraph)
            return False
        try:
            solids = playback.solids_in(cache, frame, blocking=latest_job.is_blocking())
            self.session.show_recorded(cache.frame(frame), solids)
        except HairloomError as error:
            self.bake_problem = str(error)
            return False
        self.handle_or_raise(Event.IS_BAKED, depsgraph)
        self.rig_hash = self.rig_hash or self.session.rig_hash(depsgraph)
        self.bake = self._bake_status(cache.facts, depsgraph)
        return True

    def _bake_status(self, facts: Facts, depsgraph: bpy.types.Depsgraph) -> BakeStatus:
        frame_hash = self.session.frame_hash(depsgraph)
        return BakeStatus(facts, self._changes_since_bake(facts, depsgraph, frame_hash), frame_hash)

    def _changes_since_bake(
        self, facts: Facts, depsgraph: bpy.types.Depsgraph, frame_hash: str = ""
    ) -> tuple[str, ...]:
        changed = differences(facts.rig_hash, self.rig_hash or facts.rig_hash)
        frame = depsgraph.scene.frame_current
        if facts.first <= frame <= facts.last:
            recorded = facts.frame_hashes[frame - facts.first]
            changed += differences(recorded, frame_hash or self.session.frame_hash(depsgraph))
        return tuple(dict.fromkeys(changed))

    def _cache_of(self, obj: bpy.types.Object) -> Cache | None:
        try:
            return playback.cache_of(obj)
        except HairloomError as error:
            self.bake_problem = str(error)
            return None


def baked_rig_for(hair: bpy.types.Object, scene: bpy.types.Scene) -> BakedRig | None:
    """The rig of the groom's bake, if it was made from the curves and the head as they are now."""
    try:
        cache = playback.cache_of(hair)
        if cache is None:
            return None
        now = groom_rig_hash(hair, head_of(hair), GroomSettings.of(hair), scene)
        changed = differences(cache.facts.rig_hash, now)
        return None if set(changed) & set(RIG_PARTS) else playback.rig_in(cache)
    except HairloomError:  # `show_frame` reports it
        return None


def _has_moved(known: str, now: str) -> bool:
    """Whether two frame hashes differ by more than settings."""
    return bool(set(differences(known, now)) - {"settings"})


def _first_frame(scene: bpy.types.Scene) -> int:
    """The frame at which playback begins."""
    return int(scene.frame_preview_start if scene.use_preview_range else scene.frame_start)


def _is_exact() -> bool:
    """Whether each frame waits until all of its hair is made."""
    return latest_job.is_blocking() or not playback.is_animation_playing()
