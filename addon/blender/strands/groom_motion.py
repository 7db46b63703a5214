"""Hair in motion for files: from its bake, or moved by Blender's own animation."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

import bpy
import numpy as np

from ... import motion_flow
from ...arrays import Floats, Ints
from ...errors import HairloomError
from ...rig_flow import Pose, Rig
from ...strands.center_lines import center_lines
from ..bakes import playback
from ..bakes.cache import Cache
from ..bakes.groom_hashes import frame_rate
from ..bakes.playback import check_frames
from ..bakes.stale_bakes import stale_notes
from ..base.objects import Body, Handle, head_of
from ..base.suspension import suspended
from ..colliders.rigs import CachedRig
from ..scene.source import posed_curves
from ..scene.surfaces import read_positions
from .read_hair import ExportRequest, ExportStrands, read_baked_hair, read_still_hair


class MovingHair(Protocol):
    """One hair in a file, at all frames.

    rate: frames per second.
    needs_scene: whether the scene must be at a frame before `positions_at` is called for it.
    """

    @property
    def export(self) -> ExportStrands: ...

    @property
    def rate(self) -> float: ...

    @property
    def needs_scene(self) -> bool: ...

    def positions_at(self, frame: int, depsgraph: bpy.types.Depsgraph) -> Floats:
        """The points of the strands in `export.strands`, (point_count, 3) [m]."""


@dataclass(frozen=True)
class BakedMotion:
    """Hair that is moved by its bake."""

    export: ExportStrands
    cache: Cache
    needs_scene: bool = False

    @property
    def rate(self) -> float:
        return self.cache.facts.frame_rate

    def positions_at(self, frame: int, _depsgraph: bpy.types.Depsgraph) -> Floats:
        return playback.strands_in(self.cache, frame)


@dataclass(frozen=True)
class EvaluatedMotion:
    """Hair that modifiers and animation move, read again in each frame.

    head: its surface, None without one.
    """

    export: ExportStrands
    hair: Handle
    head: Handle | None
    rate: float
    needs_scene: bool = True

    def positions_at(self, frame: int, depsgraph: bpy.types.Depsgraph) -> Floats:
        if self.head is not None:
            self.head.resolve("Export again")
        read = posed_curves(self.hair.resolve("Export again"), depsgraph).strands
        if not np.array_equal(read.offsets, self.export.strands.offsets):
            raise _other_curves(self.hair, frame)
        return read.points


@dataclass(frozen=True)
class ChildrenMotion:
    """Children between guides that modifiers and animation move.

    guides: indices of the guides among the curves that are read.
    count: number of those curves.
    body: the object that carries the roots.
    """

    export: ExportStrands
    hair: Handle
    rate: float
    rig: Rig
    guides: Ints
    count: int
    body: Body
    needs_scene: bool = True

    def positions_at(self, frame: int, depsgraph: bpy.types.Depsgraph) -> Floats:
        read = posed_curves(self.hair.resolve("Export again"), depsgraph).strands
        if read.strand_count != self.count:
            raise _other_curves(self.hair, frame)
        now = center_lines(read.take(self.guides), self.rig.guide_grid.shape[1]).grid
        positions = None
        if self.rig.head is not None:
            name = self.body.handle.name
            body = self.body.handle.resolve("Export again")
            positions = read_positions(body, depsgraph, place=name)
        pose = Pose(positions, self.body.motion_from_rest(depsgraph))
        return motion_flow.strands_at(self.rig, pose, now)


def moving_hair(
    hair: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    frames: range,
    request: ExportRequest,
    cached_rigs: tuple[CachedRig, ...] = (),
    *,
    use_bake: bool,
) -> tuple[MovingHair, tuple[str, ...]]:
    """The hair in motion, and notes for the artist.

    Args:
        frames: scene frames.
        cached_rigs: see `read_still_hair`.
        use_bake: whether its bake moves it, if it has one.

    Raises:
        HairloomError: the bake lacks frames, is damaged or gone; or there is no usable hair.
    """
    cache = playback.cache_if_baked(hair) if use_bake else None
    if cache is not None:
        check_frames(hair.name, frames, cache)
        motion = BakedMotion(read_baked_hair(hair, depsgraph, cache, request), cache)
        return motion, stale_notes(hair, cache, depsgraph)
    rate = frame_rate(depsgraph.scene)
    with _preserving_frame() as set_frame:
        depsgraph = set_frame(frames[0])
        export = read_still_hair(hair, depsgraph, request, cached_rigs)
        head = head_of(hair)
        surface = None if head is None else Handle.of(head)
        moving: MovingHair = EvaluatedMotion(export, Handle.of(hair), surface, rate)
        if export.has_children and export.cached_rig is not None:
            moving = _children_motion(hair, depsgraph, export, export.cached_rig, rate)
    notes: tuple[str, ...] = ()
    if use_bake:
        notes = (
            f"{hair.name}: it has no bake, so the motion of Blender's own animation and modifiers "
            "is written. Bake it to write Hairloom's motion.",
        )
    return moving, notes


def common_rate(parts: Sequence[MovingHair]) -> float:
    """Frames per second of all parts.

    Raises:
        HairloomError: the frame rates of the parts differ.
    """
    rates = {part.rate for part in parts}
    if len(rates) > 1:
        listed = " and ".join(f"{rate:g}" for rate in sorted(rates))
        names = ", ".join(part.export.groom.name for part in parts)
        raise HairloomError(
            f"this hair has different frame rates, {listed}",
            place=names,
            remedy="Bake all of it at the scene's rate, or write a separate file for each",
        )
    return rates.pop()


def frame_positions(parts: Sequence[MovingHair], frames: range) -> Generator[Floats]:
    """The points of all parts, one after the other, in each frame.

    The scene's frame is restored afterwards, also if the generator is closed before its end.

    Raises:
        HairloomError: hair is gone, or has other curves than in the first frame.
    """
    needs_scene = any(part.needs_scene for part in parts)
    with _preserving_frame() as set_frame:
        for frame in frames:
            depsgraph = set_frame(frame) if needs_scene else bpy.context.evaluated_depsgraph_get()
            positions = (part.positions_at(frame, depsgraph) for part in parts)
            yield np.concatenate(
                [part.export.points(each) for part, each in zip(parts, positions, strict=True)]
            )


@contextmanager
def _preserving_frame() -> Iterator[Callable[[int], bpy.types.Depsgraph]]:
    """A function that brings the scene to a frame; at the end, the scene returns to its frame."""
    scene = bpy.context.scene
    original, subframe, has_moved = scene.frame_current, scene.frame_subframe, False

    def set_frame(frame: int) -> bpy.types.Depsgraph:
        nonlocal has_moved
        has_moved = True
        with suspended():
            scene.frame_set(frame)
        return bpy.context.evaluated_depsgraph_get()

    try:
        yield set_frame
    finally:
        if has_moved:
            with suspended():
                scene.frame_set(original, subframe=subframe)


def _children_motion(
    hair: bpy.types.Object,
    depsgraph: bpy.types.Depsgraph,
    export: ExportStrands,
    cached_rig: CachedRig,
    rate: float,
) -> ChildrenMotion:
    rig, head = cached_rig.rig, head_of(hair)
    body = hair if head is None or rig.head is None else head
    return ChildrenMotion(
        export,
        Handle.of(hair),
        rate,
        rig,
        rig.guides,
        cached_rig.source.strands.strand_count,
        Body.at_rest(body, depsgraph),
    )


def _other_curves(handle: Handle, frame: int) -> HairloomError:
    return HairloomError(
        f"in frame {frame} its curves have changed, and a file needs the same curves in all frames",
        place=handle.name,
        remedy="Turn off the modifier that adds or removes curves, or write fewer frames",
    )
