"""Exports strands of the open scene: one or several grooms in one file, still or over frames."""

from __future__ import annotations

from collections import Counter
from collections.abc import Generator, Iterator
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import bpy

from ...arrays import Floats
from ...exchange.files.file_moves import commit_context
from ...exchange.groom import Groom, GroomMotion
from ...exchange.groom_presets import select_parts
from ...exchange.join_grooms import join_bones, join_grooms
from ...exchange.strand_check import check_strands
from ...exchange.strand_export_settings import StrandExportSettings, layout_of
from ...exchange.strand_formats import ALEMBIC, TRESSFX, USD, StrandFormat
from ...exchange.strand_writing import WrittenStrands, write_strands
from ...exchange.tfxbone import BoneWeights
from ..base.outcome import Outcome
from ..base.thread_work import ThreadWork
from ..colliders.rigs import CachedRig
from ..scene.bone_weights import bones_of, has_bones, unmoved_head_notes
from .groom_motion import MovingHair, common_rate, frame_positions, moving_hair
from .read_hair import ExportRequest, ExportStrands, read_still_hair


@dataclass
class StrandExport:
    """The contents of one file, read and ready to write.

    frames: of the motion; None for a still.
    frames_read: number of frames read so far. files: those that were written.
    """

    groom: Groom
    settings: StrandExportSettings
    kind: StrandFormat
    dropped: dict[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    frames: range | None = None
    rate: float = 0.0
    moving: tuple[MovingHair, ...] = ()
    frames_read: int = 0
    files: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        """If strands are requested but all curves are marked as guides, they count as strands."""
        is_guide, parts = self.groom.is_guide, layout_of(self.kind, self.settings).parts
        if parts != "guides" and is_guide is not None and is_guide.all():
            self.groom = replace(self.groom, is_guide=None, closest_guides=None, guide_weights=None)

    @classmethod
    def of(
        cls,
        hair: list[bpy.types.Object],
        depsgraph: bpy.types.Depsgraph,
        kind: StrandFormat,
        settings: StrandExportSettings,
        *,
        frames: range | None = None,
        cached_rigs: tuple[CachedRig, ...] = (),
    ) -> StrandExport:
        """Read hair of the scene; several objects become one groom, each with its own groups.

        Args:
            frames: scene frames; None: a still of the present frame.
            cached_rigs: see `read_still_hair`.

        Raises:
            HairloomError: no usable hair, frames that were not baked, or an engine or option that
                the format does not support.
        """
        with_bones = kind is TRESSFX and settings.bones
        has_roots = with_bones and any(has_bones(each) for each in hair)
        request = replace(request_of(kind, settings), roots=has_roots)
        if frames is None:
            exports, moving, notes = _read_still(hair, depsgraph, request, cached_rigs)
        else:
            exports, moving, notes = _read_moving(
                hair, depsgraph, request, frames, cached_rigs, use_bake=settings.use_bake
            )
        groom, lost = join_grooms([export.groom for export in exports], hair[0].name)
        bones, missing = None, tuple[str, ...]()
        if with_bones:
            bones, missing = _bones(hair, depsgraph, exports)
        dropped: Counter[str] = Counter()
        for export in exports:
            dropped.update(export.dropped)
        read = dict.fromkeys([note for export in exports for note in export.notes])
        return cls(
            replace(groom, bones=bones),
            settings,
            kind,
            dict(dropped),
            (*read, *notes, *lost, *missing),
            frames,
            common_rate(moving) if moving else 0.0,
            moving,
        )

    @property
    def frame_count(self) -> int:
        return 0 if self.frames is None else len(self.frames)

    def check(self) -> dict[str, Any]:
        """What the engine will see, see `exchange.strand_check`; with motion also "frames": first,
        last, and frames per second."""
        facts = check_strands(self.groom, self.kind, self.settings)
        if self.frames is not None:
            facts["frames"] = [self.frames[0], self.frames[-1], self.rate]
        return facts

    def write(self, path: Path, positions: Iterator[Floats] | None = None) -> Outcome:
        """Write the file, and the files beside it.

        Args:
            positions: of the frames, if they do not come from the method `positions`.

        Raises:
            HairloomError: as `exchange.strand_writing.write_strands`, or a frame cannot be read.
        """
        motion = None
        if self.frames is not None:
            motion = GroomMotion(positions or self.positions(), self.rate, self.frames[0])
        written = write_strands(path, self.groom, self.settings, motion)
        self.files = written.files
        return self._outcome(written)

    def positions(self) -> Generator[Floats]:
        """All points of each frame; for the main thread only."""
        assert self.frames is not None
        for points in frame_positions(self.moving, self.frames):
            yield points
            self.frames_read += 1

    def as_still(self) -> StrandExport:
        """Its first frame as a still.

        Raises:
            HairloomError: the frame cannot be read.
        """
        with closing(self.positions()) as positions:
            points = next(positions)
        groom = replace(self.groom, strands=self.groom.strands.with_points(points))
        return replace(self, groom=groom, frames=None, moving=())

    def write_in_thread(
        self, path: Path, positions: Generator[Floats] | None = None
    ) -> ThreadWork[Outcome]:
        """`write` in a thread, which has the main thread produce each frame of `positions`."""

        def work(thread: ThreadWork[Outcome]) -> Outcome:
            commit_context.set(thread.commit_context)  # a context variable of this thread alone
            frames = None if positions is None else _positions_from_main_thread(thread, positions)
            return self.write(path, frames)

        return ThreadWork(work, "Hairloom strands")

    def _outcome(self, written: WrittenStrands) -> Outcome:
        chosen = select_parts(self.groom, layout_of(self.kind, self.settings).parts)
        guides = 0 if chosen.is_guide is None else int(chosen.is_guide.sum())
        counts = {"strands": chosen.strands.strand_count - guides, "guides": guides}
        what = [f"{count:,} {name}" for name, count in counts.items() if count]
        first, *beside = (file.name for file in written.files)
        result = f"Wrote {' and '.join(what)} to {first}"
        if self.frames is not None:
            result += f", frames {self.frames[0]} to {self.frames[-1]}"
        if beside:
            result += f", and {', '.join(beside)}"
        return Outcome(result, self.dropped, (*self.notes, *written.notes))


def request_of(kind: StrandFormat, settings: StrandExportSettings) -> ExportRequest:
    """What must be read of hair for such a file.

    Raises:
        HairloomError: as `layout_of`.
    """
    guides = layout_of(kind, settings).parts != "strands"
    # in a .tfx, one colour for all points would only waste space
    return ExportRequest(guides=guides, color=kind in (ALEMBIC, USD))


def _read_still(
    hair: list[bpy.types.Object],
    depsgraph: bpy.types.Depsgraph,
    request: ExportRequest,
    cached_rigs: tuple[CachedRig, ...],
) -> tuple[list[ExportStrands], tuple[MovingHair, ...], tuple[str, ...]]:
    return [read_still_hair(each, depsgraph, request, cached_rigs) for each in hair], (), ()


def _read_moving(
    hair: list[bpy.types.Object],
    depsgraph: bpy.types.Depsgraph,
    request: ExportRequest,
    frames: range,
    cached_rigs: tuple[CachedRig, ...],
    *,
    use_bake: bool,
) -> tuple[list[ExportStrands], tuple[MovingHair, ...], tuple[str, ...]]:
    moving: list[MovingHair] = []
    notes: list[str] = []
    for each in hair:
        part, more_notes = moving_hair(
            each, depsgraph, frames, request, cached_rigs, use_bake=use_bake
        )
        moving.append(part)
        notes += more_notes
    return [part.export for part in moving], tuple(moving), tuple(notes)


def _bones(
    hair: list[bpy.types.Object], depsgraph: bpy.types.Depsgraph, exports: list[ExportStrands]
) -> tuple[BoneWeights | None, tuple[str, ...]]:
    """The bones of all strands, None if some hair has no skinned head; and warnings."""
    bones, without = [], []
    notes: list[str] = []
    for each, export in zip(hair, exports, strict=True):
        weights = bones_of(each, depsgraph, export.groom.strands)
        if weights is None:
            without.append(each.name)
            notes += unmoved_head_notes(each)
        else:
            bones.append(weights)
            notes += _loose_root_notes(each, weights)
    if without and bones:
        names = ", ".join(without)
        return None, (
            f"{names}: no bone moves its head, so no .tfxbone was written. Write it to a separate "
            "file.",
        )
    return (join_bones(bones) if bones else None), tuple(notes)


def _loose_root_notes(hair: bpy.types.Object, bones: BoneWeights) -> list[str]:
    if not bones.loose_count:
        return []
    return [
        f"{hair.name}: no bone moves the roots of {bones.loose_count} strands, so they follow "
        f"{bones.names[0]}. Weight the head there, and name vertex groups after their bones."
    ]


def _positions_from_main_thread(
    thread: ThreadWork[Outcome], positions: Generator[Floats]
) -> Iterator[Floats]:
    while (points := thread.on_main_thread(_next_positions(positions))) is not None:
        yield points


def _next_positions(positions: Generator[Floats]) -> Generator[None, None, Floats | None]:
    yield
    return next(positions, None)
