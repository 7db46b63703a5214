"""Baking: simulate all frames in order, as playback does, and write them to disk.

The steps are those of the timeline, so that a bake equals what the artist saw. A bake that is
cancelled or fails does not change the earlier bake.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from ...dynamics.figures import FiguresCollector
from ...errors import HairloomError
from ..bakes import baked_copy, playback
from ..bakes.bake_settings import (
    assign_folder,
    check_not_linked,
    check_owner,
    file_name,
    folder_names,
    folder_of,
    frames_of,
    owns_bake,
)
from ..bakes.cache import CacheWriter, Facts, check_bake_folder, delete, facts_in
from ..bakes.groom_hashes import frame_rate
from ..bakes.simulation import Simulation
from ..base.objects import Handle, ObjectGoneError
from ..base.report import environment
from ..base.suspension import suspended
from ..scene.fin_modifier import clear, fin_modifier
from ..scene.source import check_density
from ..sessions.coupled_frame import CoupledFrame
from ..sessions.fins import FinSession
from ..sessions.session import Session
from . import previews
from .passive_grooms import PassiveGrooms


@dataclass
class _BakedObject:
    """One groom or fin of a bake.

    folder: where the bake is written. folder_setting: the object's folder setting once it is
        published.
    replaced_note: note that another scene's bake was replaced; "": none was.
    """

    handle: Handle
    frames: range
    folder: Path
    folder_setting: str
    replaced_note: str = ""
    session: Simulation | None = None
    writer: CacheWriter | None = None
    rig_hash: str = ""
    notes: tuple[str, ...] = ()
    measure: FiguresCollector | None = None

    def groom_in(self, frame: int) -> Session | None:
        """Its session, if it is a groom that is being simulated and this is one of its frames."""
        session = self.session
        return session if frame in self.frames and isinstance(session, Session) else None

    def simulate(self, frame: int, depsgraph: bpy.types.Depsgraph) -> None:
        """Simulate this frame, if it is one of its frames."""
        if frame not in self.frames:
            return
        if self.writer is None or self.session is None:
            session = self.session = simulation_for(self.resolve(), depsgraph)
            session.play(depsgraph)
            self.rig_hash = session.rig_hash(depsgraph)
            if isinstance(session, Session):
                rig_notes = (f"{self.handle.name}: {note}" for note in session.rig.notes)
                self.notes = (*session.source.warnings, *rig_notes)
                self.measure = session.new_measure()
            self.writer = CacheWriter(self.folder)
            self.writer.add_constants(session.constants())
        else:
            session = self.session
            if isinstance(session, Session):
                session.take_settings()  # animated ones
            session.advance(depsgraph, 1.0 / frame_rate(depsgraph.scene))

    def write(self, frame: int, depsgraph: bpy.types.Depsgraph) -> None:
        """Write this frame, if it is one of its frames, once all parts have simulated it."""
        session = self.session
        if frame not in self.frames or self.writer is None or session is None:
            return
        if isinstance(session, Session):
            session.finish_frame()
            if frame > self.frames.start and self.measure is not None:
                session.measure_into(self.measure)
        self.writer.add(frame, session.bake_arrays(), session.frame_hash(depsgraph))

    def finish(self, rate: float) -> None:
        """Write the facts, after all frames."""
        assert self.writer is not None and self.session is not None
        self.writer.finish(
            Facts(
                owner=self.handle.name,
                first=self.frames.start,
                last=self.frames.stop - 1,
                frame_rate=rate,
                device=device_of_session(self.session),
                rig_hash=self.rig_hash,
                hairloom=environment()["hairloom"],
                file=file_name(self.resolve()),
                figures=None if self.measure is None else self.measure.figures,
            )
        )

    def abandon(self) -> None:
        """Delete files that are incomplete."""
        if self.writer is not None:
            self.writer.abandon()

    def resolve(self) -> bpy.types.Object:
        return self.handle.resolve("Bake again")


def _replaced_note(obj: bpy.types.Object, folder: Path, frames: range) -> str:
    """A note if a bake of other frames is replaced because scenes share this hair; else ""."""
    before, scenes = facts_in(folder), len(obj.users_scene)
    if before is None or scenes < 2 or (before.first in frames and before.last in frames):
        return ""
    return (
        f"{obj.name}: its bake of frames {before.first} to {before.last} was replaced, as"
        f" {scenes} scenes share this hair and its bake. Duplicate it to give each scene its own."
    )


@dataclass
class Bake:
    """A bake of some grooms and fins of the open scene, each over its own frames."""

    baked_objects: list[_BakedObject] = field(default_factory=list)
    _passive_grooms: PassiveGrooms = field(default_factory=PassiveGrooms)

    @classmethod
    def of(
        cls,
        objects: list[bpy.types.Object],
        scene: bpy.types.Scene,
        *,
        frames: range | None = None,
        folder: Path | None = None,
    ) -> Bake:
        """Plan a bake.

        Args:
            frames: replace the objects' own frame ranges.
            folder: replaces the objects' own folders, even if it holds another object's bake;
                several objects get a subfolder each.

        Raises:
            HairloomError: there is nothing to bake, no frame or no folder that can be written to;
                the weights that set the density of children are missing; or a linked object has
                no folder.
        """
        if not objects:
            raise HairloomError(
                "there is nothing to bake", place=scene.name, remedy="Select hair curves or cloth"
            )
        parts: list[_BakedObject] = []
        with _preserving_folders(objects):
            for obj, name in zip(objects, folder_names(objects), strict=True):
                if obj.type == "CURVES":
                    check_density(obj, bpy.context.evaluated_depsgraph_get())
                frame_range = frames_of(obj, scene) if frames is None else frames
                if folder is None:
                    bake_folder = assign_folder(obj)
                    check_owner(obj, bake_folder)
                    folder_setting = obj.hairloom.bake.folder
                else:
                    bake_folder = folder / name if len(objects) > 1 else folder
                    folder_setting = str(bake_folder)
                check_bake_folder(bake_folder)
                replaced = _replaced_note(obj, bake_folder, frame_range)
                parts.append(
                    _BakedObject(
                        Handle.of(obj),
                        frame_range,
                        bake_folder,
                        folder_setting,
                        replaced_note=replaced,
                    )
                )
        return cls(parts)

    @property
    def frame_count(self) -> int:
        return self._last - self._first + 1

    @property
    def _first(self) -> int:
        return min(part.frames.start for part in self.baked_objects)

    @property
    def _last(self) -> int:
        return max(part.frames.stop - 1 for part in self.baked_objects)

    @property
    def notes(self) -> list[str]:
        """Notes for the artist about what was baked so far."""
        notes = (note for part in self.baked_objects for note in (part.replaced_note, *part.notes))
        return [*dict.fromkeys(filter(None, notes)), *self.unfelt_notes]

    @property
    def unfelt_notes(self) -> list[str]:
        """Notes on hair nearby that the baked hair did not feel, and why."""
        return list(self._passive_grooms.notes.values())

    def objects(self) -> list[bpy.types.Object]:
        return [part.resolve() for part in self.baked_objects]

    def steps(self) -> Generator[int]:
        """Bake one frame at a time; yields how many are done. Closing the generator cancels.

        The scene's frame is restored afterwards.

        Raises:
            HairloomError: a groom cannot be simulated, or a file cannot be written.
        """
        scene = bpy.context.scene
        frame, subframe = scene.frame_current, scene.frame_subframe
        try:
            with suspended(), playback.fins_not_shown(self.objects()):
                yield from self._frames(scene)
                for part in self.baked_objects:
                    part.finish(frame_rate(scene))
                self._publish()
        finally:
            for part in self.baked_objects:
                part.abandon()
            with suspended():
                scene.frame_set(frame, subframe=subframe)
            self._show()

    def _frames(self, scene: bpy.types.Scene) -> Iterator[int]:
        passive_grooms = self._passive_grooms
        for done, frame in enumerate(range(self._first, self._last + 1), start=1):
            scene.frame_set(frame)
            depsgraph = bpy.context.evaluated_depsgraph_get()
            with _with_frame_in_errors(frame):
                with CoupledFrame(
                    [*self._grooms_in(frame), *passive_grooms.values()]
                ) as coupled_frame:
                    for part in self.baked_objects:
                        part.simulate(frame, depsgraph)
                    passive_grooms.move(depsgraph)
                    coupled_frame.simulate_coupled()
                for part in self.baked_objects:
                    part.write(frame, depsgraph)
                passive_grooms.join(self._grooms_in(frame), depsgraph)
            yield done

    def _grooms_in(self, frame: int) -> list[Session]:
        grooms = (part.groom_in(frame) for part in self.baked_objects)
        return [groom for groom in grooms if groom is not None]

    def _publish(self) -> None:
        """Replace all earlier bakes by the new ones, or none."""
        writers = [part.writer for part in self.baked_objects if part.writer is not None]
        try:
            for writer in writers:
                writer.publish()
        except HairloomError:
            for writer in writers:
                writer.unpublish()
            raise
        for part in self.baked_objects:
            part.resolve().hairloom.bake.folder = part.folder_setting
        for writer in writers:
            writer.remove_previous()
        for part in self.baked_objects:
            part.resolve().hairloom.bake.owner = part.handle.name

    def _show(self) -> None:
        """Let previewed grooms show the new bake, or again what they showed before."""
        depsgraph = bpy.context.evaluated_depsgraph_get()
        for part in self.baked_objects:
            obj = part.handle.find()
            if obj is not None:
                previews.bake_changed(obj, depsgraph)


@contextmanager
def _preserving_folders(objects: list[bpy.types.Object]) -> Iterator[None]:
    """Restore the objects' folders afterwards, so that they show their old bakes for now."""
    before = [obj.hairloom.bake.folder for obj in objects]
    try:
        yield
    finally:
        for obj, folder in zip(objects, before, strict=True):
            obj.hairloom.bake.folder = folder


@contextmanager
def _with_frame_in_errors(frame: int) -> Iterator[None]:
    """Add the frame to errors raised inside."""
    try:
        yield
    except HairloomError as error:
        raise HairloomError(
            f"{error.problem} (in frame {frame}); nothing was baked",
            place=error.place,
            remedy="Bake again" if isinstance(error, ObjectGoneError) else error.remedy,
        ) from error


def simulation_for(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Simulation:
    """The session of this object's preview, or a new one if there is none or its size has changed.

    Raises:
        HairloomError: it cannot be simulated.
    """
    previewed = previews.simulation_of(obj)
    if previewed is None and obj.type == "MESH":
        return FinSession(obj, depsgraph)
    if previewed is None or (isinstance(previewed, Session) and previewed.is_resized(depsgraph)):
        return Session(obj, depsgraph, is_drawn=False)
    if isinstance(previewed, Session):
        if previewed.is_stale:
            previewed.read_again(depsgraph)
        previewed.finish(depsgraph)
    return previewed


def device_of_session(session: Simulation) -> str:
    """The kind of solver that simulates it: "numpy" or "compute"."""
    return session.solver.device if isinstance(session, Session) else "numpy"


def is_bakeable(obj: bpy.types.Object) -> bool:
    """Whether it is a fin, or hair that is not itself the copy that shows a bake."""
    if obj.type == "CURVES":
        return not obj.data.hairloom.baked_in
    return fin_modifier(obj) is not None


def show_in_renders(objects: list[bpy.types.Object], depsgraph: bpy.types.Depsgraph) -> bool:
    """After a bake, add a copy for renders to hair with *Show in Renders*; remove that of others.

    Returns whether this turned on the lock of the window during renders.
    """
    was_locked = depsgraph.scene.render.use_lock_interface
    for obj in objects:
        if obj.type != "CURVES":
            continue
        cache = playback.cache_of(obj)
        if cache is not None and obj.hairloom.bake.in_renders:
            baked_copy.show_in_renders(obj, cache, depsgraph)
        else:
            baked_copy.remove_copy(obj)
    return bool(depsgraph.scene.render.use_lock_interface and not was_locked)


def free(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
    """Delete the bake of a groom or fin from disk; renders show the object itself again.

    A bake that belongs to another object or file stays on disk, but is no longer shown here.

    Raises:
        HairloomError: the files cannot be deleted, or the object is linked.
    """
    check_not_linked(obj)
    folder = folder_of(obj)
    if folder is not None and owns_bake(obj, folder):
        delete(folder)
        obj.hairloom.bake.owner = ""
    else:
        obj.hairloom.bake.folder = ""
    if obj.type == "CURVES":
        baked_copy.remove_copy(obj)
    elif fin_modifier(obj) is not None:
        clear(obj.data)
    previews.bake_changed(obj, depsgraph)
