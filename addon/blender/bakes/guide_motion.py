"""Guides over a range of frames, such as those of a bake."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol, Self

import bpy

from ...arrays import Floats
from ...errors import HairloomError
from ...rig_flow import Pose, Rig
from . import playback
from .cache import Cache
from .stale_bakes import stale_notes


class GuideMotion(Protocol):
    """Guides over a range of frames.

    rig: of the guides. frame_rate: [1/s]. notes: for the artist.
    """

    @property
    def rig(self) -> Rig: ...

    @property
    def frames(self) -> range: ...

    @property
    def frame_rate(self) -> float: ...

    @property
    def notes(self) -> tuple[str, ...]: ...

    def at(self, frame: int) -> tuple[Pose, Floats]:
        """The pose, and the guides (guide_count, cv_count, 3) [m, world]."""


@dataclass(frozen=True, eq=False)
class BakedGuides:
    """The guides of a bake; its frames are those of the scene."""

    cache: Cache
    rig: Rig
    frames: range
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, hair: bpy.types.Object, frames: range | None = None) -> Self:
        """The guides of a groom's bake; frames None: all that it has.

        Raises:
            HairloomError: no bake, a damaged one, or frames that it does not hold.
        """
        cache = playback.cache_if_baked(hair)
        if cache is None:
            raise HairloomError(
                "it has no bake, so it does not move",
                place=hair.name,
                remedy="Bake it (Dynamics > Bake), or write it without motion",
            )
        notes = stale_notes(hair, cache, bpy.context.evaluated_depsgraph_get())
        return cls._of_cache(cache, hair.name, frames, notes)

    @classmethod
    def in_folder(cls, folder: Path, frames: range | None = None) -> Self:
        """The guides of the bake in a folder.

        Raises:
            HairloomError: as `of`.
        """
        return cls._of_cache(Cache(folder), str(folder), frames)

    @classmethod
    def _of_cache(
        cls, cache: Cache, place: str, frames: range | None, notes: tuple[str, ...] = ()
    ) -> Self:
        chosen = range(cache.facts.first, cache.facts.last + 1) if frames is None else frames
        playback.check_frames(place, chosen, cache)
        return cls(cache, playback.rig_in(cache).rig, chosen, notes)

    @property
    def frame_rate(self) -> float:
        return self.cache.facts.frame_rate

    def at(self, frame: int) -> tuple[Pose, Floats]:
        arrays, solids = self.cache.frame(frame), playback.solids_in(self.cache, frame)
        pose = playback.rig_in(self.cache).pose(arrays)
        return replace(pose, solids=solids), arrays["guides"]

    def strands(self, frame: int) -> tuple[Pose, Floats]:
        """The pose, and all strands (point_count, 3) [m, world]."""
        return self.at(frame)[0], playback.strands_in(self.cache, frame)
