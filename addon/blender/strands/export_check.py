"""Checks what an engine will see of hair, while the artist still chooses export settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

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
from ..base.parts import Part, Parts, run_parts
from ..colliders.rigs import CachedRig
from .read_hair import ExportRequest, still_hair_parts
from .strand_export import StrandExport, request_of


@dataclass
class ExportCheck:
    """Hair that is read once for its dialog, and checked for each choice of settings.

    lines: what the file will contain. warnings: for the artist.
    options: what these are for; None: nothing was checked yet.
    """

    hair: list[Handle]
    lines: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    options: tuple[StrandFormat, StrandExportSettings] | None = None
    _grooms: dict[ExportRequest, tuple[Groom, tuple[str, ...]]] = field(default_factory=dict)
    _cached_rigs: dict[int, CachedRig] = field(default_factory=dict)
    _changed_inputs: dict[int, tuple[str, ...]] = field(default_factory=dict)

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

    def refresh(self, kind: StrandFormat, settings: StrandExportSettings) -> None:
        """Check for a format and settings."""
        run_parts(self.refresh_parts(kind, settings))

    def refresh_parts(self, kind: StrandFormat, settings: StrandExportSettings) -> Parts[None]:
        """`refresh` in parts, between which the scene may change."""
        if self.options == (kind, settings):
            return
        if self.options is None:
            self._find_stale_bakes()
        try:
            groom, notes = yield from self._groom_parts(request_of(kind, settings))
            facts = yield Part("Checking", StrandExport(groom, settings, kind).check)
        except HairloomError as error:
            self.lines, self.warnings = [], [str(error)]
        else:
            self.lines, self.warnings = check_lines(facts), [*notes, *facts["warnings"]]
        self.options = kind, settings

    def motion_lines(self, *, use_bake: bool) -> list[str]:
        """The source of motion of each hair, when frames are written."""
        hair = filter(None, (each.find() for each in self.hair))
        return [f"{each.name}: {self._motion_source(each, use_bake)}" for each in hair]

    def _groom_parts(self, request: ExportRequest) -> Parts[tuple[Groom, tuple[str, ...]]]:
        if request not in self._grooms:
            exports = []
            for handle in self.hair:
                hair = handle.find()
                if hair is None:
                    continue
                depsgraph = bpy.context.evaluated_depsgraph_get()
                export = yield from still_hair_parts(hair, depsgraph, request, self.cached_rigs)
                if export.cached_rig is not None:
                    self._cached_rigs[handle.uid] = export.cached_rig
                exports.append(export)
            if not exports:
                raise HairloomError("it is gone", place="hair", remedy="Export again")
            grooms = [export.groom for export in exports]
            groom, lost = join_grooms(grooms, grooms[0].name)
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

    def _find_stale_bakes(self) -> None:
        """Find stale bakes, once: hashing all inputs of a bake is too slow for drawing."""
        depsgraph = bpy.context.evaluated_depsgraph_get()
        for hair in filter(None, (each.find() for each in self.hair)):
            try:
                cache = playback.cache_of(hair)
                changed = () if cache is None else changed_inputs(hair, cache, depsgraph)
            except HairloomError:  # reported by `motion_lines`, and when the file is written
                changed = ()
            self._changed_inputs[hair.session_uid] = changed
