"""Checks what an engine will see of hair, while the artist still chooses export settings."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial

import bpy

from ...errors import HairloomError
from ...exchange.groom import Groom
from ...exchange.join_grooms import join_grooms
from ...exchange.strand_check import check_lines
from ...exchange.strand_export_settings import StrandExportSettings
from ...exchange.strand_formats import StrandFormat
from ..bakes import playback
from ..bakes.simulation import phrase_of
from ..bakes.stale_bakes import changed_inputs
from ..base.objects import Handle
from ..base.parts import Part, Parts
from ..colliders.rigs import CachedRig, rig_from
from ..properties.groom_settings import GroomSettings
from ..scene.source import read_source
from .read_hair import ExportRequest, needs_rig, read_still_hair
from .strand_export import StrandExport, request_of


@dataclass
class ExportCheck:
    """Hair that is read once, when the dialog opens, and checked for each choice of settings.

    lines: what the file will contain. warnings: for the artist.
    """

    hair: list[Handle]
    lines: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    _grooms: dict[ExportRequest, tuple[Groom, tuple[str, ...]]] = field(default_factory=dict)
    _cached_rigs: dict[int, CachedRig] = field(default_factory=dict)
    _changed_inputs: dict[int, tuple[str, ...]] = field(default_factory=dict)
    _last_options: tuple[StrandFormat, StrandExportSettings] | None = None

    @classmethod
    def of(
        cls, hair: list[bpy.types.Object], cached: Mapping[int, CachedRig] | None = None
    ) -> ExportCheck:
        """Begin a check.

        Args:
            cached: rigs of hair that are made already, by session number.
        """
        check = cls([Handle.of(each) for each in hair])
        uids = {each.uid for each in check.hair}
        check._cached_rigs = {uid: made for uid, made in (cached or {}).items() if uid in uids}
        return check

    @property
    def cached_rigs(self) -> tuple[CachedRig, ...]:
        """The rigs that were made, so that writing the file need not make them again."""
        return tuple(self._cached_rigs.values())

    def read_steps(
        self,
        depsgraph: bpy.types.Depsgraph,
        kind: StrandFormat,
        settings: StrandExportSettings,
    ) -> Parts[None]:
        """The slow part of the first `refresh`, and of one for another format."""
        request = request_of(kind, settings)
        for hair in filter(None, [each.find() for each in self.hair]):
            uid, name = hair.session_uid, hair.name
            if not needs_rig(hair, request):
                continue
            groom = GroomSettings.of(hair)
            with suppress(HairloomError):  # `refresh` gets it too, and reports it
                source = read_source(hair, depsgraph)
                cached = self._cached_rigs.get(uid)
                if cached is None or not cached.was_made_from(source, groom):
                    make = partial(rig_from, source, groom.sections, place=name)
                    rig = yield Part("Making strands", make)
                    self._cached_rigs[uid] = CachedRig(source, groom, rig)

    def refresh(
        self,
        depsgraph: bpy.types.Depsgraph,
        kind: StrandFormat,
        settings: StrandExportSettings,
    ) -> bool:
        """Check for a format and settings; returns whether the result may have changed."""
        if self._last_options == (kind, settings):
            return False
        if self._last_options is None:
            self._find_stale_bakes(depsgraph)
        try:
            groom, notes = self._groom(depsgraph, request_of(kind, settings))
            facts = StrandExport(groom, settings, kind).check()
        except HairloomError as error:
            self.lines, self.warnings = [], [str(error)]
        else:
            self.lines, self.warnings = check_lines(facts), [*notes, *facts["warnings"]]
        self._last_options = kind, settings
        return True

    def motion_lines(self, *, use_bake: bool) -> list[str]:
        """The source of motion of each hair, when frames are written."""
        hair = filter(None, (each.find() for each in self.hair))
        return [f"{each.name}: {self._motion_source(each, use_bake)}" for each in hair]

    def _groom(
        self, depsgraph: bpy.types.Depsgraph, request: ExportRequest
    ) -> tuple[Groom, tuple[str, ...]]:
        if request not in self._grooms:
            found = [hair for hair in (each.find() for each in self.hair) if hair is not None]
            if not found:
                raise HairloomError("it is gone", place="hair", remedy="Export again")
            exports = [
                read_still_hair(each, depsgraph, request, self.cached_rigs) for each in found
            ]
            for each, export in zip(found, exports, strict=True):
                if export.cached_rig is not None:
                    self._cached_rigs[each.session_uid] = export.cached_rig
            groom, lost = join_grooms([export.groom for export in exports], found[0].name)
            notes = dict.fromkeys([note for export in exports for note in export.notes])
            self._grooms[request] = groom, (*notes, *lost)
        return self._grooms[request]

    def _motion_source(self, hair: bpy.types.Object, use_bake: bool) -> str:
        try:
            cache = playback.cache_if_baked(hair) if use_bake else None
            if cache is None:
                return ("no bake, " if use_bake else "") + "moved by modifiers and animation"
        except HairloomError as error:
            return error.problem
        facts = cache.facts
        line = f"bake of frames {facts.first} to {facts.last} at {facts.frame_rate:g} fps"
        changed = self._changed_inputs.get(hair.session_uid, ())
        return f"{line}, out of date ({phrase_of(changed)})" if changed else line

    def _find_stale_bakes(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Find stale bakes, once: hashing all inputs of a bake is too slow for drawing."""
        for hair in filter(None, (each.find() for each in self.hair)):
            try:
                cache = playback.cache_of(hair)
                changed = () if cache is None else changed_inputs(hair, cache, depsgraph)
            except HairloomError:  # reported by `motion_lines`, and when the file is written
                changed = ()
            self._changed_inputs[hair.session_uid] = changed
